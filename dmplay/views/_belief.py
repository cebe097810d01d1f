"""Beliefs as bars and words."""

from collections.abc import Sequence

import numpy as np

from dmplay.chance import Reals
from dmplay.core import Problem
from dmplay.session import MAX_LISTED_STATES, View
from dmplay.views.canvas import BAR_LEVELS, Canvas
from dmplay.views.style import DrawOptions

MAX_NAMED_STATES = 10  # states that are shown of many
BAR_EIGHTHS = " ▏▎▍▌▋▊▉"
ASCII_SPARK_LEVELS = "_.:-=+*#"


def format_bar(fraction: float, width: int, ascii_only: bool) -> str:
    """A bar with eighths, the rest in dots: never without its number beside it."""
    if ascii_only:
        return ("#" * round(fraction * width)).ljust(width, ".")
    eighths = round(fraction * width * 8)
    whole, rest = divmod(eighths, 8)
    return ("█" * whole + (BAR_EIGHTHS[rest] if rest else "")).ljust(width, "·")


def draw_belief_bars(  # noqa: PLR0913 - a place on the canvas, and what goes there
    canvas: Canvas,
    y: int,
    names: Sequence[str],
    belief: Reals,
    options: DrawOptions,
    *,
    max_bar_columns: int = 20,
) -> int:
    """Draws a bar a state from row y on, as wide as the room; returns the next row."""
    longest = max(map(len, names))
    room = max(min(max_bar_columns, options.width - longest - 8), 1)
    for name, share in zip(names, belief, strict=True):
        canvas.write_text(0, y, name.ljust(longest))
        canvas.write_text(longest + 2, y, format_bar(float(share), room, options.ascii), "cyan")
        canvas.write_text(longest + 3 + room, y, f"{share:.3f}", "bold")
        y += 1
    return y


def list_state_probabilities(view: View[Problem]) -> tuple[list[str], Reals]:
    """The states with their probabilities: all, or of many the likeliest and what is left."""
    states, belief = view.problem.enumerate_states(), view.belief
    if len(belief) <= MAX_LISTED_STATES:
        return [view.problem.format_state(s) for s in states], belief
    order = np.argsort(-belief.round(9), kind="stable")[
        :MAX_NAMED_STATES
    ]  # ties as the states stand
    order = order[belief[order] > 0]
    names = [view.problem.format_state(states[place]) for place in order]
    left = np.count_nonzero(belief) - len(order)
    told = [*belief[order], max(1.0 - belief[order].sum(), 0.0)]
    return [*names, f"{left} others"], np.array(told)


def draw_true_state(canvas: Canvas, y: int, names: Sequence[str], options: DrawOptions) -> None:
    """Says the true state, once it may be told."""
    if options.revealed_state is not None:
        canvas.write_text(0, y, f"truly {names[int(options.revealed_state)]}", "bold magenta")


def format_sparkline(fractions: Sequence[float], ascii_only: bool) -> str:
    """A history of probabilities, a glyph each."""
    glyphs = ASCII_SPARK_LEVELS if ascii_only else BAR_LEVELS
    return "".join(glyphs[min(int(share * len(glyphs)), len(glyphs) - 1)] for share in fractions)


def format_likeliest_states(names: Sequence[str], belief: Reals) -> list[str]:
    """The states from the likeliest down: `hungry 0.732`, `sated 0.268`."""
    pairs = sorted(zip(names, belief, strict=True), key=lambda pair: -pair[1])
    return [f"{name} {share:.3f}" for name, share in pairs]


def format_belief(names: Sequence[str], belief: Reals) -> str:
    """The same in one line."""
    return ", ".join(format_likeliest_states(names, belief))

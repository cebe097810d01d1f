"""Beliefs as bars and words."""

from collections.abc import Sequence

import numpy as np

from dmplay.chance import Reals
from dmplay.core import Problem
from dmplay.session import LONGEST_LIST, View
from dmplay.views.canvas import BARS, Canvas
from dmplay.views.style import Look

LIKELIEST = 10  # states that are shown of many
EIGHTHS = " ▏▎▍▌▋▊▉"
ASCII_SPARKS = "_.:-=+*#"


def bar(share: float, width: int, plain: bool) -> str:
    """A bar with eighths, the rest in dots: never without its number beside it."""
    if plain:
        return ("#" * round(share * width)).ljust(width, ".")
    eighths = round(share * width * 8)
    whole, rest = divmod(eighths, 8)
    return ("█" * whole + (EIGHTHS[rest] if rest else "")).ljust(width, "·")


def bars(  # noqa: PLR0913 - a place on the canvas, and what goes there
    canvas: Canvas, y: int, names: Sequence[str], belief: Reals, look: Look, *, most: int = 20
) -> int:
    """Draws a bar a state from row y on, as wide as the room; returns the next row."""
    longest = max(map(len, names))
    room = max(min(most, look.width - longest - 8), 1)
    for name, share in zip(names, belief, strict=True):
        canvas.put(0, y, name.ljust(longest))
        canvas.put(longest + 2, y, bar(float(share), room, look.ascii), "cyan")
        canvas.put(longest + 3 + room, y, f"{share:.3f}", "bold")
        y += 1
    return y


def shares(view: View[Problem]) -> tuple[list[str], Reals]:
    """The states with their probabilities: all, or of many the likeliest and what is left."""
    states, belief = view.problem.enumerated(), view.belief
    if len(belief) <= LONGEST_LIST:
        return [view.problem.notation(s) for s in states], belief
    order = np.argsort(-belief.round(9), kind="stable")[:LIKELIEST]  # ties as the states stand
    order = order[belief[order] > 0]
    names = [view.problem.notation(states[place]) for place in order]
    left = np.count_nonzero(belief) - len(order)
    told = [*belief[order], max(1.0 - belief[order].sum(), 0.0)]
    return [*names, f"{left} others"], np.array(told)


def truth(canvas: Canvas, y: int, names: Sequence[str], look: Look) -> None:
    """Says the true state, once it may be told."""
    if look.state is not None:
        canvas.put(0, y, f"truly {names[int(look.state)]}", "bold magenta")


def spark(shares: Sequence[float], plain: bool) -> str:
    """A history of probabilities, a glyph each."""
    glyphs = ASCII_SPARKS if plain else BARS
    return "".join(glyphs[min(int(share * len(glyphs)), len(glyphs) - 1)] for share in shares)


def likeliest(names: Sequence[str], belief: Reals) -> list[str]:
    """The states from the likeliest down: `hungry 0.732`, `sated 0.268`."""
    pairs = sorted(zip(names, belief, strict=True), key=lambda pair: -pair[1])
    return [f"{name} {share:.3f}" for name, share in pairs]


def words(names: Sequence[str], belief: Reals) -> str:
    """The same in one line."""
    return ", ".join(likeliest(names, belief))

"""How the blind hunt looks: for each hex how likely the prey is there, and how likely you are."""

import math
from collections.abc import Iterator
from string import ascii_uppercase
from typing import NamedTuple

import numpy as np
from rich.text import Text

from dmplay.chance import Reals
from dmplay.hexes import DIRECTIONS, Hex, format_hex, hex_neighbours
from dmplay.problems.collaborative_predator_prey import (
    CAPTURE_REWARD,
    MOVE_REWARD,
    CollaborativePredatorPrey,
)
from dmplay.session import View
from dmplay.views import hexgrid
from dmplay.views._advice import format_regret_rows
from dmplay.views._belief import format_sparkline
from dmplay.views.canvas import format_percent
from dmplay.views.generic import format_last_observation
from dmplay.views.hexgrid import HexCell, HexSize
from dmplay.views.style import DrawOptions, Lesson

KEY_FAMILY, KEYS, SECOND_PLAYER_KEYS = hexgrid.KEY_FAMILY, hexgrid.KEYS, hexgrid.SECOND_PLAYER_KEYS
MAX_DESCRIBED_HEXES = 4  # likeliest hexes that are told in words
REGRET_ROW_COLUMNS = 58  # columns of what six ways lose
PREY_SHADE_COUNT = 4  # of the prey, the darkest where it is likeliest
MAX_PERCENT_HEXES = 3  # likeliest hexes that have their percent
MIN_CERTAIN_PROBABILITY = 1 - 1e-9


class Marginals(NamedTuple):
    """The probability of each hex to hold the prey, and to hold you."""

    prey: Reals  # [H]
    you: Reals  # [H]


def compute_marginals(view: View[CollaborativePredatorPrey]) -> Marginals | None:
    """What the belief says of each hex; None where it is too large to have."""
    return None if view.beliefs is None else _marginalize_belief(view, view.belief)


def _marginalize_belief(view: View[CollaborativePredatorPrey], belief: Reals) -> Marginals:
    """What a belief says of each hex."""
    problem = view.problem
    joint = belief.reshape((len(problem.hexes),) * problem.walker_count)

    def sum_over_others(walker: int) -> Reals:
        others = tuple(axis for axis in range(problem.walker_count) if axis != walker)
        return np.asarray(joint.sum(axis=others))

    return Marginals(sum_over_others(problem.walker_count - 1), sum_over_others(view.seat))


def _find_own_hex(view: View[CollaborativePredatorPrey], marginals: Marginals | None) -> Hex | None:
    """Where you are, if you know."""
    if marginals is None or marginals.you.max() < MIN_CERTAIN_PROBABILITY:
        return None
    return view.problem.hexes[int(marginals.you.argmax())]


def iter_boards(view: View[CollaborativePredatorPrey], options: DrawOptions) -> Iterator[Text]:
    """The map, the largest first, and a row that says how it is to be read."""
    if options.allow_large or options.forecast or options.regret is not None:
        yield from _iter_shaded_maps(view, options)
    else:
        yield from _iter_numbered_maps(view, options)


def _iter_shaded_maps(
    view: View[CollaborativePredatorPrey], options: DrawOptions
) -> Iterator[Text]:
    """The belief as shades; of an action that is asked for, after each of its two likeliest senses;
    at the end who truly is where.
    """
    problem, known = view.problem, compute_marginals(view)
    here = _find_own_hex(view, known)
    around = hex_neighbours(here) if options.show_keys and here else []
    shown = _forecast_prey_marginals(view, options) or ([known.prey] if known else [])
    truly: dict[Hex, list[str]] = {}
    for walker, place in enumerate(
        [] if options.revealed_state is None else options.revealed_state
    ):
        truly.setdefault(problem.hexes[int(place)], []).append(_get_agent_glyph(view, walker))

    def draw_cell(hex_: Hex, size: HexSize) -> HexCell:
        at, room = problem.hexes.index(hex_), size.width - 1
        shades = [
            _format_prey_shade(belief, at, room if size.text_rows else 1, options.ascii)
            for belief in shown
        ]
        first, last = (shades[0], shades[-1]) if shades else ("", "")
        if hex_ in truly:
            marks = "".join(sorted(truly[hex_]))[:room]
            return HexCell(marks, last, marks, "bold reverse" if "@" in marks else "bold yellow")
        you = _format_own_density(known.you, at, room) if known and not truly else ""
        style = "bold reverse" if hex_ == here else "cyan"
        if size.text_rows > 1:
            key = hexgrid.get_direction_key(options, around.index(hex_)) if hex_ in around else ""
            return HexCell(first if len(shades) > 1 else you or key, last, style=style)
        shade = "@" + first[1:] if you and size.text_rows and len(shades) == 1 else first
        return HexCell(
            shade, dot_glyph=f"@{first}" if you and room > 1 else first or ".", style=style
        )

    caption = _format_caption(view, options, here)
    for drawn in map(Text.copy, hexgrid.iter_maps(problem.hexes, draw_cell, options)):
        for row in caption:
            drawn.append(f"\n{row[: options.width]}", "dim")
        yield drawn


def _get_agent_glyph(view: View[CollaborativePredatorPrey], walker: int) -> str:
    """`@` for you, a capital for a partner, `o` for the prey."""
    if walker == view.seat:
        return "@"
    return "o" if walker == view.problem.walker_count - 1 else ascii_uppercase[walker]


def _format_prey_shade(belief: Reals, hex_index: int, width: int, ascii_only: bool) -> str:
    """How likely the prey is in a hex against the likeliest; in the few likeliest the percent."""
    share, most = float(belief[hex_index]), float(belief.max())
    if share < 1e-9:
        return " " * (width - 1) + "." if width == 1 else ""
    shade = format_sparkline(
        [math.ceil(PREY_SHADE_COUNT * share / most - 1e-9) / PREY_SHADE_COUNT - 1e-9], ascii_only
    )
    many = int((belief >= share - 1e-9).sum())
    told = format_percent(share) if many <= MAX_PERCENT_HEXES else ""
    return told.center(width, shade) if len(told) < width else shade * width


def _format_own_density(belief: Reals, hex_index: int, width: int) -> str:
    """A sign for each third of the likeliest hex's probability that you are here."""
    share, most = float(belief[hex_index]), float(belief.max())
    signs = round(min(width, 3) * share / most)
    if most >= MIN_CERTAIN_PROBABILITY:
        return "@" * (signs > 0)
    told = (
        format_percent(share) if share >= most - 1e-9 and (belief >= most - 1e-9).sum() == 1 else ""
    )
    return f"@{told}" if told and len(told) < width else "@" * signs


def _forecast_prey_marginals(
    view: View[CollaborativePredatorPrey], options: DrawOptions
) -> list[Reals]:
    """What would be believed of the prey after the two likeliest senses that an action brings."""
    if options.forecast is None or options.forecast.beliefs is None:
        return []
    return [_marginalize_belief(view, belief).prey for belief in options.forecast.beliefs[:2]]


def _format_caption(
    view: View[CollaborativePredatorPrey], options: DrawOptions, own_hex: Hex | None
) -> list[str]:
    """What was sensed, and how the map is to be read."""
    if options.revealed_state is not None:
        names = [*view.problem.agents, "prey"]
        who = (f"{_get_agent_glyph(view, walker)} {name}" for walker, name in enumerate(names))
        return [f"truly {', '.join(who)}"]
    if options.forecast:
        senses = view.problem.observations[view.seat]
        lines = zip(
            ("upper", "lower"),
            options.forecast.outcomes,
            options.forecast.probabilities,
            strict=False,
        )
        told = (
            f"{line} if {senses[int(sense)]}, {format_percent(float(p))}"
            for line, sense, p in lines
        )
        return [
            f"{hexgrid.format_move_condition(options.forecast)}, where the prey is",
            "; ".join(told),
        ]
    if options.regret is not None:
        names = [hexgrid.get_direction_key(options, way) for way in range(len(DIRECTIONS))]
        room = (
            options.columns_beside_panel
            if options.columns_beside_panel >= REGRET_ROW_COLUMNS
            else options.width
        )
        return format_regret_rows(options._replace(width=room), names)
    sensed = f"sensed {format_last_observation(view)}"
    if view.beliefs is None:
        return [f"{sensed}. belief too large"]
    you, full = view.player_label, "#" if options.ascii else "█"
    place = you if own_hex else f"where {you} may be"
    readings = f"@ {place}, {full} where the prey may be", f"@ {you}, {full} prey if likely", sensed
    return [next(one for one in readings if len(one) <= options.width or one == sensed)]


def _iter_numbered_maps(
    view: View[CollaborativePredatorPrey], options: DrawOptions
) -> Iterator[Text]:
    """Each hex with both probabilities, as a transcript has it."""
    problem, known = view.problem, compute_marginals(view)
    here = _find_own_hex(view, known)
    around = hex_neighbours(here) if options.show_keys and here else []
    keys = {hex_: hexgrid.get_direction_key(options, way) for way, hex_ in enumerate(around)}
    true = (
        set()
        if options.revealed_state is None
        else {problem.hexes[int(place)] for place in options.revealed_state}
    )

    def draw_cell(hex_: Hex, size: HexSize) -> HexCell:
        if known is None:
            return HexCell("")
        at = problem.hexes.index(hex_)
        prey, you = float(known.prey[at]), float(known.you[at])
        style = "reverse" if hex_ in true else "bold" if prey >= known.prey.max() - 1e-9 else ""
        if size.text_rows > 1:
            note = _format_marked_percent("@", you, options) or keys.get(hex_, "")
            return HexCell(_format_marked_percent("o", prey, options), note, "", style)
        if size == hexgrid.SMALL_DOT_SIZE:
            return HexCell(
                "",
                dot_glyph=format_sparkline([prey], options.ascii) if prey >= 1e-9 else ".",
                style=style,
            )
        digits = format_percent(min(prey, 0.99)).rstrip("%")  # two columns
        both = digits.rjust(2) + (format_sparkline([you], options.ascii) if you >= 1e-9 else " ")
        return HexCell(both, dot_glyph=both if both.strip() else ".", style=style)

    both = f"% prey, bar: {view.player_label}"
    small = (both, both, "bar: prey")
    drawings = [*map(Text.copy, hexgrid.iter_maps(problem.hexes, draw_cell, options))]
    legends = [f"o prey, @ {view.player_label}"] * (len(drawings) - len(small)) + [*small]
    for drawn, legend in zip(drawings, legends, strict=True):
        said = f"sensed {format_last_observation(view)}. {legend if known else 'belief too large'}"
        drawn.append(f"\n{said[: options.width]}")
        if options.revealed_state is not None:
            drawn.append(f"\n{_format_true_positions(view, options)}", "bold magenta")
        yield drawn


def _format_marked_percent(mark: str, probability: float, options: DrawOptions) -> str:
    """A mark, a bar where there is room for it, and the percent, in five columns."""
    told = format_percent(probability)
    shade = (
        "" if options.ascii or len(told) > 3 else format_sparkline([probability], ascii_only=False)
    )
    return f"{mark}{shade}{told:>{4 - len(shade)}}" if told else ""


def _format_true_positions(view: View[CollaborativePredatorPrey], options: DrawOptions) -> str:
    """Where everyone truly is."""
    problem = view.problem
    assert options.revealed_state is not None
    names = [*problem.agents, "prey"]
    places = [format_hex(problem.hexes[int(place)]) for place in options.revealed_state]
    full = "truly " + ", ".join(
        f"{name} {place}" for name, place in zip(names, places, strict=True)
    )
    return full if len(full) <= options.width else f"truly {' '.join(places)}"[: options.width]


def _list_likeliest_hexes(
    view: View[CollaborativePredatorPrey], probabilities: Reals, hex_count: int
) -> list[tuple[str, float]]:
    order = np.argsort(-np.round(probabilities, 9), kind="stable")[:hex_count]
    hexes = view.problem.hexes
    return [
        (format_hex(hexes[i]), float(probabilities[i])) for i in order if probabilities[i] >= 0.0005
    ]


def _describe_partners(view: View[CollaborativePredatorPrey]) -> str:
    others = [agent for seat, agent in enumerate(view.problem.agents) if seat != view.seat]
    if not others:
        return ""
    verb = "is" if len(others) == 1 else "are"
    return f" {' and '.join(others)} {verb} unseen and believed to act uniformly at random."


def goal_lines(view: View[CollaborativePredatorPrey]) -> list[str]:
    """What the team is paid, and what it cannot see."""
    slip, own = view.problem.slip, view.player_label == "you"
    return [
        "find the unseen prey",
        f"a catch by anyone pays all {CAPTURE_REWARD:g}",
        f"else a turn costs {-MOVE_REWARD:g}",
        f"{view.player_label} {'sense' if own else 'senses'} it from the next hex",
        *([f"{format_percent(slip)} of steps slip aside"] if slip else []),
    ]


def lesson(view: View[CollaborativePredatorPrey]) -> Lesson:
    """Who hunts, what is not seen, and what a turn costs."""
    problem, others = view.problem, len(view.problem.agents) - 1
    team = f", one of {others + 1} who cannot talk" if others else ""
    blind = "you see your own hex" if problem.sighted else "you see nothing, not even where you are"
    slips = (
        f"{format_percent(problem.slip)} of steps slip aside" if problem.slip else "no step slips"
    )
    return Lesson(
        f"You are {problem.agents[view.seat]}{team}; {blind}, and only sense a prey on your hex or "
        "the next",
        f"You want to be where the prey is: a turn begun there pays {'all ' * (others > 0)}"
        f"{CAPTURE_REWARD:g}",
        f"Any other turn costs {-MOVE_REWARD:g}, and {slips}",
    )


def panel_rows(view: View[CollaborativePredatorPrey]) -> list[tuple[str, str]]:
    """What you did and sensed; the board has what is likely, a reward would betray a capture."""
    sensed = format_last_observation(view) if view.turns_played else "-"
    reward = f"{view.rewards[-1]:g}" if view.rewards else "hidden"
    rows = [("last", view.last_action_label.upper() or "-"), ("sensed", sensed), ("reward", reward)]
    if len(view.problem.agents) > 1:
        rows.append(("partner", "unseen"))
    return [*rows, ("discount", f"{view.problem.discount:.2f} (gamma)")]


def describe_turn(view: View[CollaborativePredatorPrey]) -> str:
    """What you sensed and did, and where the prey and you most likely are."""
    return f"{format_last_observation(view)}. chose {view.last_action_label.upper()}. {_describe_belief(view, 1)}".rstrip()


def _describe_belief(view: View[CollaborativePredatorPrey], hex_count: int) -> str:
    """The likeliest hexes of the prey and of you in words."""
    known = compute_marginals(view)
    if known is None:
        return ""
    sentences = []
    for name, shares in known._asdict().items():
        each = ", ".join(
            f"{hex_} {share:.3f}" for hex_, share in _list_likeliest_hexes(view, shares, hex_count)
        )
        sentences.append(f"{view.player_label if name == 'you' else name} likeliest at {each}.")
    return " ".join(sentences)


def describe_situation(view: View[CollaborativePredatorPrey]) -> str:
    """What you sensed, the belief, and where you see it the ways on."""
    problem, known = view.problem, compute_marginals(view)
    sentences = [
        f"sensed {format_last_observation(view)}.",
        _describe_belief(view, MAX_DESCRIBED_HEXES),
    ]
    here = _find_own_hex(view, known)
    if known is not None and here:

        def describe_hex(hex_: Hex) -> str:
            return f"prey {known.prey[problem.hexes.index(hex_)]:.3f}"

        sentences += [
            f"at {format_hex(here)}.",
            *hexgrid.describe_neighbours(problem.hexes, here, describe_hex),
        ]
    if known is None:
        return f"{sentences[0]} the belief is over too many states to be told."
    return " ".join(sentences) + _describe_partners(view)

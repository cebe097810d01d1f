"""How hex world looks: the map with its exits, you, and the keys that lead on."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.hexes import Hex, format_hex, hex_neighbours
from dmplay.problems.hexworld import HexWorld
from dmplay.session import View
from dmplay.views import hexgrid
from dmplay.views._advice import format_probability
from dmplay.views.canvas import format_percent, format_signed
from dmplay.views.hexgrid import HexCell, HexSize
from dmplay.views.style import DrawOptions, Lesson

POSITIVE_EXIT_STYLE, NEGATIVE_EXIT_STYLE = (
    "bold color(231) on color(25)",
    "bold color(16) on color(214)",
)  # of the palette
KEY_FAMILY, KEYS, SECOND_PLAYER_KEYS = hexgrid.KEY_FAMILY, hexgrid.KEYS, hexgrid.SECOND_PLAYER_KEYS


def _find_position(view: View[HexWorld], turn: int = -1) -> Hex | None:
    """The hex after a turn; None once the game is over."""
    hexes = view.problem.hexes
    state = int(view.observations[turn])
    return hexes[state] if state < len(hexes) else None


def iter_boards(view: View[HexWorld], options: DrawOptions) -> Iterator[Text]:
    """The map, the largest first."""
    problem = view.problem
    # Once over, the exit taken is still where you stand.
    here = _find_position(view) or (_find_position(view, -2) if view.actions else None)
    exits = dict(problem.rewards)
    around = hex_neighbours(here) if here else []
    ghost = (
        None
        if options.ghost_state is None
        else dict(enumerate(problem.hexes)).get(int(options.ghost_state))
    )
    may = _forecast_hex_probabilities(view, options)

    def make_cell(hex_: Hex, size: HexSize) -> HexCell:
        pay = exits.get(hex_)
        glyph = "" if pay is None else "◆" if pay > 0 else "✗"
        style = "" if pay is None else POSITIVE_EXIT_STYLE if pay > 0 else NEGATIVE_EXIT_STYLE
        note = "" if pay is None else format_signed(pay)
        dot = note or "."
        mark = glyph
        if options.overlay and pay is None:
            mark, note, _, style = hexgrid.make_overlay_cell(
                options, problem.hexes.index(hex_), size
            )
        if hex_ == here:
            stays = (
                format_probability(may[hex_], size.width - 1)
                if hex_ in may and size.text_rows > 1
                else note
            )
            return HexCell("@", stays, "@", "bold reverse")
        if hex_ in may:
            chance = format_probability(may[hex_], size.width - 1)
            return HexCell(chance, note, chance, style or "bold cyan")
        if (
            hex_ in around
            and _find_position(view)
            and here not in exits
            and options.regret is not None
        ):
            way = hexgrid.make_direction_cell(options, around.index(hex_), size)
            return (
                way
                if pay is None
                else HexCell(f"{glyph} {way.mark}"[:5], way.second_line, dot, style)
            )
        if hex_ == ghost:
            return HexCell("&", note, "&", "dim")
        if (
            options.show_keys
            and not options.overlay
            and hex_ in around
            and _find_position(view)
            and pay is None
        ):
            mark, style = hexgrid.get_direction_key(options, around.index(hex_)), style or "green"
        return HexCell(mark, note, dot, style)

    yield from hexgrid.iter_maps(problem.hexes, make_cell, options, _format_caption(view, options))


def _forecast_hex_probabilities(view: View[HexWorld], options: DrawOptions) -> dict[Hex, float]:
    """How likely an action leads to each hex, if that is asked."""
    hexes, may = view.problem.hexes, dict[Hex, float]()
    if options.forecast:
        for state, chance in zip(
            options.forecast.outcomes, options.forecast.probabilities, strict=True
        ):
            if int(state) < len(hexes):
                hex_ = hexes[int(state)]
                may[hex_] = may.get(hex_, 0.0) + float(chance)
    return may


def _format_caption(view: View[HexWorld], options: DrawOptions) -> str:
    """What an exit pays when you stand on it, else what is written into the hexes."""
    if not (options.allow_large or options.forecast or options.regret is not None):
        return ""
    here, exits = _find_position(view), dict(view.problem.rewards)
    if here is None:
        return _describe_last_move(view)[1] if view.actions else "over"
    if here in exits and not view.end_reason:
        return f"any key {'collects' if exits[here] > 0 else 'takes'} {format_signed(exits[here])}"
    if options.forecast:
        return f"{hexgrid.format_move_condition(options.forecast)}, how likely each hex is"
    if options.regret is not None:
        return hexgrid.format_wall_regrets(view.problem.hexes, here, options)
    ghost = ", & ghost" * (options.ghost_state is not None)
    return (
        f"@ {view.player_label}{ghost}, ◆ pays, ✗ costs{', letters are keys' * options.show_keys}"
    )


def _describe_last_move(view: View[HexWorld]) -> tuple[str, str]:
    """What came of the last move, for the panel and in a sentence."""
    before, after = _find_position(view, -2), _find_position(view)
    assert before
    if after is None:
        way_out = f"exit {format_signed(dict(view.problem.rewards)[before])}"
        return way_out, f"left by the {way_out}"
    walk = hexgrid.classify_move(before, after, int(view.actions[-1]))
    return f"{walk.direction}{' slip' * walk.has_slipped}" or "bumped", walk.description


def goal_lines(view: View[HexWorld]) -> list[str]:
    """The exits that pay and those that cost, the price of a bump, and how often steps slip."""
    problem = view.problem
    return [
        *_format_exit_goals(view),
        *([f"a bump costs {problem.bump_cost:g}"] if problem.bump_cost else []),
        *([f"{format_percent(problem.slip)} of steps slip aside"] if problem.slip else []),
    ]


def _format_exit_goals(view: View[HexWorld]) -> list[str]:
    """Which exits to reach, and which to keep off."""
    pays = sorted({pay for _, pay in view.problem.rewards}, reverse=True)
    good = " or ".join(format_signed(pay) for pay in pays if pay > 0)
    bad = " and ".join(format_signed(pay) for pay in pays if pay < 0)
    return [*([f"reach {good}"] if good else []), *([f"keep off {bad}"] if bad else [])]


def lesson(view: View[HexWorld]) -> Lesson:
    """A walker, the exits, and what a bump and a slip are."""
    problem = view.problem
    bump = f"a bump costs {problem.bump_cost:g}" if problem.bump_cost else "so is a bump"
    slips = (
        f"{format_percent(problem.slip)} of steps slip aside" if problem.slip else "no step slips"
    )
    return Lesson(
        "You are @ and walk from hex to hex; you always see where you are",
        f"You want to {' and '.join(_format_exit_goals(view))}: "
        "on an exit any key collects what it says and ends the game",
        f"A step is free, {bump}, and {slips}",
    )


def panel_rows(view: View[HexWorld]) -> list[tuple[str, str]]:
    """The last move and the odds of the next."""
    problem = view.problem
    moved = _describe_last_move(view)[0] if view.actions else "-"
    reward = f"{view.rewards[-1]:.2f}" if view.rewards else "-"
    return [
        ("last", view.last_action_label.upper() or "-"),
        ("moved", moved),
        ("reward", reward),
        ("goes on", f"{1 - problem.slip:.2f}"),
        ("slips aside", f"{problem.slip / 2:.2f} each"),
        ("discount", f"{problem.discount:.2f} (gamma)"),
    ]


def describe_turn(view: View[HexWorld]) -> str:
    """Where you are and how you got there."""
    here = _find_position(view)
    where = f"at {format_hex(here)}" if here else "over"
    return f"{where}. chose {view.last_action_label.upper()}, {_describe_last_move(view)[1]}."


def describe_situation(view: View[HexWorld]) -> str:
    """The six ways on, in action order, and how far the exits are."""
    problem, here = view.problem, _find_position(view)
    exits = dict(problem.rewards)
    if here is None:
        return "the game is over."
    sentences = [f"at {format_hex(here)}."]
    if here in exits:
        sentences.append(f"exit {format_signed(exits[here])} here: any action takes it.")
    sentences += hexgrid.describe_neighbours(
        problem.hexes, here, lambda hex_: _describe_hex(hex_, exits)
    )
    for hex_, pay in exits.items():
        what, far = "goal" if pay > 0 else "hazard", hexgrid.format_distance(here, hex_)
        sentences.append(f"{what} {format_signed(pay)} at {format_hex(hex_)}: {far}.")
    return " ".join(sentences)


def _describe_hex(hex_: Hex, exits: dict[Hex, float]) -> str:
    return f"exit {format_signed(exits[hex_])}" if hex_ in exits else "floor"

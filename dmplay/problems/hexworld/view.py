"""The view of hex world: the map with its exits, your position and the keys of each move."""

from collections.abc import Iterator
from functools import lru_cache

from rich.text import Text

from dmplay.core.hexgrid import Hex, format_hex, hex_neighbours
from dmplay.core.session import View
from dmplay.core.text import format_reward
from dmplay.draw import hex_map, theme
from dmplay.draw.action_hints import format_probability
from dmplay.draw.canvas import format_percent, format_signed
from dmplay.draw.hex_map import HexCell, HexSize
from dmplay.draw.options import DrawOptions
from dmplay.views.protocol import FinishedGame, Lesson

from .rules import HexWorld

POSITIVE_EXIT_STYLE, NEGATIVE_EXIT_STYLE = (
    "bold color(231) on color(25)",
    "bold color(16) on color(214)",
)  # ANSI palette colours
EMPTY_CELL = HexCell("")
KEY_FAMILY, KEYS, SECOND_PLAYER_KEYS = hex_map.KEY_FAMILY, hex_map.KEYS, hex_map.SECOND_PLAYER_KEYS


def _find_position(view: View[HexWorld], turn: int = -1) -> Hex | None:
    """Return the position after a turn, or None once the game is over."""
    hexes = view.problem.hexes
    state = int(view.observations[turn])
    return hexes[state] if state < len(hexes) else None


def iter_boards(view: View[HexWorld], options: DrawOptions) -> Iterator[Text]:
    """Yield the map in every size, the largest first."""
    problem = view.problem
    # After the game, you are still drawn on the exit that you took.
    position_now = _find_position(view)
    position = position_now or (_find_position(view, -2) if view.actions else None)
    exits = dict(problem.rewards)
    marks_directions = options.show_keys or options.regret is not None
    adjacent = hex_neighbours(position) if position and marks_directions else []
    ghost = None
    if options.ghost_state is not None:
        ghost = dict(enumerate(problem.hexes)).get(int(options.ghost_state))
    probabilities = _forecast_hex_probabilities(view, options)
    can_step = position_now is not None and position_now not in exits
    shows_regrets = can_step and options.regret is not None and not options.overlay
    marked_hexes = {position, ghost, *exits, *adjacent, *probabilities}

    def make_cell(hex_: Hex, size: HexSize) -> HexCell:
        """Return the content of a hex."""
        if hex_ not in marked_hexes and not options.overlay:
            return EMPTY_CELL
        reward = exits.get(hex_)
        glyph = "" if reward is None else "◆" if reward > 0 else "✗"
        style = "" if reward is None else POSITIVE_EXIT_STYLE if reward > 0 else NEGATIVE_EXIT_STYLE
        note = "" if reward is None else format_signed(reward)
        is_compact = size.text_rows == 1 and 0 < len(note) < size.width
        dot, mark = note or ".", note if is_compact else glyph
        if options.overlay and reward is None:
            state = problem.hexes.index(hex_)
            mark, note, _, style, _ = hex_map.make_overlay_cell(options, state, size)
        if hex_ == position:
            stay_text = note
            if hex_ in probabilities and size.text_rows > 1:
                stay_text = format_probability(probabilities[hex_], size.width - 1)
            return HexCell("@", stay_text, "@", "bold reverse")
        if hex_ in probabilities:
            probability_text = format_probability(probabilities[hex_], size.width - 1)
            return HexCell(probability_text, note, probability_text, style or theme.STRONG_DATA)
        if hex_ in adjacent and shows_regrets:
            key_cell = hex_map.make_direction_cell(options, adjacent.index(hex_), size)
            if reward is not None:
                mark = f"{glyph} {key_cell.mark}"[:5]
                key_cell = HexCell(mark, key_cell.second_line, dot, style)
            return key_cell
        if hex_ == ghost:
            return HexCell("&", note, "&", "dim")
        key = ""
        if options.show_keys and hex_ in adjacent and position_now:
            key = hex_map.get_direction_key(options, adjacent.index(hex_))
        if key and mark == glyph and options.allow_large:
            mark = f"{glyph} {key}"[:5]
        has_space = not (options.overlay and (mark or size.text_rows < 2)) and reward is None
        if key and has_space:
            mark, style = key, style or theme.CHOICE
        return HexCell(mark, note, dot, style)

    yield from hex_map.iter_maps(problem.hexes, make_cell, options, _format_caption(view, options))


def _forecast_hex_probabilities(view: View[HexWorld], options: DrawOptions) -> dict[Hex, float]:
    """Return the probability that the forecast action leads to each hex; empty if no forecast."""
    hexes, probabilities = view.problem.hexes, dict[Hex, float]()
    if options.forecast:
        _, chances, states, *_ = options.forecast
        for state, probability in zip(states, chances, strict=True):
            if int(state) < len(hexes):
                hex_ = hexes[int(state)]
                probabilities[hex_] = probabilities.get(hex_, 0.0) + float(probability)
    return probabilities


def _format_caption(view: View[HexWorld], options: DrawOptions) -> str:
    """Return the caption of the map: an exit's reward, the forecast, wall regrets or a legend.

    The caption is '' on small boards without a forecast or hints.
    """
    if not (options.allow_large or options.forecast or options.regret is not None):
        return ""
    position, exits = _find_position(view), dict(view.problem.rewards)
    if position is None:
        return _describe_last_move(view)[1] if view.actions else "over"
    if position in exits and not view.end_reason:
        verb = "collects" if exits[position] > 0 else "takes"
        return f"any action {verb} {format_signed(exits[position])}"
    if options.forecast:
        return f"{hex_map.format_move_condition(options.forecast)}: chance of each hex"
    if options.regret is not None and not options.overlay:
        return hex_map.format_wall_regrets(view.problem.hexes, position, options)
    ghost = ", & ghost" * (options.ghost_state is not None)
    keys = ", letters are keys" * options.show_keys
    rewards = exits.values()
    good = hex_map.GOOD_EXIT_LEGEND * any(reward > 0 for reward in rewards)
    bad = hex_map.BAD_EXIT_LEGEND * any(reward <= 0 for reward in rewards)
    return f"@ {view.player_label}{ghost}{good}{bad}{keys}"


def _describe_last_move(view: View[HexWorld]) -> tuple[str, str]:
    """Return the result of the last move, in short for the panel and as a clause."""
    before, after = _find_position(view, -2), _find_position(view)
    assert before
    if after is None:
        exit_text = f"exit {format_signed(dict(view.problem.rewards)[before])}"
        return exit_text, f"took {exit_text}"
    return hex_map.describe_move(view.problem.hexes, before, after, int(view.actions[-1]))


def describe_keys(view: View[HexWorld]) -> dict[str, str]:
    """Return the effect of the keys that move into a wall."""
    position = _find_position(view)
    if position is None or position in dict(view.problem.rewards):
        return {}
    return hex_map.describe_wall_keys(view.problem.hexes, position)


def goal_lines(view: View[HexWorld]) -> list[str]:
    """Return the exits to reach and avoid, the cost of a bump and the slips, as clauses."""
    problem = view.problem
    return [
        *_format_exit_goals(problem.rewards),
        *([f"a bump costs {problem.bump_cost:g}"] if problem.bump_cost else []),
        *([f"{format_percent(problem.slip)} of steps slip"] if problem.slip else []),
    ]


@lru_cache(16)  # Every frame shows them.
def _format_exit_goals(exits: tuple[tuple[Hex, float], ...]) -> tuple[str, ...]:
    """Return a clause with the rewards of exits to reach, and one of exits to avoid."""
    rewards = sorted({pay for _, pay in exits}, reverse=True)
    positive = " or ".join(format_signed(pay) for pay in rewards if pay > 0)
    negative = " and ".join(format_signed(pay) for pay in rewards if pay < 0)
    return (
        *([f"reach exit {positive}"] if positive else []),
        *([f"avoid exit {negative}"] if negative else []),
    )


def lesson(view: View[HexWorld]) -> Lesson:
    """Return the three sentences that introduce the problem: role, objective and costs."""
    problem = view.problem
    cost = f"costs {problem.bump_cost:g}" if problem.bump_cost else "is free too"
    slips = hex_map.describe_slips(problem.slip) or "no step slips"
    return Lesson(
        "You walk from hex to hex; you always see where you are",
        f"You want to {' and '.join(_format_exit_goals(problem.rewards))}: "
        "on an exit, any action collects its reward and ends the game",
        f"A step is free, a bump into a wall {cost}, and {slips}",
        example_start="from hex {}",
        chances=hex_map.describe_step_chances(problem.slip),
        map_mark="@",
    )


def panel_rows(view: View[HexWorld]) -> list[tuple[str, str]]:
    """Return the panel rows: last action, result, reward, slip probabilities and discount."""
    problem = view.problem
    move_text = _describe_last_move(view)[0] if view.actions else "-"
    reward = format_reward(view.rewards[-1]) if view.rewards else "-"
    return [
        ("chose", view.last_action_label.upper() or "-"),
        ("result", move_text),
        ("reward", reward),
        ("forward", f"{1 - problem.slip:.2f}"),
        ("slip", f"{problem.slip / 2:.2f} each side"),
        ("discount", f"{problem.discount:.2f} (gamma)"),
    ]


def describe_turn(view: View[HexWorld]) -> str:
    """Return a description of the last action, its result and the position after it."""
    position = _find_position(view)
    move_text = _describe_last_move(view)[1]
    if position:
        move_text = hex_map.append_position(move_text, position)
    return f"chose {view.last_action_label.upper()}, {move_text}."


def describe_situation(view: View[HexWorld]) -> str:
    """Return a description of the position, the six neighbours and the distance to each exit."""
    problem, position = view.problem, _find_position(view)
    exits = dict(problem.rewards)
    if position is None:
        return "the game is over."
    sentences = [f"at {format_hex(position)}."]
    if position in exits:
        sentences.append(f"exit {format_signed(exits[position])} here: any action takes it.")
    sentences += hex_map.describe_neighbours(
        problem.hexes,
        position,
        lambda hex_: f"exit {format_signed(exits[hex_])}" if hex_ in exits else "floor",
    )
    for hex_, pay in exits.items():
        distance = hex_map.format_distance(problem.hexes, position, hex_)
        sentences.append(f"exit {format_signed(pay)} at {format_hex(hex_)}: {distance}.")
    return " ".join(sentences)


def describe_end(game: FinishedGame[HexWorld]) -> str:
    """Return the exit that the player took, or that no exit was reached."""
    exit_hex = game.problem.hexes[int(game.states[-2])]
    exits = dict(game.problem.rewards)
    if not game.is_terminal:
        return f"{game.player} took no exit in {game.turns}"
    verb = "reached the exit with" if exits[exit_hex] > 0 else "ended on the exit with"
    return f"{game.player} {verb} {format_signed(exits[exit_hex])} in {game.turns}"

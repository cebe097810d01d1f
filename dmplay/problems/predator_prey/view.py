"""The view of predator-prey hex world: the map with all agents and the keys of each move."""

from collections.abc import Iterator
from string import ascii_uppercase

import numpy as np
from rich.text import Text

from dmplay.core.hexgrid import DIRECTIONS, Hex, format_hex, hex_neighbours
from dmplay.core.session import View
from dmplay.core.text import format_count, format_reward
from dmplay.draw import hex_map, theme
from dmplay.draw.action_hints import format_probability
from dmplay.draw.hex_map import HexCell, HexSize
from dmplay.draw.options import DrawOptions
from dmplay.problems._shared.hex_hunt import STANDARD_HEXES
from dmplay.views.protocol import FinishedGame, Lesson

from .rules import DEVOURED_REWARD, MOVE_REWARD, PredatorPrey

KEY_FAMILY, KEYS, SECOND_PLAYER_KEYS = hex_map.KEY_FAMILY, hex_map.KEYS, hex_map.SECOND_PLAYER_KEYS
PREDATOR_GLYPHS = ascii_uppercase  # keys on the map are never capitals
PREDATOR_COLORS, PREY_COLOR = theme.SEAT_COLORS, theme.DATA


def _list_positions(view: View[PredatorPrey], turn: int = -1) -> list[Hex]:
    """Return the hex of each agent after a turn."""
    problem = view.problem
    return [problem.hexes[int(hex_index)] for hex_index in view.observations[turn]]


def get_agent_glyph(problem: PredatorPrey, seat: int) -> str:
    """Return the glyph of an agent: a capital for a predator, `o` for prey, numbered if several."""
    if seat in problem.predator_seats:
        return PREDATOR_GLYPHS[seat % len(PREDATOR_GLYPHS)]
    number = seat - problem.predators + 1
    return "o" if problem.prey == 1 else f"o{number}"


def _choose_agent_style(view: View[PredatorPrey], seat: int, options: DrawOptions) -> str:
    """Return the style of an agent; your own agent is in reverse video."""
    if not options.allow_large:
        return "bold reverse" if seat == view.seat else theme.PIECE
    color = PREY_COLOR
    if seat in view.problem.predator_seats:
        color = PREDATOR_COLORS[seat % len(PREDATOR_COLORS)]
    return f"bold {color}{' reverse' * (seat == view.seat)}"


def _mark_feeding_agents(view: View[PredatorPrey], turn: int = -1) -> list[bool]:
    """Return a list of flags, one per agent: true if a predator and a prey share its hex."""
    problem, positions = view.problem, _list_positions(view, turn)
    prey_hexes = {positions[seat] for seat in problem.prey_seats}
    shared_hexes = prey_hexes & {positions[seat] for seat in problem.predator_seats}
    return [position in shared_hexes for position in positions]


def iter_boards(view: View[PredatorPrey], options: DrawOptions) -> Iterator[Text]:
    """Yield the map in every size, the largest first.

    An overlay is for the states with you on each hex and all other agents where they are.
    """
    problem, positions = view.problem, _list_positions(view)
    position = positions[view.seat]
    adjacent = hex_neighbours(position)
    can_show_keys = options.show_keys or options.regret is not None
    if options.overlay or _mark_feeding_agents(view)[view.seat]:
        can_show_keys = False

    def find_state_at(hex_: Hex) -> int:
        """Return the index of the state with you on this hex and all others where they are."""
        state = view.observation.copy()
        state[view.seat] = problem.hexes.index(hex_)
        return int(problem.state_indices(state[None])[0])

    probabilities = _forecast_hex_probabilities(view, options)
    glyphs = [get_agent_glyph(problem, seat) for seat in range(len(positions))]
    if not options.allow_large:
        glyphs[view.seat] = "@"

    def make_cell(hex_: Hex, size: HexSize) -> HexCell:
        """Return the content of a hex."""
        key_cell = HexCell("")
        if can_show_keys and hex_ in adjacent:
            key_cell = hex_map.make_direction_cell(options, adjacent.index(hex_), size)
        seats_on_hex = [seat for seat, agent_hex in enumerate(positions) if agent_hex == hex_]
        marks = [glyphs[seat] for seat in seats_on_hex]
        if len(marks) > 1:
            note, columns = "".join(sorted(marks)), size.width - 1
            if len(note) > columns:
                note = note[: columns - 1] + "…"
            style = "bold reverse" if view.seat in seats_on_hex else theme.PIECE
            return HexCell("*", note, "*", style)
        arrival_cell = _make_arrival_cell(view, probabilities.get(hex_, {}), size)
        if marks:
            is_own = options.allow_large and view.seat in seats_on_hex
            own_label = view.player_label if is_own and len(view.player_label) < size.width else ""
            # The key of a move to an occupied hex is in the second line, or beside the glyph with
            # hints.
            mark_text = marks[0]
            if options.regret is not None and key_cell.mark:
                mark_text += f" {key_cell.mark.strip()}" if size.text_rows > 1 else key_cell.mark
            second_line = arrival_cell.mark or key_cell.second_line or key_cell.mark or own_label
            style = _choose_agent_style(view, seats_on_hex[0], options)
            return HexCell(mark_text, "" if options.overlay else second_line, marks[0], style)
        if arrival_cell.second_line:
            return arrival_cell
        if options.overlay:
            return hex_map.make_overlay_cell(options, find_state_at(hex_), size)
        return key_cell

    yield from hex_map.iter_maps(problem.hexes, make_cell, options, _format_caption(view, options))


def _forecast_hex_probabilities(
    view: View[PredatorPrey], options: DrawOptions
) -> dict[Hex, dict[int, float]]:
    """Return the probability of each agent on each hex after the forecast action.

    The result maps a hex to a dict from seat to probability; it is empty without a forecast.
    """
    probabilities: dict[Hex, dict[int, float]] = {}
    if options.forecast:
        _, chances, states, *_ = options.forecast
        for state, probability in zip(states, chances, strict=True):
            for seat, hex_index in enumerate(state):
                by_seat = probabilities.setdefault(view.problem.hexes[int(hex_index)], {})
                by_seat[seat] = by_seat.get(seat, 0.0) + float(probability)
    return probabilities


def _make_arrival_cell(
    view: View[PredatorPrey], probabilities: dict[int, float], size: HexSize
) -> HexCell:
    """Return a hex with the forecast probabilities that you and another agent arrive there.

    Of the other agents, only the likeliest is shown.
    """
    columns = size.width - 1
    others_by_seat = {seat: p for seat, p in probabilities.items() if seat != view.seat}
    own_probability, other_text = probabilities.get(view.seat, 0.0), ""
    if others_by_seat:
        seat = max(others_by_seat, key=lambda other: others_by_seat[other])
        name = get_agent_glyph(view.problem, seat)
        other_text = name + format_probability(others_by_seat[seat], columns - len(name))
    if own_probability:
        probability = format_probability(own_probability, columns)
        return HexCell(probability, other_text or " ", probability, theme.STRONG_DATA)
    return HexCell(other_text, " " * bool(other_text), other_text, theme.DATA)


def _format_caption(view: View[PredatorPrey], options: DrawOptions) -> str:
    """Return the caption of the map: the forecast, feeding, wall regrets or the agents' names."""
    if options.forecast:
        return f"{hex_map.format_move_condition(options.forecast)}: chance of each hex"
    is_caption_visible = options.allow_large or options.regret is not None
    if _mark_feeding_agents(view)[view.seat] and not view.end_reason and is_caption_visible:
        is_predator = view.seat in view.problem.predator_seats
        return (
            "you have the prey: any key eats it"
            if is_predator
            else "caught: any key moves you away"
        )
    if options.regret is not None and not options.overlay:
        position = _list_positions(view)[view.seat]
        return hex_map.format_wall_regrets(view.problem.hexes, position, options)
    problem, player = view.problem, view.player_label
    player = player if player == "you" else f"the {player}"
    text = f"{get_agent_glyph(problem, view.seat)} is {player}"
    if len(problem.agents) == 2:
        other = 1 - view.seat
        text += f", {get_agent_glyph(problem, other)} is the {problem.agents[other]}"
    return text if options.allow_large else ""


def _get_last_action(view: View[PredatorPrey], seat: int) -> int:
    """Return the last action of an agent."""
    assert view.joint_actions is not None
    return int(view.joint_actions[-1][seat])


def _describe_last_move(view: View[PredatorPrey], seat: int) -> tuple[str, str]:
    """Return the result of an agent's last move, in short for the panel and as a clause."""
    if _mark_feeding_agents(view, -2)[seat]:
        if seat in view.problem.predator_seats:
            return "ate prey", "ate the prey, stayed"
        return "caught", "was caught, reappeared"
    before, after = _list_positions(view, -2)[seat], _list_positions(view)[seat]
    action = _get_last_action(view, seat)
    return hex_map.describe_move(view.problem.hexes, before, after, action)


def _describe_action_and_move(view: View[PredatorPrey], seat: int) -> str:
    """Return an agent's last action and its result, such as `chose NE, moved NE to (1,2)`."""
    move_text = _describe_last_move(view, seat)[1]
    move_text = hex_map.append_position(move_text, _list_positions(view)[seat])
    return f"chose {DIRECTIONS[_get_last_action(view, seat)].upper()}, {move_text}"


def describe_keys(view: View[PredatorPrey]) -> dict[str, str]:
    """Return the effect of the keys that move into a wall."""
    if _mark_feeding_agents(view)[view.seat]:
        return {}
    return hex_map.describe_wall_keys(view.problem.hexes, _list_positions(view)[view.seat])


def _is_standard_hunt(problem: PredatorPrey) -> bool:
    """Return whether a predator hunts a prey on the standard map, with a discount.

    The map is too large for a catch in every second turn, so that the costs are more than is won.
    """
    is_pair = problem.predators == problem.prey == 1
    return is_pair and problem.hexes == STANDARD_HEXES and problem.discount < 1.0


def goal_lines(view: View[PredatorPrey]) -> list[str]:
    """Return the goal and the rewards of a predator or a prey, as clauses."""
    problem, slips = view.problem, [*filter(None, [hex_map.describe_slips(view.problem.slip)])]
    if view.seat in problem.predator_seats:
        unit = "" if problem.prey == 1 else " per prey"
        sharing_clause = ", shared by the predators there" if problem.predators > 1 else ""
        return [
            f"step onto {'the' if problem.prey == 1 else 'a'} prey",
            f"one turn later, that pays 1{unit}{sharing_clause}",
            "turns without a catch cost 1",
            *["early catches count most"] * (problem.discount < 1.0),
            *["even best play ends below 0 on average"] * _is_standard_hunt(problem),
            *slips,
            "a bump into a wall costs nothing more",
            f"a caught prey loses {-DEVOURED_REWARD:g} and reappears at random",
        ]
    return [
        f"avoid predators: being caught costs {-DEVOURED_REWARD:g}",
        "moves and bumps into walls are free",
        *slips,
        "once caught, you reappear on a random hex",
    ]


def lesson(view: View[PredatorPrey]) -> Lesson:
    """Return the three sentences that introduce the problem: role, objective and costs."""
    problem = view.problem
    slips = hex_map.describe_slips(problem.slip) or "no step slips"
    start = f"with {' and '.join(f'{name} at {{}}' for name in problem.agents)}"
    role = (
        f"You are {problem.agents[view.seat]}; all agents see each other, move one hex at the same "
        "time, and can swap hexes"
    )
    chances = (
        *hex_map.describe_step_chances(problem.slip),
        "A predator and a prey that begin a turn on the same hex take no step in it, whatever they "
        "choose",
        f"The predator stays, and the prey reappears on each of the {len(problem.hexes)} hexes "
        f"with probability 1/{len(problem.hexes)}",
    )
    mark = get_agent_glyph(problem, view.seat)
    if view.seat in problem.predator_seats:
        sharing_clause = ", shared by the predators on it" if problem.predators > 1 else ""
        objective = (
            f"You want to reach a prey: if you begin a turn on its hex, you get 1{sharing_clause}; "
            f"you stay there, and the prey loses {-DEVOURED_REWARD:g} and reappears on a random hex"
        )
        costs = f"Any other turn costs {-MOVE_REWARD:g}, also one with a bump, and {slips}"
    else:
        objective = "You want to avoid the hexes of predators"
        costs = (
            f"A turn that begins on the hex of a predator costs you {-DEVOURED_REWARD:g}, and you "
            f"reappear on a random hex; a step is free, and {slips}"
        )
    return Lesson(role, objective, costs, example_start=start, chances=chances, map_mark=mark)


def panel_rows(view: View[PredatorPrey]) -> list[tuple[str, str]]:
    """Return the panel rows: your last move, all positions, scores and shared hexes."""
    problem, positions = view.problem, _list_positions(view)
    move_text = _describe_last_move(view, view.seat)[0] if view.turns_played else "-"
    reward = format_reward(view.rewards[-1]) if view.rewards else "-"
    last = view.last_action_label.upper() or "-"
    rows = [("last", last), ("moved", move_text), ("reward", reward)]
    for seat, agent in enumerate(problem.agents):
        name = view.player_label if seat == view.seat else agent
        rows.append((f"{get_agent_glyph(problem, seat)} {name}", format_hex(positions[seat])))
    rows += [
        *_list_discounted_scores(view),
        ("slip", f"{problem.slip / 2:.2f} each side"),
        ("discount", f"{problem.discount:.2f} (gamma)"),
    ]
    for hex_ in dict.fromkeys(positions):  # last, because these rows come and go
        seats = [seat for seat, position in enumerate(positions) if position == hex_]
        marks = sorted(get_agent_glyph(problem, seat) for seat in seats)
        if len(marks) > 1:
            rows.append((f"* {format_hex(hex_)}", " ".join(marks)))
    return rows


def _list_discounted_scores(view: View[PredatorPrey]) -> list[tuple[str, str]]:
    """Return panel rows with the discounted return of each agent so far.

    All agents see every state, and the rewards depend on the states alone.
    """
    problem = view.problem
    if not view.turns_played:
        return []
    states = np.array(view.observations[:-1])
    any_actions = np.zeros_like(states)  # the rewards do not depend on the actions
    rewards = problem.resolve_events(states, any_actions, tuple(any_actions.T)).rewards
    weights = problem.discount ** np.arange(view.turns_played)
    sums = enumerate(np.sum(weights[:, None] * rewards, axis=0))
    return [
        (f"score {get_agent_glyph(problem, seat)}", format_reward(total)) for seat, total in sums
    ]


def describe_turn(view: View[PredatorPrey]) -> str:
    """Return a description of your last move and position, then of the other agents."""
    agents, positions = view.problem.agents, _list_positions(view)
    other_seats = [seat for seat in range(len(agents)) if seat != view.seat]
    sentences = [f"{_describe_action_and_move(view, view.seat)}."]
    sentences += _iter_shared_hex_sentences(view)
    fed_before = _mark_feeding_agents(view, -2)
    for seat in other_seats:
        # With several other agents, only the actions of those that fed or were caught are
        # described.
        text = f"at {format_hex(positions[seat])}"
        if len(other_seats) == 1 or fed_before[seat]:
            text = _describe_action_and_move(view, seat)
        sentences.append(f"{agents[seat]} {text}.")
    return " ".join(sentences)


def _iter_shared_hex_sentences(view: View[PredatorPrey]) -> Iterator[str]:
    """Yield a sentence on the next turn if the player shares a hex with its prey or predator."""
    if not _mark_feeding_agents(view)[view.seat] or view.player_label != "you" or view.end_reason:
        return
    if view.seat in view.problem.predator_seats:
        yield "you have the prey: any action eats it."
    else:
        yield "you are caught: after any action you reappear on a random hex."


def describe_situation(view: View[PredatorPrey]) -> str:
    """Return a description of your position, the six neighbours and the other agents' distances."""
    problem, positions = view.problem, _list_positions(view)
    position = positions[view.seat]
    is_watched = view.player_label != "you"
    sentences = [f"at {format_hex(position)}, you are {problem.agents[view.seat]}."]
    if is_watched:
        sentences = [f"{view.player_label} at {format_hex(position)}."]
    sentences += _iter_shared_hex_sentences(view)

    def describe_hex(hex_: Hex) -> str:
        """Return the names of the agents on a hex, or `free`."""
        names = [problem.agents[i] for i, agent_hex in enumerate(positions) if agent_hex == hex_]
        return " and ".join(names) or "free"

    sentences += hex_map.describe_neighbours(problem.hexes, position, describe_hex)
    for seat, agent in enumerate(problem.agents):
        if seat != view.seat:
            distance, hex_ = "here", positions[seat]
            if hex_ != position:
                distance = hex_map.format_distance(problem.hexes, position, hex_)
            sentences.append(f"{agent} at {format_hex(hex_)}: {distance}.")
    return " ".join(sentences)


def describe_end(game: FinishedGame[PredatorPrey]) -> str:
    """Count the turns in which the player caught prey, or was caught."""
    problem, rewards = game.problem, game.rewards[:, game.seat]
    if game.seat < problem.predators:
        prey = "the prey" if problem.prey == 1 else "prey"
        return f"{game.player} caught {prey} in {int((rewards > 0).sum())} of {game.turns}"
    hunters = "the predator" if problem.predators == 1 else "the predators"
    count = format_count(int((rewards == DEVOURED_REWARD).sum()), "time")
    return f"{hunters} caught {game.player} {count} in {game.turns}"

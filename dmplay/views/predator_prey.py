"""How the hunt looks: the map with everyone on it, and the keys that lead on."""

from collections.abc import Iterator
from string import ascii_uppercase

import numpy as np
from rich.text import Text

from dmplay.hexes import DIRECTIONS, Hex, format_hex, hex_neighbours
from dmplay.problems.predator_prey import DEVOURED_REWARD, MOVE_REWARD, PredatorPrey
from dmplay.session import View
from dmplay.views import hexgrid
from dmplay.views._advice import format_probability
from dmplay.views.canvas import format_percent
from dmplay.views.hexgrid import HexCell, HexSize
from dmplay.views.style import DrawOptions, Lesson

KEY_FAMILY, KEYS, SECOND_PLAYER_KEYS = hexgrid.KEY_FAMILY, hexgrid.KEYS, hexgrid.SECOND_PLAYER_KEYS
PREDATOR_GLYPHS = ascii_uppercase  # no key that a hex shows is a capital
PREDATOR_COLORS, PREY_COLOR = ("yellow", "magenta", "blue"), "cyan"


def _list_positions(view: View[PredatorPrey], turn: int = -1) -> list[Hex]:
    """The hex of each agent after a turn."""
    problem = view.problem
    return [problem.hexes[int(place)] for place in view.observations[turn]]


def get_agent_glyph(problem: PredatorPrey, seat: int) -> str:
    """A capital for a predator, `o` for prey, numbered where there are more."""
    if seat in problem.predator_seats:
        return PREDATOR_GLYPHS[seat % len(PREDATOR_GLYPHS)]
    number = seat - problem.predators + 1
    return "o" if problem.prey == 1 else f"o{number}"


def get_displayed_glyph(view: View[PredatorPrey], seat: int, options: DrawOptions) -> str:
    """The glyph of an agent, the same whoever looks; in a transcript's frame `@` for you."""
    return (
        "@"
        if seat == view.seat and not options.allow_large
        else get_agent_glyph(view.problem, seat)
    )


def _choose_agent_style(view: View[PredatorPrey], seat: int, options: DrawOptions) -> str:
    """The colour of an agent; you are reversed as well."""
    if not options.allow_large:
        return "bold reverse" if seat == view.seat else "bold yellow"
    own = (
        PREDATOR_COLORS[seat % len(PREDATOR_COLORS)]
        if seat in view.problem.predator_seats
        else PREY_COLOR
    )
    return f"bold {own}{' reverse' * (seat == view.seat)}"


def _flag_feeding_agents(view: View[PredatorPrey], turn: int = -1) -> list[bool]:
    """Whether each agent is on the hex of its prey or of a predator."""
    problem, places = view.problem, _list_positions(view, turn)
    met = {places[i] for i in problem.predator_seats} & {places[i] for i in problem.prey_seats}
    return [place in met for place in places]


def iter_boards(view: View[PredatorPrey], options: DrawOptions) -> Iterator[Text]:
    """The map, the largest first; an overlay is of you on each hex, the others where they are."""
    problem, places = view.problem, _list_positions(view)
    here = places[view.seat]
    around = hex_neighbours(here)
    free = (options.show_keys or options.regret is not None) and not _flag_feeding_agents(view)[
        view.seat
    ]

    def find_state_at(hex_: Hex) -> int:
        """The state in which you are on this hex, all others where they are."""
        state = view.observation.copy()
        state[view.seat] = problem.hexes.index(hex_)
        return int(problem.state_indices(state[None])[0])

    may = _forecast_hex_probabilities(view, options)

    def make_cell(hex_: Hex, size: HexSize) -> HexCell:
        way = HexCell("")
        if free and hex_ in around:
            way = hexgrid.make_direction_cell(options, around.index(hex_), size)
        here_now = [seat for seat, place in enumerate(places) if place == hex_]
        marks = [get_displayed_glyph(view, seat, options) for seat in here_now]
        if len(marks) > 1:
            together, room = "".join(sorted(marks)), size.width - 1
            note = together if len(together) <= room else together[: room - 1] + "…"
            return HexCell(
                "*", note, "*", "bold reverse" if view.seat in here_now else "bold yellow"
            )
        chances = _make_arrival_cell(view, may.get(hex_, {}), size)
        if marks:
            mine = options.allow_large and view.seat in here_now
            you = view.player_label if mine and len(view.player_label) < size.width else ""
            # The key of a way that leads to somebody stands below; beside, where losses are told.
            shown = marks[0]
            if options.regret is not None and way.mark:
                shown += f" {way.mark.strip()}" if size.text_rows > 1 else way.mark
            told = chances.mark or way.second_line or way.mark or you
            return HexCell(
                shown,
                "" if options.overlay else told,
                marks[0],
                _choose_agent_style(view, here_now[0], options),
            )
        if chances.second_line:
            return chances
        return (
            hexgrid.make_overlay_cell(options, find_state_at(hex_), size)
            if options.overlay
            else way
        )

    yield from hexgrid.iter_maps(problem.hexes, make_cell, options, _format_caption(view, options))


def _forecast_hex_probabilities(
    view: View[PredatorPrey], options: DrawOptions
) -> dict[Hex, dict[int, float]]:
    """How likely an action leads each agent to each hex, if that is asked."""
    may: dict[Hex, dict[int, float]] = {}
    if options.forecast:
        for state, chance in zip(
            options.forecast.outcomes, options.forecast.probabilities, strict=True
        ):
            for seat, place in enumerate(state):
                there = may.setdefault(view.problem.hexes[int(place)], {})
                there[seat] = there.get(seat, 0.0) + float(chance)
    return may


def _make_arrival_cell(
    view: View[PredatorPrey], probabilities: dict[int, float], size: HexSize
) -> HexCell:
    """Who may come to a hex: you, and the likeliest of the others."""
    room = size.width - 1
    others = {seat: chance for seat, chance in probabilities.items() if seat != view.seat}
    yours, theirs = probabilities.get(view.seat, 0.0), ""
    if others:
        seat = max(others, key=lambda one: others[one])
        name = get_agent_glyph(view.problem, seat)
        theirs = name + format_probability(others[seat], room - len(name))
    if yours:
        chance = format_probability(yours, room)
        return HexCell(chance, theirs or " ", chance, "bold cyan")
    return HexCell(theirs, " " * bool(theirs), theirs, "cyan")


def _format_caption(view: View[PredatorPrey], options: DrawOptions) -> str:
    """Who you are, or what is written into the hexes."""
    if options.forecast:
        return f"{hexgrid.format_move_condition(options.forecast)}, how likely"
    if (
        _flag_feeding_agents(view)[view.seat]
        and not view.end_reason
        and (options.allow_large or options.regret is not None)
    ):
        return "any key feeds" if view.seat in view.problem.predator_seats else "caught: any key"
    if options.regret is not None:
        return hexgrid.format_wall_regrets(
            view.problem.hexes, _list_positions(view)[view.seat], options
        )
    you = f"{get_agent_glyph(view.problem, view.seat)} is {_name_own_agent(view)}"
    others = [seat for seat in range(len(view.problem.agents)) if seat != view.seat]
    if len(others) == 1:
        you += (
            f", {get_agent_glyph(view.problem, others[0])} is the {view.problem.agents[others[0]]}"
        )
    return you if options.allow_large else ""


def _name_own_agent(view: View[PredatorPrey]) -> str:
    """Who looks: you, or an agent that is watched."""
    return view.player_label if view.player_label == "you" else f"the {view.player_label}"


def _get_last_action(view: View[PredatorPrey], seat: int) -> int:
    """The last action of an agent."""
    assert view.joint_actions is not None
    return int(view.joint_actions[-1][seat])


def _describe_last_move(view: View[PredatorPrey], seat: int) -> tuple[str, str]:
    """What came of an agent's last move, in one word for the panel and in a sentence."""
    if _flag_feeding_agents(view, -2)[seat]:
        hunts = seat in view.problem.predator_seats
        return ("fed", "fed, stayed") if hunts else ("devoured", "was devoured, born again")
    walk = hexgrid.classify_move(
        _list_positions(view, -2)[seat], _list_positions(view)[seat], _get_last_action(view, seat)
    )
    return f"{'slip ' * walk.has_slipped}{walk.direction}" or "bumped", walk.description


def _describe_action_and_move(view: View[PredatorPrey], seat: int) -> str:
    """The last move of an agent: `chose NE, moved NE`, `chose E, fed, stayed`."""
    return f"chose {DIRECTIONS[_get_last_action(view, seat)].upper()}, {_describe_last_move(view, seat)[1]}"


def goal_lines(view: View[PredatorPrey]) -> list[str]:
    """What the seat hunts for, or flees from."""
    problem = view.problem
    slips = [f"{format_percent(problem.slip)} of steps slip aside"] if problem.slip else []
    if view.seat in problem.predator_seats:
        meal = "a meal" if problem.prey == 1 else "a meal for each prey"
        shared = ", shared by those on its hex" if problem.predators > 1 else ""
        return [f"catch the prey: its hex is {meal}, +1{shared}", "any other turn costs 1", *slips]
    return [f"keep away: to be caught costs {-DEVOURED_REWARD:g}", "moving is free", *slips]


def lesson(view: View[PredatorPrey]) -> Lesson:
    """Who hunts whom, and what a turn costs."""
    problem = view.problem
    slips = (
        f"{format_percent(problem.slip)} of steps slip aside" if problem.slip else "no step slips"
    )
    name = f"{get_agent_glyph(problem, view.seat)}, {problem.agents[view.seat]}"
    you = f"You are {name}; all see all and move at once, one hex a turn"
    if view.seat in problem.predator_seats:
        shared = ", shared by the predators on it" if problem.predators > 1 else ""
        want = f"You want to share a hex with prey: a turn begun there pays 1{shared}"
        return Lesson(you, want, f"Any other turn costs {-MOVE_REWARD:g}, and {slips}")
    want = "You want never to share a hex with a predator"
    cost = (
        f"To be caught costs {-DEVOURED_REWARD:g} and you are born again on any hex; a step is free"
    )
    return Lesson(you, want, f"{cost}, and {slips}")


def panel_rows(view: View[PredatorPrey]) -> list[tuple[str, str]]:
    """Your last move, where everyone is, the scores, and what shares a hex."""
    problem, places = view.problem, _list_positions(view)
    moved = _describe_last_move(view, view.seat)[0] if view.turns_played else "-"
    reward = f"{view.rewards[-1]:g}" if view.rewards else "-"
    rows = [("last", view.last_action_label.upper() or "-"), ("moved", moved), ("reward", reward)]
    for seat, agent in enumerate(problem.agents):
        name = view.player_label if seat == view.seat else agent
        rows.append((f"{get_agent_glyph(problem, seat)} {name}", format_hex(places[seat])))
    rows += [
        *_list_discounted_scores(view),
        ("slips aside", f"{problem.slip / 2:.2f} each"),
        ("discount", f"{problem.discount:.2f} (gamma)"),
    ]
    for hex_ in dict.fromkeys(places):  # last, as these come and go
        marks = sorted(
            get_agent_glyph(problem, seat) for seat, place in enumerate(places) if place == hex_
        )
        if len(marks) > 1:
            rows.append((f"* {format_hex(hex_)}", " ".join(marks)))
    return rows


def _list_discounted_scores(view: View[PredatorPrey]) -> list[tuple[str, str]]:
    """What each has won, discounted: all see where everybody was, and that alone pays."""
    problem = view.problem
    if not view.turns_played:
        return []
    states = np.array(view.observations[:-1])
    still = np.zeros_like(states)  # any move pays the same
    rewards = problem.resolve_events(states, still, tuple(still.T)).rewards
    weights = problem.discount ** np.arange(view.turns_played)
    sums = np.sum(weights[:, None] * rewards, axis=0)
    return [
        (f"score {get_agent_glyph(problem, seat)}", f"{sums[seat]:.4g}")
        for seat in range(len(sums))
    ]


def describe_turn(view: View[PredatorPrey]) -> str:
    """Where you are and how you got there, then the others."""
    agents, places = view.problem.agents, _list_positions(view)
    others = [seat for seat in range(len(agents)) if seat != view.seat]
    sentences = [
        f"at {format_hex(places[view.seat])}. {_describe_action_and_move(view, view.seat)}."
    ]
    met = _flag_feeding_agents(view, -2)
    for seat in others:
        # Of one other all is told, of many only the meals.
        what = f" {_describe_action_and_move(view, seat)}" if len(others) == 1 or met[seat] else ""
        sentences.append(f"{agents[seat]}{what} at {format_hex(places[seat])}.")
    return " ".join(sentences)


def describe_situation(view: View[PredatorPrey]) -> str:
    """Where you are, the six ways on in action order, and how far the others are."""
    problem, places = view.problem, _list_positions(view)
    here = places[view.seat]
    watched = view.player_label != "you"
    who = f"{view.player_label} at {format_hex(here)}." if watched else ""
    sentences = [who or f"at {format_hex(here)}, you are {problem.agents[view.seat]}."]
    if _flag_feeding_agents(view)[view.seat] and not watched:
        feeds = view.seat in problem.predator_seats
        sentences.append(
            "you feed: any action stays here."
            if feeds
            else "you are caught: any action, then you are born on any hex."
        )

    def describe_hex(hex_: Hex) -> str:
        names = [problem.agents[i] for i, place in enumerate(places) if place == hex_]
        return " and ".join(names) or "free"

    sentences += hexgrid.describe_neighbours(problem.hexes, here, describe_hex)
    for seat, agent in enumerate(problem.agents):
        if seat != view.seat:
            far = "here" if places[seat] == here else hexgrid.format_distance(here, places[seat])
            sentences.append(f"{agent} at {format_hex(places[seat])}: {far}.")
    return " ".join(sentences)

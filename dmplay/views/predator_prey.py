"""How the hunt looks: the map with everyone on it, and the keys that lead on."""

from collections.abc import Iterator
from string import ascii_uppercase

import numpy as np
from rich.text import Text

from dmplay.hexes import DIRECTIONS, Hex, neighbours, notation_of
from dmplay.problems.predator_prey import DEVOURED, MOVED, PredatorPrey
from dmplay.session import View
from dmplay.views import hexgrid
from dmplay.views._advice import odds
from dmplay.views.canvas import percent
from dmplay.views.hexgrid import Cell, Size
from dmplay.views.style import Lesson, Look

FAMILY, KEYS, LEFT = hexgrid.FAMILY, hexgrid.KEYS, hexgrid.LEFT
PREDATORS = ascii_uppercase  # no key that a hex shows is a capital
OWN, PREY = ("yellow", "magenta", "blue"), "cyan"


def _places(view: View[PredatorPrey], turn: int = -1) -> list[Hex]:
    """The hex of each agent after a turn."""
    problem = view.problem
    return [problem.hexes[int(place)] for place in view.observations[turn]]


def glyph(problem: PredatorPrey, seat: int) -> str:
    """A capital for a predator, `o` for prey, numbered where there are more."""
    if seat in problem.hunters:
        return PREDATORS[seat % len(PREDATORS)]
    number = seat - problem.predators + 1
    return "o" if problem.prey == 1 else f"o{number}"


def mark(view: View[PredatorPrey], seat: int, look: Look) -> str:
    """The glyph of an agent, the same whoever looks; in a transcript's frame `@` for you."""
    return "@" if seat == view.seat and not look.large else glyph(view.problem, seat)


def _color(view: View[PredatorPrey], seat: int, look: Look) -> str:
    """The colour of an agent; you are reversed as well."""
    if not look.large:
        return "bold reverse" if seat == view.seat else "bold yellow"
    own = OWN[seat % len(OWN)] if seat in view.problem.hunters else PREY
    return f"bold {own}{' reverse' * (seat == view.seat)}"


def _feeding(view: View[PredatorPrey], turn: int = -1) -> list[bool]:
    """Whether each agent is on the hex of its prey or of a predator."""
    problem, places = view.problem, _places(view, turn)
    met = {places[i] for i in problem.hunters} & {places[i] for i in problem.hunted}
    return [place in met for place in places]


def boards(view: View[PredatorPrey], look: Look) -> Iterator[Text]:
    """The map, the largest first; an overlay is of you on each hex, the others where they are."""
    problem, places = view.problem, _places(view)
    here = places[view.seat]
    around = neighbours(here)
    free = (look.keys or look.regret is not None) and not _feeding(view)[view.seat]

    def elsewhere(hex_: Hex) -> int:
        """The state in which you are on this hex, all others where they are."""
        state = view.observation.copy()
        state[view.seat] = problem.hexes.index(hex_)
        return int(problem.index(state[None])[0])

    may = _may(view, look)

    def cell(hex_: Hex, size: Size) -> Cell:
        way = Cell("")
        if free and hex_ in around:
            way = hexgrid.way_on(look, around.index(hex_), size)
        here_now = [seat for seat, place in enumerate(places) if place == hex_]
        marks = [mark(view, seat, look) for seat in here_now]
        if len(marks) > 1:
            together, room = "".join(sorted(marks)), size.width - 1
            note = together if len(together) <= room else together[: room - 1] + "…"
            return Cell("*", note, "*", "bold reverse" if view.seat in here_now else "bold yellow")
        chances = _chances(view, may.get(hex_, {}), size)
        if marks:
            mine = look.large and view.seat in here_now
            you = view.you if mine and len(view.you) < size.width else ""
            # The key of a way that leads to somebody stands below; beside, where losses are told.
            shown = marks[0]
            if look.regret is not None and way.mark:
                shown += f" {way.mark.strip()}" if size.lines > 1 else way.mark
            told = chances.mark or way.note or way.mark or you
            return Cell(
                shown, "" if look.overlay else told, marks[0], _color(view, here_now[0], look)
            )
        if chances.note:
            return chances
        return hexgrid.overlaid(look, elsewhere(hex_), size) if look.overlay else way

    yield from hexgrid.grids(problem.hexes, cell, look, _caption(view, look))


def _may(view: View[PredatorPrey], look: Look) -> dict[Hex, dict[int, float]]:
    """How likely an action leads each agent to each hex, if that is asked."""
    may: dict[Hex, dict[int, float]] = {}
    if look.outlook:
        for state, chance in zip(look.outlook.states, look.outlook.chances, strict=True):
            for seat, place in enumerate(state):
                there = may.setdefault(view.problem.hexes[int(place)], {})
                there[seat] = there.get(seat, 0.0) + float(chance)
    return may


def _chances(view: View[PredatorPrey], may: dict[int, float], size: Size) -> Cell:
    """Who may come to a hex: you, and the likeliest of the others."""
    room = size.width - 1
    others = {seat: chance for seat, chance in may.items() if seat != view.seat}
    yours, theirs = may.get(view.seat, 0.0), ""
    if others:
        seat = max(others, key=lambda one: others[one])
        name = glyph(view.problem, seat)
        theirs = name + odds(others[seat], room - len(name))
    if yours:
        chance = odds(yours, room)
        return Cell(chance, theirs or " ", chance, "bold cyan")
    return Cell(theirs, " " * bool(theirs), theirs, "cyan")


def _caption(view: View[PredatorPrey], look: Look) -> str:
    """Who you are, or what is written into the hexes."""
    if look.outlook:
        return f"{hexgrid.going(look.outlook)}, how likely"
    if _feeding(view)[view.seat] and not view.ending and (look.large or look.regret is not None):
        return "any key feeds" if view.seat in view.problem.hunters else "caught: any key"
    if look.regret is not None:
        return hexgrid.walls(view.problem.hexes, _places(view)[view.seat], look)
    you = f"{glyph(view.problem, view.seat)} is {_the(view)}"
    others = [seat for seat in range(len(view.problem.agents)) if seat != view.seat]
    if len(others) == 1:
        you += f", {glyph(view.problem, others[0])} is the {view.problem.agents[others[0]]}"
    return you if look.large else ""


def _the(view: View[PredatorPrey]) -> str:
    """Who looks: you, or an agent that is watched."""
    return view.you if view.you == "you" else f"the {view.you}"


def _chosen(view: View[PredatorPrey], seat: int) -> int:
    """The last action of an agent."""
    assert view.joint is not None
    return int(view.joint[-1][seat])


def _came(view: View[PredatorPrey], seat: int) -> tuple[str, str]:
    """What came of an agent's last move, in one word for the panel and in a sentence."""
    if _feeding(view, -2)[seat]:
        hunts = seat in view.problem.hunters
        return ("fed", "fed, stayed") if hunts else ("devoured", "was devoured, born again")
    walk = hexgrid.walked(_places(view, -2)[seat], _places(view)[seat], _chosen(view, seat))
    return f"{'slip ' * walk.slipped}{walk.way}" or "bumped", walk.said


def _happened(view: View[PredatorPrey], seat: int) -> str:
    """The last move of an agent: `chose NE, moved NE`, `chose E, fed, stayed`."""
    return f"chose {DIRECTIONS[_chosen(view, seat)].upper()}, {_came(view, seat)[1]}"


def goal(view: View[PredatorPrey]) -> list[str]:
    """What the seat hunts for, or flees from."""
    problem = view.problem
    slips = [f"{percent(problem.slip)} of steps slip aside"] if problem.slip else []
    if view.seat in problem.hunters:
        meal = "a meal" if problem.prey == 1 else "a meal for each prey"
        shared = ", shared by those on its hex" if problem.predators > 1 else ""
        return [f"catch the prey: its hex is {meal}, +1{shared}", "any other turn costs 1", *slips]
    return [f"keep away: to be caught costs {-DEVOURED:g}", "moving is free", *slips]


def lesson(view: View[PredatorPrey]) -> Lesson:
    """Who hunts whom, and what a turn costs."""
    problem = view.problem
    slips = f"{percent(problem.slip)} of steps slip aside" if problem.slip else "no step slips"
    name = f"{glyph(problem, view.seat)}, {problem.agents[view.seat]}"
    you = f"You are {name}; all see all and move at once, one hex a turn"
    if view.seat in problem.hunters:
        shared = ", shared by the predators on it" if problem.predators > 1 else ""
        want = f"You want to share a hex with prey: a turn begun there pays 1{shared}"
        return Lesson(you, want, f"Any other turn costs {-MOVED:g}, and {slips}")
    want = "You want never to share a hex with a predator"
    cost = f"To be caught costs {-DEVOURED:g} and you are born again on any hex; a step is free"
    return Lesson(you, want, f"{cost}, and {slips}")


def panel(view: View[PredatorPrey]) -> list[tuple[str, str]]:
    """Your last move, where everyone is, the scores, and what shares a hex."""
    problem, places = view.problem, _places(view)
    moved = _came(view, view.seat)[0] if view.turn else "-"
    reward = f"{view.rewards[-1]:g}" if view.rewards else "-"
    rows = [("last", view.last.upper() or "-"), ("moved", moved), ("reward", reward)]
    for seat, agent in enumerate(problem.agents):
        name = view.you if seat == view.seat else agent
        rows.append((f"{glyph(problem, seat)} {name}", notation_of(places[seat])))
    rows += [
        *_scores(view),
        ("slips aside", f"{problem.slip / 2:.2f} each"),
        ("discount", f"{problem.discount:.2f} (gamma)"),
    ]
    for hex_ in dict.fromkeys(places):  # last, as these come and go
        marks = sorted(glyph(problem, seat) for seat, place in enumerate(places) if place == hex_)
        if len(marks) > 1:
            rows.append((f"* {notation_of(hex_)}", " ".join(marks)))
    return rows


def _scores(view: View[PredatorPrey]) -> list[tuple[str, str]]:
    """What each has won, discounted: all see where everybody was, and that alone pays."""
    problem = view.problem
    if not view.turn:
        return []
    states = np.array(view.observations[:-1])
    still = np.zeros_like(states)  # any move pays the same
    rewards = problem.move(states, still, tuple(still.T)).rewards
    weights = problem.discount ** np.arange(view.turn)
    sums = np.sum(weights[:, None] * rewards, axis=0)
    return [(f"score {glyph(problem, seat)}", f"{sums[seat]:.4g}") for seat in range(len(sums))]


def told(view: View[PredatorPrey]) -> str:
    """Where you are and how you got there, then the others."""
    agents, places = view.problem.agents, _places(view)
    others = [seat for seat in range(len(agents)) if seat != view.seat]
    sentences = [f"at {notation_of(places[view.seat])}. {_happened(view, view.seat)}."]
    met = _feeding(view, -2)
    for seat in others:
        # Of one other all is told, of many only the meals.
        what = f" {_happened(view, seat)}" if len(others) == 1 or met[seat] else ""
        sentences.append(f"{agents[seat]}{what} at {notation_of(places[seat])}.")
    return " ".join(sentences)


def situation(view: View[PredatorPrey]) -> str:
    """Where you are, the six ways on in action order, and how far the others are."""
    problem, places = view.problem, _places(view)
    here = places[view.seat]
    watched = view.you != "you"
    who = f"{view.you} at {notation_of(here)}." if watched else ""
    sentences = [who or f"at {notation_of(here)}, you are {problem.agents[view.seat]}."]
    if _feeding(view)[view.seat] and not watched:
        feeds = view.seat in problem.hunters
        sentences.append(
            "you feed: any action stays here."
            if feeds
            else "you are caught: any action, then you are born on any hex."
        )

    def kind(hex_: Hex) -> str:
        names = [problem.agents[i] for i, place in enumerate(places) if place == hex_]
        return " and ".join(names) or "free"

    sentences += hexgrid.ways(problem.hexes, here, kind)
    for seat, agent in enumerate(problem.agents):
        if seat != view.seat:
            far = "here" if places[seat] == here else hexgrid.steps(here, places[seat])
            sentences.append(f"{agent} at {notation_of(places[seat])}: {far}.")
    return " ".join(sentences)

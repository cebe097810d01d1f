"""How the hunt looks: the map with everyone on it, and the keys that lead on."""

from collections.abc import Iterator
from string import ascii_uppercase

from rich.text import Text

from dmplay.hexes import DIRECTIONS, Hex, neighbours, notation_of
from dmplay.problems.predator_prey import DEVOURED, PredatorPrey
from dmplay.session import View
from dmplay.views import hexgrid
from dmplay.views.canvas import percent
from dmplay.views.hexgrid import Cell, Size
from dmplay.views.style import Look

FAMILY, KEYS, LEFT = hexgrid.FAMILY, hexgrid.KEYS, hexgrid.LEFT
PREDATORS = ascii_uppercase  # no key that a hex shows is a capital


def _places(view: View[PredatorPrey], turn: int = -1) -> list[Hex]:
    """The hex of each agent after a turn."""
    problem = view.problem
    return [problem.hexes[int(place)] for place in view.observations[turn]]


def mark(view: View[PredatorPrey], seat: int) -> str:
    """`@` for you, a capital for another predator, `o` for prey, numbered where there are more."""
    problem = view.problem
    if seat == view.seat:
        return "@"
    if seat in problem.hunters:
        return PREDATORS[seat % len(PREDATORS)]
    number = seat - problem.predators + 1
    return "o" if problem.prey == 1 else f"o{number}"


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
    free = look.keys and not _feeding(view)[view.seat]

    def elsewhere(hex_: Hex) -> int:
        """The state in which you are on this hex, all others where they are."""
        state = view.observation.copy()
        state[view.seat] = problem.hexes.index(hex_)
        return int(problem.index(state[None])[0])

    def cell(hex_: Hex, size: Size) -> Cell:
        key = hexgrid.key_of(look, around.index(hex_)) if free and hex_ in around else ""
        marks = [mark(view, seat) for seat, place in enumerate(places) if place == hex_]
        mine = "@" in marks
        style = "bold reverse" if mine else "bold yellow"
        if len(marks) > 1:
            together, room = "".join(sorted(marks)), size.width - 1
            note = together if len(together) <= room else together[: room - 1] + "…"
            return Cell("*", note, "*", style)
        if marks:
            return Cell(marks[0], "" if look.overlay else key, marks[0], style)
        if look.overlay:
            return hexgrid.overlaid(look, elsewhere(hex_), size)
        return Cell(key, style="green")

    yield from hexgrid.grids(problem.hexes, cell, large=look.large)


def _chosen(view: View[PredatorPrey], seat: int) -> int:
    """The last action of an agent."""
    assert view.joint is not None
    return int(view.joint[-1][seat])


def _came(view: View[PredatorPrey], seat: int) -> tuple[str, str]:
    """What came of an agent's last move, for the panel and in a sentence."""
    if _feeding(view, -2)[seat]:
        met = "fed, stayed" if seat in view.problem.hunters else "was devoured, born again"
        return met, met
    walk = hexgrid.walked(_places(view, -2)[seat], _places(view)[seat], _chosen(view, seat))
    return f"{'slip ' * walk.slipped}{walk.way}" or walk.said, walk.said


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


def panel(view: View[PredatorPrey]) -> list[tuple[str, str]]:
    """Your last move, where everyone is, and what shares a hex."""
    problem, places = view.problem, _places(view)
    moved = _came(view, view.seat)[0] if view.turn else "-"
    reward = f"{view.rewards[-1]:g}" if view.rewards else "-"
    rows = [("last", view.last.upper() or "-"), ("moved", moved), ("reward", reward)]
    for seat, agent in enumerate(problem.agents):
        rows.append((f"{mark(view, seat)} {agent}", notation_of(places[seat])))
    for hex_ in dict.fromkeys(places):
        marks = sorted(mark(view, seat) for seat, place in enumerate(places) if place == hex_)
        if len(marks) > 1:
            rows.append((f"* {notation_of(hex_)}", " ".join(marks)))
    return [*rows, ("slip", f"{problem.slip / 2:.2f} x2"), ("gamma", f"{problem.discount:.2f}")]


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
    sentences = [f"at {notation_of(here)}, you are {problem.agents[view.seat]}."]
    if _feeding(view)[view.seat]:
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

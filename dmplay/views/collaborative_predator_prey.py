"""How the blind hunt looks: for each hex how likely the prey is there, and how likely you are."""

import math
from collections.abc import Iterator
from string import ascii_uppercase
from typing import NamedTuple

import numpy as np
from rich.text import Text

from dmplay.chance import Reals
from dmplay.hexes import DIRECTIONS, Hex, neighbours, notation_of
from dmplay.problems.collaborative_predator_prey import CAPTURED, MOVED, CollaborativePredatorPrey
from dmplay.session import View
from dmplay.views import hexgrid
from dmplay.views._advice import losses
from dmplay.views._belief import spark
from dmplay.views.canvas import percent
from dmplay.views.generic import seen
from dmplay.views.hexgrid import Cell, Size
from dmplay.views.style import Lesson, Look

FAMILY, KEYS, LEFT = hexgrid.FAMILY, hexgrid.KEYS, hexgrid.LEFT
TOLD = 4  # likeliest hexes that are told in words
SIX = 58  # columns of what six ways lose
SHADES = 4  # of the prey, the darkest where it is likeliest
FEW = 3  # likeliest hexes that have their percent
CERTAIN = 1 - 1e-9


class Marginals(NamedTuple):
    """The probability of each hex to hold the prey, and to hold you."""

    prey: Reals  # [H]
    you: Reals  # [H]


def marginals(view: View[CollaborativePredatorPrey]) -> Marginals | None:
    """What the belief says of each hex; None where it is too large to have."""
    return None if view.beliefs is None else _each(view, view.belief)


def _each(view: View[CollaborativePredatorPrey], belief: Reals) -> Marginals:
    """What a belief says of each hex."""
    problem = view.problem
    joint = belief.reshape((len(problem.hexes),) * problem.walkers)

    def over(walker: int) -> Reals:
        others = tuple(axis for axis in range(problem.walkers) if axis != walker)
        return np.asarray(joint.sum(axis=others))

    return Marginals(over(problem.walkers - 1), over(view.seat))


def _here(view: View[CollaborativePredatorPrey], known: Marginals | None) -> Hex | None:
    """Where you are, if you know."""
    if known is None or known.you.max() < CERTAIN:
        return None
    return view.problem.hexes[int(known.you.argmax())]


def boards(view: View[CollaborativePredatorPrey], look: Look) -> Iterator[Text]:
    """The map, the largest first, and a row that says how it is to be read."""
    if look.large or look.outlook or look.regret is not None:
        yield from _shaded(view, look)
    else:
        yield from _numbered(view, look)


def _shaded(view: View[CollaborativePredatorPrey], look: Look) -> Iterator[Text]:
    """The belief as shades; of an action that is asked for, after each of its two likeliest senses;
    at the end who truly is where.
    """
    problem, known = view.problem, marginals(view)
    here = _here(view, known)
    around = neighbours(here) if look.keys and here else []
    shown = _after(view, look) or ([known.prey] if known else [])
    truly: dict[Hex, list[str]] = {}
    for walker, place in enumerate([] if look.state is None else look.state):
        truly.setdefault(problem.hexes[int(place)], []).append(_glyph(view, walker))

    def cell(hex_: Hex, size: Size) -> Cell:
        at, room = problem.hexes.index(hex_), size.width - 1
        shades = [_shade(belief, at, room if size.lines else 1, look.ascii) for belief in shown]
        first, last = (shades[0], shades[-1]) if shades else ("", "")
        if hex_ in truly:
            marks = "".join(sorted(truly[hex_]))[:room]
            return Cell(marks, last, marks, "bold reverse" if "@" in marks else "bold yellow")
        you = _density(known.you, at, room) if known and not truly else ""
        style = "bold reverse" if hex_ == here else "cyan"
        if size.lines > 1:
            key = hexgrid.key_of(look, around.index(hex_)) if hex_ in around else ""
            return Cell(first if len(shades) > 1 else you or key, last, style=style)
        shade = "@" + first[1:] if you and size.lines and len(shades) == 1 else first
        return Cell(shade, dot=f"@{first}" if you and room > 1 else first or ".", style=style)

    caption = _caption(view, look, here)
    for drawn in map(Text.copy, hexgrid.grids(problem.hexes, cell, look)):
        for row in caption:
            drawn.append(f"\n{row[: look.width]}", "dim")
        yield drawn


def _glyph(view: View[CollaborativePredatorPrey], walker: int) -> str:
    """`@` for you, a capital for a partner, `o` for the prey."""
    if walker == view.seat:
        return "@"
    return "o" if walker == view.problem.walkers - 1 else ascii_uppercase[walker]


def _shade(belief: Reals, at: int, room: int, plain: bool) -> str:
    """How likely the prey is in a hex against the likeliest; in the few likeliest the percent."""
    share, most = float(belief[at]), float(belief.max())
    if share < 1e-9:
        return " " * (room - 1) + "." if room == 1 else ""
    shade = spark([math.ceil(SHADES * share / most - 1e-9) / SHADES - 1e-9], plain)
    many = int((belief >= share - 1e-9).sum())
    told = percent(share) if many <= FEW else ""
    return told.center(room, shade) if len(told) < room else shade * room


def _density(belief: Reals, at: int, room: int) -> str:
    """A sign for each third of the likeliest hex's probability that you are here."""
    share, most = float(belief[at]), float(belief.max())
    signs = round(min(room, 3) * share / most)
    if most >= CERTAIN:
        return "@" * (signs > 0)
    told = percent(share) if share >= most - 1e-9 and (belief >= most - 1e-9).sum() == 1 else ""
    return f"@{told}" if told and len(told) < room else "@" * signs


def _after(view: View[CollaborativePredatorPrey], look: Look) -> list[Reals]:
    """What would be believed of the prey after the two likeliest senses that an action brings."""
    if look.outlook is None or look.outlook.beliefs is None:
        return []
    return [_each(view, belief).prey for belief in look.outlook.beliefs[:2]]


def _caption(view: View[CollaborativePredatorPrey], look: Look, here: Hex | None) -> list[str]:
    """What was sensed, and how the map is to be read."""
    if look.state is not None:
        names = [*view.problem.agents, "prey"]
        who = (f"{_glyph(view, walker)} {name}" for walker, name in enumerate(names))
        return [f"truly {', '.join(who)}"]
    if look.outlook:
        senses = view.problem.observations[view.seat]
        lines = zip(("upper", "lower"), look.outlook.states, look.outlook.chances, strict=False)
        told = (f"{line} if {senses[int(sense)]}, {percent(float(p))}" for line, sense, p in lines)
        return [f"{hexgrid.going(look.outlook)}, where the prey is", "; ".join(told)]
    if look.regret is not None:
        names = [hexgrid.key_of(look, way) for way in range(len(DIRECTIONS))]
        room = look.beside if look.beside >= SIX else look.width
        return losses(look._replace(width=room), names)
    sensed = f"sensed {seen(view)}"
    if view.beliefs is None:
        return [f"{sensed}. belief too large"]
    you, full = view.you, "#" if look.ascii else "█"
    place = you if here else f"where {you} may be"
    readings = f"@ {place}, {full} where the prey may be", f"@ {you}, {full} prey if likely", sensed
    return [next(one for one in readings if len(one) <= look.width or one == sensed)]


def _numbered(view: View[CollaborativePredatorPrey], look: Look) -> Iterator[Text]:
    """Each hex with both probabilities, as a transcript has it."""
    problem, known = view.problem, marginals(view)
    here = _here(view, known)
    around = neighbours(here) if look.keys and here else []
    keys = {hex_: hexgrid.key_of(look, way) for way, hex_ in enumerate(around)}
    true = set() if look.state is None else {problem.hexes[int(place)] for place in look.state}

    def cell(hex_: Hex, size: Size) -> Cell:
        if known is None:
            return Cell("")
        at = problem.hexes.index(hex_)
        prey, you = float(known.prey[at]), float(known.you[at])
        style = "reverse" if hex_ in true else "bold" if prey >= known.prey.max() - 1e-9 else ""
        if size.lines > 1:
            note = _line("@", you, look) or keys.get(hex_, "")
            return Cell(_line("o", prey, look), note, "", style)
        if size == hexgrid.FINE:
            return Cell("", dot=spark([prey], look.ascii) if prey >= 1e-9 else ".", style=style)
        digits = percent(min(prey, 0.99)).rstrip("%")  # two columns
        both = digits.rjust(2) + (spark([you], look.ascii) if you >= 1e-9 else " ")
        return Cell(both, dot=both if both.strip() else ".", style=style)

    both = f"% prey, bar: {view.you}"
    small = (both, both, "bar: prey")
    drawings = [*map(Text.copy, hexgrid.grids(problem.hexes, cell, look))]
    legends = [f"o prey, @ {view.you}"] * (len(drawings) - len(small)) + [*small]
    for drawn, legend in zip(drawings, legends, strict=True):
        said = f"sensed {seen(view)}. {legend if known else 'belief too large'}"
        drawn.append(f"\n{said[: look.width]}")
        if look.state is not None:
            drawn.append(f"\n{_truth(view, look)}", "bold magenta")
        yield drawn


def _line(mark: str, share: float, look: Look) -> str:
    """A mark, a bar where there is room for it, and the percent, in five columns."""
    told = percent(share)
    shade = "" if look.ascii or len(told) > 3 else spark([share], plain=False)
    return f"{mark}{shade}{told:>{4 - len(shade)}}" if told else ""


def _truth(view: View[CollaborativePredatorPrey], look: Look) -> str:
    """Where everyone truly is."""
    problem = view.problem
    assert look.state is not None
    names = [*problem.agents, "prey"]
    places = [notation_of(problem.hexes[int(place)]) for place in look.state]
    full = "truly " + ", ".join(
        f"{name} {place}" for name, place in zip(names, places, strict=True)
    )
    return full if len(full) <= look.width else f"truly {' '.join(places)}"[: look.width]


def _likeliest(
    view: View[CollaborativePredatorPrey], shares: Reals, many: int
) -> list[tuple[str, float]]:
    order = np.argsort(-np.round(shares, 9), kind="stable")[:many]
    hexes = view.problem.hexes
    return [(notation_of(hexes[i]), float(shares[i])) for i in order if shares[i] >= 0.0005]


def _partners(view: View[CollaborativePredatorPrey]) -> str:
    others = [agent for seat, agent in enumerate(view.problem.agents) if seat != view.seat]
    if not others:
        return ""
    verb = "is" if len(others) == 1 else "are"
    return f" {' and '.join(others)} {verb} unseen and believed to act uniformly at random."


def goal(view: View[CollaborativePredatorPrey]) -> list[str]:
    """What the team is paid, and what it cannot see."""
    slip, own = view.problem.slip, view.you == "you"
    return [
        "find the unseen prey",
        f"a catch by anyone pays all {CAPTURED:g}",
        f"else a turn costs {-MOVED:g}",
        f"{view.you} {'sense' if own else 'senses'} it from the next hex",
        *([f"{percent(slip)} of steps slip aside"] if slip else []),
    ]


def lesson(view: View[CollaborativePredatorPrey]) -> Lesson:
    """Who hunts, what is not seen, and what a turn costs."""
    problem, others = view.problem, len(view.problem.agents) - 1
    team = f", one of {others + 1} who cannot talk" if others else ""
    blind = "you see your own hex" if problem.sighted else "you see nothing, not even where you are"
    slips = f"{percent(problem.slip)} of steps slip aside" if problem.slip else "no step slips"
    return Lesson(
        f"You are {problem.agents[view.seat]}{team}; {blind}, and only sense a prey on your hex or "
        "the next",
        f"You want to be where the prey is: a turn begun there pays {'all ' * (others > 0)}"
        f"{CAPTURED:g}",
        f"Any other turn costs {-MOVED:g}, and {slips}",
    )


def panel(view: View[CollaborativePredatorPrey]) -> list[tuple[str, str]]:
    """What you did and sensed; the board has what is likely, a reward would betray a capture."""
    sensed = seen(view) if view.turn else "-"
    reward = f"{view.rewards[-1]:g}" if view.rewards else "hidden"
    rows = [("last", view.last.upper() or "-"), ("sensed", sensed), ("reward", reward)]
    if len(view.problem.agents) > 1:
        rows.append(("partner", "unseen"))
    return [*rows, ("discount", f"{view.problem.discount:.2f} (gamma)")]


def told(view: View[CollaborativePredatorPrey]) -> str:
    """What you sensed and did, and where the prey and you most likely are."""
    return f"{seen(view)}. chose {view.last.upper()}. {_believed(view, 1)}".rstrip()


def _believed(view: View[CollaborativePredatorPrey], many: int) -> str:
    """The likeliest hexes of the prey and of you in words."""
    known = marginals(view)
    if known is None:
        return ""
    sentences = []
    for name, shares in known._asdict().items():
        each = ", ".join(f"{hex_} {share:.3f}" for hex_, share in _likeliest(view, shares, many))
        sentences.append(f"{view.you if name == 'you' else name} likeliest at {each}.")
    return " ".join(sentences)


def situation(view: View[CollaborativePredatorPrey]) -> str:
    """What you sensed, the belief, and where you see it the ways on."""
    problem, known = view.problem, marginals(view)
    sentences = [f"sensed {seen(view)}.", _believed(view, TOLD)]
    here = _here(view, known)
    if known is not None and here:

        def kind(hex_: Hex) -> str:
            return f"prey {known.prey[problem.hexes.index(hex_)]:.3f}"

        sentences += [f"at {notation_of(here)}.", *hexgrid.ways(problem.hexes, here, kind)]
    if known is None:
        return f"{sentences[0]} the belief is over too many states to be told."
    return " ".join(sentences) + _partners(view)

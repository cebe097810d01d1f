"""How hex world looks: the map with its exits, you, and the keys that lead on."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.hexes import Hex, neighbours, notation_of
from dmplay.problems.hexworld import HexWorld
from dmplay.session import View
from dmplay.views import hexgrid
from dmplay.views._advice import odds
from dmplay.views.canvas import percent, signed
from dmplay.views.hexgrid import Cell, Size
from dmplay.views.style import Lesson, Look

GOOD, BAD = "bold color(231) on color(25)", "bold color(16) on color(214)"  # of the palette
FAMILY, KEYS, LEFT = hexgrid.FAMILY, hexgrid.KEYS, hexgrid.LEFT


def _here(view: View[HexWorld], turn: int = -1) -> Hex | None:
    """The hex after a turn; None once the game is over."""
    hexes = view.problem.hexes
    state = int(view.observations[turn])
    return hexes[state] if state < len(hexes) else None


def boards(view: View[HexWorld], look: Look) -> Iterator[Text]:
    """The map, the largest first."""
    problem = view.problem
    # Once over, the exit taken is still where you stand.
    here = _here(view) or (_here(view, -2) if view.actions else None)
    exits = dict(problem.rewards)
    around = neighbours(here) if here else []
    ghost = None if look.ghost is None else dict(enumerate(problem.hexes)).get(int(look.ghost))
    may = _may(view, look)

    def cell(hex_: Hex, size: Size) -> Cell:
        pay = exits.get(hex_)
        glyph = "" if pay is None else "◆" if pay > 0 else "✗"
        style = "" if pay is None else GOOD if pay > 0 else BAD
        note = "" if pay is None else signed(pay)
        dot = note or "."
        mark = glyph
        if look.overlay and pay is None:
            mark, note, _, style = hexgrid.overlaid(look, problem.hexes.index(hex_), size)
        if hex_ == here:
            stays = odds(may[hex_], size.width - 1) if hex_ in may and size.lines > 1 else note
            return Cell("@", stays, "@", "bold reverse")
        if hex_ in may:
            chance = odds(may[hex_], size.width - 1)
            return Cell(chance, note, chance, style or "bold cyan")
        if hex_ in around and _here(view) and here not in exits and look.regret is not None:
            way = hexgrid.way_on(look, around.index(hex_), size)
            return way if pay is None else Cell(f"{glyph} {way.mark}"[:5], way.note, dot, style)
        if hex_ == ghost:
            return Cell("&", note, "&", "dim")
        if look.keys and not look.overlay and hex_ in around and _here(view) and pay is None:
            mark, style = hexgrid.key_of(look, around.index(hex_)), style or "green"
        return Cell(mark, note, dot, style)

    yield from hexgrid.grids(problem.hexes, cell, look, _caption(view, look))


def _may(view: View[HexWorld], look: Look) -> dict[Hex, float]:
    """How likely an action leads to each hex, if that is asked."""
    hexes, may = view.problem.hexes, dict[Hex, float]()
    if look.outlook:
        for state, chance in zip(look.outlook.states, look.outlook.chances, strict=True):
            if int(state) < len(hexes):
                hex_ = hexes[int(state)]
                may[hex_] = may.get(hex_, 0.0) + float(chance)
    return may


def _caption(view: View[HexWorld], look: Look) -> str:
    """What an exit pays when you stand on it, else what is written into the hexes."""
    if not (look.large or look.outlook or look.regret is not None):
        return ""
    here, exits = _here(view), dict(view.problem.rewards)
    if here is None:
        return _came(view)[1] if view.actions else "over"
    if here in exits and not view.ending:
        return f"any key {'collects' if exits[here] > 0 else 'takes'} {signed(exits[here])}"
    if look.outlook:
        return f"{hexgrid.going(look.outlook)}, how likely each hex is"
    if look.regret is not None:
        return hexgrid.walls(view.problem.hexes, here, look)
    ghost = ", & ghost" * (look.ghost is not None)
    return f"@ {view.you}{ghost}, ◆ pays, ✗ costs{', letters are keys' * look.keys}"


def _came(view: View[HexWorld]) -> tuple[str, str]:
    """What came of the last move, for the panel and in a sentence."""
    before, after = _here(view, -2), _here(view)
    assert before
    if after is None:
        way_out = f"exit {signed(dict(view.problem.rewards)[before])}"
        return way_out, f"left by the {way_out}"
    walk = hexgrid.walked(before, after, int(view.actions[-1]))
    return f"{walk.way}{' slip' * walk.slipped}" or "bumped", walk.said


def goal(view: View[HexWorld]) -> list[str]:
    """The exits that pay and those that cost, the price of a bump, and how often steps slip."""
    problem = view.problem
    return [
        *_exits(view),
        *([f"a bump costs {problem.bump_cost:g}"] if problem.bump_cost else []),
        *([f"{percent(problem.slip)} of steps slip aside"] if problem.slip else []),
    ]


def _exits(view: View[HexWorld]) -> list[str]:
    """Which exits to reach, and which to keep off."""
    pays = sorted({pay for _, pay in view.problem.rewards}, reverse=True)
    good = " or ".join(signed(pay) for pay in pays if pay > 0)
    bad = " and ".join(signed(pay) for pay in pays if pay < 0)
    return [*([f"reach {good}"] if good else []), *([f"keep off {bad}"] if bad else [])]


def lesson(view: View[HexWorld]) -> Lesson:
    """A walker, the exits, and what a bump and a slip are."""
    problem = view.problem
    bump = f"a bump costs {problem.bump_cost:g}" if problem.bump_cost else "so is a bump"
    slips = f"{percent(problem.slip)} of steps slip aside" if problem.slip else "no step slips"
    return Lesson(
        "You are @ and walk from hex to hex; you always see where you are",
        f"You want to {' and '.join(_exits(view))}: "
        "on an exit any key collects what it says and ends the game",
        f"A step is free, {bump}, and {slips}",
    )


def panel(view: View[HexWorld]) -> list[tuple[str, str]]:
    """The last move and the odds of the next."""
    problem = view.problem
    moved = _came(view)[0] if view.actions else "-"
    reward = f"{view.rewards[-1]:.2f}" if view.rewards else "-"
    return [
        ("last", view.last.upper() or "-"),
        ("moved", moved),
        ("reward", reward),
        ("goes on", f"{1 - problem.slip:.2f}"),
        ("slips aside", f"{problem.slip / 2:.2f} each"),
        ("discount", f"{problem.discount:.2f} (gamma)"),
    ]


def told(view: View[HexWorld]) -> str:
    """Where you are and how you got there."""
    here = _here(view)
    where = f"at {notation_of(here)}" if here else "over"
    return f"{where}. chose {view.last.upper()}, {_came(view)[1]}."


def situation(view: View[HexWorld]) -> str:
    """The six ways on, in action order, and how far the exits are."""
    problem, here = view.problem, _here(view)
    exits = dict(problem.rewards)
    if here is None:
        return "the game is over."
    sentences = [f"at {notation_of(here)}."]
    if here in exits:
        sentences.append(f"exit {signed(exits[here])} here: any action takes it.")
    sentences += hexgrid.ways(problem.hexes, here, lambda hex_: _kind(hex_, exits))
    for hex_, pay in exits.items():
        what, far = "goal" if pay > 0 else "hazard", hexgrid.steps(here, hex_)
        sentences.append(f"{what} {signed(pay)} at {notation_of(hex_)}: {far}.")
    return " ".join(sentences)


def _kind(hex_: Hex, exits: dict[Hex, float]) -> str:
    return f"exit {signed(exits[hex_])}" if hex_ in exits else "floor"

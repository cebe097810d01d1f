"""How hex world looks: the map with its exits, you, and the keys that lead on."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.hexes import DIRECTIONS, Hex, neighbours, notation_of
from dmplay.problems.hexworld import HexWorld
from dmplay.session import View
from dmplay.views.canvas import signed
from dmplay.views.hexgrid import (
    FAMILY,
    KEYS,
    LEFT,
    Cell,
    Size,
    grids,
    key_of,
    overlaid,
    steps,
    walked,
    ways,
)
from dmplay.views.style import Look


def _here(view: View[HexWorld], turn: int = -1) -> Hex | None:
    """The hex after a turn; None once the game is over."""
    hexes = view.problem.hexes
    state = int(view.observations[turn])
    return hexes[state] if state < len(hexes) else None


def boards(view: View[HexWorld], look: Look) -> Iterator[Text]:
    """The map, the largest first."""
    problem = view.problem
    # Once over, the exit taken is still where you stand.
    here = _here(view) or (_here(view, -2) if view.turn else None)
    exits = dict(problem.rewards)
    around = neighbours(here) if here else []

    def cell(hex_: Hex, size: Size) -> Cell:
        pay = exits.get(hex_)
        glyph = "" if pay is None else "◆" if pay > 0 else "✗"
        style = "" if pay is None else "bold blue" if pay > 0 else "bold yellow"
        note = "" if pay is None else signed(pay)
        dot = note or "."
        mark = glyph
        if look.overlay and pay is None:
            mark, note, _, style = overlaid(look, problem.hexes.index(hex_), size)
        if hex_ == here:
            return Cell("@", note, "@", "bold reverse")
        if look.keys and not look.overlay and hex_ in around and _here(view) and pay is None:
            mark, style = key_of(look, around.index(hex_)), style or "green"
        return Cell(mark, note, dot, style)

    yield from grids(problem.hexes, cell)


def _moved(view: View[HexWorld]) -> tuple[str, str]:
    """The action of the last turn, and what came of it."""
    problem, before, after = view.problem, _here(view, -2), _here(view)
    chosen = int(view.actions[-1])
    name = DIRECTIONS[chosen].upper()
    if before is None:
        return name, "the game was over"
    if after is None:
        return name, f"left by the exit {signed(dict(problem.rewards)[before])}"
    return name, walked(before, after, chosen)


def panel(view: View[HexWorld]) -> list[tuple[str, str]]:
    """The last move and the odds of the next."""
    problem = view.problem
    last, moved = _moved(view) if view.turn else ("-", "-")
    reward = f"{view.rewards[-1]:.2f}" if view.rewards else "-"
    return [
        ("last", last),
        ("moved", moved.removeprefix("moved ").removeprefix("left by the ").partition(",")[0]),
        ("reward", reward),
        ("p(go)", f"{1 - problem.slip:.2f}"),
        ("slip", f"{problem.slip / 2:.2f} x2"),
        ("gamma", f"{problem.discount:.2f}"),
    ]


def told(view: View[HexWorld]) -> str:
    """Where you are and how you got there."""
    chosen, moved = _moved(view)
    here = _here(view)
    slipped = moved.endswith(" slip")
    moved = f"slipped, {moved.removesuffix(' slip')}" if slipped else moved
    return f"{'at ' + notation_of(here) if here else 'over'}. chose {chosen}, {moved}."


def situation(view: View[HexWorld]) -> str:
    """The six ways on, in action order, and how far the exits are."""
    problem, here = view.problem, _here(view)
    exits = dict(problem.rewards)
    if here is None:
        return "the game is over."
    sentences = [f"at {notation_of(here)}."]
    if here in exits:
        sentences.append(f"exit {signed(exits[here])} here: any action takes it.")
    sentences += ways(problem.hexes, here, lambda hex_: _kind(hex_, exits))
    for hex_, pay in exits.items():
        what = "goal" if pay > 0 else "hazard"
        sentences.append(f"{what} {signed(pay)} at {notation_of(hex_)}: {steps(here, hex_)}.")
    return " ".join(sentences)


def _kind(hex_: Hex, exits: dict[Hex, float]) -> str:
    return f"exit {signed(exits[hex_])}" if hex_ in exits else "floor"


__all__ = ["FAMILY", "KEYS", "LEFT", "boards", "panel", "situation", "told"]

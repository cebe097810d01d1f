"""Published problems of teams as files, written anew from their definitions."""

from collections.abc import Callable, Iterator, Sequence
from itertools import product

from dmplay.files import markov
from dmplay.files.problem import FileProblem

Row = Sequence[float]
PAIRS = [*product(range(2), repeat=2)]


def read(text: str) -> FileProblem:
    return markov.read_markov_file("team.dpomdp", text.encode(), team=True)


def _line(row: Row) -> str:
    return " ".join(f"{number:.10g}" for number in row)


def _file(  # noqa: PLR0913, PLR0917 - a problem has as many parts
    start: Row,
    actions: str,
    seen: str,
    goes: Callable[[int, tuple[int, ...]], Row],
    sees: Callable[[int, tuple[int, ...]], Row],
    pays: Iterator[str],
) -> str:
    """A file of two agents alike; states by where they go and what is seen in them."""
    states = range(len(start))
    lines = ["agents: 2", "discount: 1", "values: reward", f"states: {len(states)}", "start:"]
    lines += [_line(start), "actions:", actions, actions, "observations:", seen, seen]
    for a in product(range(len(actions.split())), repeat=2):
        lines += [f"T: {a[0]} {a[1]} :", *(_line(goes(s, a)) for s in states)]
        lines += [f"O: {a[0]} {a[1]} :", *(_line(sees(s, a)) for s in states)]
    return "\n".join([*lines, *pays, ""])


def both(first: float, second: float) -> Row:
    """How likely each of the four pairs is, of two things so likely each."""
    return [(first if a else 1 - first) * (second if b else 1 - second) for a, b in PAIRS]


def dectiger() -> str:
    """Two who listen for one tiger (Nair et al., IJCAI 2003)."""

    def goes(s: int, a: tuple[int, ...]) -> Row:
        return (0.5, 0.5) if any(a) else (1.0 - s, s)

    def sees(s: int, a: tuple[int, ...]) -> Row:
        right = 0.85 if s else 0.15
        return [0.25] * 4 if any(a) else both(right, right)

    def pays() -> Iterator[str]:
        for s, a in product(range(2), product(range(3), repeat=2)):
            opened = [door == s + 1 for door in a if door]
            alone = -101 if any(opened) else 9
            together = -100 if a[0] != a[1] else -50 if any(opened) else 20
            paid = (-2, alone, together)[len(opened)]
            yield f"R: {a[0]} {a[1]} : {s} : * : * : {paid}"

    return _file((0.5, 0.5), "listen left right", "hear-left hear-right", goes, sees, pays())


def broadcast() -> str:
    """Two nodes of one channel, on which only one may send (Hansen et al., AAAI 2004)."""

    def goes(s: int, a: tuple[int, ...]) -> Row:
        waiting = [bool(full and act) for full, act in zip(PAIRS[s], a, strict=True)]
        return both(*(1.0 if kept else new for kept, new in zip(waiting, (0.9, 0.1), strict=True)))

    def sees(s: int, a: tuple[int, ...]) -> Row:
        quiet = 0.1 if a == (0, 0) else 0.9
        return both(quiet, quiet)

    def pays() -> Iterator[str]:
        for s, (first, second) in enumerate(PAIRS):
            yield f"R: send wait : {s} : * : * : {first}"
            yield f"R: wait send : {s} : * : * : {second}"

    return _file((0, 0, 0, 1), "send wait", "collision quiet", goes, sees, pays())


def recycling() -> str:
    """Two robots with batteries that look for cans (Amato et al., UAI 2007)."""
    low = {(0, 0): 0.0, (0, 1): 0.0, (1, 0): 0.3, (1, 1): 0.8, (2, 0): 0.5, (2, 1): 0.7}
    stuck = {(1, 1): 0.2, (2, 1): 0.3}

    def goes(s: int, a: tuple[int, ...]) -> Row:
        return both(*(low[pair] for pair in zip(a, PAIRS[s], strict=True)))

    def sees(s: int, a: tuple[int, ...]) -> Row:
        return both(*map(float, PAIRS[s]))

    def pays() -> Iterator[str]:
        for s, a in product(range(4), product(range(3), repeat=2)):
            first, second = (stuck.get(pair, 0.0) for pair in zip(a, PAIRS[s], strict=True))
            cans = 5 if a == (2, 2) else 2 * a.count(1)
            paid = cans * (1 - first) * (1 - second) - 10 * (first + second)
            yield f"R: {a[0]} {a[1]} : {s} : * : * : {paid:.10g}"

    return _file((1, 0, 0, 0), "wait small big", "high low", goes, sees, pays())


def meeting(size: int = 2) -> str:
    """Two who are to meet on a grid of 2 x 2 (Bernstein et al., IJCAI 2005; Amato et al., 2006),
    or of 3 x 3 in one of two corners (Amato et al., ICAPS 2009).
    """
    cells, small = size * size, size == 2
    steps = ((-1, 0), (1, 0), (0, -1), (0, 1), (0, 0))
    kinds = size if small else cells

    def moved(cell: int, step: int) -> int:
        row, column = cell // size + steps[step][0], cell % size + steps[step][1]
        return row * size + column if 0 <= row < size and 0 <= column < size else cell

    def one(cell: int, step: int) -> Row:
        shares = [0.0] * cells
        for other in range(5):
            shares[moved(cell, other)] += 0.6 if other == step else 0.1
        return [float(cell == stays) for stays in range(cells)] if step == 4 else shares

    def goes(s: int, a: tuple[int, ...]) -> Row:
        return [p * q for p in one(s // cells, a[0]) for q in one(s % cells, a[1])]

    def sees(s: int, a: tuple[int, ...]) -> Row:
        own = [cell % size if small else cell for cell in divmod(s, cells)]
        return [float([*pair] == own) for pair in product(range(kinds), repeat=2)]

    def pays() -> Iterator[str]:
        for cell in range(cells) if small else (0, cells - 1):
            met = cell * (cells + 1)
            yield f"R: * : * : {met} : * : 1" if small else f"R: * : {met} : * : * : 1"

    begun = cells + 2 if small else (size - 1) * cells + size * (size - 1)
    start = [float(s == begun) for s in range(cells * cells)]
    return _file(start, "up down left right stay", str(kinds), goes, sees, pays())

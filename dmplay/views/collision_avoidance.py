"""How collision avoidance looks: height above the intruder against the time that is left.

+100  ····                 · and arrows: where you were, and the advisory given there
          ↑↑◆ ∘ ∘ ∘ ∘      ◆ you, ∘ where this rate leads
   0 ┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄▒A     A the intruder, ▒ too close to it
    40s            0s
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from rich.text import Text

from dmplay.chance import Array
from dmplay.problems.collision_avoidance import (
    CHANGE_COST,
    FIRST_TIME,
    NEAR,
    NEAR_COST,
    CollisionAvoidance,
)
from dmplay.session import View
from dmplay.views._advice import foreseen, losses
from dmplay.views._scale import Scale, plus
from dmplay.views.canvas import Canvas, percent, written
from dmplay.views.style import Lesson, Look

KEYS = {
    "j": "descend", "space": "no-advisory", "k": "climb",
    "down": "descend", "up": "climb", "s": "descend", "w": "climb",
}  # fmt: skip
MARKS = "↓·↑"  # by action
AHEAD = "↓∘↑"  # where an action, kept, leads
NAMES = ("descend", "none", "climb")  # of the actions, in few columns
STEADY = 1  # the middle gust of three
CEILINGS = (100, 200, 300, 400, 600, 800)  # m: the least that holds every height so far is on top
LABEL = 6  # columns for heights
EVERY = 3  # columns between two places ahead


class Size(NamedTuple):
    """A drawing: its columns, the rows of heights, how often one is labelled, what follows."""

    width: int
    rows: int
    labels: int
    full: bool = True  # the times and the state below the heights
    ends: int = 0  # columns beside it for the names of what leads there


class Path(NamedTuple):
    """Where an advisory leads if it is kept in calm air: a height a second from now on."""

    action: int
    heights: list[float]


SIZES = (Size(87, 25, 6), Size(47, 13, 3), Size(47, 9, 2), Size(38, 5, 1), Size(38, 5, 1, False))
MOST = Size(161, 45, 11)  # columns and rows of heights that a drawing grows to
ENDS = 13


def _sizes(look: Look) -> list[Size]:
    """The largest first; one that fills the room beside the panel before those of a transcript."""
    width, rows = min(look.beside - ENDS, MOST.width), min(look.height - 2, MOST.rows)
    labels = (rows - 1) // 4
    if width < SIZES[1].width or rows < SIZES[2].rows:
        return [*SIZES]
    return [Size(width, 4 * labels + 1, labels, ends=ENDS), *SIZES]


def boards(view: View[CollisionAvoidance], look: Look) -> Iterator[Text]:
    """The encounter in five sizes and on a screen in one more, the last with less below it, then
    the numbers.
    """
    paths = _paths(view, look)
    for size in _sizes(look):
        canvas = Canvas()
        _encounter(canvas, view, size, paths)
        y = size.rows
        if size.full:
            _times(canvas, y, _time(size))
            if not size.ends:  # else the panel beside has it
                y += 1
                canvas.put(0, y, _standing(view) if look.large else _state(view), "bold")
            y += 1
        canvas.put(0, y, _advice(look, size.width) or _passing(view), "bold")
        yield canvas.text()
    yield written(_state(view), _passing(view))
    yield written(_state(view))


def _paths(view: View[CollisionAvoidance], look: Look) -> list[Path]:
    """Where each advisory leads; or a single one, from each state that it may bring."""
    if passed(view) or not (look.large or look.outlook):
        return []
    if look.outlook:
        action = int(look.outlook.action)
        now = _now(view)[0]
        ahead = _kept(view, look.outlook.states, np.full(len(look.outlook.states), action))
        return [Path(action, [now, *heights]) for heights in ahead]
    kept = _kept(view, np.tile(view.observation, (3, 1)), np.arange(3))
    return [Path(action, heights) for action, heights in enumerate(kept)]


def _kept(view: View[CollisionAvoidance], states: Array, actions: Array) -> list[list[float]]:
    """The heights of states `[B, 4]` a second each, each under an action that is kept."""
    problem, heights = view.problem, []
    while not problem.terminal(states).all():
        heights.append(states[:, 0])
        states = problem.move(states, actions[:, None], (np.full(len(states), STEADY),)).state
    return np.array(heights).reshape(-1, len(actions)).T.tolist()


def _advice(look: Look, width: int) -> str:
    """What an advisory may bring, or what each loses."""
    if look.outlook:
        rates = zip(look.outlook.states[:, 1], look.outlook.chances, strict=True)
        each = ", ".join(f"{percent(float(p))} {plus(float(rate), 1)}" for rate, p in rates)
        name = NAMES[int(look.outlook.action)]
        forms = [foreseen(look.outlook, f"advise {name}"), f"if {name}", name]
        told = [f"{form}: rate {each}" for form in forms]
        return next((one for one in told if len(one) <= width), told[-1])
    return next(iter(losses(look._replace(width=width), NAMES)), "")


def _time(size: Size) -> Scale:
    """Seconds left, from the first on the left."""
    return Scale(-FIRST_TIME, 0.0, LABEL, size.width - 1)


def _states(view: View[CollisionAvoidance]) -> list[tuple[float, float, float, float]]:
    """Height, rate, advisory and time before each of the forty turns at most, and now."""
    return [(float(h), float(dh), float(a), float(t)) for h, dh, a, t in view.observations]


def _now(view: View[CollisionAvoidance]) -> tuple[float, float, float, float]:
    """The present state; once they have passed, the one in which they did."""
    h, dh, a, left = map(float, view.observations[-2 if passed(view) and view.turn else -1])
    return h, dh, a, left


def _ceiling(heights: Iterable[float]) -> float:
    most = max(map(abs, heights))
    return float(next((high for high in CEILINGS if most <= high), most))


def _encounter(
    canvas: Canvas, view: View[CollisionAvoidance], size: Size, paths: list[Path]
) -> None:
    states = _states(view)
    high = _ceiling([*(h for h, *_ in states), *(h for path in paths for h in path.heights)])
    heights, time = Scale(-high, high, 0, size.rows - 1), _time(size)
    bottom = size.rows - 1
    for row in range(0, size.rows, size.labels):
        canvas.put(0, bottom - row, f"{heights.value(row):>+{LABEL - 1}.0f}", "dim")
    middle = bottom - heights.column(0)
    canvas.put(0, middle, "0".rjust(LABEL - 1), "dim")
    canvas.put(LABEL, middle, "┄" * (time.right - LABEL), "dim")
    for row in range(heights.column(-NEAR), heights.column(NEAR) + 1):
        canvas.put(time.right - 1, bottom - row, "▒▒", "red")
    h, dh, _, left = _now(view)
    if paths:
        _leads(canvas, paths, (time, heights), left, size)
    else:
        for column in range(time.column(-left) + 2, time.right + 1, 2):
            ahead = h + dh * (left + time.value(column))
            if abs(ahead) <= high:
                canvas.put(column, bottom - heights.column(ahead), "∘", "cyan")
    canvas.put(time.right, middle, "A", "bold red")
    for (was, _, _, then), action in zip(states, view.actions, strict=False):
        mark = MARKS[int(action)]
        canvas.put(time.column(-then), bottom - heights.column(was), mark, "yellow")
    canvas.put(time.column(-left), bottom - heights.column(h), "◆", "bold yellow")


def _leads(
    canvas: Canvas, paths: list[Path], scales: tuple[Scale, Scale], left: float, size: Size
) -> None:
    """Where each advisory leads, and at the end of each its name."""
    time, heights = scales
    ends: dict[int, list[str]] = {}
    first = time.column(-left) + 2
    first += (time.right - first) % EVERY  # what is kept to stays as it is drawn
    for action, path in paths:
        for column in range(first, time.right + 1, EVERY):
            second = min(round(left + time.value(column)), len(path) - 1)
            row = size.rows - 1 - heights.column(path[second])
            canvas.put(column, row, AHEAD[action], "cyan")
        names = ends.setdefault(size.rows - 1 - heights.column(path[-1]), [])
        if NAMES[action] not in names:
            names.insert(0, NAMES[action])
    for row, names in ends.items():
        told = "/".join(names) if len(names) < len(NAMES) else "any"
        if size.ends:
            canvas.put(time.right + 2, row, told, "bold cyan")


def _times(canvas: Canvas, y: int, time: Scale) -> None:
    for left in (40, 30, 20, 10, 0):
        canvas.put(time.column(-left) - 1, y, f"{left}s", "dim")


def _advisory(view: View[CollisionAvoidance]) -> str:
    """The advisory that stands."""
    rate = float(view.observation[2])
    return "none" if not rate else "climb" if rate > 0 else "descend"


def _state(view: View[CollisionAvoidance]) -> str:
    """Where it stands: the numbers."""
    h, dh, _, left = _now(view)
    return f"◆ h {plus(h, 0)} m  dh {plus(dh, 1)} m/s  {left:g} s  {_advisory(view)}"


def _standing(view: View[CollisionAvoidance]) -> str:
    """The same with its units alone."""
    h, dh, _, left = _now(view)
    return f"◆ {plus(h, 0)} m  {plus(dh, 1)} m/s  {left:g} s left  {_advisory(view)}"


def passed(view: View[CollisionAvoidance]) -> bool:
    """Whether the aircraft have passed one another."""
    return bool(view.observation[3] < 0)


def miss(view: View[CollisionAvoidance]) -> float:
    """By how much, in metres, they passed or will at this rate."""
    h, dh, _, left = _now(view)
    return h + dh * left


def _passing(view: View[CollisionAvoidance]) -> str:
    """How they passed, or will at this rate."""
    return f"{_how(view)} A: {'COLLISION' if _close(view) else 'clear'}"


def _how(view: View[CollisionAvoidance]) -> str:
    when, side = "passed" if passed(view) else "will pass", "below" if miss(view) < 0 else "above"
    return f"{when} {abs(miss(view)):.0f} m {side}"


def _close(view: View[CollisionAvoidance]) -> bool:
    return abs(miss(view)) < NEAR


def _outcome(view: View[CollisionAvoidance]) -> str:
    """How they pass, in words."""
    ahead = "" if passed(view) else " ahead"
    return f"{'collision' if _close(view) else 'clear'}{ahead}: {_how(view)} the intruder"


def goal(view: View[CollisionAvoidance]) -> list[str]:
    """What to be clear of when the other passes, and the price of an advice."""
    return [
        f"be {NEAR:g} m clear of the intruder at 0 s",
        f"a collision costs {NEAR_COST:g}",
        f"each change of advice costs {CHANGE_COST:g}",
    ]


def lesson(view: View[CollisionAvoidance]) -> Lesson:
    """The aircraft, what to be clear of, and the price of an advice."""
    return Lesson(
        "You advise the aircraft ◆ to climb, to descend or neither; another, A, comes head on at "
        "height 0",
        f"You want to be {NEAR:g} m above or below it when they pass, {FIRST_TIME:g} s after the "
        "start",
        f"A collision costs {NEAR_COST:g}, each change of advice {CHANGE_COST:g}, to keep to one "
        "nothing; gusts push the aircraft up and down",
        "climb",
    )


def panel(view: View[CollisionAvoidance]) -> list[tuple[str, str]]:
    """The state and the advisories; how they will pass stands below the board."""
    h, dh, _, left = _now(view)
    return [
        ("height", f"{plus(h, 0)} m"),
        ("rate", f"{plus(dh, 1)} m/s"),
        ("left", f"{left:g} s"),
        ("advice", _advisory(view)),
    ]


def told(view: View[CollisionAvoidance]) -> str:
    """How they pass, what was advised, and the state."""
    changed = view.observation[2] != view.observations[-2][2]
    how = "changed to" if changed else "kept"
    return f"{_outcome(view)}. {how} {view.last}. {_numbers(view)}."


def situation(view: View[CollisionAvoidance]) -> str:
    """How they pass, and the state."""
    return f"{_outcome(view)}. {_numbers(view)}. advisory {_advisory(view)}."


def _numbers(view: View[CollisionAvoidance]) -> str:
    h, dh, _, left = _now(view)
    return f"height {plus(h, 0)} m, rate {plus(dh, 1)} m/s, {left:g} s left"

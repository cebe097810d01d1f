"""How collision avoidance looks: height above the intruder against the time that is left.

+100  ····                 · and arrows: where you were, and the advisory given there
          ↑↑◆ ∘ ∘ ∘ ∘      ◆ you, ∘ where this rate leads
   0 ┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄▒A     A the intruder, ▒ too close to it
    40s            0s
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

from rich.text import Text

from dmplay.problems.collision_avoidance import (
    CHANGE_COST,
    FIRST_TIME,
    NEAR,
    NEAR_COST,
    CollisionAvoidance,
)
from dmplay.session import View
from dmplay.views._scale import Scale, plus
from dmplay.views.canvas import Canvas, written
from dmplay.views.style import Look

KEYS = {
    "j": "descend", "space": "no-advisory", "k": "climb",
    "down": "descend", "up": "climb", "s": "descend", "w": "climb",
}  # fmt: skip
MARKS = "↓·↑"  # by action
CEILINGS = (100, 200, 300, 400, 600, 800)  # m: the least that holds every height so far is on top
LABEL = 6  # columns for heights


class Size(NamedTuple):
    """A drawing: its columns, the rows of heights, how often one is labelled, what follows."""

    width: int
    rows: int
    labels: int
    full: bool = True  # the times and the state below the heights


SIZES = (Size(87, 25, 6), Size(47, 13, 3), Size(47, 9, 2), Size(38, 5, 1), Size(38, 5, 1, False))


def boards(view: View[CollisionAvoidance], look: Look) -> Iterator[Text]:
    """The encounter in five sizes, the last with less below it, then the numbers."""
    for size in SIZES:
        canvas = Canvas()
        _encounter(canvas, view, size)
        y = size.rows
        if size.full:
            _times(canvas, y, _time(size))
            canvas.put(0, y + 1, _state(view), "bold")
            y += 2
        canvas.put(0, y, _passing(view), "bold")
        yield canvas.text()
    yield written(_state(view), _passing(view))
    yield written(_state(view))


def _time(size: Size) -> Scale:
    """Seconds left, from the first on the left."""
    return Scale(-FIRST_TIME, 0.0, LABEL, size.width - 1)


def _states(view: View[CollisionAvoidance]) -> list[tuple[float, float, float, float]]:
    """Height, rate, advisory and time before each turn, and now."""
    return [(float(h), float(dh), float(a), float(t)) for h, dh, a, t in view.observations]


def _now(view: View[CollisionAvoidance]) -> tuple[float, float, float, float]:
    """The present state; once they have passed, the one in which they did."""
    states = _states(view)
    return states[-2] if states[-1][3] < 0 and view.turn else states[-1]


def _ceiling(view: View[CollisionAvoidance]) -> float:
    most = max(abs(h) for h, *_ in _states(view))
    return float(next((high for high in CEILINGS if most <= high), most))


def _encounter(canvas: Canvas, view: View[CollisionAvoidance], size: Size) -> None:
    high = _ceiling(view)
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
    for column in range(time.column(-left) + 2, time.right + 1, 2):
        ahead = h + dh * (left + time.value(column))
        if abs(ahead) <= high:
            canvas.put(column, bottom - heights.column(ahead), "∘", "cyan")
    canvas.put(time.right, middle, "A", "bold red")
    for (was, _, _, then), action in zip(_states(view), view.actions, strict=False):
        mark = MARKS[int(action)]
        canvas.put(time.column(-then), bottom - heights.column(was), mark, "yellow")
    canvas.put(time.column(-left), bottom - heights.column(h), "◆", "bold yellow")


def _times(canvas: Canvas, y: int, time: Scale) -> None:
    for left in (40, 30, 20, 10, 0):
        canvas.put(time.column(-left) - 1, y, f"{left}s", "dim")


def _advisory(view: View[CollisionAvoidance]) -> str:
    """The advisory that stands."""
    _, _, rate, _ = _states(view)[-1]
    return "none" if not rate else "climb" if rate > 0 else "descend"


def _state(view: View[CollisionAvoidance]) -> str:
    """Where it stands: the numbers."""
    h, dh, _, left = _now(view)
    return f"◆ h {plus(h, 0)} m  dh {plus(dh, 1)} m/s  {left:g} s  {_advisory(view)}"


def passed(view: View[CollisionAvoidance]) -> bool:
    """Whether the aircraft have passed one another."""
    return _states(view)[-1][3] < 0


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


def _changes(view: View[CollisionAvoidance]) -> int:
    """How often the advisory was changed."""
    advisories = [a for _, _, a, _ in _states(view)]
    return sum(a != b for a, b in pairwise(advisories))


def goal(view: View[CollisionAvoidance]) -> list[str]:
    """What to be clear of when the other passes, and the price of an advice."""
    return [
        f"be {NEAR:g} m clear of the intruder at 0 s",
        f"a collision costs {NEAR_COST:g}",
        f"each change of advice costs {CHANGE_COST:g}",
    ]


def panel(view: View[CollisionAvoidance]) -> list[tuple[str, str]]:
    """The state, what it leads to, the advisories."""
    h, dh, _, left = _now(view)
    return [
        ("h", f"{plus(h, 0)} m"),
        ("dh", f"{plus(dh, 1)} m/s"),
        ("time", f"{left:g} s"),
        ("passed" if passed(view) else "passes", f"{plus(miss(view), 0)} m"),
        ("", "COLLISION" if _close(view) else "clear"),
        ("near", f"below {NEAR:g} m"),
        ("last", view.last or "-"),
        ("changes", str(_changes(view))),
        ("reward", f"{view.rewards[-1]:.2f}" if view.rewards else "-"),
    ]


def told(view: View[CollisionAvoidance]) -> str:
    """How they pass, what was advised, and the state."""
    changed = _states(view)[-1][2] != _states(view)[-2][2]
    how = "changed to" if changed else "kept"
    return f"{_outcome(view)}. {how} {view.last}. {_numbers(view)}."


def situation(view: View[CollisionAvoidance]) -> str:
    """How they pass, and the state."""
    return f"{_outcome(view)}. {_numbers(view)}. advisory {_advisory(view)}."


def _numbers(view: View[CollisionAvoidance]) -> str:
    h, dh, _, left = _now(view)
    return f"h {plus(h, 0)} m, dh {plus(dh, 1)} m/s, {left:g} s left"

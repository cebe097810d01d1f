"""How the simple regulator looks: the last pushes, where the next number was due, and where it is.

       │    ∘────→    from a number to where its push aimed, turn by turn
       │  ←───∘
      ▂▆█▆▂           how the number now was distributed, before nature drew it
├─────┼──●──┬─────┤   the number now
"""

import math
from collections.abc import Iterator
from operator import add
from typing import NamedTuple

from rich.text import Text

from dmplay.problems.simple_regulator import START_DEVIATION, START_MEAN, SimpleRegulator
from dmplay.session import View
from dmplay.views._scale import Scale, plus
from dmplay.views.canvas import Canvas, signed, written
from dmplay.views.style import Look

KEYS: dict[str, str] = {}
NUDGES = {"left": -0.05, "right": 0.05, "down": -0.5, "up": 0.5}
RULERS = (1.0, 2.0, 5.0)  # and ten times as much, and so on: how far the number line reaches
BLOCKS = " ▁▂▃▄▅▆▇█"


class Size(NamedTuple):
    """A drawing: its columns, the turns it shows, the rows of the distribution."""

    width: int
    turns: int
    bell: int


SIZES = (Size(121, 12, 4), Size(61, 6, 2), Size(61, 3, 2), Size(39, 3, 1), Size(39, 1, 1))


def _numbers(view: View[SimpleRegulator], last: int = 2) -> list[float]:
    """The last numbers, up to now."""
    return [float(state[0]) for state in view.observations[-last:]]


def due(view: View[SimpleRegulator]) -> tuple[float, float]:
    """Mean and standard deviation of the number now, before nature drew it."""
    if not view.turn:
        return START_MEAN, START_DEVIATION
    return _numbers(view)[-2] + view.actions[-1], view.problem.noise


def reach(values: list[float]) -> float:
    """The shortest ruler that holds the values."""
    most = max(map(abs, values))
    tens = 1.0
    while True:
        for ruler in RULERS:
            if most <= ruler * tens:
                return ruler * tens
        tens *= 10


def boards(view: View[SimpleRegulator], look: Look) -> Iterator[Text]:
    """The number line with the last turns above it, in five sizes; the line; the numbers."""
    for size in SIZES:
        turns = min(view.turn, size.turns)
        numbers = _numbers(view, turns + 1)
        aims = [*map(add, numbers, view.actions[view.turn - turns :])]
        scale = _scale(reach([*numbers, *aims, due(view)[0]]), size.width)
        canvas = Canvas()
        for row in range(size.turns + size.bell):
            canvas.put(scale.column(0), row, "│", "dim")
        for row, (before, aim) in enumerate(zip(numbers, aims, strict=False), size.turns - turns):
            _push(canvas, row, scale, before, aim)
        _bell(canvas, size, scale, *due(view))
        _line(canvas, size.turns + size.bell, scale, numbers[-1])
        canvas.put(
            0, size.turns + size.bell + 2, _words(view, size.width == SIZES[-1].width), "bold"
        )
        yield canvas.text()
    canvas = Canvas()
    _line(canvas, 0, _scale(reach([numbers[-1]]), SIZES[-1].width), numbers[-1])
    yield canvas.text()
    yield written(f"s {plus(numbers[-1], 3)}")


def _scale(far: float, width: int) -> Scale:
    return Scale(-far, far, 1, width - 2)


def _push(canvas: Canvas, y: int, scale: Scale, before: float, aim: float) -> None:
    """A number, and an arrow to where its push aimed."""
    start, end = scale.column(before), scale.column(aim)
    for column in range(min(start, end), max(start, end)):
        canvas.put(column, y, "─", "cyan")
    if start != end:
        canvas.put(end, y, "→" if end > start else "←", "cyan")
    canvas.put(start, y, "∘", "bold")


def _bell(canvas: Canvas, size: Size, scale: Scale, mean: float, deviation: float) -> None:
    """The distribution, as high as its rows in the middle."""
    middle = scale.column(mean)
    for column in range(scale.left, scale.right + 1):
        away = scale.value(column) - scale.value(middle)
        far = away / deviation if deviation else math.inf * away if away else 0.0
        density = math.exp(-far * far / 2)  # a square by `**` raises where it is large
        whole, rest = divmod(round(density * size.bell * 8), 8)
        for row in range(whole + (rest > 0)):
            block = BLOCKS[8 if row < whole else rest]
            canvas.put(column, size.turns + size.bell - 1 - row, block, "blue")


def _line(canvas: Canvas, y: int, scale: Scale, number: float) -> None:
    """The number line, and what its marks are."""
    canvas.put(scale.left, y, "├" + "─" * (scale.right - scale.left - 1) + "┤", "dim")
    for share in (-1.0, -0.5, 0.0, 0.5, 1.0):
        value = share * scale.high
        column, text = scale.column(value), signed(value)
        if abs(share) < 1:
            canvas.put(column, y, "┼" if not share else "┬", "dim")
        left = min(max(column - len(text) // 2, 0), scale.right + 2 - len(text))
        canvas.put(left, y + 1, text, "dim")
    canvas.put(scale.column(number), y, "●", "bold yellow")


def _words(view: View[SimpleRegulator], short: bool) -> str:
    """The number, and the last push with what it aimed at."""
    numbers, (mean, deviation) = _numbers(view), due(view)
    now = f"s {plus(numbers[-1], 3)}"
    if not view.turn:
        around = f"{mean:g}" if short else f"{mean:g}, give or take {deviation:g}"
        return f"{now}   drawn around {around}"
    push, aim = plus(view.actions[-1], 3), plus(mean, 3)
    if short:
        return f"{now}  a {push}  aimed {aim}"
    return f"{now}   pushed {plus(numbers[-2], 3)} by {push}, aimed at {aim}"


def goal(view: View[SimpleRegulator]) -> list[str]:
    """The number to keep, the price, and what disturbs it."""
    return [
        "keep the number near 0",
        "each turn costs its square",
        "your push is added to it",
        *([f"nature adds {view.problem.noise:g} or so"] if view.problem.noise else []),
    ]


def panel(view: View[SimpleRegulator]) -> list[tuple[str, str]]:
    """The number and what it costs, the last push, and what does not change."""
    problem, number = view.problem, _numbers(view)[-1]
    bounds = problem.actions[0]
    return [
        ("s", plus(number, 3)),
        ("costs", f"{number * number:.3f}"),
        ("last a", plus(view.actions[-1], 3) if view.turn else "-"),
        ("aimed", plus(due(view)[0], 3) if view.turn else "-"),
        ("reward", f"{view.rewards[-1]:.3f}" if view.rewards else "-"),
        ("noise", f"{problem.noise:g}"),
        ("gamma", f"{problem.discount:g}"),
        ("a from", f"{bounds.low:g} to {bounds.high:g}"),
    ]


def told(view: View[SimpleRegulator]) -> str:
    """The number now, the push, and where it aimed."""
    numbers = _numbers(view)
    return (
        f"s {plus(numbers[-1], 3)}. pushed {plus(numbers[-2], 3)} by {plus(view.actions[-1], 3)}, "
        f"aimed at {plus(due(view)[0], 3)}."
    )


def situation(view: View[SimpleRegulator]) -> str:
    """The number, what it costs to be there, and what can be done."""
    problem, number = view.problem, _numbers(view)[-1]
    return (
        f"s {plus(number, 3)}. a turn here costs {number * number:.3f}. "
        f"push by {problem.actions[0].words()}; "
        f"noise of {problem.noise:g} comes on top."
    )

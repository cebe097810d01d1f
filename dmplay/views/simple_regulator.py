"""How the simple regulator looks: the last pushes, where the next number was due, and where it is.

       │    ∘────→    from a number to where its push aimed, turn by turn
       │  ←───∘
      ▂▆█▆▂           how the number now was distributed, before nature drew it
├─────┼──●──┬─────┤   the number now
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

from rich.text import Text

from dmplay.problems.simple_regulator import START_DEVIATION, START_MEAN, SimpleRegulator
from dmplay.session import View
from dmplay.views._advice import foreseen
from dmplay.views._scale import Scale, plus
from dmplay.views.canvas import Canvas, signed, written
from dmplay.views.style import Lesson, Look, Outlook

KEYS: dict[str, str] = {}
NUDGES = {"left": -0.05, "right": 0.05, "down": -0.5, "up": 0.5}
RULERS = (1.0, 2.0, 5.0)  # and ten times as much, and so on: how far the number line reaches
LEGEND = "● the number, ∘→ a push and its aim, ▄█▄ where chance took it"
BLOCKS = " ▁▂▃▄▅▆▇█"


class Size(NamedTuple):
    """A drawing: its columns, the turns it shows, the rows of the distribution."""

    width: int
    turns: int
    bell: int


MOST = Size(161, 20, 4)  # columns, turns and rows of bell that a drawing grows to
SIZES = (Size(121, 12, 4), Size(61, 6, 2), Size(61, 3, 2), Size(39, 3, 1), Size(39, 1, 1))


def _sizes(look: Look) -> list[Size]:
    """The largest first; one that fills the room beside the panel before those of a transcript."""
    width, rows = min(look.beside, MOST.width), look.height - 3  # number line, its marks, words
    bell = min(rows // 4, MOST.bell)
    if width < SIZES[1].width or bell < SIZES[1].bell:
        return [*SIZES]
    return [Size(width - 1 + width % 2, min(rows - bell, MOST.turns), bell), *SIZES]


def _numbers(view: View[SimpleRegulator], turns: int) -> list[float]:
    """The number before each of the last turns, and now: no more, as a film asks turn by turn."""
    return [float(state[0]) for state in view.observations[-turns - 1 :]]


def due(view: View[SimpleRegulator]) -> tuple[float, float]:
    """Mean and standard deviation of the number now, before nature drew it."""
    if not view.turn:
        return START_MEAN, START_DEVIATION
    return _numbers(view, 1)[0] + view.actions[-1], view.problem.noise


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
    """The number line with the last turns above it, in sizes; the line; the numbers."""
    for size in _sizes(look):
        turns = min(view.turn, size.turns)
        numbers = _numbers(view, turns)
        pushes = view.actions[view.turn - turns :]
        aims = [number + push for number, push in zip(numbers, pushes, strict=False)]
        ahead = [float(state[0]) for state in look.outlook.states] if look.outlook else []
        wanted = [] if look.advised is None else [numbers[-1] + look.advised]
        scale = _scale(reach([*numbers, *aims, due(view)[0], *ahead, *wanted]), size.width)
        canvas = Canvas()
        for row in range(size.turns + size.bell):
            canvas.put(scale.column(0), row, "│", "dim")
        for row, (number, aim) in enumerate(zip(numbers, aims, strict=False), size.turns - turns):
            _push(canvas, row, scale, number, aim)
        if look.outlook:
            _heap(canvas, size, scale, look.outlook)
        else:
            _bell(canvas, size, scale, *due(view))
        _line(canvas, size.turns + size.bell, scale, numbers[-1], look.advised)
        brief, y = size.width == SIZES[-1].width, size.turns + size.bell + 2
        if look.outlook:
            canvas.put(0, y, _costs(view, look.outlook, brief), "bold cyan")
        elif size.width > look.beside:  # else the panel beside has the numbers
            canvas.put(0, y, _words(view, brief, look), "bold")
        else:
            canvas.put(0, y, LEGEND, "dim")
        yield canvas.text()
    (now,) = _numbers(view, 0)
    canvas = Canvas()
    _line(canvas, 0, _scale(reach([now]), SIZES[-1].width), now)
    yield canvas.text()
    yield written(f"s {plus(now, 3)}")


def _costs(view: View[SimpleRegulator], outlook: Outlook, brief: bool) -> str:
    """What a push costs: this turn whatever it is, and the next on average."""
    (now,) = _numbers(view, 0)
    after = float((outlook.chances * outlook.states[:, 0] ** 2).sum())
    if brief:
        samples = " (samples)" * outlook.sampled
        return f"{plus(outlook.action, 2)}: {now * now:.2f} now, {after:.2f} next{samples}"
    push = foreseen(outlook, f"push {plus(outlook.action, 3)}")
    return f"{push}: costs {now * now:.3f} now, {after:.3f} next"


def price(view: View[SimpleRegulator], push: float) -> str:
    """What a turn costs now whatever is pushed, and the next after this push."""
    (now,), noise = _numbers(view, 0), view.problem.noise
    aim = now + push
    return (
        f"aims at {plus(aim, 3)}; costs {now * now:.3f} now, {aim * aim + noise * noise:.3f} next "
        "on average"
    )


def _heap(canvas: Canvas, size: Size, scale: Scale, outlook: Outlook) -> None:
    """How the number after a push is distributed, as high as its rows where it is likeliest."""
    heaps: dict[int, float] = {}
    for state, chance in zip(outlook.states, outlook.chances, strict=True):
        column = scale.column(float(state[0]))
        heaps[column] = heaps.get(column, 0.0) + float(chance)
    most = max(heaps.values())
    for column, chance in heaps.items():
        _block(canvas, column, size, chance / most, "cyan")


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
        _block(canvas, column, size, density, "blue")


def _block(canvas: Canvas, column: int, size: Size, share: float, style: str) -> None:
    """A column of the distribution, in eighths of a row."""
    whole, rest = divmod(round(share * size.bell * 8), 8)
    for row in range(whole + (rest > 0)):
        block = BLOCKS[8 if row < whole else rest]
        canvas.put(column, size.turns + size.bell - 1 - row, block, style)


def _line(canvas: Canvas, y: int, scale: Scale, number: float, push: float | None = None) -> None:
    """The number line, what its marks are, and on it the way of a push."""
    canvas.put(scale.left, y, "├" + "─" * (scale.right - scale.left - 1) + "┤", "dim")
    for share in (-1.0, -0.5, 0.0, 0.5, 1.0):
        value = share * scale.high
        column, text = scale.column(value), signed(value)
        if abs(share) < 1:
            canvas.put(column, y, "┼" if not share else "┬", "dim")
        left = min(max(column - len(text) // 2, 0), scale.right + 2 - len(text))
        canvas.put(left, y + 1, text, "dim")
    here, aim = scale.column(number), scale.column(number + (push or 0.0))
    canvas.put(min(here, aim), y, "━" * abs(aim - here), "bold green")
    if aim != here:
        canvas.put(aim, y, "→" if aim > here else "←", "bold green")
    canvas.put(here, y, "●", "bold yellow")


def _words(view: View[SimpleRegulator], short: bool, look: Look) -> str:
    """The number, and the last push with what it aimed at."""
    numbers, (mean, deviation) = _numbers(view, 1), due(view)
    number, pushed = ("number", "push") if look.large else ("s", "a")
    now = f"{number} {plus(numbers[-1], 3)}"
    if not view.turn:
        around = f"{mean:g}" if short else f"{mean:g}, give or take {deviation:g}"
        return f"{now}   drawn around {around}"
    push, aim = plus(view.actions[-1], 3), plus(mean, 3)
    if short:
        return f"{now}  {pushed} {push}  aimed {aim}"
    return f"{now}   pushed {plus(numbers[0], 3)} by {push}, aimed at {aim}"


def goal(view: View[SimpleRegulator]) -> list[str]:
    """The number to keep, the price, and what disturbs it."""
    return [
        "keep the number near 0",
        "each turn costs its square",
        f"{'your' if view.you == 'you' else 'the'} push is added to it",
        *([f"nature adds {view.problem.noise:g} or so"] if view.problem.noise else []),
    ]


def lesson(view: View[SimpleRegulator]) -> Lesson:
    """The number, the push, and what a turn costs."""
    problem, bounds = view.problem, view.problem.actions[0]
    noise = f", and nature adds {problem.noise:g} or so, up or down" if problem.noise else ""
    return Lesson(
        f"You add a push to a number each turn, anything from {bounds.low:g} to {bounds.high:g}",
        "You want the number as near to 0 as you can keep it",
        f"A turn costs the square of the number before it, a push nothing{noise}",
        "-0.2",
    )


def panel(view: View[SimpleRegulator]) -> list[tuple[str, str]]:
    """The number and what it costs, the last push, and what does not change."""
    problem, number = view.problem, _numbers(view, 0)[0]
    bounds = problem.actions[0]
    return [
        ("number", plus(number, 3)),
        ("costs", f"{number * number:.3f}"),
        ("pushed", plus(view.actions[-1], 3) if view.turn else "-"),
        ("aimed at", plus(due(view)[0], 3) if view.turn else "-"),
        ("reward", f"{view.rewards[-1]:.3f}" if view.rewards else "-"),
        ("noise", f"{problem.noise:g}"),
        ("push by", f"{bounds.low:g} to {bounds.high:g}"),
        ("discount", f"{problem.discount:g} (gamma)"),
    ]


def told(view: View[SimpleRegulator]) -> str:
    """The number now, the push, and where it aimed."""
    numbers, push = _numbers(view, 1), plus(view.actions[-1], 3)
    return (
        f"number {plus(numbers[-1], 3)}. pushed {plus(numbers[0], 3)} by {push}, "
        f"aimed at {plus(due(view)[0], 3)}."
    )


def situation(view: View[SimpleRegulator]) -> str:
    """The number, what it costs to be there, and what can be done."""
    problem, number = view.problem, _numbers(view, 0)[0]
    return (
        f"number {plus(number, 3)}. a turn here costs {number * number:.3f}. "
        f"push by {problem.actions[0].words()}; "
        f"noise of {problem.noise:g} comes on top."
    )

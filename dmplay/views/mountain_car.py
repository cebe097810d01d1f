"""How the mountain car looks: the hill sin 3x, the car on it, and the flag to reach.

│  F     the wall on the left is the end of the world; the point is where the car came from
│  │
│●·▂█    the blocks are eighths of a row
│▆▄███
"""

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

from rich.text import Text

from dmplay.problems.mountain_car import LEFT_WALL, RIGHT_WALL, TOP_SPEED, MountainCar
from dmplay.session import View
from dmplay.views._advice import foreseen, lost
from dmplay.views._scale import Scale, gauge, named, plus
from dmplay.views.canvas import Canvas, written
from dmplay.views.style import Lesson, Look

KEYS = {
    "h": "left", "j": "coast", "l": "right", "left": "left", "down": "coast", "right": "right",
    "space": "coast", "a": "left", "s": "coast", "d": "right",
}  # fmt: skip
BLOCKS = " ▁▂▃▄▅▆▇"
ASCII_BLOCKS = " __--==#"  # none like the car's star or the point behind it
DOING = ("drive left", "coast", "drive right")  # by action
ENGINE = {"left": (-1, "←"), "right": (1, "→")}  # beside the car, by the last action
FLOOR = -math.pi / 6  # where the valley is deepest


class Size(NamedTuple):
    """A drawing: its columns, the rows of the hill, those above it, and whether it has scales."""

    width: int
    hill: int
    sky: int = 2
    scales: bool = False


MOST = Size(161, 40)  # columns and rows of hill that a drawing grows to
SIZES = (Size(121, 20, 2, True), Size(61, 9, 2, True), Size(61, 6), Size(39, 5), Size(39, 4, 1))


def _sizes(look: Look) -> list[Size]:
    """The largest first; one that fills the room beside the panel before those of a transcript."""
    width, hill = min(look.beside, MOST.width), min(look.height - 8, MOST.hill)
    sizes = [one for one in SIZES if one.width <= look.width]
    if width < SIZES[1].width or hill < SIZES[2].hill:
        return sizes
    return [Size(width - 1 + width % 2, hill, 3, True), *sizes]


def height(x: float) -> float:
    """The hill."""
    return math.sin(3 * x)


def _eighths(x: float, rows: int) -> int:
    """The hill in eighths of a row, at least one."""
    return max(round((height(x) + 1) / 2 * rows * 8), 1)


def boards(view: View[MountainCar], look: Look) -> Iterator[Text]:
    """The hill in five sizes and on a screen in one more, then the numbers in a line."""
    after = [tuple(map(float, state)) for state in look.outlook.states] if look.outlook else []
    for size in _sizes(look):
        scale = Scale(LEFT_WALL, RIGHT_WALL, 1, size.width - 1)
        canvas = _hill(scale, size, ASCII_BLOCKS if look.ascii else BLOCKS).copy()
        _things(canvas, view, scale, size, look)
        _advice(canvas, look, scale, view)
        y = size.hill + size.sky
        if size.scales:
            _labels(canvas, y, scale, view.problem.goal)
            speed = Scale(-TOP_SPEED, TOP_SPEED, 1, size.width - 2)
            gauge(canvas, y + 1, speed, float(view.observation[1]), [v for _, v in after])
            named(canvas, y + 2, speed, "speed (v)" if look.large else "v")
            y += 4
        if look.outlook and after:
            doing, (x, v) = DOING[int(look.outlook.action)], after[0]
            what = foreseen(look.outlook, doing) if size.width > SIZES[-1].width else doing
            told = f"{what}: place {plus(x, 3)} speed {plus(v, 4)}"
            canvas.put(0, y, told, "bold cyan")
        elif size.width > look.beside:  # else the panel beside has them
            _say(canvas, y, view, look, size)
        yield canvas.text()
    yield written(_numbers(view, False))


def _advice(canvas: Canvas, look: Look, scale: Scale, view: View[MountainCar]) -> None:
    """Above the car, left of the flag, what is lost by each action."""
    losses = [f"{way} {lost(look, a)}" for a, way in enumerate("←·→") if lost(look, a)]
    if losses:
        text = "  ".join(losses)
        last = scale.column(view.problem.goal) - 2 - len(text)
        middle = scale.column(float(view.observation[0])) - len(text) // 2
        canvas.put(max(min(middle, last), 1), 0, text, "bold green")


def _say(canvas: Canvas, y: int, view: View[MountainCar], look: Look, size: Size) -> None:
    """The numbers, on a screen by their names."""
    x, v = map(float, view.observation)
    told = f"place {plus(x, 3)}  speed {plus(v, 4)}"
    transcript = _numbers(view, size.width > SIZES[-1].width)
    canvas.put(0, y, told if look.large else transcript, "bold")


@lru_cache(16)
def _hill(scale: Scale, size: Size, blocks: str) -> Canvas:
    """The wall on the left, and the hill in eighths of a row: those of every turn."""
    canvas = Canvas()
    for y in range(size.sky + size.hill):
        canvas.put(0, y, "│", "dim")
    columns = range(scale.left, scale.right + 1)
    heights = [_eighths(scale.value(column), size.hill) for column in columns]
    for y in range(size.hill):
        row = "".join(f"{blocks}█"[min(max(high - 8 * y, 0), 8)] for high in heights)
        canvas.put(scale.left, size.sky + size.hill - 1 - y, row, "green")
    return canvas


def _things(canvas: Canvas, view: View[MountainCar], scale: Scale, size: Size, look: Look) -> None:
    """The flag, where the car came from and may come to, the car and its engine, on the ground."""

    def ground(x: float) -> tuple[int, int]:
        column = scale.column(x)
        eighths = _eighths(scale.value(column), size.hill)
        # What is less than half a row of hill hides behind what stands there.
        return column, size.sky + size.hill - 1 - (eighths + 3) // 8

    column, y = ground(view.problem.goal)
    canvas.put(column, y, "│", "bold blue")
    canvas.put(column, max(y - 1, 0), "F", "bold blue")
    if view.turn:
        canvas.put(*ground(float(view.observations[-2][0])), "·", "yellow")
    for state in look.outlook.states if look.outlook else ():
        canvas.put(*ground(float(state[0])), "∘", "cyan")
    column, y = ground(float(view.observation[0]))
    canvas.put(column, y, "●", "bold yellow")
    if look.large and view.last in ENGINE:
        aside, arrow = ENGINE[view.last]
        if scale.left <= column + aside <= scale.right:
            canvas.put(column + aside, y, arrow, "bold green")


def _labels(canvas: Canvas, y: int, scale: Scale, goal: float) -> None:
    """Where the wall, the floor of the valley and the goal are."""
    canvas.put(0, y, f"{LEFT_WALL:g}", "dim")
    canvas.put(scale.column(FLOOR) - 2, y, f"{FLOOR:.2f}", "dim")
    text = f"goal {goal:g}"
    canvas.put(min(scale.column(goal) - 4, scale.right + 1 - len(text)), y, text, "dim")


def _goal(view: View[MountainCar]) -> list[str]:
    """What has to be reached."""
    problem = view.problem
    fast = [f"v >= {problem.goal_speed:g}"] if problem.goal_speed > -TOP_SPEED else []
    return [f"x >= {problem.goal:g}", *fast]


def _numbers(view: View[MountainCar], long: bool) -> str:
    x, v = map(float, view.observation)
    state = f"x {plus(x, 3)}  v {plus(v, 4)}"
    if long:
        return f"{state}  last: {view.last or '-'}   goal {', '.join(_goal(view))}"
    return f"{state}  goal {_goal(view)[0]}"


def goal(view: View[MountainCar]) -> list[str]:
    """The place to reach, the price of time, and why it is hard."""
    return [
        f"reach the flag at {_flag(view)}",
        "each turn costs 1",
        "the engine is too weak to climb: rock",
    ]


def lesson(view: View[MountainCar]) -> Lesson:
    """The car, its flag, and the price of time."""
    return Lesson(
        "You are a car in a valley; its engine pulls left or right, or coasts, and is too weak to "
        "climb out at once",
        f"You want to reach the flag at {_flag(view)}: rock to and fro to gain speed",
        "Every turn costs 1 until you are there, whatever the engine does",
        "right",
    )


def _flag(view: View[MountainCar]) -> str:
    """Where the flag is, and how fast one must be there."""
    problem = view.problem
    fast = f", no slower than {problem.goal_speed:g}" if problem.goal_speed > -TOP_SPEED else ""
    return f"{problem.goal:g}{fast}"


def panel(view: View[MountainCar]) -> list[tuple[str, str]]:
    """The state, how high that is, and the last action; the goal stands above the board."""
    x, v = map(float, view.observation)
    return [
        ("place", plus(x, 3)),
        ("speed", plus(v, 4)),
        ("height", plus(height(x), 2)),
        ("last", view.last or "-"),
    ]


def _stands(view: View[MountainCar]) -> str:
    """Where the car is, and which way it rolls."""
    x, v = map(float, view.observation)
    if view.problem.terminal(view.observation[None])[0]:
        return f"at the goal, place {plus(x, 3)}"
    way = f"rolls {'right' if v > 0 else 'left'} at {plus(v, 4)}" if v else "stands still"
    if x == LEFT_WALL:
        return f"at the left wall, {'stopped' if not v else way}"
    return f"{way}, place {plus(x, 3)}"


def told(view: View[MountainCar]) -> str:
    """What the car does, and what the engine did."""
    drove = "coasted" if view.last == "coast" else f"drove {view.last}"
    return f"{_stands(view)}. {drove}."


def situation(view: View[MountainCar]) -> str:
    """What the car does, how high it is, and what has to be reached."""
    high = plus(height(float(view.observation[0])), 2)
    return f"{_stands(view)}. height {high}. goal {' and '.join(_goal(view))}."

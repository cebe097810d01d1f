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
from dmplay.views._advice import format_condition, format_regret
from dmplay.views._scale import NumberLine, draw_gauge, draw_scale_labels, format_signed_fixed
from dmplay.views.canvas import Canvas, draw_text_rows
from dmplay.views.style import DrawOptions, Lesson

KEYS = {
    "h": "left", "j": "coast", "l": "right", "left": "left", "down": "coast", "right": "right",
    "space": "coast", "a": "left", "s": "coast", "d": "right",
}  # fmt: skip
BLOCKS = " ▁▂▃▄▅▆▇"
ASCII_BLOCKS = " __--==#"  # none like the car's star or the point behind it
ACTION_PHRASES = ("drive left", "coast", "drive right")  # by action
ENGINE_ARROWS = {"left": (-1, "←"), "right": (1, "→")}  # beside the car, by the last action
VALLEY_FLOOR_X = -math.pi / 6  # where the valley is deepest


class HillLayout(NamedTuple):
    """A drawing: its columns, the rows of the hill, those above it, and whether it has scales."""

    width: int
    hill_rows: int
    sky_rows: int = 2
    has_scales: bool = False


MAX_LAYOUT = HillLayout(161, 40)  # columns and rows of hill that a drawing grows to
LAYOUTS = (
    HillLayout(121, 20, 2, True),
    HillLayout(61, 9, 2, True),
    HillLayout(61, 6),
    HillLayout(39, 5),
    HillLayout(39, 4, 1),
)


def _list_layouts(options: DrawOptions) -> list[HillLayout]:
    """The largest first; one that fills the room beside the panel before those of a transcript."""
    width, hill = (
        min(options.columns_beside_panel, MAX_LAYOUT.width),
        min(options.height - 8, MAX_LAYOUT.hill_rows),
    )
    sizes = [one for one in LAYOUTS if one.width <= options.width]
    if width < LAYOUTS[1].width or hill < LAYOUTS[2].hill_rows:
        return sizes
    return [HillLayout(width - 1 + width % 2, hill, 3, True), *sizes]


def compute_hill_height(x: float) -> float:
    """The hill."""
    return math.sin(3 * x)


def _compute_hill_eighths(x: float, rows: int) -> int:
    """The hill in eighths of a row, at least one."""
    return max(round((compute_hill_height(x) + 1) / 2 * rows * 8), 1)


def iter_boards(view: View[MountainCar], options: DrawOptions) -> Iterator[Text]:
    """The hill in five sizes and on a screen in one more, then the numbers in a line."""
    after = (
        [tuple(map(float, state)) for state in options.forecast.outcomes]
        if options.forecast
        else []
    )
    for size in _list_layouts(options):
        scale = NumberLine(LEFT_WALL, RIGHT_WALL, 1, size.width - 1)
        canvas = _draw_hill(scale, size, ASCII_BLOCKS if options.ascii else BLOCKS).copy()
        _draw_flag_and_car(canvas, view, scale, size, options)
        _draw_hint(canvas, options, scale, view)
        y = size.hill_rows + size.sky_rows
        if size.has_scales:
            _draw_place_labels(canvas, y, scale, view.problem.goal)
            speed = NumberLine(-TOP_SPEED, TOP_SPEED, 1, size.width - 2)
            draw_gauge(canvas, y + 1, speed, float(view.observation[1]), [v for _, v in after])
            draw_scale_labels(canvas, y + 2, speed, "speed (v)" if options.allow_large else "v")
            y += 4
        if options.forecast and after:
            doing, (x, v) = ACTION_PHRASES[int(options.forecast.action)], after[0]
            what = (
                format_condition(options.forecast, doing)
                if size.width > LAYOUTS[-1].width
                else doing
            )
            told = f"{what}: place {format_signed_fixed(x, 3)} speed {format_signed_fixed(v, 4)}"
            canvas.write_text(0, y, told, "bold cyan")
        elif size.width > options.columns_beside_panel:  # else the panel beside has them
            _draw_state_numbers(canvas, y, view, options, size)
        yield canvas.to_text()
    yield draw_text_rows(_format_state(view, False))


def _draw_hint(
    canvas: Canvas, options: DrawOptions, scale: NumberLine, view: View[MountainCar]
) -> None:
    """Above the car, left of the flag, what is lost by each action."""
    losses = [
        f"{way} {format_regret(options, a)}"
        for a, way in enumerate("←·→")
        if format_regret(options, a)
    ]
    if losses:
        text = "  ".join(losses)
        last = scale.column_of(view.problem.goal) - 2 - len(text)
        middle = scale.column_of(float(view.observation[0])) - len(text) // 2
        canvas.write_text(max(min(middle, last), 1), 0, text, "bold green")


def _draw_state_numbers(
    canvas: Canvas, y: int, view: View[MountainCar], options: DrawOptions, layout: HillLayout
) -> None:
    """The numbers, on a screen by their names."""
    x, v = map(float, view.observation)
    told = f"place {format_signed_fixed(x, 3)}  speed {format_signed_fixed(v, 4)}"
    transcript = _format_state(view, layout.width > LAYOUTS[-1].width)
    canvas.write_text(0, y, told if options.allow_large else transcript, "bold")


@lru_cache(16)
def _draw_hill(scale: NumberLine, layout: HillLayout, blocks: str) -> Canvas:
    """The wall on the left, and the hill in eighths of a row: those of every turn."""
    canvas = Canvas()
    for y in range(layout.sky_rows + layout.hill_rows):
        canvas.write_text(0, y, "│", "dim")
    columns = range(scale.left, scale.right + 1)
    heights = [
        _compute_hill_eighths(scale.value_at(column), layout.hill_rows) for column in columns
    ]
    for y in range(layout.hill_rows):
        row = "".join(f"{blocks}█"[min(max(high - 8 * y, 0), 8)] for high in heights)
        canvas.write_text(scale.left, layout.sky_rows + layout.hill_rows - 1 - y, row, "green")
    return canvas


def _draw_flag_and_car(
    canvas: Canvas,
    view: View[MountainCar],
    scale: NumberLine,
    layout: HillLayout,
    options: DrawOptions,
) -> None:
    """The flag, where the car came from and may come to, the car and its engine, on the ground."""

    def locate_ground(x: float) -> tuple[int, int]:
        column = scale.column_of(x)
        eighths = _compute_hill_eighths(scale.value_at(column), layout.hill_rows)
        # What is less than half a row of hill hides behind what stands there.
        return column, layout.sky_rows + layout.hill_rows - 1 - (eighths + 3) // 8

    column, y = locate_ground(view.problem.goal)
    canvas.write_text(column, y, "│", "bold blue")
    canvas.write_text(column, max(y - 1, 0), "F", "bold blue")
    if view.turns_played:
        canvas.write_text(*locate_ground(float(view.observations[-2][0])), "·", "yellow")
    for state in options.forecast.outcomes if options.forecast else ():
        canvas.write_text(*locate_ground(float(state[0])), "∘", "cyan")
    column, y = locate_ground(float(view.observation[0]))
    canvas.write_text(column, y, "●", "bold yellow")
    if options.allow_large and view.last_action_label in ENGINE_ARROWS:
        aside, arrow = ENGINE_ARROWS[view.last_action_label]
        if scale.left <= column + aside <= scale.right:
            canvas.write_text(column + aside, y, arrow, "bold green")


def _draw_place_labels(canvas: Canvas, y: int, scale: NumberLine, goal: float) -> None:
    """Where the wall, the floor of the valley and the goal are."""
    canvas.write_text(0, y, f"{LEFT_WALL:g}", "dim")
    canvas.write_text(scale.column_of(VALLEY_FLOOR_X) - 2, y, f"{VALLEY_FLOOR_X:.2f}", "dim")
    text = f"goal {goal:g}"
    canvas.write_text(min(scale.column_of(goal) - 4, scale.right + 1 - len(text)), y, text, "dim")


def _format_goal_conditions(view: View[MountainCar]) -> list[str]:
    """What has to be reached."""
    problem = view.problem
    fast = [f"v >= {problem.goal_speed:g}"] if problem.goal_speed > -TOP_SPEED else []
    return [f"x >= {problem.goal:g}", *fast]


def _format_state(view: View[MountainCar], with_last_action: bool) -> str:
    x, v = map(float, view.observation)
    state = f"x {format_signed_fixed(x, 3)}  v {format_signed_fixed(v, 4)}"
    if with_last_action:
        return f"{state}  last: {view.last_action_label or '-'}   goal {', '.join(_format_goal_conditions(view))}"
    return f"{state}  goal {_format_goal_conditions(view)[0]}"


def goal_lines(view: View[MountainCar]) -> list[str]:
    """The place to reach, the price of time, and why it is hard."""
    return [
        f"reach the flag at {_describe_flag(view)}",
        "each turn costs 1",
        "the engine is too weak to climb: rock",
    ]


def lesson(view: View[MountainCar]) -> Lesson:
    """The car, its flag, and the price of time."""
    return Lesson(
        "You are a car in a valley; its engine pulls left or right, or coasts, and is too weak to "
        "climb out at once",
        f"You want to reach the flag at {_describe_flag(view)}: rock to and fro to gain speed",
        "Every turn costs 1 until you are there, whatever the engine does",
        "right",
    )


def _describe_flag(view: View[MountainCar]) -> str:
    """Where the flag is, and how fast one must be there."""
    problem = view.problem
    fast = f", no slower than {problem.goal_speed:g}" if problem.goal_speed > -TOP_SPEED else ""
    return f"{problem.goal:g}{fast}"


def panel_rows(view: View[MountainCar]) -> list[tuple[str, str]]:
    """The state, how high that is, and the last action; the goal stands above the board."""
    x, v = map(float, view.observation)
    return [
        ("place", format_signed_fixed(x, 3)),
        ("speed", format_signed_fixed(v, 4)),
        ("height", format_signed_fixed(compute_hill_height(x), 2)),
        ("last", view.last_action_label or "-"),
    ]


def _describe_state(view: View[MountainCar]) -> str:
    """Where the car is, and which way it rolls."""
    x, v = map(float, view.observation)
    if view.problem.terminal(view.observation[None])[0]:
        return f"at the goal, place {format_signed_fixed(x, 3)}"
    way = (
        f"rolls {'right' if v > 0 else 'left'} at {format_signed_fixed(v, 4)}"
        if v
        else "stands still"
    )
    if x == LEFT_WALL:
        return f"at the left wall, {'stopped' if not v else way}"
    return f"{way}, place {format_signed_fixed(x, 3)}"


def describe_turn(view: View[MountainCar]) -> str:
    """What the car does, and what the engine did."""
    drove = "coasted" if view.last_action_label == "coast" else f"drove {view.last_action_label}"
    return f"{_describe_state(view)}. {drove}."


def describe_situation(view: View[MountainCar]) -> str:
    """What the car does, how high it is, and what has to be reached."""
    high = format_signed_fixed(compute_hill_height(float(view.observation[0])), 2)
    return f"{_describe_state(view)}. height {high}. goal {' and '.join(_format_goal_conditions(view))}."

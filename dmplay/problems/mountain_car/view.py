"""The view of the mountain car: the hill sin 3x, the car on it, and the flag to reach.

│  F     the wall on the left ends the world; the dot is the car's previous position
│  │
│●·▂█    the blocks are eighths of a row
│▆▄███
"""

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

from rich.text import Text

from dmplay.core.session import View
from dmplay.draw import theme
from dmplay.draw.action_hints import format_as_loss, format_condition, format_regret
from dmplay.draw.bars import count_eighths, format_column
from dmplay.draw.canvas import Canvas, draw_text_rows
from dmplay.draw.number_line import NumberLine, draw_gauge, draw_scale_labels, format_signed_fixed
from dmplay.draw.options import DrawOptions
from dmplay.views.protocol import Clock, FinishedGame, Lesson

from .rules import LEFT_WALL, RIGHT_WALL, TOP_SPEED, MountainCar

KEYS = {
    "left": "left", "down": "coast", "right": "right", "h": "left", "j": "coast", "l": "right",
    "space": "coast", "a": "left", "s": "coast", "d": "right",
}  # fmt: skip
ACTION_PHRASES = ("drive left", "coast", "drive right")  # indexed by action
# column offset from the car and arrow, by the last action
ENGINE_ARROWS = {"left": (-1, "←"), "right": (1, "→")}
VALLEY_FLOOR_X = -math.pi / 6  # position of the valley's lowest point


def clock(view: View[MountainCar]) -> Clock:
    """Return the clock, at a speed that people can steer; the car coasts while no key is held."""
    return Clock(20.0, ("coast",))


class HillLayout(NamedTuple):
    """A layout of the board: columns, rows of hill, rows of sky, and whether it has scales."""

    width: int
    hill_rows: int
    sky_rows: int = 2
    has_scales: bool = False


MAX_LAYOUT = HillLayout(161, 40)  # maximum columns and rows of hill
LAYOUTS = (
    HillLayout(121, 20, 2, True),
    HillLayout(61, 9, 2, True),
    HillLayout(61, 6),
    HillLayout(39, 5),
    HillLayout(39, 4, 1),
)


def _list_layouts(options: DrawOptions) -> list[HillLayout]:
    """Return the layouts that are narrow enough, the largest first.

    The first one fills the space beside the side panel, if that is large enough.
    """
    width = min(options.columns_beside_panel, MAX_LAYOUT.width)
    hill_rows = min(options.height - 8, MAX_LAYOUT.hill_rows)
    layouts = [layout for layout in LAYOUTS if layout.width <= options.width]
    if width < LAYOUTS[1].width or hill_rows < LAYOUTS[2].hill_rows:
        return layouts
    return [HillLayout(width - 1 + width % 2, hill_rows, 3, True), *layouts]


def compute_hill_height(x: float) -> float:
    """Return the height of the hill at a position: sin 3x."""
    return math.sin(3 * x)


def _compute_hill_eighths(x: float, rows: int) -> int:
    """Return the height of the hill in eighths of a row, at least one."""
    return max(count_eighths((compute_hill_height(x) + 1) / 2, rows), 1)


def iter_boards(view: View[MountainCar], options: DrawOptions) -> Iterator[Text]:
    """Yield the hill in each layout, the largest first, then the state in one line."""
    forecast_states = []
    if options.forecast:
        forecast_states = [tuple(map(float, state)) for state in options.forecast.outcomes]
    for layout in _list_layouts(options):
        scale = NumberLine(LEFT_WALL, RIGHT_WALL, 1, layout.width - 1)
        canvas = _draw_hill(scale, layout, options.ascii).copy()
        _draw_flag_and_car(canvas, view, scale, layout, options)
        _draw_action_regrets(canvas, options, scale, view)
        y = layout.hill_rows + layout.sky_rows
        if layout.has_scales:
            _draw_place_labels(canvas, y, scale, view.problem.goal)
            speed_scale = NumberLine(-TOP_SPEED, TOP_SPEED, 1, layout.width - 2)
            speed, forecast_speeds = float(view.observation[1]), [v for _, v in forecast_states]
            draw_gauge(canvas, y + 1, speed_scale, speed, forecast_speeds)
            name = "speed (v)" if options.allow_large else "v"
            draw_scale_labels(canvas, y + 2, speed_scale, name)
            y += 4
        if options.forecast and forecast_states:
            condition = ACTION_PHRASES[int(options.forecast.action)]
            if layout.width > LAYOUTS[-1].width:
                condition = format_condition(options.forecast, condition)
            position, speed_text = _format_numbers(*forecast_states[0])
            text = f"{condition}: position {position} speed {speed_text}"
            canvas.write_text(0, y, text, theme.STRONG_DATA)
        # otherwise the side panel shows the numbers
        elif layout.width > options.columns_beside_panel:
            _draw_position_and_speed(canvas, y, view, options, layout)
        yield canvas.to_text()
    yield draw_text_rows(_format_state(view, False))


def _draw_action_regrets(
    canvas: Canvas, options: DrawOptions, scale: NumberLine, view: View[MountainCar]
) -> None:
    """Draw the regret of each action above the car, left of the flag."""
    texts = [format_as_loss(format_regret(options, action)) for action in range(3)]
    pairs = zip(("←", "coast", "→"), texts, strict=True)
    text = "  ".join(f"{arrow} {regret}" for arrow, regret in pairs if regret)
    if text:
        last_column = scale.column_of(view.problem.goal) - 2 - len(text)
        middle = scale.column_of(float(view.observation[0])) - len(text) // 2
        canvas.write_text(max(min(middle, last_column), 1), 0, text, theme.BEST)


def _draw_position_and_speed(
    canvas: Canvas, y: int, view: View[MountainCar], options: DrawOptions, layout: HillLayout
) -> None:
    """Draw position and speed, with their full names on a large screen."""
    position, speed = _format_numbers(*view.observation)
    named_numbers = f"position {position}  speed {speed}"
    short_numbers = _format_state(view, layout.width > LAYOUTS[-1].width)
    canvas.write_text(0, y, named_numbers if options.allow_large else short_numbers, "bold")


@lru_cache(len(LAYOUTS))
def _draw_hill(scale: NumberLine, layout: HillLayout, ascii_only: bool) -> Canvas:
    """Return a canvas with the left wall and the hill, to be copied: it is the same each turn."""
    canvas = Canvas()
    for y in range(layout.sky_rows + layout.hill_rows):
        canvas.write_text(0, y, "│", "dim")
    bottom = layout.sky_rows + layout.hill_rows - 1
    for column in range(scale.left, scale.right + 1):
        eighths = _compute_hill_eighths(scale.value_at(column), layout.hill_rows)
        for row, glyph in enumerate(format_column(eighths, ascii_only).ljust(layout.hill_rows)):
            canvas.write_text(column, bottom - row, glyph, theme.LAND)
    return canvas


def _draw_flag_and_car(
    canvas: Canvas,
    view: View[MountainCar],
    scale: NumberLine,
    layout: HillLayout,
    options: DrawOptions,
) -> None:
    """Draw the flag, the previous and forecast positions, the car, and its engine's arrow."""

    def locate_ground(x: float) -> tuple[int, int]:
        """Return the column of a position and the row of the ground there."""
        column = scale.column_of(x)
        eighths = _compute_hill_eighths(scale.value_at(column), layout.hill_rows)
        # Objects hide less than half a row of the hill that they stand on.
        return column, layout.sky_rows + layout.hill_rows - 1 - (eighths + 3) // 8

    column, y = locate_ground(view.problem.goal)
    canvas.write_text(column, y, "│", theme.GOAL)
    canvas.write_text(column, max(y - 1, 0), "F", theme.GOAL)
    if view.turns_played:
        canvas.write_text(*locate_ground(float(view.observations[-2][0])), "·", theme.PIECE_TRAIL)
    for state in options.forecast.outcomes if options.forecast else ():
        canvas.write_text(*locate_ground(float(state[0])), "∘", theme.DATA)
    column, y = locate_ground(float(view.observation[0]))
    canvas.write_text(column, y, "●", theme.PIECE)
    if options.allow_large and view.last_action_label in ENGINE_ARROWS:
        offset, arrow = ENGINE_ARROWS[view.last_action_label]
        if scale.left <= column + offset <= scale.right:
            canvas.write_text(column + offset, y, arrow, theme.BEST)


def _draw_place_labels(canvas: Canvas, y: int, scale: NumberLine, goal: float) -> None:
    """Draw the positions of the wall, the valley floor and the goal in row `y`."""
    canvas.write_text(0, y, f"{LEFT_WALL:g}", "dim")
    canvas.write_text(scale.column_of(VALLEY_FLOOR_X) - 2, y, f"{VALLEY_FLOOR_X:.2f}", "dim")
    text = f"goal {goal:g}"
    canvas.write_text(min(scale.column_of(goal) - 4, scale.right + 1 - len(text)), y, text, "dim")


def _format_numbers(x: float, v: float) -> tuple[str, str]:
    """Return a position and a speed as texts."""
    return format_signed_fixed(x, 3), format_signed_fixed(v, 4)


def _format_goals(view: View[MountainCar]) -> list[str]:
    """Return the conditions on position and speed for reaching the goal."""
    goal, speed = view.problem.goal, view.problem.goal_speed
    return [f"x >= {goal:g}", *([f"v >= {speed:g}"] if speed > -TOP_SPEED else [])]


def _format_state(view: View[MountainCar], with_last_action: bool) -> str:
    """Return position, speed and goal in one line, and the last action if requested."""
    state, goals = "x {}  v {}".format(*_format_numbers(*view.observation)), _format_goals(view)
    if with_last_action:
        return f"{state}  last: {view.last_action_label or '-'}   goal {', '.join(goals)}"
    return f"{state}  goal {goals[0]}"


def goal_lines(view: View[MountainCar]) -> list[str]:
    """Return the position to reach, the cost of a turn and the difficulty, as clauses."""
    return [
        f"reach the flag at {_describe_flag(view)}",
        "each turn until then costs 1",
        "where the engine is too weak, rock back and forth",
    ]


def lesson(view: View[MountainCar]) -> Lesson:
    """Return the three sentences that introduce the problem: role, objective and costs."""
    return Lesson(
        "You are a car in a valley; its engine pulls left or right, or coasts, and is too weak to "
        "climb out from the bottom at rest",
        f"You want to reach the flag at {_describe_flag(view)}: rock back and forth to gain speed",
        "Every turn costs 1 until you reach it, whatever the engine does",
        "right",
    )


def _describe_flag(view: View[MountainCar]) -> str:
    """Return the position of the flag, and the minimum speed there if there is one, as text."""
    goal, speed = view.problem.goal, view.problem.goal_speed
    return f"{goal:g}{f', no slower than {speed:g}' if speed > -TOP_SPEED else ''}"


def panel_rows(view: View[MountainCar]) -> list[tuple[str, str]]:
    """Return the panel rows: position, speed, height and last action.

    The goal is not repeated, as it is above the board.
    """
    position, speed = _format_numbers(*view.observation)
    height = compute_hill_height(float(view.observation[0]))
    return [
        ("position", position),
        ("speed", speed),
        ("height", format_signed_fixed(height, 2)),
        ("last", view.last_action_label or "-"),
    ]


def _describe_state(view: View[MountainCar]) -> str:
    """Return the car's position and its direction and speed, in words."""
    (x, v), (position, speed) = view.observation, _format_numbers(*view.observation)
    if view.problem.terminal(view.observation[None])[0]:
        return f"at the goal, position {position}"
    if x == LEFT_WALL:
        hold = f"until its speed, {speed}, turns positive" if v < 0 else f"speed {speed}"
        return f"at the left wall, {hold if v else 'stopped'}; driving right leaves it soonest"
    slope = "uphill" if v * math.cos(3.0 * x) > 0.0 else "downhill"
    motion = f"rolls {'right' if v > 0 else 'left'} {slope} at {speed}" if v else "stands still"
    return f"{motion}, position {position}"


def describe_turn(view: View[MountainCar]) -> str:
    """Return a description of the last action and of the car's motion after it."""
    action = view.last_action_label
    drive = "coasted" if action == "coast" else f"drove {action}"
    return f"{drive}, now {_describe_state(view)}."


def describe_situation(view: View[MountainCar]) -> str:
    """Return a description of the car's motion, its height and the goal."""
    height = format_signed_fixed(compute_hill_height(float(view.observation[0])), 2)
    goal = " and ".join(_format_goals(view))
    return f"{_describe_state(view)}. height {height}. goal {goal}."


def describe_end(game: FinishedGame[MountainCar]) -> str:
    """Return whether the car reached the flag, and in how many turns."""
    verb = "reached" if game.is_terminal else "did not reach"
    return f"{game.player} {verb} the flag in {game.turns}"

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
    ADVISORY_CHANGE_COST,
    COLLISION_COST,
    COLLISION_DISTANCE,
    START_TIME,
    CollisionAvoidance,
)
from dmplay.session import View
from dmplay.views._advice import format_condition, format_regret_rows
from dmplay.views._scale import NumberLine, format_signed_fixed
from dmplay.views.canvas import Canvas, draw_text_rows, format_percent
from dmplay.views.style import DrawOptions, Lesson

KEYS = {
    "j": "descend", "space": "no-advisory", "k": "climb",
    "down": "descend", "up": "climb", "s": "descend", "w": "climb",
}  # fmt: skip
ADVISORY_GLYPHS = "↓·↑"  # by action
PATH_GLYPHS = "↓∘↑"  # where an action, kept, leads
SHORT_ACTION_NAMES = ("descend", "none", "climb")  # of the actions, in few columns
STEADY_GUST_INDEX = 1  # the middle gust of three
MAX_HEIGHT_CHOICES = (
    100,
    200,
    300,
    400,
    600,
    800,
)  # m: the least that holds every height so far is on top
LABEL_COLUMNS = 6  # columns for heights
PATH_POINT_COLUMNS = 3  # columns between two places ahead


class EncounterLayout(NamedTuple):
    """A drawing: its columns, the rows of heights, how often one is labelled, what follows."""

    width: int
    height_rows: int
    label_interval: int
    has_status_rows: bool = True  # the times and the state below the heights
    path_label_columns: int = 0  # columns beside it for the names of what leads there


class AdvisoryPath(NamedTuple):
    """Where an advisory leads if it is kept in calm air: a height a second from now on."""

    action: int
    heights: list[float]


LAYOUTS = (
    EncounterLayout(87, 25, 6),
    EncounterLayout(47, 13, 3),
    EncounterLayout(47, 9, 2),
    EncounterLayout(38, 5, 1),
    EncounterLayout(38, 5, 1, False),
)
MAX_LAYOUT = EncounterLayout(161, 45, 11)  # columns and rows of heights that a drawing grows to
PATH_LABEL_COLUMNS = 13


def _list_layouts(options: DrawOptions) -> list[EncounterLayout]:
    """The largest first; one that fills the room beside the panel before those of a transcript."""
    width, rows = (
        min(options.columns_beside_panel - PATH_LABEL_COLUMNS, MAX_LAYOUT.width),
        min(options.height - 2, MAX_LAYOUT.height_rows),
    )
    labels = (rows - 1) // 4
    if width < LAYOUTS[1].width or rows < LAYOUTS[2].height_rows:
        return [*LAYOUTS]
    return [
        EncounterLayout(width, 4 * labels + 1, labels, path_label_columns=PATH_LABEL_COLUMNS),
        *LAYOUTS,
    ]


def iter_boards(view: View[CollisionAvoidance], options: DrawOptions) -> Iterator[Text]:
    """The encounter in five sizes and on a screen in one more, the last with less below it, then
    the numbers.
    """
    paths = _predict_paths(view, options)
    for size in _list_layouts(options):
        canvas = Canvas()
        _draw_encounter(canvas, view, size, paths)
        y = size.height_rows
        if size.has_status_rows:
            _draw_time_labels(canvas, y, _make_time_line(size))
            if not size.path_label_columns:  # else the panel beside has it
                y += 1
                canvas.write_text(
                    0,
                    y,
                    _format_state_with_units(view) if options.allow_large else _format_state(view),
                    "bold",
                )
            y += 1
        canvas.write_text(0, y, _format_hint(options, size.width) or _describe_pass(view), "bold")
        yield canvas.to_text()
    yield draw_text_rows(_format_state(view), _describe_pass(view))
    yield draw_text_rows(_format_state(view))


def _predict_paths(view: View[CollisionAvoidance], options: DrawOptions) -> list[AdvisoryPath]:
    """Where each advisory leads; or a single one, from each state that it may bring."""
    if has_passed_intruder(view) or not (options.allow_large or options.forecast):
        return []
    if options.forecast:
        action = int(options.forecast.action)
        now = _get_current_state(view)[0]
        ahead = _simulate_kept_advisories(
            view, options.forecast.outcomes, np.full(len(options.forecast.outcomes), action)
        )
        return [AdvisoryPath(action, [now, *heights]) for heights in ahead]
    kept = _simulate_kept_advisories(view, np.tile(view.observation, (3, 1)), np.arange(3))
    return [AdvisoryPath(action, heights) for action, heights in enumerate(kept)]


def _simulate_kept_advisories(
    view: View[CollisionAvoidance], states: Array, actions: Array
) -> list[list[float]]:
    """The heights of states `[B, 4]` a second each, each under an action that is kept."""
    problem, heights = view.problem, []
    while not problem.terminal(states).all():
        heights.append(states[:, 0])
        states = problem.resolve_events(
            states, actions[:, None], (np.full(len(states), STEADY_GUST_INDEX),)
        ).state
    return np.array(heights).reshape(-1, len(actions)).T.tolist()


def _format_hint(options: DrawOptions, width: int) -> str:
    """What an advisory may bring, or what each loses."""
    if options.forecast:
        rates = zip(options.forecast.outcomes[:, 1], options.forecast.probabilities, strict=True)
        each = ", ".join(
            f"{format_percent(float(p))} {format_signed_fixed(float(rate), 1)}" for rate, p in rates
        )
        name = SHORT_ACTION_NAMES[int(options.forecast.action)]
        forms = [format_condition(options.forecast, f"advise {name}"), f"if {name}", name]
        told = [f"{form}: rate {each}" for form in forms]
        return next((one for one in told if len(one) <= width), told[-1])
    return next(iter(format_regret_rows(options._replace(width=width), SHORT_ACTION_NAMES)), "")


def _make_time_line(layout: EncounterLayout) -> NumberLine:
    """Seconds left, from the first on the left."""
    return NumberLine(-START_TIME, 0.0, LABEL_COLUMNS, layout.width - 1)


def _list_past_states(view: View[CollisionAvoidance]) -> list[tuple[float, float, float, float]]:
    """Height, rate, advisory and time before each of the forty turns at most, and now."""
    return [(float(h), float(dh), float(a), float(t)) for h, dh, a, t in view.observations]


def _get_current_state(view: View[CollisionAvoidance]) -> tuple[float, float, float, float]:
    """The present state; once they have passed, the one in which they did."""
    h, dh, a, left = map(
        float, view.observations[-2 if has_passed_intruder(view) and view.turns_played else -1]
    )
    return h, dh, a, left


def _choose_max_height(heights: Iterable[float]) -> float:
    most = max(map(abs, heights))
    return float(next((high for high in MAX_HEIGHT_CHOICES if most <= high), most))


def _draw_encounter(
    canvas: Canvas,
    view: View[CollisionAvoidance],
    layout: EncounterLayout,
    paths: list[AdvisoryPath],
) -> None:
    states = _list_past_states(view)
    high = _choose_max_height(
        [*(h for h, *_ in states), *(h for path in paths for h in path.heights)]
    )
    heights, time = NumberLine(-high, high, 0, layout.height_rows - 1), _make_time_line(layout)
    bottom = layout.height_rows - 1
    for row in range(0, layout.height_rows, layout.label_interval):
        canvas.write_text(
            0, bottom - row, f"{heights.value_at(row):>+{LABEL_COLUMNS - 1}.0f}", "dim"
        )
    middle = bottom - heights.column_of(0)
    canvas.write_text(0, middle, "0".rjust(LABEL_COLUMNS - 1), "dim")
    canvas.write_text(LABEL_COLUMNS, middle, "┄" * (time.right - LABEL_COLUMNS), "dim")
    for row in range(
        heights.column_of(-COLLISION_DISTANCE), heights.column_of(COLLISION_DISTANCE) + 1
    ):
        canvas.write_text(time.right - 1, bottom - row, "▒▒", "red")
    h, dh, _, left = _get_current_state(view)
    if paths:
        _draw_paths(canvas, paths, (time, heights), left, layout)
    else:
        for column in range(time.column_of(-left) + 2, time.right + 1, 2):
            ahead = h + dh * (left + time.value_at(column))
            if abs(ahead) <= high:
                canvas.write_text(column, bottom - heights.column_of(ahead), "∘", "cyan")
    canvas.write_text(time.right, middle, "A", "bold red")
    for (was, _, _, then), action in zip(states, view.actions, strict=False):
        mark = ADVISORY_GLYPHS[int(action)]
        canvas.write_text(time.column_of(-then), bottom - heights.column_of(was), mark, "yellow")
    canvas.write_text(time.column_of(-left), bottom - heights.column_of(h), "◆", "bold yellow")


def _draw_paths(
    canvas: Canvas,
    paths: list[AdvisoryPath],
    scales: tuple[NumberLine, NumberLine],
    seconds_left: float,
    layout: EncounterLayout,
) -> None:
    """Where each advisory leads, and at the end of each its name."""
    time, heights = scales
    ends: dict[int, list[str]] = {}
    first = time.column_of(-seconds_left) + 2
    first += (time.right - first) % PATH_POINT_COLUMNS  # what is kept to stays as it is drawn
    for action, path in paths:
        for column in range(first, time.right + 1, PATH_POINT_COLUMNS):
            second = min(round(seconds_left + time.value_at(column)), len(path) - 1)
            row = layout.height_rows - 1 - heights.column_of(path[second])
            canvas.write_text(column, row, PATH_GLYPHS[action], "cyan")
        names = ends.setdefault(layout.height_rows - 1 - heights.column_of(path[-1]), [])
        if SHORT_ACTION_NAMES[action] not in names:
            names.insert(0, SHORT_ACTION_NAMES[action])
    for row, names in ends.items():
        told = "/".join(names) if len(names) < len(SHORT_ACTION_NAMES) else "any"
        if layout.path_label_columns:
            canvas.write_text(time.right + 2, row, told, "bold cyan")


def _draw_time_labels(canvas: Canvas, y: int, time_axis: NumberLine) -> None:
    for left in (40, 30, 20, 10, 0):
        canvas.write_text(time_axis.column_of(-left) - 1, y, f"{left}s", "dim")


def _get_current_advisory(view: View[CollisionAvoidance]) -> str:
    """The advisory that stands."""
    rate = float(view.observation[2])
    return "none" if not rate else "climb" if rate > 0 else "descend"


def _format_state(view: View[CollisionAvoidance]) -> str:
    """Where it stands: the numbers."""
    h, dh, _, left = _get_current_state(view)
    return f"◆ h {format_signed_fixed(h, 0)} m  dh {format_signed_fixed(dh, 1)} m/s  {left:g} s  {_get_current_advisory(view)}"


def _format_state_with_units(view: View[CollisionAvoidance]) -> str:
    """The same with its units alone."""
    h, dh, _, left = _get_current_state(view)
    return f"◆ {format_signed_fixed(h, 0)} m  {format_signed_fixed(dh, 1)} m/s  {left:g} s left  {_get_current_advisory(view)}"


def has_passed_intruder(view: View[CollisionAvoidance]) -> bool:
    """Whether the aircraft have passed one another."""
    return bool(view.observation[3] < 0)


def predict_miss_distance(view: View[CollisionAvoidance]) -> float:
    """By how much, in metres, they passed or will at this rate."""
    h, dh, _, left = _get_current_state(view)
    return h + dh * left


def _describe_pass(view: View[CollisionAvoidance]) -> str:
    """How they passed, or will at this rate."""
    return f"{_format_miss_distance(view)} A: {'COLLISION' if _is_collision(view) else 'clear'}"


def _format_miss_distance(view: View[CollisionAvoidance]) -> str:
    when, side = (
        "passed" if has_passed_intruder(view) else "will pass",
        "below" if predict_miss_distance(view) < 0 else "above",
    )
    return f"{when} {abs(predict_miss_distance(view)):.0f} m {side}"


def _is_collision(view: View[CollisionAvoidance]) -> bool:
    return abs(predict_miss_distance(view)) < COLLISION_DISTANCE


def _describe_outcome(view: View[CollisionAvoidance]) -> str:
    """How they pass, in words."""
    ahead = "" if has_passed_intruder(view) else " ahead"
    return f"{'collision' if _is_collision(view) else 'clear'}{ahead}: {_format_miss_distance(view)} the intruder"


def goal_lines(view: View[CollisionAvoidance]) -> list[str]:
    """What to be clear of when the other passes, and the price of an advice."""
    return [
        f"be {COLLISION_DISTANCE:g} m clear of the intruder at 0 s",
        f"a collision costs {COLLISION_COST:g}",
        f"each change of advice costs {ADVISORY_CHANGE_COST:g}",
    ]


def lesson(view: View[CollisionAvoidance]) -> Lesson:
    """The aircraft, what to be clear of, and the price of an advice."""
    return Lesson(
        "You advise the aircraft ◆ to climb, to descend or neither; another, A, comes head on at "
        "height 0",
        f"You want to be {COLLISION_DISTANCE:g} m above or below it when they pass, {START_TIME:g} s after the "
        "start",
        f"A collision costs {COLLISION_COST:g}, each change of advice {ADVISORY_CHANGE_COST:g}, to keep to one "
        "nothing; gusts push the aircraft up and down",
        "climb",
    )


def panel_rows(view: View[CollisionAvoidance]) -> list[tuple[str, str]]:
    """The state and the advisories; how they will pass stands below the board."""
    h, dh, _, left = _get_current_state(view)
    return [
        ("height", f"{format_signed_fixed(h, 0)} m"),
        ("rate", f"{format_signed_fixed(dh, 1)} m/s"),
        ("left", f"{left:g} s"),
        ("advice", _get_current_advisory(view)),
    ]


def describe_turn(view: View[CollisionAvoidance]) -> str:
    """How they pass, what was advised, and the state."""
    changed = view.observation[2] != view.observations[-2][2]
    how = "changed to" if changed else "kept"
    return f"{_describe_outcome(view)}. {how} {view.last_action_label}. {_describe_state(view)}."


def describe_situation(view: View[CollisionAvoidance]) -> str:
    """How they pass, and the state."""
    return f"{_describe_outcome(view)}. {_describe_state(view)}. advisory {_get_current_advisory(view)}."


def _describe_state(view: View[CollisionAvoidance]) -> str:
    h, dh, _, left = _get_current_state(view)
    return f"height {format_signed_fixed(h, 0)} m, rate {format_signed_fixed(dh, 1)} m/s, {left:g} s left"

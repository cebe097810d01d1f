"""The view of collision avoidance: height above the intruder against the time left.

+100  ····                 · and arrows: past positions, and the advisory given there
          ↑↑◆ ∘ ∘ ∘ ∘      ◆ you, ∘ the path at this rate
   0 ┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄▒A     A the intruder, ▒ too close to it
    40s            0s
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from rich.text import Text

from dmplay.core.arrays import Array
from dmplay.core.session import View
from dmplay.core.text import format_count
from dmplay.draw import theme
from dmplay.draw.action_hints import format_condition, format_regret_rows
from dmplay.draw.canvas import Canvas, draw_text_rows, format_percent
from dmplay.draw.number_line import NumberLine, format_signed_fixed
from dmplay.draw.options import DrawOptions
from dmplay.views.protocol import FinishedGame, Lesson

from .rules import (
    ADVISED_RATES,
    ADVISORY_CHANGE_COST,
    COLLISION_COST,
    COLLISION_DISTANCE,
    MAX_ACCELERATION,
    START_TIME,
    CollisionAvoidance,
)

KEYS = {
    "j": "descend", "space": "no-advisory", "k": "climb",
    "down": "descend", "up": "climb", "s": "descend", "w": "climb",
}  # fmt: skip
ADVISORY_GLYPHS = "↓·↑"  # by action
PATH_GLYPHS = "↓∘↑"  # predicted path if an action is repeated, by action
ACTION_NAMES = ("descend", "no-advisory", "climb")  # by action
STEADY_GUST_INDEX = 1  # the middle one of three gusts
# metres; the smallest that holds all heights is the top
MAX_HEIGHT_CHOICES = (100, 200, 300, 400, 600, 800)
PATH_LEGENDS = (  # of the predicted paths and the past, the longest first
    "left of ◆: past advisories; right of ◆: the next seconds in calm air if you always advise "
    "↑ climb, ∘ no-advisory, ↓ descend; ▒ collision",
    "the next seconds in calm air if you always advise ↑ climb, ∘ no-advisory, ↓ descend; "
    "▒ collision",
    "paths: next seconds by advisory; ▒ collision",
)
LABEL_COLUMNS = 6  # columns of the height labels
PATH_POINT_COLUMNS = 3  # columns between two points of a path


class EncounterLayout(NamedTuple):
    """A size of drawing: columns, rows, rows between labels, and the parts below and beside it."""

    width: int
    height_rows: int
    label_interval: int
    has_status_rows: bool = True  # times and state below the heights
    path_label_columns: int = 0  # columns for the names of the paths; 0 for none


# An action, and the predicted heights if it is repeated in calm air, one for each second.
AdvisoryPath = tuple[int, list[float]]


LAYOUTS = (
    EncounterLayout(87, 25, 6),
    EncounterLayout(47, 13, 3),
    EncounterLayout(47, 9, 2),
    EncounterLayout(38, 5, 1),
    EncounterLayout(38, 5, 1, False),
)
MAX_LAYOUT = EncounterLayout(161, 45, 11)  # largest columns and rows of a drawing
PATH_LABEL_COLUMNS = 13


def _list_layouts(options: DrawOptions) -> list[EncounterLayout]:
    """Return the layouts to try, largest first.

    A layout that fills the space beside the panel comes before those of a transcript.
    """
    width = min(options.columns_beside_panel - PATH_LABEL_COLUMNS, MAX_LAYOUT.width)
    rows = min(options.height - 3, MAX_LAYOUT.height_rows)
    labels = (rows - 1) // 4
    if width < LAYOUTS[1].width or rows < LAYOUTS[2].height_rows:
        return [*LAYOUTS]
    first = EncounterLayout(width, 4 * labels + 1, labels, path_label_columns=PATH_LABEL_COLUMNS)
    return [first, *LAYOUTS]


def iter_boards(view: View[CollisionAvoidance], options: DrawOptions) -> Iterator[Text]:
    """Yield the encounter in five or six sizes, then its numbers alone.

    The smallest drawing lacks the rows of times and state.
    """
    paths, state_row = _predict_paths(view, options), _format_state(view)
    for layout in _list_layouts(options):
        canvas = Canvas()
        _draw_encounter(canvas, view, layout, paths)
        y = layout.height_rows
        if layout.has_status_rows:
            _draw_time_labels(canvas, y, _make_time_line(layout))
            y += 1
            if layout.path_label_columns and paths and not options.forecast:
                fitting = (legend for legend in PATH_LEGENDS if len(legend) <= layout.width)
                y = canvas.write_rows(y, [next(fitting, "")], "dim")
            # With names at the paths' ends, the panel beside the drawing has the state.
            if not layout.path_label_columns:
                state = _format_state_with_units(view) if options.allow_large else state_row
                y = canvas.write_rows(y, [state], "bold")
        canvas.write_text(
            0, y, _format_advice(options, layout.width) or _describe_miss(view), "bold"
        )
        yield canvas.to_text()
    yield draw_text_rows(state_row, _describe_miss(view))
    yield draw_text_rows(state_row)


def _predict_paths(view: View[CollisionAvoidance], options: DrawOptions) -> list[AdvisoryPath]:
    """Predict the path of each advisory, or of the previewed one from each state it may lead to.

    Return [] after the aircraft have passed, and in a transcript without a forecast.
    """
    if has_passed_intruder(view) or not (options.allow_large or options.forecast):
        return []
    if options.forecast:
        action, states = int(options.forecast.action), options.forecast.outcomes
        current_height = _get_current_state(view)[0]
        heights = _predict_repeated_advisories(view, states, np.full(len(states), action))
        return [(action, [current_height, *future]) for future in heights]
    states = np.tile(view.observation, (3, 1))
    heights = _predict_repeated_advisories(view, states, np.arange(3))
    return [*enumerate(heights)]


def _predict_repeated_advisories(
    view: View[CollisionAvoidance], states: Array, actions: Array
) -> list[list[float]]:
    """Return the heights `[B][seconds]` under repeated actions in calm air.

    `states` has shape `[B, 4]` and `actions` shape `[B]`.
    """
    problem, heights = view.problem, []
    gusts = (np.full(len(states), STEADY_GUST_INDEX),)
    while not problem.terminal(states).all():
        heights.append(states[:, 0])
        states = problem.resolve_events(states, actions[:, None], gusts).state
    return np.array(heights).reshape(-1, len(actions)).T.tolist()


def _format_advice(options: DrawOptions, width: int) -> str:
    """Format the rates that the previewed advisory may lead to, or the regret of each advisory."""
    if options.forecast:
        rates = zip(options.forecast.outcomes[:, 1], options.forecast.probabilities, strict=True)
        rates_text = ", ".join(
            f"{format_signed_fixed(rate, 1)} ({format_percent(p)})" for rate, p in rates
        )
        name = ACTION_NAMES[int(options.forecast.action)]
        forms = [format_condition(options.forecast, f"advise {name}"), f"if {name}", name]
        texts = [f"{form}: rate {rates_text}" for form in forms]
        return next((text for text in texts if len(text) <= width), texts[-1])
    row = ""
    for names in (ACTION_NAMES, PATH_GLYPHS):
        (row,) = format_regret_rows(options._replace(width=width), names) or [""]
        if all(name in row for name in names):
            break
    return row


def _make_time_line(layout: EncounterLayout) -> NumberLine:
    """Return the time axis: seconds left, the first on the left."""
    return NumberLine(-START_TIME, 0.0, LABEL_COLUMNS, layout.width - 1)


def _get_current_state(view: View[CollisionAvoidance]) -> tuple[float, float, float, float]:
    """Return (height, rate, advisory, time left) now, or at the pass if it is over."""
    turn = -2 if has_passed_intruder(view) and view.turns_played else -1
    h, dh, a, seconds_left = map(float, view.observations[turn])
    return h, dh, a, seconds_left


def _draw_encounter(
    canvas: Canvas,
    view: View[CollisionAvoidance],
    layout: EncounterLayout,
    paths: list[AdvisoryPath],
) -> None:
    """Draw the axes, the intruder, the past heights and advisories, and the predicted paths."""
    # (height, rate, advisory, time left) before each turn, and now
    past_states = [(float(h), float(dh), float(a), float(t)) for h, dh, a, t in view.observations]
    heights = [*(h for h, *_ in past_states), *(h for _, path in paths for h in path)]
    largest = max(map(abs, heights))
    max_height = next((choice for choice in MAX_HEIGHT_CHOICES if largest <= choice), largest)
    height_axis = NumberLine(-max_height, max_height, 0, layout.height_rows - 1)
    time_axis = _make_time_line(layout)
    bottom = layout.height_rows - 1
    for row in range(0, layout.height_rows, layout.label_interval):
        label = f"{height_axis.value_at(row):>+{LABEL_COLUMNS - 1}.0f}"
        canvas.write_text(0, bottom - row, label, "dim")
    middle = bottom - height_axis.column_of(0)
    canvas.write_text(0, middle, "0".rjust(LABEL_COLUMNS - 1), "dim")
    canvas.write_text(LABEL_COLUMNS, middle, "┄" * (time_axis.right - LABEL_COLUMNS), "dim")
    lowest, highest = map(height_axis.column_of, (-COLLISION_DISTANCE, COLLISION_DISTANCE))
    for row in range(lowest, highest + 1):
        canvas.write_text(time_axis.right - 1, bottom - row, "▒▒", theme.DANGER_AREA)
    h, dh, _, seconds_left = _get_current_state(view)
    if paths:
        _draw_paths(canvas, paths, (time_axis, height_axis), seconds_left, layout)
    else:
        for column in range(time_axis.column_of(-seconds_left) + 2, time_axis.right + 1, 2):
            predicted_height = h + dh * (seconds_left + time_axis.value_at(column))
            if abs(predicted_height) <= max_height:
                y = bottom - height_axis.column_of(predicted_height)
                canvas.write_text(column, y, "∘", theme.DATA)
    canvas.write_text(time_axis.right, middle, "A", theme.DANGER)
    for (past_height, _, _, past_time), action in zip(past_states, view.actions, strict=False):
        x, y = time_axis.column_of(-past_time), bottom - height_axis.column_of(past_height)
        canvas.write_text(x, y, ADVISORY_GLYPHS[int(action)], theme.PIECE_TRAIL)
    x, y = time_axis.column_of(-seconds_left), bottom - height_axis.column_of(h)
    canvas.write_text(x, y, "◆", theme.PIECE)


def _draw_paths(
    canvas: Canvas,
    paths: list[AdvisoryPath],
    scales: tuple[NumberLine, NumberLine],
    seconds_left: float,
    layout: EncounterLayout,
) -> None:
    """Draw the predicted path of each advisory, and the advisory's name at its end."""
    time_axis, height_axis = scales
    actions_by_row: dict[int, list[int]] = {}
    first_column = time_axis.column_of(-seconds_left) + 2
    # The points of a repeated advisory stay at the same columns from turn to turn.
    first_column += (time_axis.right - first_column) % PATH_POINT_COLUMNS
    for action, path in paths:
        for column in range(first_column, time_axis.right + 1, PATH_POINT_COLUMNS):
            index = min(round(seconds_left + time_axis.value_at(column)), len(path) - 1)
            row = layout.height_rows - 1 - height_axis.column_of(path[index])
            canvas.write_text(column, row, PATH_GLYPHS[action], theme.DATA)
        end_row = layout.height_rows - 1 - height_axis.column_of(path[-1])
        row_actions = actions_by_row.setdefault(end_row, [])
        if action not in row_actions:
            row_actions.insert(0, action)
    for row, row_actions in actions_by_row.items():
        names = ACTION_NAMES if len(row_actions) == 1 else PATH_GLYPHS
        label = " or ".join(names[action] for action in row_actions)
        if layout.path_label_columns:
            canvas.write_text(time_axis.right + 2, row, label, theme.STRONG_DATA)


def _draw_time_labels(canvas: Canvas, y: int, time_axis: NumberLine) -> None:
    """Draw the labels of the time axis."""
    for seconds_left in (40, 30, 20, 10, 0):
        canvas.write_text(time_axis.column_of(-seconds_left) - 1, y, f"{seconds_left}s", "dim")


def _get_current_advisory(view: View[CollisionAvoidance]) -> str:
    """Return the name of the advisory in force."""
    rate = float(view.observation[2])
    return "no-advisory" if not rate else "climb" if rate > 0 else "descend"


def _format_current_numbers(view: View[CollisionAvoidance]) -> tuple[str, str, str]:
    """Return the current height, rate and time left as texts."""
    h, dh, _, seconds_left = _get_current_state(view)
    return format_signed_fixed(h, 0), format_signed_fixed(dh, 1), f"{seconds_left:g}"


def _format_state(view: View[CollisionAvoidance]) -> str:
    """Format the current state in one line, with its symbols."""
    h, dh, seconds_left = _format_current_numbers(view)
    advisory = _get_current_advisory(view).replace("no-advisory", "none")  # a short row
    return f"◆ h {h} m  dh {dh} m/s  {seconds_left} s  {advisory}"


def _format_state_with_units(view: View[CollisionAvoidance]) -> str:
    """Format the current state in one line, with units only."""
    h, dh, seconds_left = _format_current_numbers(view)
    return f"◆ {h} m  {dh} m/s  {seconds_left} s left  {_get_current_advisory(view)}"


def has_passed_intruder(view: View[CollisionAvoidance]) -> bool:
    """Return whether the aircraft have passed each other."""
    return bool(view.observation[3] < 0)


def predict_miss_distance(view: View[CollisionAvoidance]) -> float:
    """Return the vertical miss distance in metres, or its prediction at the current rate.

    It is positive above the intruder.
    """
    h, dh, _, seconds_left = _get_current_state(view)
    return h + dh * seconds_left


def _describe_miss(view: View[CollisionAvoidance]) -> str:
    """Describe the miss distance, and if it is a collision."""
    return f"{_format_miss_distance(view)} A: {'COLLISION' if _is_collision(view) else 'clear'}"


def _format_miss_distance(view: View[CollisionAvoidance]) -> str:
    """Describe the miss distance as passed, or at the current rate without gusts."""
    verb = "passed" if has_passed_intruder(view) else "at this rate"
    side = "below" if predict_miss_distance(view) < 0 else "above"
    return f"{verb} {abs(predict_miss_distance(view)):.0f} m {side}"


def _is_collision(view: View[CollisionAvoidance]) -> bool:
    """Return whether the miss distance is less than COLLISION_DISTANCE."""
    return abs(predict_miss_distance(view)) < COLLISION_DISTANCE


def _describe_pass_outcome(view: View[CollisionAvoidance]) -> str:
    """Describe the outcome of the pass, or the predicted one, in words."""
    outcome = "collision" if _is_collision(view) else "clear"
    suffix = "" if has_passed_intruder(view) else " course"
    return f"{outcome}{suffix}: {_format_miss_distance(view)} aircraft A"


def describe_keys(view: View[CollisionAvoidance]) -> dict[str, str]:
    """Return the cost of each advisory, or the one in force, which is free to keep."""
    cost = f"-{ADVISORY_CHANGE_COST:g}"
    if not view.observation[2]:
        return {name: cost for name in ACTION_NAMES if name != _get_current_advisory(view)}
    return {_get_current_advisory(view): "keep, free"}


def goal_lines(view: View[CollisionAvoidance]) -> list[str]:
    """Return the goal: the distance to keep from the intruder, the role, the costs, the effects."""
    return [
        f"pass aircraft A at least {COLLISION_DISTANCE:g} m above or below",
        "each second, advise the pilot",
        f"a collision costs {COLLISION_COST:g}, each change of the advisory "
        f"{ADVISORY_CHANGE_COST:g}",
        f"climb aims at a rate of {ADVISED_RATES[2]:+g} m/s, descend at {ADVISED_RATES[0]:+g}",
        "no-advisory lets the rate stay",
        "gusts change it too",
    ]


def lesson(view: View[CollisionAvoidance]) -> Lesson:
    """Return the lesson: the advisories, the distance to keep, and the costs."""
    return Lesson(
        "You advise the aircraft ◆ to climb, to descend, or neither (no-advisory, which keeps its "
        "rate); another aircraft, A, comes towards it at height 0",
        f"You want ◆ to be at least {COLLISION_DISTANCE:g} m above or below A when they pass, "
        f"{START_TIME:g} s after the start",
        f"A collision costs {COLLISION_COST:g}, and each change of the advisory costs "
        f"{ADVISORY_CHANGE_COST:g}; {_describe_response(view.problem)}; gusts also change the rate",
        "climb",
    )


def _describe_response(problem: CollisionAvoidance) -> str:
    """Return a clause on how the rate follows an advisory."""
    down, _, up = ADVISED_RATES
    exception = (
        f"; less than {MAX_ACCELERATION:g} m/s from there, climb adds {up:g} m/s and descend takes "
        f"{-down:g} m/s away"
    )
    return (
        f"each second, climb brings the rate {MAX_ACCELERATION:g} m/s nearer to {up:+g} m/s, and "
        f"descend to {down:+g} m/s, so climb slows a faster climb"
        f"{exception * (not problem.repaired)}"
    )


def panel_rows(view: View[CollisionAvoidance]) -> list[tuple[str, str]]:
    """Return the side panel's rows: height, rate, time left and advisory."""
    h, dh, seconds_left = _format_current_numbers(view)
    is_last_turn = seconds_left == "0" and not has_passed_intruder(view)
    return [
        ("height", f"{h} m"),
        ("rate", f"{dh} m/s"),
        ("pass in", "0 s: now, the last turn" if is_last_turn else f"{seconds_left} s"),
        ("advisory", _get_current_advisory(view)),
    ]


def describe_turn(view: View[CollisionAvoidance]) -> str:
    """Describe the last advisory, the gust if there was one, the state and the outcome."""
    gust = 0.0  # after the pass, the rate is not shown any more
    if not has_passed_intruder(view):
        gust = view.problem.compute_gust(view.observations[-2], view.observation)
    effect = f"a gust {'raised' if gust > 0 else 'lowered'} the rate by {abs(gust):.0f} m/s"
    has_changed = view.observation[2] != view.observations[-2][2]
    verb = "changed the advisory to" if has_changed else "kept"
    advisory = f"{verb} {_get_current_advisory(view)}"
    cost = f"costs {ADVISORY_CHANGE_COST:g}" if has_changed else "free"
    advisory += f" ({cost}){f'; {effect}' * (abs(gust) > 1)}"
    return f"{advisory}. {_describe_state(view)}. {_describe_pass_outcome(view)}."


def describe_situation(view: View[CollisionAvoidance]) -> str:
    """Describe the predicted outcome, the state and the advisory in force."""
    advisory = f"advisory: {_get_current_advisory(view)}"
    return f"{_describe_pass_outcome(view)}. {_describe_state(view)}. {advisory}."


def _describe_state(view: View[CollisionAvoidance]) -> str:
    """Describe the current height, rate and time left in words."""
    h, dh, seconds_left = _format_current_numbers(view)
    return f"height {h} m, rate {dh} m/s, {seconds_left} s left"


def describe_end(game: FinishedGame[CollisionAvoidance]) -> str:
    """Return the distance at which the aircraft passed, and the number of changed advisories."""
    distance = abs(float(game.states[-2][0]))
    advisories = game.states[:, 2]
    changes = format_count(int((advisories[1:] != advisories[:-1]).sum()), "change")
    advice = f"with {changes} of the advisory"
    if not game.is_terminal:
        return f"{game.player} had {game.turns}, {advice}; the aircraft have not passed yet"
    verb = "collided with" if distance < COLLISION_DISTANCE else "passed"
    return f"{game.player} {verb} aircraft A at {distance:.0f} m, {advice}"

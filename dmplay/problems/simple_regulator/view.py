"""The view of the simple regulator: the last pushes, the expected number and the number.

       │    ∘────→    from a number to the aim of its push, one row per turn
       │  ←───∘
      ▂▆█▆▂           the distribution of the current number, before nature drew it
├─────┼──●──┬─────┤   the current number
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from rich.text import Text

from dmplay.core.session import View
from dmplay.core.text import format_count, format_reward
from dmplay.draw import theme
from dmplay.draw.action_hints import format_condition
from dmplay.draw.bars import count_eighths, format_column
from dmplay.draw.canvas import Canvas, draw_text_rows, format_signed
from dmplay.draw.number_line import NumberLine, format_signed_fixed
from dmplay.draw.options import DrawOptions, Forecast
from dmplay.views.protocol import FinishedGame, Lesson

from .linear_policy_evaluation import OPTIMAL_POLICY, evaluate_finite_horizon
from .rules import START_DEVIATION, START_MEAN, SimpleRegulator

KEYS: dict[str, str] = {}
NUMBER_NAME = "push"
NUMBER_STEPS = {"left": -0.05, "right": 0.05, "down": -0.5, "up": 0.5}
NUMBER_LINE_LIMITS = (1.0, 2.0, 5.0)  # limits of the number line, and these times 10, 100, ...
LEGEND = "● number, ▄█▄ where it could {verb}, → push to its aim"


class RegulatorLayout(NamedTuple):
    """A layout of the board: columns, turns shown, and rows of the distribution."""

    width: int
    shown_turns: int
    distribution_rows: int


MAX_LAYOUT = RegulatorLayout(161, 20, 4)  # maximum columns, turns and rows of the distribution
LAYOUTS = (
    RegulatorLayout(121, 12, 4),
    RegulatorLayout(61, 6, 2),
    RegulatorLayout(61, 3, 2),
    RegulatorLayout(39, 3, 1),
    RegulatorLayout(39, 1, 1),
)


def _list_layouts(options: DrawOptions) -> list[RegulatorLayout]:
    """Return the layouts, the largest first.

    The first one fills the space beside the side panel, if that is large enough.
    """
    # without number line, labels, text
    width, rows = min(options.columns_beside_panel, MAX_LAYOUT.width), options.height - 3
    distribution_rows = min(rows // 4, MAX_LAYOUT.distribution_rows)
    if width < LAYOUTS[1].width or distribution_rows < LAYOUTS[1].distribution_rows:
        return [*LAYOUTS]
    turns = min(rows - distribution_rows, MAX_LAYOUT.shown_turns)
    return [RegulatorLayout(width - 1 + width % 2, turns, distribution_rows), *LAYOUTS]


def _list_recent_numbers(view: View[SimpleRegulator], turns: int) -> list[float]:
    """Return the number before each of the last `turns` turns, and the current number.

    Older observations are not read, because an animation calls this in every turn.
    """
    return [float(state[0]) for state in view.observations[-turns - 1 :]]


def predict_number(view: View[SimpleRegulator]) -> tuple[float, float]:
    """Return mean and standard deviation of the current number, before nature drew it."""
    if not view.turns_played:
        return START_MEAN, START_DEVIATION
    return _list_recent_numbers(view, 1)[0] + view.actions[-1], view.problem.noise


def choose_number_line_limit(values: list[float]) -> float:
    """Return the smallest limit of a number line that covers all values."""
    largest, power_of_ten = max(map(abs, values)), 1.0
    while largest > NUMBER_LINE_LIMITS[-1] * power_of_ten:
        power_of_ten *= 10
    return next(x * power_of_ten for x in NUMBER_LINE_LIMITS if largest <= x * power_of_ten)


def iter_boards(view: View[SimpleRegulator], options: DrawOptions) -> Iterator[Text]:
    """Yield the board in each layout, the largest first, then the number line, then the number."""
    for layout in _list_layouts(options):
        turns = min(view.turns_played, layout.shown_turns)
        numbers = _list_recent_numbers(view, turns)
        pushes = view.actions[view.turns_played - turns :]
        aims = [number + push for number, push in zip(numbers, pushes, strict=False)]
        covered = [*numbers, *aims, predict_number(view)[0]]
        if options.forecast:
            covered += [float(state[0]) for state in options.forecast.outcomes]
        next_push = options.typed_action
        if next_push is None:
            next_push = options.suggested_action
        if next_push is not None:
            covered.append(numbers[-1] + next_push)
        scale = _make_number_line(choose_number_line_limit(covered), layout.width)
        canvas, line_row = Canvas(), layout.shown_turns + layout.distribution_rows
        for row in range(line_row):
            canvas.write_text(scale.column_of(0), row, "│", "dim")
        pairs = zip(numbers, aims, strict=False)
        for row, (number, aim) in enumerate(pairs, layout.shown_turns - turns):
            _draw_push_arrow(canvas, row, scale, number, aim)
        if options.forecast:
            _draw_forecast_distribution(canvas, layout, scale, options.forecast)
        else:
            _draw_normal_distribution(canvas, layout, scale, *predict_number(view))
        _draw_number_line(canvas, line_row, scale, numbers[-1], next_push)
        is_brief, y = layout.width == LAYOUTS[-1].width, line_row + 2
        if options.forecast:
            costs = _format_forecast_costs(view, options.forecast, is_brief)
            canvas.write_text(0, y, costs, theme.STRONG_DATA)
        # otherwise the side panel shows the numbers
        elif layout.width > options.columns_beside_panel:
            canvas.write_text(0, y, _format_state(view, is_brief, options), "bold")
        else:
            canvas.write_text(0, y, LEGEND.format(verb="have been" if turns else "start"), "dim")
        yield canvas.to_text()
    (current,) = _list_recent_numbers(view, 0)
    canvas = Canvas()
    scale = _make_number_line(choose_number_line_limit([current]), LAYOUTS[-1].width)
    _draw_number_line(canvas, 0, scale, current)
    yield canvas.to_text()
    yield draw_text_rows(f"s {format_signed_fixed(current, 3)}")


def _format_forecast_costs(view: View[SimpleRegulator], forecast: Forecast, is_brief: bool) -> str:
    """Return this turn's cost, and the expected cost of the next turn after the forecast push."""
    (number,) = _list_recent_numbers(view, 0)
    next_cost = float((forecast.probabilities * forecast.outcomes[:, 0] ** 2).sum())
    if is_brief:
        push, samples = format_signed_fixed(forecast.action, 2), " (samples)" * forecast.is_sampled
        return f"{push}: {number * number:.2f} now, {next_cost:.2f} next{samples}"
    push = format_condition(forecast, f"push {format_signed_fixed(forecast.action, 3)}")
    return f"{push}: costs {format_reward(number * number)} now, {format_reward(next_cost)} next"


def describe_expected_reward(view: View[SimpleRegulator], push: float) -> str:
    """Return the aim of a push, this turn's cost and the expected cost of the next, as text."""
    (number,), noise = _list_recent_numbers(view, 0), view.problem.noise
    aim = number + push
    cost, next_cost = format_reward(number * number), format_reward(aim * aim + noise * noise)
    return f"aims at {format_signed_fixed(aim, 3)}; costs {cost} now, {next_cost} next on average"


def _draw_forecast_distribution(
    canvas: Canvas, layout: RegulatorLayout, scale: NumberLine, forecast: Forecast
) -> None:
    """Draw the distribution of the number after a push, at full height where it is likeliest."""
    column_probabilities: dict[int, float] = {}
    for state, probability in zip(forecast.outcomes, forecast.probabilities, strict=True):
        column = scale.column_of(float(state[0]))
        column_probabilities[column] = column_probabilities.get(column, 0.0) + float(probability)
    largest = max(column_probabilities.values())
    for column, probability in column_probabilities.items():
        eighths = count_eighths(probability / largest, layout.distribution_rows)
        _draw_distribution_column(canvas, column, layout, eighths, theme.DATA)


def _make_number_line(limit: float, width: int) -> NumberLine:
    """Return a number line from `-limit` to `limit`."""
    return NumberLine(-limit, limit, 1, width - 2)


def _draw_push_arrow(canvas: Canvas, y: int, scale: NumberLine, number: float, aim: float) -> None:
    """Draw a number, and an arrow to the aim of its push."""
    start, end = scale.column_of(number), scale.column_of(aim)
    for column in range(min(start, end), max(start, end)):
        canvas.write_text(column, y, "─", theme.DATA)
    if start != end:
        canvas.write_text(end, y, "→" if end > start else "←", theme.DATA)
    canvas.write_text(start, y, "∘", "bold")


def _draw_normal_distribution(
    canvas: Canvas, layout: RegulatorLayout, scale: NumberLine, mean: float, deviation: float
) -> None:
    """Draw a normal distribution above the number line, at full height at its mean."""
    middle = scale.column_of(mean)
    for column in range(scale.left, scale.right + 1):
        offset = scale.value_at(column) - scale.value_at(middle)
        z_score = offset / deviation if deviation else math.inf * offset if offset else 0.0
        density = math.exp(-z_score * z_score / 2)  # `**` raises OverflowError for large numbers
        # A density is positive everywhere; only a large one is drawn.
        eighths = round(density * layout.distribution_rows * 8)
        _draw_distribution_column(canvas, column, layout, eighths, theme.CHANCE)


def _draw_distribution_column(
    canvas: Canvas, column: int, layout: RegulatorLayout, eighths: int, style: str
) -> None:
    """Draw one column of the distribution, `eighths` of a row high."""
    bottom = layout.shown_turns + layout.distribution_rows - 1
    for row, glyph in enumerate(format_column(eighths)):
        canvas.write_text(column, bottom - row, glyph, style)


def _draw_number_line(
    canvas: Canvas, y: int, scale: NumberLine, number: float, push: float | None = None
) -> None:
    """Draw the number line with its labels, the number, and an arrow to the aim of a push."""
    canvas.write_text(scale.left, y, "├" + "─" * (scale.right - scale.left - 1) + "┤", "dim")
    for fraction in (-1.0, -0.5, 0.0, 0.5, 1.0):
        value = fraction * scale.high
        column, text = scale.column_of(value), format_signed(value)
        if abs(fraction) < 1:
            canvas.write_text(column, y, "┼" if not fraction else "┬", "dim")
        left = min(max(column - len(text) // 2, 0), scale.right + 2 - len(text))
        canvas.write_text(left, y + 1, text, "dim")
    start, end = scale.column_of(number), scale.column_of(number + (push or 0.0))
    canvas.write_text(min(start, end), y, "━" * abs(end - start), theme.BEST)
    if end != start:
        canvas.write_text(end, y, "→" if end > start else "←", theme.BEST)
    canvas.write_text(start, y, "●", theme.PIECE)


def _format_state(view: View[SimpleRegulator], is_brief: bool, options: DrawOptions) -> str:
    """Return the number, the last push and its aim as text."""
    numbers, (mean, deviation) = _list_recent_numbers(view, 1), predict_number(view)
    number_name, push_name = ("number", "push") if options.allow_large else ("s", "a")
    number_text = f"{number_name} {format_signed_fixed(numbers[-1], 3)}"
    if not view.turns_played:
        mean_text = f"{mean:g}" if is_brief else f"{mean:g}, standard deviation {deviation:g}"
        return f"{number_text}   starts around {mean_text}"
    push, aim = format_signed_fixed(view.actions[-1], 3), format_signed_fixed(mean, 3)
    if is_brief:
        return f"{number_text}  {push_name} {push}  aimed {aim}"
    return f"{number_text}   at {format_signed_fixed(numbers[0], 3)} pushed {push}, aimed at {aim}"


def goal_lines(view: View[SimpleRegulator]) -> list[str]:
    """Return the goal, the costs, the score of best play, the push and the noise, as clauses."""
    turns, start = view.problem.horizon, float(view.observations[0][0])
    best = evaluate_finite_horizon(view.problem, OPTIMAL_POLICY, turns).evaluate_at(start)
    return [
        "regulate a number: add pushes to keep it near 0",
        "each turn costs its square",
        f"best play from this start scores about {best:.2f} in {format_count(turns, 'turn')}",
        "a push itself is free",
        *([f"chance moves it by about {view.problem.noise:g}"] if view.problem.noise else []),
        "the number may be an error, such as degrees off course",
    ]


def lesson(view: View[SimpleRegulator]) -> Lesson:
    """Return the three sentences that introduce the problem: role, objective and costs."""
    problem, bounds = view.problem, view.problem.actions[0]
    noise = ""
    if problem.noise:
        noise = f"; chance moves the number by about {problem.noise:g}, up or down"
    return Lesson(
        f"You add a push from {bounds.low:g} to {bounds.high:g} to a number in each turn",
        "You want to keep the number as close to 0 as possible",
        f"A turn costs the square of the number at its start; a push is free{noise}",
        "-0.2",
    )


def panel_rows(view: View[SimpleRegulator]) -> list[tuple[str, str]]:
    """Return the panel rows: the number, its cost, the last push and the parameters."""
    problem, number = view.problem, _list_recent_numbers(view, 0)[0]
    bounds, push, aim = problem.actions[0], "-", "-"
    if view.turns_played:
        push, aim = (format_signed_fixed(x, 3) for x in (view.actions[-1], predict_number(view)[0]))
    return [
        ("number", format_signed_fixed(number, 3)),
        *([] if view.end_reason else [("costs now", format_reward(number * number))]),
        ("pushed", push),
        ("aimed at", aim),
        ("last turn", format_reward(view.rewards[-1]) if view.rewards else "-"),
        ("noise", f"{problem.noise:g}"),
        ("push by", f"{bounds.low:g} to {bounds.high:g}"),
        ("discount", f"{problem.discount:g} (gamma)"),
    ]


def describe_turn(view: View[SimpleRegulator]) -> str:
    """Return a description of the last push, its aim and the number after it."""
    values = *_list_recent_numbers(view, 1), view.actions[-1], predict_number(view)[0]
    before, after, push, aim = (format_signed_fixed(value, 3) for value in values)
    moved = "chance moved it to" if view.problem.noise else "now at"
    return f"at {before} pushed {push}, aimed at {aim}, {moved} {after}."


def describe_situation(view: View[SimpleRegulator]) -> str:
    """Return a description of the number, its cost and the possible pushes."""
    problem, number = view.problem, _list_recent_numbers(view, 0)[0]
    cost = format_reward(number * number)
    return (
        f"number {format_signed_fixed(number, 3)}. a turn here costs {cost}. "
        f"push by {problem.actions[0].describe_actions()}; "
        f"noise of about {problem.noise:g} is added."
    )


def describe_end(game: FinishedGame[SimpleRegulator]) -> str:
    """Return the average distance of the number from 0, and the part of chance."""
    distance, noise = float(np.abs(game.states[:-1]).mean()), game.problem.noise
    text = f"{game.player} kept the number {distance:.2f} away from 0 on average, for {game.turns}"
    alone = noise * math.sqrt(2.0 / math.pi)  # the mean distance of a normal number from its mean
    return f"{text}{f'; chance alone moves it by {alone:.2f} a turn' * bool(noise)}"

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
from dmplay.views._advice import format_condition
from dmplay.views._scale import NumberLine, format_signed_fixed
from dmplay.views.canvas import Canvas, draw_text_rows, format_signed
from dmplay.views.style import DrawOptions, Forecast, Lesson

KEYS: dict[str, str] = {}
NUMBER_STEPS = {"left": -0.05, "right": 0.05, "down": -0.5, "up": 0.5}
NUMBER_LINE_LIMITS = (
    1.0,
    2.0,
    5.0,
)  # and ten times as much, and so on: how far the number line reaches
LEGEND = "● the number, ∘→ a push and its aim, ▄█▄ where chance took it"
BLOCKS = " ▁▂▃▄▅▆▇█"


class RegulatorLayout(NamedTuple):
    """A drawing: its columns, the turns it shows, the rows of the distribution."""

    width: int
    shown_turns: int
    distribution_rows: int


MAX_LAYOUT = RegulatorLayout(161, 20, 4)  # columns, turns and rows of bell that a drawing grows to
LAYOUTS = (
    RegulatorLayout(121, 12, 4),
    RegulatorLayout(61, 6, 2),
    RegulatorLayout(61, 3, 2),
    RegulatorLayout(39, 3, 1),
    RegulatorLayout(39, 1, 1),
)


def _list_layouts(options: DrawOptions) -> list[RegulatorLayout]:
    """The largest first; one that fills the room beside the panel before those of a transcript."""
    width, rows = (
        min(options.columns_beside_panel, MAX_LAYOUT.width),
        options.height - 3,
    )  # number line, its marks, words
    bell = min(rows // 4, MAX_LAYOUT.distribution_rows)
    if width < LAYOUTS[1].width or bell < LAYOUTS[1].distribution_rows:
        return [*LAYOUTS]
    return [
        RegulatorLayout(width - 1 + width % 2, min(rows - bell, MAX_LAYOUT.shown_turns), bell),
        *LAYOUTS,
    ]


def _list_recent_numbers(view: View[SimpleRegulator], turns: int) -> list[float]:
    """The number before each of the last turns, and now: no more, as a film asks turn by turn."""
    return [float(state[0]) for state in view.observations[-turns - 1 :]]


def predict_number(view: View[SimpleRegulator]) -> tuple[float, float]:
    """Mean and standard deviation of the number now, before nature drew it."""
    if not view.turns_played:
        return START_MEAN, START_DEVIATION
    return _list_recent_numbers(view, 1)[0] + view.actions[-1], view.problem.noise


def choose_number_line_limit(values: list[float]) -> float:
    """The shortest ruler that holds the values."""
    most = max(map(abs, values))
    tens = 1.0
    while True:
        for ruler in NUMBER_LINE_LIMITS:
            if most <= ruler * tens:
                return ruler * tens
        tens *= 10


def iter_boards(view: View[SimpleRegulator], options: DrawOptions) -> Iterator[Text]:
    """The number line with the last turns above it, in sizes; the line; the numbers."""
    for size in _list_layouts(options):
        turns = min(view.turns_played, size.shown_turns)
        numbers = _list_recent_numbers(view, turns)
        pushes = view.actions[view.turns_played - turns :]
        aims = [number + push for number, push in zip(numbers, pushes, strict=False)]
        ahead = [float(state[0]) for state in options.forecast.outcomes] if options.forecast else []
        wanted = (
            [] if options.suggested_action is None else [numbers[-1] + options.suggested_action]
        )
        scale = _make_number_line(
            choose_number_line_limit([*numbers, *aims, predict_number(view)[0], *ahead, *wanted]),
            size.width,
        )
        canvas = Canvas()
        for row in range(size.shown_turns + size.distribution_rows):
            canvas.write_text(scale.column_of(0), row, "│", "dim")
        for row, (number, aim) in enumerate(
            zip(numbers, aims, strict=False), size.shown_turns - turns
        ):
            _draw_push_arrow(canvas, row, scale, number, aim)
        if options.forecast:
            _draw_forecast_distribution(canvas, size, scale, options.forecast)
        else:
            _draw_normal_distribution(canvas, size, scale, *predict_number(view))
        _draw_number_line(
            canvas,
            size.shown_turns + size.distribution_rows,
            scale,
            numbers[-1],
            options.suggested_action,
        )
        brief, y = size.width == LAYOUTS[-1].width, size.shown_turns + size.distribution_rows + 2
        if options.forecast:
            canvas.write_text(
                0, y, _format_forecast_costs(view, options.forecast, brief), "bold cyan"
            )
        elif size.width > options.columns_beside_panel:  # else the panel beside has the numbers
            canvas.write_text(0, y, _format_state(view, brief, options), "bold")
        else:
            canvas.write_text(0, y, LEGEND, "dim")
        yield canvas.to_text()
    (now,) = _list_recent_numbers(view, 0)
    canvas = Canvas()
    _draw_number_line(
        canvas, 0, _make_number_line(choose_number_line_limit([now]), LAYOUTS[-1].width), now
    )
    yield canvas.to_text()
    yield draw_text_rows(f"s {format_signed_fixed(now, 3)}")


def _format_forecast_costs(view: View[SimpleRegulator], forecast: Forecast, is_brief: bool) -> str:
    """What a push costs: this turn whatever it is, and the next on average."""
    (now,) = _list_recent_numbers(view, 0)
    after = float((forecast.probabilities * forecast.outcomes[:, 0] ** 2).sum())
    if is_brief:
        samples = " (samples)" * forecast.is_sampled
        return f"{format_signed_fixed(forecast.action, 2)}: {now * now:.2f} now, {after:.2f} next{samples}"
    push = format_condition(forecast, f"push {format_signed_fixed(forecast.action, 3)}")
    return f"{push}: costs {now * now:.3f} now, {after:.3f} next"


def describe_expected_reward(view: View[SimpleRegulator], push: float) -> str:
    """What a turn costs now whatever is pushed, and the next after this push."""
    (now,), noise = _list_recent_numbers(view, 0), view.problem.noise
    aim = now + push
    return (
        f"aims at {format_signed_fixed(aim, 3)}; costs {now * now:.3f} now, {aim * aim + noise * noise:.3f} next "
        "on average"
    )


def _draw_forecast_distribution(
    canvas: Canvas, layout: RegulatorLayout, scale: NumberLine, forecast: Forecast
) -> None:
    """How the number after a push is distributed, as high as its rows where it is likeliest."""
    heaps: dict[int, float] = {}
    for state, chance in zip(forecast.outcomes, forecast.probabilities, strict=True):
        column = scale.column_of(float(state[0]))
        heaps[column] = heaps.get(column, 0.0) + float(chance)
    most = max(heaps.values())
    for column, chance in heaps.items():
        _draw_distribution_column(canvas, column, layout, chance / most, "cyan")


def _make_number_line(limit: float, width: int) -> NumberLine:
    return NumberLine(-limit, limit, 1, width - 2)


def _draw_push_arrow(canvas: Canvas, y: int, scale: NumberLine, number: float, aim: float) -> None:
    """A number, and an arrow to where its push aimed."""
    start, end = scale.column_of(number), scale.column_of(aim)
    for column in range(min(start, end), max(start, end)):
        canvas.write_text(column, y, "─", "cyan")
    if start != end:
        canvas.write_text(end, y, "→" if end > start else "←", "cyan")
    canvas.write_text(start, y, "∘", "bold")


def _draw_normal_distribution(
    canvas: Canvas, layout: RegulatorLayout, scale: NumberLine, mean: float, deviation: float
) -> None:
    """The distribution, as high as its rows in the middle."""
    middle = scale.column_of(mean)
    for column in range(scale.left, scale.right + 1):
        away = scale.value_at(column) - scale.value_at(middle)
        far = away / deviation if deviation else math.inf * away if away else 0.0
        density = math.exp(-far * far / 2)  # a square by `**` raises where it is large
        _draw_distribution_column(canvas, column, layout, density, "blue")


def _draw_distribution_column(
    canvas: Canvas, column: int, layout: RegulatorLayout, fraction: float, style: str
) -> None:
    """A column of the distribution, in eighths of a row."""
    whole, rest = divmod(round(fraction * layout.distribution_rows * 8), 8)
    for row in range(whole + (rest > 0)):
        block = BLOCKS[8 if row < whole else rest]
        canvas.write_text(
            column, layout.shown_turns + layout.distribution_rows - 1 - row, block, style
        )


def _draw_number_line(
    canvas: Canvas, y: int, scale: NumberLine, number: float, push: float | None = None
) -> None:
    """The number line, what its marks are, and on it the way of a push."""
    canvas.write_text(scale.left, y, "├" + "─" * (scale.right - scale.left - 1) + "┤", "dim")
    for share in (-1.0, -0.5, 0.0, 0.5, 1.0):
        value = share * scale.high
        column, text = scale.column_of(value), format_signed(value)
        if abs(share) < 1:
            canvas.write_text(column, y, "┼" if not share else "┬", "dim")
        left = min(max(column - len(text) // 2, 0), scale.right + 2 - len(text))
        canvas.write_text(left, y + 1, text, "dim")
    here, aim = scale.column_of(number), scale.column_of(number + (push or 0.0))
    canvas.write_text(min(here, aim), y, "━" * abs(aim - here), "bold green")
    if aim != here:
        canvas.write_text(aim, y, "→" if aim > here else "←", "bold green")
    canvas.write_text(here, y, "●", "bold yellow")


def _format_state(view: View[SimpleRegulator], is_brief: bool, options: DrawOptions) -> str:
    """The number, and the last push with what it aimed at."""
    numbers, (mean, deviation) = _list_recent_numbers(view, 1), predict_number(view)
    number, pushed = ("number", "push") if options.allow_large else ("s", "a")
    now = f"{number} {format_signed_fixed(numbers[-1], 3)}"
    if not view.turns_played:
        around = f"{mean:g}" if is_brief else f"{mean:g}, give or take {deviation:g}"
        return f"{now}   drawn around {around}"
    push, aim = format_signed_fixed(view.actions[-1], 3), format_signed_fixed(mean, 3)
    if is_brief:
        return f"{now}  {pushed} {push}  aimed {aim}"
    return f"{now}   pushed {format_signed_fixed(numbers[0], 3)} by {push}, aimed at {aim}"


def goal_lines(view: View[SimpleRegulator]) -> list[str]:
    """The number to keep, the price, and what disturbs it."""
    return [
        "keep the number near 0",
        "each turn costs its square",
        f"{'your' if view.player_label == 'you' else 'the'} push is added to it",
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


def panel_rows(view: View[SimpleRegulator]) -> list[tuple[str, str]]:
    """The number and what it costs, the last push, and what does not change."""
    problem, number = view.problem, _list_recent_numbers(view, 0)[0]
    bounds = problem.actions[0]
    return [
        ("number", format_signed_fixed(number, 3)),
        ("costs", f"{number * number:.3f}"),
        ("pushed", format_signed_fixed(view.actions[-1], 3) if view.turns_played else "-"),
        ("aimed at", format_signed_fixed(predict_number(view)[0], 3) if view.turns_played else "-"),
        ("reward", f"{view.rewards[-1]:.3f}" if view.rewards else "-"),
        ("noise", f"{problem.noise:g}"),
        ("push by", f"{bounds.low:g} to {bounds.high:g}"),
        ("discount", f"{problem.discount:g} (gamma)"),
    ]


def describe_turn(view: View[SimpleRegulator]) -> str:
    """The number now, the push, and where it aimed."""
    numbers, push = _list_recent_numbers(view, 1), format_signed_fixed(view.actions[-1], 3)
    return (
        f"number {format_signed_fixed(numbers[-1], 3)}. pushed {format_signed_fixed(numbers[0], 3)} by {push}, "
        f"aimed at {format_signed_fixed(predict_number(view)[0], 3)}."
    )


def describe_situation(view: View[SimpleRegulator]) -> str:
    """The number, what it costs to be there, and what can be done."""
    problem, number = view.problem, _list_recent_numbers(view, 0)[0]
    return (
        f"number {format_signed_fixed(number, 3)}. a turn here costs {number * number:.3f}. "
        f"push by {problem.actions[0].describe_actions()}; "
        f"noise of {problem.noise:g} comes on top."
    )

"""Mixed strategies as bars, and curves of one number for each step."""

import math
from collections.abc import Sequence

import numpy as np
from rich.text import Text

from dmplay.algorithms.step import Curve, StrategyMixes
from dmplay.core.text import format_score
from dmplay.draw.axes import ROWS_AROUND_AREA, Axis
from dmplay.draw.bars import format_bar, format_sparkline
from dmplay.draw.canvas import Canvas
from dmplay.draw.line_plot import draw_lines
from dmplay.draw.options import DrawOptions
from dmplay.draw.panels import LinePanel, Series

MAX_BAR_COLUMNS = 24
MIN_AGENT_COLUMNS = 26  # columns of an agent's bars from which agents are beside each other
LOG_RATIO = 100.0  # ratio of largest and smallest number from which a curve has a log scale
MIN_CURVE_COLUMNS, MIN_CURVE_ROWS = 16, 4


def draw_strategy_mixes(strategies: StrategyMixes, options: DrawOptions) -> Text:
    """Return the probability of each action of each agent as bars.

    If not all actions fit, the best response and the most probable actions are shown; of equally
    probable ones, those beside the best response.
    """
    agent_count = len(strategies.agents)
    is_beside = options.width >= agent_count * MIN_AGENT_COLUMNS
    columns = options.width // agent_count - 2 if is_beside else options.width
    agent_rows = options.height if is_beside else max(options.height // agent_count, 2)
    canvas = Canvas()
    for seat, (agent, mix) in enumerate(zip(strategies.agents, strategies.mixes, strict=True)):
        x = seat * (columns + 2) if is_beside else 0
        y = 0 if is_beside else seat * agent_rows
        best = strategies.best_responses[seat] if strategies.best_responses else -1
        heading = f"{agent}  > best response" if best >= 0 else agent
        canvas.write_text(x, y, heading[:columns], "bold")
        capacity = max(agent_rows - 1, 1)
        actions = np.arange(len(mix))
        omitted = ""
        if len(actions) > capacity:
            rank = -mix - 2.0 * (actions == best)
            likeliest = np.lexsort((abs(actions - best), rank))[: max(capacity - 1, 1)]
            actions = np.sort(likeliest[(mix[likeliest] > 0) | (likeliest == best)])
            omitted = f"{len(mix) - len(actions)} others {1 - mix[actions].sum():.3f}"
        labels = strategies.action_labels[seat]
        label_columns = max(len(labels[action]) for action in actions.tolist())
        bar_columns = min(columns - label_columns - 10, MAX_BAR_COLUMNS)
        for row, action in enumerate(actions.tolist(), y + 1):
            mark, style = (">", "bold") if action == best else (" ", "")
            text = f"{mark} {labels[action]:<{label_columns}} {mix[action]:.3f}"
            canvas.write_text(x, row, text[:columns], style)
            if bar_columns >= 3:
                bar = format_bar(float(mix[action]), bar_columns, options.ascii)
                canvas.write_text(x + label_columns + 9, row, bar, "cyan")
        if omitted and len(actions) < capacity:
            canvas.write_text(x, y + 1 + len(actions), f"  {omitted}"[:columns], "dim")
    return canvas.to_text()


def _scale_curve(curve: Curve) -> tuple[list[float], Axis]:
    """Return the heights of a curve's numbers, and their axis.

    It has a log scale if the numbers differ much in size.
    """
    numbers = [float(number) for number in curve.numbers]
    positive = [number for number in numbers if number > 0]
    if len(positive) < 2 or max(positive) / min(positive) < LOG_RATIO:
        low, high = min(*numbers, 0.0), max(*numbers, 0.0)
        axis = Axis(curve.label, low, high if high > low else low + 1.0)
        return numbers, axis
    heights = [math.log10(max(number, min(positive))) for number in numbers]
    low, high = float(math.floor(min(heights))), float(math.ceil(max(heights)))
    axis = Axis(f"{curve.label} (log scale)", low, high, is_whole=True, tick_format="1e{:+.0f}")
    return heights, axis


def draw_curve(curve: Curve, options: DrawOptions) -> Text:
    """Return a curve over the steps as a plot, or as one row if there is little space."""
    if not curve.numbers:
        return Text("")
    heights, axis = _scale_curve(curve)
    if options.width < MIN_CURVE_COLUMNS + 8 or options.height < MIN_CURVE_ROWS + ROWS_AROUND_AREA:
        return _draw_curve_row(curve, heights, axis, options)
    steps = np.arange(1.0, len(heights) + 1)
    series = Series("", steps, np.array(heights), "points")
    step_axis = Axis("step", 1, max(len(heights), 2), is_whole=True)
    return draw_lines(LinePanel("", step_axis, axis, [series]), options.width, options.height)


def _draw_curve_row(
    curve: Curve, heights: Sequence[float], axis: Axis, options: DrawOptions
) -> Text:
    """Return the name of a curve, its last points as bars, and its last number."""
    number = format_score(float(curve.numbers[-1]))
    columns = max(options.width - len(axis.label) - len(number) - 2, 0)
    last_heights = heights[-columns:] if columns else []
    shares = [(height - axis.low) / (axis.high - axis.low) for height in last_heights]
    bars = format_sparkline(shares, options.ascii)
    row = Text(f"{axis.label} ").append(bars, "cyan").append(f" {number}", "bold")
    row.truncate(options.width)
    return row

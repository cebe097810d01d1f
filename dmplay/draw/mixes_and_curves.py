"""Mixed strategies as bars, and curves of one number for each step."""

import math
from collections.abc import Sequence

import numpy as np
from rich.text import Text

from dmplay.algorithms.step import Curve, StrategyMixes
from dmplay.core.text import format_score
from dmplay.draw.axes import ROWS_AROUND_AREA, Axis
from dmplay.draw.bars import draw_bars, format_sparkline
from dmplay.draw.canvas import join_beside, split_rows
from dmplay.draw.line_plot import draw_lines
from dmplay.draw.options import DrawOptions
from dmplay.draw.panels import BarsPanel, LinePanel, Series

MIN_AGENT_COLUMNS = 26  # columns of an agent's bars from which agents are beside each other
LOG_RATIO = 100.0  # ratio of largest and smallest number from which a curve has a log scale
MIN_CURVE_COLUMNS, MIN_CURVE_ROWS = 16, 4


def draw_strategy_mixes(strategies: StrategyMixes, options: DrawOptions) -> Text:
    """Return the probability of each action of each agent as bars, beside or below each other."""
    agent_count = len(strategies.agents)
    is_beside = options.width >= agent_count * MIN_AGENT_COLUMNS
    columns = options.width // agent_count - 2 if is_beside else options.width
    agent_rows = options.height if is_beside else max(options.height // agent_count, 2)
    drawings = []
    for seat, (agent, mix) in enumerate(zip(strategies.agents, strategies.mixes, strict=True)):
        best = strategies.best_responses[seat] if strategies.best_responses else None
        heading = agent if best is None else f"{agent}  > best response"
        panel = BarsPanel("", strategies.action_labels[seat], [("", mix)], marked_row=best)
        bars = draw_bars(panel, columns, agent_rows - 1, ascii_only=options.ascii)
        drawings.append([Text(heading[:columns], "bold"), *split_rows(bars)])
    if is_beside:
        starts = range(0, agent_count * (columns + 2), columns + 2)
        return Text("\n").join(join_beside(drawings, starts))
    return Text("\n").join([row for drawing in drawings for row in drawing])


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

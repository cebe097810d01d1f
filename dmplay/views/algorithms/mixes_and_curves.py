"""Mixed strategies as bars, and curves of one number for each step."""

import math

import numpy as np
from rich.text import Text

from dmplay.algorithms.step import Curve, StrategyMixes
from dmplay.core.text import format_score
from dmplay.views.protocol import DrawOptions
from dmplay.views.toolkit.belief_bars import format_bar
from dmplay.views.toolkit.canvas import Canvas
from dmplay.views.toolkit.plots import Axis, Plot

MAX_BAR_COLUMNS = 24
MIN_AGENT_COLUMNS = 26  # columns of an agent's bars from which agents are beside each other
LOG_RATIO = 100.0  # ratio of largest and smallest number from which a curve has a log scale
MIN_CURVE_COLUMNS, MIN_CURVE_ROWS = 16, 4


def draw_strategy_mixes(picture: StrategyMixes, options: DrawOptions) -> Text:
    """Return the probability of each action of each agent as bars.

    If not all actions fit, the most probable ones and the best response are shown.
    """
    agent_count = len(picture.agents)
    is_beside = options.width >= agent_count * MIN_AGENT_COLUMNS
    columns = options.width // agent_count - 2 if is_beside else options.width
    agent_rows = options.height if is_beside else options.height // agent_count
    canvas = Canvas()
    for seat, (agent, mix) in enumerate(zip(picture.agents, picture.mixes, strict=True)):
        x = seat * (columns + 2) if is_beside else 0
        y = 0 if is_beside else seat * agent_rows
        best = picture.best_responses[seat] if picture.best_responses else -1
        heading = f"{agent}  > best response" if best >= 0 else agent
        canvas.write_text(x, y, heading[:columns], "bold")
        capacity = max(agent_rows - 1, 1)
        actions = np.arange(len(mix))
        omitted = ""
        if len(actions) > capacity:
            rank = -mix - 2.0 * (actions == best)
            likeliest = np.argsort(rank, kind="stable")[: max(capacity - 1, 1)]
            actions = np.sort(likeliest[(mix[likeliest] > 0) | (likeliest == best)])
            omitted = f"{len(mix) - len(actions)} others {1 - mix[actions].sum():.3f}"
        labels = picture.action_labels[seat]
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


def draw_curve(picture: Curve, options: DrawOptions) -> Text:
    """Return a curve over the steps; with a log scale if its numbers differ much in size."""
    numbers = [float(number) for number in picture.numbers]
    if not numbers or options.width < MIN_CURVE_COLUMNS + 8 or options.height < MIN_CURVE_ROWS + 3:
        return Text(f"{picture.label} {format_score(numbers[-1])}" if numbers else "")
    positive = [number for number in numbers if number > 0]
    has_log_scale = len(positive) > 1 and max(positive) / min(positive) >= LOG_RATIO
    if has_log_scale:
        floor = min(positive)
        heights = [math.log10(max(number, floor)) for number in numbers]
        low, high = float(math.floor(min(heights))), float(math.ceil(max(heights)))
        axis = Axis(low, high, f"{picture.label} (log scale)", "1e{:+.0f}")
    else:
        heights = numbers
        low, high = min(*numbers, 0.0), max(*numbers, 0.0)
        axis = Axis(low, high if high > low else low + 1.0, picture.label, "{:.3g}")
    labels = max(len(axis.number_format.format(value)) for value in (axis.low, axis.high)) + 2
    last = max(len(numbers), 2)
    plot = Plot(Axis(1, last, "step"), axis, options.width - labels, options.height - 3)
    for step, height in enumerate(heights, 1):
        plot.draw_point(step, height, "●" if step == len(heights) else "∘", "cyan")
    return plot.to_text()

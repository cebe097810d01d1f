"""The panels of watched algorithms, and their drawing in a size."""

import math
from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
from rich.text import Text

from dmplay.algorithms.finite_mdp import format_state_name
from dmplay.algorithms.step import (
    AlphaVectorSet,
    BeliefTable,
    Curve,
    Picture,
    StateValues,
    StrategyMixes,
    TreeNode,
)
from dmplay.core.arrays import Reals
from dmplay.core.hexgrid import HexMap, find_hex_map
from dmplay.core.problem import Problem
from dmplay.core.text import format_count, format_score
from dmplay.draw import theme
from dmplay.draw.axes import Axis
from dmplay.draw.bars import format_sparkline
from dmplay.draw.canvas import to_ascii
from dmplay.draw.options import DrawOptions
from dmplay.draw.panel_text import draw_panels
from dmplay.draw.panels import (
    BarsPanel,
    BeliefMarks,
    GridPanel,
    HexPanel,
    LinePanel,
    Panel,
    PlottedHex,
    Series,
    TablePanel,
    TrianglePanel,
    make_value_axis,
)
from dmplay.draw.search_tree import draw_search_tree

HEX_CAPTION = "* changed  > < formula"
TABLE_CAPTION = "> state of the formula, * changed"
BELIEF_DECIMALS = 4  # as in the formulas
MAX_LISTED_VECTORS = 8  # vectors whose numbers the legend lists
LOG_RATIO = 100.0  # ratio of largest and smallest number from which a curve has a log scale


def draw_algorithm_picture(
    picture: Picture, problem: Problem, options: DrawOptions
) -> tuple[Text, int]:
    """Return a picture of a step, drawn in a size, and the number of panels that it leaves out."""
    drawing, omitted = _draw_picture(picture, problem, options)
    return (to_ascii(drawing) if options.ascii else drawing), omitted


def _draw_picture(picture: Picture, problem: Problem, options: DrawOptions) -> tuple[Text, int]:
    """Return the panels of a picture that fit, or else its text, and the number of others."""
    if isinstance(picture, TreeNode):
        return draw_search_tree(picture, options), 0
    panel_count = 0
    for panels in _iter_panels(picture, problem):
        panel_count = panel_count or len(panels)  # The first alternative has all of them.
        drawing = draw_panels(panels, options.width, options.height, ascii_only=options.ascii)
        if drawing is not None:
            return drawing, panel_count - len(panels)
    if isinstance(picture, Curve):
        return _draw_curve_row(picture, options), 0
    return Text("a picture needs a larger window"[: options.width], "dim"), 0


def _iter_panels(picture: Picture, problem: Problem) -> Iterator[Sequence[Panel]]:
    """Yield the panels of a picture, and then others that need less space."""
    match picture:
        case StateValues():
            if hex_map := find_hex_map(problem):
                yield [build_hex_panel(picture, hex_map)]
            if grids := build_grid_panels(picture, problem):
                yield grids
                yield grids[:1]
            yield [build_state_table(picture, problem)]
        case Curve() if picture.numbers:
            yield [build_curve_panel(picture)]
        case BeliefTable(labels, columns):
            yield [BarsPanel("", labels, columns, "state", decimals=BELIEF_DECIMALS)]
        case AlphaVectorSet():
            if len(picture.state_labels) == 2:
                yield [build_line_panel(picture)]
            if len(picture.state_labels) == 3:
                yield [build_triangle_panel(picture)]
            yield [build_vector_table(picture)]
        case StrategyMixes():
            yield (mixes := build_mixes(picture))
            yield mixes[:1]


def build_hex_panel(state_values: StateValues, hex_map: HexMap) -> HexPanel:
    """Return the map of the values and actions; exits have a sign in place of the action."""
    hexes, exits = hex_map
    cells = []
    for state, hex_ in enumerate(hexes):
        action = -1 if state_values.actions is None else int(state_values.actions[state])
        has_changed = state_values.changed is not None and bool(state_values.changed[state])
        kind: Literal["", "gain", "loss"] = ""
        if hex_ in exits:
            kind, action = "gain" if exits[hex_] > 0 else "loss", -1
        directions, value = (action,) * (action >= 0), float(state_values.values[state])
        is_marked = state == state_values.focus
        cells.append(PlottedHex(hex_, value, directions, "", kind, has_changed, is_marked))
    signs = {"◆" if reward > 0 else "✗": None for reward in exits.values()}
    exit_note = f"  {' '.join(sorted(signs))} exit: any action ends the game" * bool(exits)
    return HexPanel("", cells, caption=f"{HEX_CAPTION}{exit_note}")


def build_grid_panels(state_values: StateValues, problem: Problem) -> list[GridPanel]:
    """Return maps of the values and of the actions over two numbers; [] for other states.

    A point of a map is that of the nearest state.
    """
    states, grid = state_values.states, problem.state_grid
    if states.ndim != 2 or states.dtype.kind != "f":
        return []
    positions = [i for i in range(states.shape[1]) if len(np.unique(states[:, i])) > 1]
    names = [f"number {position + 1}" for position in positions]
    if grid:
        positions = [grid.x, grid.y]
        names = [grid.axes[i].name for i in positions]
    if len(positions) != 2:
        return []
    numbers = states[:, positions]
    axis_points = [np.unique(column) for column in numbers.T]
    x, y = (
        Axis(name, float(points[0]), float(points[-1]))
        for name, points in zip(names, axis_points, strict=True)
    )
    cells = tuple(
        np.searchsorted(points, column)
        for points, column in zip(axis_points, numbers.T, strict=True)
    )
    nearest = np.ix_(
        *(
            abs(np.linspace(points[0], points[-1], len(points))[:, None] - points).argmin(axis=1)
            for points in axis_points
        )
    )

    def spread(of_states: Reals) -> Reals:
        """Return the numbers `[S]` of the states at the points `[X, Y]` of the map."""
        at_points = np.full([len(points) for points in axis_points], np.nan)
        at_points[cells] = of_states
        return at_points[nearest]

    focus = state_values.focus
    marks = () if focus is None else ((float(numbers[focus, 0]), float(numbers[focus, 1])),)
    panels = [GridPanel("", x, y, spread(state_values.values), "V", (), marks, "formula")]
    if state_values.actions is not None:
        actions = np.where(state_values.actions < 0, np.nan, state_values.actions)
        labels = problem.actions[0].labels
        panels.append(GridPanel("", x, y, spread(actions), "", labels, marks, "formula"))
    return panels


def build_state_table(state_values: StateValues, problem: Problem) -> TablePanel:
    """Return the table of the states with their values and actions."""
    names = [format_state_name(problem, state) for state in state_values.states]
    columns = [[format_score(value) for value in state_values.values.tolist()]]
    if state_values.actions is not None:
        labels = (*problem.actions[0].labels, "")
        columns.append([labels[action] for action in state_values.actions.tolist()])
    changed = np.zeros(len(names), bool) if state_values.changed is None else state_values.changed
    marks = ["*" if has_changed else " " for has_changed in changed.tolist()]
    if state_values.focus is not None:
        marks[state_values.focus] = ">"
    return TablePanel(
        "", "state", "", names, ["V", "action"][: len(columns)], list(zip(*columns, strict=True)),
        row_marks=marks, focus_row=state_values.focus or 0, caption=TABLE_CAPTION,
    )  # fmt: skip


def measure_belief_table(belief_table: BeliefTable) -> int:
    """Return the minimum number of columns of a table whose labels and headings are whole."""
    headings = [heading for heading, _ in belief_table.columns]
    pitch = max(BELIEF_DECIMALS + 4, *(len(heading) + 2 for heading in headings))
    return max(map(len, [*belief_table.state_labels, "state"])) + pitch * len(headings)


def _format_numbers(numbers: Reals) -> str:
    """Return the numbers of a vector or a belief, joined by commas."""
    return ", ".join(map(format_score, numbers.tolist()))


def _label_vectors(alphas: AlphaVectorSet) -> list[str]:
    """Return the label of each vector, '' for none: its numbers, or else the count of its action.

    Only the first vector that is dominated or not listed has a label.
    """
    needed = np.flatnonzero(~alphas.dominated).tolist()
    names = [alphas.action_labels[index] for index in needed]
    labels = [""] * len(alphas.vectors)
    for index, name in zip(needed, names, strict=True):
        if len(needed) <= MAX_LISTED_VECTORS:
            labels[index] = f"{name} ({_format_numbers(alphas.vectors[index])})"
        elif names.index(name) == needed.index(index):
            labels[index] = f"{name}: {format_count(names.count(name), 'vector')}"
    if alphas.dominated.any():
        labels[int(alphas.dominated.argmax())] = f"{np.count_nonzero(alphas.dominated)} removed"
    return labels


def build_line_panel(alphas: AlphaVectorSet) -> LinePanel:
    """Return the vectors as lines over the probability of the second of two states."""
    actions = list(dict.fromkeys(alphas.action_labels))
    ends, labels = np.array([0.0, 1.0]), _label_vectors(alphas)
    series = [
        Series(labels[index], ends, alphas.vectors[index], "line", actions.index(action), is_thin)
        for index, (action, is_thin) in enumerate(
            zip(alphas.action_labels, alphas.dominated.tolist(), strict=True)
        )
    ]
    rules = [] if alphas.belief is None else [(float(alphas.belief[1]), "belief")]
    return LinePanel(
        "", Axis(f"P({alphas.state_labels[1]})", 0.0, 1.0), make_value_axis("V", alphas.vectors),
        sorted(series, key=lambda series: series.is_thin), rules=rules,
        legend_title=f"({', '.join(alphas.state_labels)})",
    )  # fmt: skip


def build_triangle_panel(alphas: AlphaVectorSet) -> TrianglePanel:
    """Return the regions of the vectors that are best over the beliefs of three states."""
    needed = np.flatnonzero(~alphas.dominated).tolist()
    labels, actions = _label_vectors(alphas), alphas.action_labels
    marks = [] if alphas.belief is None else [BeliefMarks(alphas.belief)]
    return TrianglePanel(
        "", alphas.state_labels, alphas.vectors[needed], [actions[index] for index in needed],
        marks=marks, labels=[labels[index] for index in needed],
    )  # fmt: skip


def build_vector_table(alphas: AlphaVectorSet) -> TablePanel:
    """Return the table of the vectors that are best at some belief; the best one is first."""
    rows = np.flatnonzero(~alphas.dominated).tolist()
    caption = "" if alphas.belief is None else "the vector that is best at the belief is first"
    if alphas.belief is not None:
        rows.sort(key=lambda index: -float(alphas.vectors[index] @ alphas.belief))
    cells = [list(map(format_score, alphas.vectors[index].tolist())) for index in rows]
    names = [alphas.action_labels[index] for index in rows]
    return TablePanel("", "vector", "", names, alphas.state_labels, cells, caption=caption)


def build_mixes(strategies: StrategyMixes) -> list[BarsPanel]:
    """Return the probability of each action of each agent."""
    panels = []
    for seat, (agent, mix) in enumerate(zip(strategies.agents, strategies.mixes, strict=True)):
        best = strategies.best_responses[seat] if strategies.best_responses else None
        title = agent if best is None else f"{agent}  > best response"
        panels.append(BarsPanel(title, strategies.action_labels[seat], [("", mix)], "", best))
    return panels


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


def build_curve_panel(curve: Curve) -> LinePanel:
    """Return a curve over the steps."""
    heights, axis = _scale_curve(curve)
    series = Series("", np.arange(1.0, len(heights) + 1), np.array(heights), "points")
    return LinePanel("", Axis("step", 1, max(len(heights), 2), is_whole=True), axis, [series])


def _draw_curve_row(curve: Curve, options: DrawOptions) -> Text:
    """Return the name of a curve, its last points as bars, and its last number."""
    if not curve.numbers:
        return Text()
    heights, axis = _scale_curve(curve)
    number = format_score(float(curve.numbers[-1]))
    columns = max(options.width - len(axis.label) - len(number) - 2, 0)
    last_heights = heights[-columns:] if columns else []
    shares = [(height - axis.low) / (axis.high - axis.low) for height in last_heights]
    bars = format_sparkline(shares, options.ascii)
    row = Text(f"{axis.label} ").append(bars, theme.DATA).append(f" {number}", "bold")
    row.truncate(options.width)
    return row

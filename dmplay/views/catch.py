"""How catch looks: the curves of figure F.13, the belief over them, what each throw promises."""

from collections.abc import Iterator, Sequence

from rich.text import Text

from dmplay.chance import Reals
from dmplay.problems.catch import CAUGHT, DISTANCES, PROFICIENCIES, Catch
from dmplay.session import View
from dmplay.views._advice import (
    format_forecast_rows,
    format_regret_rows,
    format_significant,
    iter_with_and_without_rows,
)
from dmplay.views._belief import draw_belief_bars, format_bar, format_belief, format_sparkline
from dmplay.views.canvas import Canvas, format_percent
from dmplay.views.style import REGRET_TOLERANCE, DrawOptions, Lesson

KEYS: dict[str, str] = {}  # a distance is typed
NUMBER_STEPS = {"left": -10, "right": 10}  # metres; Enter throws
PROFICIENCY_NAMES = tuple(f"{proficiency} m" for proficiency in PROFICIENCIES)
PLOT_LABEL_COLUMNS, PLOT_DISTANCE_COLUMNS, PLOT_ROWS = (
    6,
    4,
    6,
)  # of the plot: columns before it, a distance, rows from 1.0 to 0.0
HEAT_LABEL_COLUMNS, HEAT_CELL_COLUMNS = (
    20,
    4,
)  # of the rows of heat: columns before them, of a distance
HEAT_STYLES = ("dim", "", "cyan", "bold cyan")  # the styles of a catch from never to always
PAYOFF_CHART_HEIGHTS = (6, 4, 2, 0)  # rows of the columns of what is paid
HEAT_LEGEND = "skill: metres of which half are caught; cells: percent caught"
ACTION_PHRASE = "throw {} m"
PLOT_LEGEND = ("p(caught) by", "proficiency:", "2 is 20 m,", "4 is 40 m ...")


def _read_throw(view: View[Catch], turn: int) -> tuple[str, bool]:
    """The distance of a throw, and whether it was caught."""
    name = view.problem.format_action(view.seat, view.actions[turn])
    return name, int(view.observations[turn + 1]) == CAUGHT


def _compute_expected_rewards(view: View[Catch]) -> Reals:
    """The reward expected of each distance under the belief."""
    return view.belief @ view.problem.catch_probabilities * DISTANCES


def iter_boards(view: View[Catch], options: DrawOptions) -> Iterator[Text]:
    """The curves as rows of heat over columns of what is paid; plots and tables."""
    for high in PAYOFF_CHART_HEIGHTS if options.allow_large else ():
        yield _draw_large_board(view, options, high)
    best = [f"{distance:.0f} m" for distance in DISTANCES]
    after = format_forecast_rows(view, options, PROFICIENCY_NAMES, ACTION_PHRASE)
    yield from iter_with_and_without_rows(
        _iter_small_boards(view, options), [*format_regret_rows(options, best), *after], options
    )


def _draw_large_board(view: View[Catch], options: DrawOptions, chart_rows: int) -> Text:
    """Each proficiency's belief and curve in a row, columns of the pay to expect, the throws."""
    canvas = Canvas()
    canvas.write_text(0, 0, "skill believed throw", "dim")
    _draw_distance_cells(canvas, 0, [f"{distance:.0f}" for distance in DISTANCES], "dim")
    if options.suggested_action is not None:
        _draw_throw_marker(canvas, 0, int(options.suggested_action))
    rows = zip(PROFICIENCY_NAMES, view.belief, view.problem.catch_probabilities, strict=True)
    for y, (name, share, caught) in enumerate(rows, 1):
        canvas.write_text(0, y, name)
        canvas.write_text(5, y, format_bar(float(share), 8, options.ascii), "cyan")
        canvas.write_text(14, y, f"{share:.3f}", "bold")
        heat = format_sparkline([float(chance) for chance in caught], options.ascii)
        for column, (glyph, chance) in enumerate(zip(heat, caught, strict=True)):
            style = HEAT_STYLES[min(int(chance * len(HEAT_STYLES)), len(HEAT_STYLES) - 1)]
            canvas.write_text(
                HEAT_LABEL_COLUMNS + HEAT_CELL_COLUMNS * column + 1,
                y,
                f"{glyph}{100 * chance:2.0f}",
                style,
            )
    y = len(PROFICIENCY_NAMES) + 2
    promises = _compute_expected_rewards(view)
    y = _draw_column_chart(
        canvas, y, promises / promises.max(), chart_rows=chart_rows, style="green", options=options
    )
    canvas.write_text(0, y, "pays on average")
    _draw_distance_cells(canvas, y, [f"{promise:.0f}" for promise in promises], "bold")
    if options.regret is not None:
        shares = options.regret / (options.regret.max() or 1.0)
        y = _draw_column_chart(canvas, y + 1, shares, chart_rows=1, style="yellow", options=options)
        canvas.write_text(0, y, "loses (● is best)")
        _draw_distance_cells(
            canvas, y, [_format_regret_cell(lost) for lost in options.regret], "yellow"
        )
    rows_ = format_forecast_rows(view, options, PROFICIENCY_NAMES, ACTION_PHRASE) or [HEAT_LEGEND]
    _draw_past_throws(view, canvas, y + 2, options)
    for row, words_ in enumerate(rows_, y + 3 + bool(options.forecast)):
        canvas.write_text(0, row, words_, "" if options.forecast else "dim")
    return canvas.to_text()


def _format_regret_cell(regret: float) -> str:
    """What is lost, in three columns; a dot where nothing is."""
    return "●" if regret < REGRET_TOLERANCE else format_significant(regret, 3)


def _draw_distance_cells(canvas: Canvas, y: int, cells: Sequence[str], style: str) -> None:
    """A text a distance, at the right of its columns."""
    for column, cell in enumerate(cells):
        canvas.write_text(
            HEAT_LABEL_COLUMNS + HEAT_CELL_COLUMNS * column, y, cell.rjust(HEAT_CELL_COLUMNS), style
        )


def _draw_throw_marker(canvas: Canvas, y: int, throw: int) -> None:
    """The distance of a hint, or the one that is written, between arrows."""
    told = f"→{DISTANCES[throw]:.0f}←"
    canvas.write_text(
        HEAT_LABEL_COLUMNS + HEAT_CELL_COLUMNS * (throw + 1) + 1 - len(told), y, told, "bold green"
    )


def describe_expected_reward(view: View[Catch], throw: float) -> str:
    """Which throw an action is, how likely it is caught, and what it pays on average."""
    distance, promise = DISTANCES[int(throw)], float(_compute_expected_rewards(view)[int(throw)])
    caught = format_percent(promise / distance)
    return f"throws {distance:.0f} m: caught {caught}, pays {promise:.0f} on average"


def _draw_column_chart(  # noqa: PLR0913 - a place on the canvas, and what goes there
    canvas: Canvas, y: int, fractions: Reals, *, chart_rows: int, style: str, options: DrawOptions
) -> int:
    """A column a distance, so many rows high; the row after them."""
    for row in range(chart_rows):
        parts = [
            min(max(chart_rows * float(share) - (chart_rows - 1 - row), 0.0), 1.0)
            for share in fractions
        ]
        blocks = zip(format_sparkline(parts, options.ascii), parts, strict=True)
        _draw_distance_cells(
            canvas, y + row, [2 * glyph if part > 0.0 else "" for glyph, part in blocks], style
        )
    return y + chart_rows


def _iter_small_boards(view: View[Catch], options: DrawOptions) -> Iterator[Text]:
    """The plot with the belief beside it, or below; a table; the table with the belief in a row."""
    wide = PLOT_LABEL_COLUMNS + PLOT_DISTANCE_COLUMNS * len(DISTANCES)
    for beside in (True, False):
        canvas = Canvas()
        y = _draw_catch_plot(view, canvas)
        if beside:
            _draw_belief_bars(view, canvas, wide + 18, 0, options)
        else:
            y = _draw_belief_bars(view, canvas, 0, y + 1, options)
        _draw_past_throws(view, canvas, y + beside, options)
        yield canvas.to_text()
    for full in (True, False):
        canvas = Canvas()
        y = _draw_distance_table(view, canvas)
        if full:
            y = draw_belief_bars(
                canvas, y, PROFICIENCY_NAMES, view.belief, options._replace(width=34)
            )
        else:
            pairs = zip(PROFICIENCIES, view.belief, strict=True)
            canvas.write_text(0, y, "  ".join(f"{name}: {share:.2f}" for name, share in pairs))
            y += 1
        _draw_past_throws(view, canvas, y, options)
        yield canvas.to_text()


def _draw_catch_plot(view: View[Catch], canvas: Canvas) -> int:
    """The probability of a catch by distance, a digit a proficiency: 2 is 20 m."""
    for row in range(PLOT_ROWS + 1):
        label = {0: "1.0 ┤", PLOT_ROWS // 2: "0.5 ┤", PLOT_ROWS: "0.0 ┤"}.get(row, "    │")
        canvas.write_text(0, row, label, "dim")
    foot = PLOT_ROWS + 1
    right = PLOT_LABEL_COLUMNS + PLOT_DISTANCE_COLUMNS * len(DISTANCES) + 2
    for row, words_ in enumerate(PLOT_LEGEND):
        canvas.write_text(right, row, words_, "dim")
    canvas.write_text(right, foot + 2, "expected", "dim")
    canvas.write_text(4, foot, "└" + "─" * (PLOT_DISTANCE_COLUMNS * len(DISTANCES) + 1), "dim")
    canvas.write_text(0, foot + 1, "metres", "dim")
    canvas.write_text(0, foot + 2, "pays")
    for column, (distance, promise) in enumerate(
        zip(DISTANCES, _compute_expected_rewards(view), strict=True)
    ):
        x = PLOT_LABEL_COLUMNS + column * PLOT_DISTANCE_COLUMNS
        marks: dict[int, str] = {}
        for proficiency, caught in zip(
            PROFICIENCIES, view.problem.catch_probabilities, strict=True
        ):
            row = round(PLOT_ROWS * (1.0 - float(caught[column])))
            marks[row] = marks.get(row, "") + str(proficiency // 10)
        for row, digits in marks.items():
            canvas.write_text(x, row, digits.rjust(PLOT_DISTANCE_COLUMNS), "cyan")
        canvas.write_text(x, foot + 1, f"{distance:{PLOT_DISTANCE_COLUMNS}.0f}", "dim")
        canvas.write_text(x, foot + 2, f"{promise:{PLOT_DISTANCE_COLUMNS}.0f}", "bold")
    return foot + 3


def _draw_belief_bars(
    view: View[Catch], canvas: Canvas, x: int, y: int, options: DrawOptions
) -> int:
    """The belief in bars at any place; the row after it."""
    drawn = Canvas()
    draw_belief_bars(
        drawn, 0, PROFICIENCY_NAMES, view.belief, options._replace(width=min(options.width, 36))
    )
    canvas.write_text(x, y, "belief in the proficiency", "dim")
    for row, line in enumerate(drawn.to_text().split("\n")):
        canvas.write_text(x, y + 1 + row, line.plain, "cyan")
    return y + 1 + len(PROFICIENCY_NAMES)


def _draw_distance_table(view: View[Catch], canvas: Canvas) -> int:
    """Distances, the probability of a catch in percent, and the reward to expect."""
    caught = view.belief @ view.problem.catch_probabilities
    rows = [
        ("metres", DISTANCES),
        ("caught %", caught * 100),
        ("expected", _compute_expected_rewards(view)),
    ]
    for y, (name, values) in enumerate(rows):
        canvas.write_text(0, y, name, "dim")
        for column, value in enumerate(values):
            canvas.write_text(
                8 + 3 * column, y, f"{value:{4 if column == 9 else 3}.0f}", "bold" * (y == 2)
            )
    return len(rows)


def _draw_past_throws(view: View[Catch], canvas: Canvas, y: int, options: DrawOptions) -> None:
    """The last throws, and once it is told the truth."""
    thrown = [_read_throw(view, turn) for turn in range(view.turns_played)]
    words_ = [f"{name}{'✓' if caught else '✗'}" for name, caught in thrown]
    truth = (
        ""
        if options.revealed_state is None
        else f"truly {PROFICIENCY_NAMES[int(options.revealed_state)]}  "
    )
    while words_ and len(truth) + 7 + len(" ".join(words_)) > options.width:
        words_ = words_[1:]
    canvas.write_text(0, y, truth, "bold magenta")
    canvas.write_text(len(truth), y, "throws " + (" ".join(words_) or "none yet"))


def goal_lines(view: View[Catch]) -> list[str]:
    """What a throw pays, and what is not known."""
    return [
        "throw far: a catch pays its metres",
        "a drop nothing",
        "how far the other can catch is hidden",
    ]


def lesson(view: View[Catch]) -> Lesson:
    """Who throws to whom, what pays, and what a throw costs."""
    limit = f"one of your {view.turn_limit} throws" if view.turn_limit else "a turn"
    return Lesson(
        f"You throw a ball, {DISTANCES[0]:g} to {DISTANCES[-1]:g} m far, to somebody whose skill "
        "you do not know",
        "You want long throws that are caught: a catch pays its metres, a drop nothing",
        f"A throw costs nothing but {limit}; each catch and each drop tells how good the other is",
        "60",
    )


def panel_rows(view: View[Catch]) -> list[tuple[str, str]]:
    """What the last throw paid, the sum, and the discount."""
    rewards = view.rewards or ()
    return [
        ("reward", f"{rewards[-1]:g}" if rewards else "-"),
        ("total", f"{sum(rewards):g}"),
        ("discount", f"{view.problem.discount:.2f}"),
    ]


def describe_turn(view: View[Catch]) -> str:
    """Caught or dropped, how far it was, what to believe."""
    name, caught = _read_throw(view, view.turns_played - 1)
    likeliest = format_belief(PROFICIENCY_NAMES, view.belief).partition(",")[0]
    return (
        f"{'caught' if caught else 'dropped'}. threw {name} m. proficiency likeliest {likeliest}."
    )


def describe_situation(view: View[Catch]) -> str:
    """The last throw, the belief, and the reward to expect of each distance."""
    each = zip(DISTANCES, _compute_expected_rewards(view), strict=True)
    promises = ", ".join(f"{distance:.0f} m {promise:.1f}" for distance, promise in each)
    before = "no throw yet."
    if view.turns_played:
        name, caught = _read_throw(view, view.turns_played - 1)
        before = f"{'caught' if caught else 'dropped'} {name} m."
    belief = f"belief in the proficiency: {format_belief(PROFICIENCY_NAMES, view.belief)}."
    return f"{before} {belief} expected reward: {promises}."

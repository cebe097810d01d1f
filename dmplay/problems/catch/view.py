"""The view of catch: the curves of figure F.13, the belief over them, the expected rewards."""

from collections.abc import Iterator, Sequence
from functools import partial

from rich.text import Text

from dmplay.core.arrays import Reals
from dmplay.core.session import View
from dmplay.core.text import format_count, format_reward
from dmplay.draw import theme
from dmplay.draw.action_hints import (
    format_forecast_rows,
    format_regret_rows,
    format_significant,
    iter_with_and_without_rows,
)
from dmplay.draw.bars import (
    count_eighths,
    draw_bars,
    draw_belief_bars,
    format_bar,
    format_belief,
    format_column,
    format_sparkline,
)
from dmplay.draw.canvas import Canvas, format_percent
from dmplay.draw.options import DrawOptions
from dmplay.draw.panels import BarsPanel
from dmplay.views.protocol import FinishedGame, Lesson

from .rules import CAUGHT, DISTANCES, PROFICIENCIES, Catch

NEEDS_BELIEF = True  # no board hides the belief
KEYS: dict[str, str] = {}  # The player types a distance.
NUMBER_NAME = "throw"
NUMBER_STEPS = {"left": -10, "right": 10}  # steps in metres; Enter throws
PROFICIENCY_NAMES = tuple(f"{proficiency} m" for proficiency in PROFICIENCIES)
# columns before the plot, columns of a distance, rows from 1.0 to 0.0
PLOT_LABEL_COLUMNS, PLOT_DISTANCE_COLUMNS, PLOT_ROWS = 6, 4, 6
HEAT_LABEL_COLUMNS = 20  # columns before the heat map
# styles of catch probabilities from 0 to 1
HEAT_STYLES = ("dim", "", theme.DATA, theme.STRONG_DATA)
# columns of a distance in the heat map, and rows of the expected-reward chart, tried in this order
LARGE_LAYOUTS = ((12, 30), (7, 20), (4, 6), (4, 4), (4, 2), (4, 0))
HEAT_LEGEND = "% caught at each distance in m (50% if the distance equals the skill)"
SMALL_REGRET = 0.095  # smaller regrets are printed with two decimals
ACTION_PHRASE = "throw {} m"
PLOT_LEGEND = ("chance of catch", "2: skill 20 m", "4: skill 40 m", "and so on")


def _get_throw(view: View[Catch], turn: int) -> tuple[str, bool]:
    """Return the distance of a throw, and whether it was caught."""
    name = view.problem.format_action(view.seat, view.actions[turn])
    return name, int(view.observations[turn + 1]) == CAUGHT


def _compute_expected_rewards(view: View[Catch]) -> Reals:
    """Return the expected reward of each distance under the belief."""
    return view.belief @ view.problem.success_probabilities * DISTANCES


def iter_boards(view: View[Catch], options: DrawOptions) -> Iterator[Text]:
    """Yield the boards, largest first: heat maps with a reward chart, then plots, then tables."""
    for cell_columns, chart_rows in LARGE_LAYOUTS if options.allow_large else ():
        yield _draw_large_board(view, options, cell_columns, chart_rows)
    rows = [
        *format_regret_rows(options, [f"{distance:.0f} m" for distance in DISTANCES]),
        *format_forecast_rows(view, options, PROFICIENCY_NAMES, ACTION_PHRASE),
    ]
    yield from iter_with_and_without_rows(_iter_small_boards(view, options), rows, options)


def _draw_large_board(
    view: View[Catch], options: DrawOptions, cell_columns: int, chart_rows: int
) -> Text:
    """Draw each proficiency's belief and curve, the reward chart and the last throws.

    With a hint the regrets are added, with a forecast its outcomes.
    """
    canvas = Canvas()
    canvas.write_text(0, 0, HEAT_LEGEND, "dim")
    canvas.write_text(0, 1, "skill        belief", "dim")
    distance_names = [f"{distance:.0f}" for distance in DISTANCES]
    _draw_distance_cells(canvas, 1, distance_names, "dim", cell_columns)
    if options.typed_action is not None:
        throw = int(options.typed_action)
        marker = f"→{DISTANCES[throw]:.0f}←"
        x = HEAT_LABEL_COLUMNS + cell_columns * (throw + 1) + 1 - len(marker)
        canvas.write_text(x, 1, marker, theme.BEST)
    rows = zip(PROFICIENCY_NAMES, view.belief, view.problem.success_probabilities, strict=True)
    for y, (name, probability, catch_probabilities) in enumerate(rows, 2):
        canvas.write_text(0, y, name)
        canvas.write_text(5, y, format_bar(float(probability), 8, options.ascii), theme.DATA)
        canvas.write_text(14, y, f"{probability:.3f}", "bold")
        glyphs = format_sparkline(catch_probabilities.tolist(), options.ascii)
        cells = zip(glyphs, catch_probabilities.tolist(), strict=True)
        for column, (glyph, chance) in enumerate(cells, 1):
            style = HEAT_STYLES[min(int(chance * len(HEAT_STYLES)), len(HEAT_STYLES) - 1)]
            x = HEAT_LABEL_COLUMNS + cell_columns * column - 3
            canvas.write_text(x, y, f"{glyph}{100 * chance:2.0f}", style)
    y = len(PROFICIENCY_NAMES) + 2
    draw_columns = partial(
        _draw_column_chart, canvas, cell_columns=cell_columns, ascii_only=options.ascii
    )
    expected_rewards = _compute_expected_rewards(view)
    y = draw_columns(y, expected_rewards / expected_rewards.max(), chart_rows, theme.CHOICE)
    canvas.write_text(0, y, "expected reward")
    reward_texts = [f"{expected_reward:.0f}" for expected_reward in expected_rewards]
    _draw_distance_cells(canvas, y, reward_texts, "bold", cell_columns)
    if options.regret is not None:
        regret_fractions = options.regret / (options.regret.max() or 1.0)
        y = draw_columns(y + 1, regret_fractions, max(chart_rows // 6, 1), theme.REGRET)
        canvas.write_text(0, y, "value below best")
        regret_texts = [_format_regret_cell(regret) for regret in options.regret]
        _draw_distance_cells(canvas, y, regret_texts, theme.REGRET, cell_columns)
    bottom_rows = format_forecast_rows(view, options, PROFICIENCY_NAMES, ACTION_PHRASE)
    _draw_past_throws(view, canvas, y + 2, options)
    canvas.write_rows(y + 3 + bool(options.forecast), bottom_rows)
    return canvas.to_text()


def _format_regret_cell(regret: float) -> str:
    """Format a regret in three columns."""
    if 0.0 < regret < SMALL_REGRET:
        return f"{regret:.2f}".removeprefix("0").replace(".00", "~0")
    return format_significant(regret, 3)


def _draw_distance_cells(
    canvas: Canvas, y: int, cells: Sequence[str], style: str, cell_columns: int
) -> None:
    """Draw one text for each distance, aligned right in its columns."""
    for column, cell in enumerate(cells):
        x = HEAT_LABEL_COLUMNS + cell_columns * column
        canvas.write_text(x, y, cell.rjust(cell_columns), style)


def describe_expected_reward(view: View[Catch], throw: float) -> str:
    """Describe a throw: its catch probability and expected reward."""
    expected_reward = float(_compute_expected_rewards(view)[int(throw)])
    catch_percent = format_percent(expected_reward / DISTANCES[int(throw)])
    return f"caught in {catch_percent} of cases; expected reward {expected_reward:.0f}"


def _draw_column_chart(  # noqa: PLR0913 - a canvas, a position and the content
    canvas: Canvas,
    y: int,
    fractions: Reals,
    chart_rows: int,
    style: str,
    *,
    cell_columns: int,
    ascii_only: bool,
) -> int:
    """Draw a column for each distance, a fraction of `chart_rows` high; return the next row."""
    for number, fraction in enumerate(fractions.tolist()):
        x = HEAT_LABEL_COLUMNS + cell_columns * number + 2
        for row, glyph in enumerate(format_column(count_eighths(fraction, chart_rows), ascii_only)):
            canvas.write_text(x, y + chart_rows - 1 - row, glyph * (cell_columns - 2), style)
    return y + chart_rows


def _iter_small_boards(view: View[Catch], options: DrawOptions) -> Iterator[Text]:
    """Yield the plot with the belief beside or below, then tables with bars or numbers."""
    plot_columns = PLOT_LABEL_COLUMNS + PLOT_DISTANCE_COLUMNS * len(DISTANCES)
    for is_beside in (True, False):
        canvas = Canvas()
        y = _draw_catch_plot(view, canvas)
        if is_beside:
            _draw_belief_bars(view, canvas, plot_columns + 18, 0, options)
        else:
            y = _draw_belief_bars(view, canvas, 0, y + 1, options)
        _draw_past_throws(view, canvas, y + is_beside, options)
        yield canvas.to_text()
    for has_bars in (True, False):
        canvas = Canvas()
        y = _draw_distance_table(view, canvas)
        if has_bars:
            narrow = options._replace(width=34)
            y = draw_belief_bars(canvas, y, PROFICIENCY_NAMES, view.belief, narrow)
        else:
            pairs = zip(PROFICIENCIES, view.belief, strict=True)
            y = canvas.write_rows(y, ["  ".join(f"{name}: {p:.2f}" for name, p in pairs)])
        _draw_past_throws(view, canvas, y, options)
        yield canvas.to_text()


def _draw_catch_plot(view: View[Catch], canvas: Canvas) -> int:
    """Draw the catch probability by distance, with a digit for each proficiency: 2 is 20 m.

    The expected rewards are below. Return the next row.
    """
    for row in range(PLOT_ROWS + 1):
        label = {0: "1.0 ┤", PLOT_ROWS // 2: "0.5 ┤", PLOT_ROWS: "0.0 ┤"}.get(row, "    │")
        canvas.write_text(0, row, label, "dim")
    axis_row = PLOT_ROWS + 1
    legend_column = PLOT_LABEL_COLUMNS + PLOT_DISTANCE_COLUMNS * len(DISTANCES) + 2
    for row, legend_text in enumerate(PLOT_LEGEND):
        canvas.write_text(legend_column, row, legend_text, "dim")
    canvas.write_text(legend_column, axis_row + 2, "expected", "dim")
    canvas.write_text(4, axis_row, "└" + "─" * (PLOT_DISTANCE_COLUMNS * len(DISTANCES) + 1), "dim")
    canvas.write_text(0, axis_row + 1, "metres", "dim")
    canvas.write_text(0, axis_row + 2, "reward")
    rewards = zip(DISTANCES, _compute_expected_rewards(view), strict=True)
    for column, (distance, expected_reward) in enumerate(rewards):
        x = PLOT_LABEL_COLUMNS + column * PLOT_DISTANCE_COLUMNS
        digits_by_row: dict[int, str] = {}
        chances = view.problem.success_probabilities[:, column].tolist()
        for proficiency, chance in zip(PROFICIENCIES, chances, strict=True):
            row = round(PLOT_ROWS * (1.0 - chance))
            digits_by_row[row] = digits_by_row.get(row, "") + str(proficiency // 10)
        for row, digits in digits_by_row.items():
            canvas.write_text(x, row, digits.rjust(PLOT_DISTANCE_COLUMNS), theme.DATA)
        canvas.write_text(x, axis_row + 1, f"{distance:{PLOT_DISTANCE_COLUMNS}.0f}", "dim")
        canvas.write_text(x, axis_row + 2, f"{expected_reward:{PLOT_DISTANCE_COLUMNS}.0f}", "bold")
    return axis_row + 3


def _draw_belief_bars(
    view: View[Catch], canvas: Canvas, x: int, y: int, options: DrawOptions
) -> int:
    """Draw the belief as bars at a position; return the next row."""
    canvas.write_text(x, y, "belief: skill", "dim")
    panel = BarsPanel("", PROFICIENCY_NAMES, [("", view.belief)])
    bars = draw_bars(panel, min(options.width, 36), ascii_only=options.ascii)
    return canvas.write_canvas(x, y + 1, bars)


def _draw_distance_table(view: View[Catch], canvas: Canvas) -> int:
    """Draw the distances, their catch probabilities in percent and their expected rewards.

    Return the next row.
    """
    catch_probabilities = view.belief @ view.problem.success_probabilities
    rows = [
        ("metres", DISTANCES),
        ("caught %", catch_probabilities * 100),
        ("expected", _compute_expected_rewards(view)),
    ]
    for y, (name, values) in enumerate(rows):
        canvas.write_text(0, y, name, "dim")
        for column, value in enumerate(values):
            text = f"{value:{4 if column == 9 else 3}.0f}"
            canvas.write_text(8 + 3 * column, y, text, "bold" * (y == 2))
    return len(rows)


def _draw_past_throws(view: View[Catch], canvas: Canvas, y: int, options: DrawOptions) -> None:
    """Draw the last throws, after the true proficiency once it may be shown."""
    throws = [_get_throw(view, turn) for turn in range(view.turns_played)]
    throw_texts = [f"{name}{'✓' if caught else '✗'}" for name, caught in throws]
    truth = ""
    if options.revealed_state is not None:
        truth = f"true skill {PROFICIENCY_NAMES[int(options.revealed_state)]}  "
    while throw_texts and len(truth) + 7 + len(" ".join(throw_texts)) > options.width:
        throw_texts = throw_texts[1:]
    canvas.write_text(0, y, truth, theme.TRUTH)
    canvas.write_text(len(truth), y, "throws " + (" ".join(throw_texts) or "nothing yet"))


def goal_lines(view: View[Catch]) -> list[str]:
    """Return the goal, with the hidden proficiency, and the reward of a catch."""
    first, second, *_, last = DISTANCES
    return [
        "throw far to a catcher of unknown skill",
        "a catch pays 1 per metre, a drop 0",
        f"a throw is {first:g} to {last:g} metres, in steps of {second - first:g}",
    ]


def lesson(view: View[Catch]) -> Lesson:
    """Return the lesson: the thrower and the catcher, the reward, and the cost of a throw."""
    limit = f"one of your {view.turn_limit} throws" if view.turn_limit else "a turn"
    return Lesson(
        f"You throw a ball {DISTANCES[0]:g} to {DISTANCES[-1]:g} m far, to a catcher whose skill "
        "you do not know",
        "You want long throws that are caught: a catch pays 1 per metre, a drop nothing",
        f"A throw is free but uses {limit}; each catch or drop is a clue to the catcher's skill",
        "60",
        "with a skill of {} m",
        "skill {} m",
        (
            "With a skill of s metres, a throw of d metres is caught with probability "
            f"1 / (1 + exp((d - s) / {view.problem.falloff:g}))",
            "The skill never changes",
        ),
    )


def panel_rows(view: View[Catch]) -> list[tuple[str, str]]:
    """Return the side panel's rows: the last reward, the total, and the discount."""
    rewards = view.rewards or ()
    return [
        ("reward", format_reward(rewards[-1]) if rewards else "-"),
        ("total", f"{sum(rewards):g}"),
        ("discount", f"{view.problem.discount:.2f}"),
    ]


def describe_turn(view: View[Catch]) -> str:
    """Describe the last throw: its distance, its result and the likeliest skill, or several."""
    name, caught = _get_throw(view, view.turns_played - 1)
    percents = [format_percent(p) for p in view.belief]
    highest = percents[int(view.belief.argmax())]
    pairs = zip(PROFICIENCY_NAMES, percents, strict=True)
    likeliest = [skill for skill, percent in pairs if percent == highest]
    share = f"{highest} each" if len(likeliest) > 1 else highest
    result = "caught" if caught else "dropped"
    return f"threw {name} m: {result}. likeliest skill {' or '.join(likeliest)} ({share})."


def describe_situation(view: View[Catch]) -> str:
    """Describe the last throw, the belief, and the expected reward of each distance."""
    pairs = zip(DISTANCES, _compute_expected_rewards(view), strict=True)
    rewards_text = ", ".join(f"{distance:.0f} m {reward:.1f}" for distance, reward in pairs)
    last_throw = "threw nothing yet."
    if view.turns_played:
        name, caught = _get_throw(view, view.turns_played - 1)
        last_throw = f"threw {name} m: {'caught' if caught else 'dropped'}."
    belief = f"belief about the skill: {format_belief(PROFICIENCY_NAMES, view.belief)}."
    return f"{last_throw} {belief} expected reward: {rewards_text}."


def describe_end(game: FinishedGame[Catch]) -> str:
    """Return the number of throws and of catches, their metres, and the throw for this skill."""
    caught = int((game.observations[:, 0] == CAUGHT).sum())
    balls, metres = format_count(len(game.actions), "ball"), f"{game.rewards.sum():g}"
    verb = "was" if caught == 1 else "were"
    skill = int(game.states[-1])
    best = DISTANCES[int((game.problem.success_probabilities[skill] * DISTANCES).argmax())]
    advice = f"for a skill of {PROFICIENCY_NAMES[skill]}, throws of {best:g} m pay most"
    return (
        f"{game.player} threw {balls}; {caught} {verb} caught, for {metres} m; {advice} on "
        "average, but the skill was hidden"
    )

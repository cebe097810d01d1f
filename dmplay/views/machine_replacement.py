"""How the machine looks: what was seen, the belief as bars and in a triangle, and prospects."""

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from rich.text import Text

from dmplay.chance import Reals
from dmplay.problems.machine_replacement import MachineReplacement
from dmplay.session import View
from dmplay.solvers.alpha_vectors import (
    AlphaVectorStage,
    compute_action_values,
    solve_finite_horizon,
)
from dmplay.solvers.value_iteration import mark_best_actions
from dmplay.tabular import tabulate
from dmplay.views import crying_baby
from dmplay.views._advice import (
    format_forecast_rows,
    format_regret_rows,
    format_regret_with_bar,
    iter_with_and_without_rows,
    list_action_keys,
    rank_actions,
)
from dmplay.views._belief import draw_belief_bars, draw_true_state, format_belief, format_sparkline
from dmplay.views.canvas import Canvas
from dmplay.views.generic import format_last_observation
from dmplay.views.style import DrawOptions, Lesson

MAX_HISTORY_TURNS = 40  # turns of it that are drawn
KEYS = {"m": "manufacture", "e": "examine", "i": "interrupt", "r": "replace"}
STATE_NAMES = ("0 failed", "1 failed", "2 failed")
BELIEF_COLUMNS, SMALL_TRIANGLE_COLUMNS = 36, 21  # columns
TALL_TRIANGLE_ROWS, REGRET_BAR_COLUMNS = (
    11,
    8,
)  # rows of the tall triangle; columns of a bar of what is lost
TRIANGLE_LEGEND = (
    "● the belief, · before: the nearer a",
    "corner, the likelier that many failed;",
    "Tab writes what is best where",
)
REGION_LEGEND = (
    "● the belief; letters: the best key",
    "at a belief that is where they stand,",
    "with the turns that are left",
)
REGION_STYLES = ("dim", "cyan", "magenta", "yellow")  # the style of each action
MAX_PLANNED_TURNS = 40  # turns that are planned for the regions
APEX_COLUMN, BASE_ROW = 10, 4  # of the triangle: the column of its top, the row of its base


def _compute_expected_rewards(
    view: View[MachineReplacement], options: DrawOptions
) -> list[tuple[str, str, float]]:
    """Key, action and the reward expected of it at once, under the belief."""
    each = view.belief @ view.problem.tables.rewards[:, :, 0]
    return [
        (options.keys_by_action.get(name, key), name, float(reward))
        for (key, name), reward in zip(KEYS.items(), each, strict=True)
    ]


def iter_boards(view: View[MachineReplacement], options: DrawOptions) -> Iterator[Text]:
    """Everything with a triangle that explains itself; with a small one; without; in few rows."""
    if options.allow_large:
        yield _draw_large_board(view, options)
    after = format_forecast_rows(view, options, view.problem.state_names)
    yield from iter_with_and_without_rows(
        _iter_small_boards(view, options),
        [*format_regret_rows(options, list_action_keys(KEYS, options)), *after],
        options,
    )


def _iter_small_boards(view: View[MachineReplacement], options: DrawOptions) -> Iterator[Text]:
    """Everything with the triangle; without it; the bars and one line of prospects."""
    for triangle in (True, False):
        canvas = Canvas()
        y = _draw_observation_and_belief(view, options, canvas, 2)
        if triangle:
            _draw_small_triangle(canvas, BELIEF_COLUMNS + 4, view.belief)
        _draw_belief_history(view, canvas, y, options)
        canvas.write_text(0, y + 2, "reward expected at once", "dim")
        for number, (key, name, reward) in enumerate(_compute_expected_rewards(view, options)):
            canvas.write_text(0, y + 3 + number, f"{key} {name:<11} {reward:+.3f}")
        draw_true_state(canvas, y + 8, STATE_NAMES, options)
        yield canvas.to_text()
    canvas = Canvas()
    y = _draw_observation_and_belief(view, options, canvas, 1)
    line = "  ".join(
        f"{key} {reward:+.2f}" for key, _, reward in _compute_expected_rewards(view, options)
    )
    canvas.write_text(0, y, line)
    draw_true_state(canvas, y + 1, STATE_NAMES, options)
    yield canvas.to_text()


def _draw_belief_history(
    view: View[MachineReplacement], canvas: Canvas, y: int, options: DrawOptions
) -> None:
    """How the belief in a failure moved."""
    title = "history of a failure "
    room = max(min(MAX_HISTORY_TURNS, options.width - len(title)), 1)
    failed = [1.0 - float(b[0]) for b in (view.beliefs or ())[-room:]]
    canvas.write_text(0, y, title, "dim")
    canvas.write_text(len(title), y, format_sparkline(failed, options.ascii), "cyan")


def _draw_large_board(view: View[MachineReplacement], options: DrawOptions) -> Text:
    """What is known at the left, with what each action loses; at the right the tall triangle."""
    canvas = Canvas()
    y = _draw_observation_and_belief(view, options, canvas, 2)
    _draw_belief_history(
        view, canvas, y, options._replace(width=min(options.width, BELIEF_COLUMNS))
    )
    tail = "; in the end" if options.regret is not None else ""
    canvas.write_text(0, y + 2, f"expected at once{tail}", "dim")
    prospects = _compute_expected_rewards(view, options)
    for row, action in enumerate(rank_actions(options, len(prospects)), y + 3):
        key, name, reward = prospects[action]
        canvas.write_text(0, row, f"{key} {name:<11} {reward:+.3f}")
        canvas.write_text(
            21, row, format_regret_with_bar(options, action, REGRET_BAR_COLUMNS), "yellow"
        )
    draw_true_state(canvas, y + 7, STATE_NAMES, options)
    open_ = (
        TRIANGLE_LEGEND if view.rewards is None else TRIANGLE_LEGEND[:-1]
    )  # no hint is given after the end
    legend = open_ if options.regret is None else REGION_LEGEND
    for row, words_ in enumerate(
        format_forecast_rows(view, options, view.problem.state_names) or legend, y + 8
    ):
        canvas.write_text(0, row, words_, "" if options.forecast else "dim")
    _draw_tall_triangle(view, canvas, BELIEF_COLUMNS + 2, options)
    return canvas.to_text()


def _draw_tall_triangle(
    view: View[MachineReplacement], canvas: Canvas, x: int, options: DrawOptions
) -> None:
    """The tall triangle: its corners by name, the beliefs so far, the present, those to come."""
    for row in range(1, TALL_TRIANGLE_ROWS):
        canvas.write_text(x + TALL_TRIANGLE_ROWS - row, row + 1, "╱", "dim")
        canvas.write_text(x + TALL_TRIANGLE_ROWS + row, row + 1, "╲", "dim")
    canvas.write_text(x, TALL_TRIANGLE_ROWS + 1, "─" * (2 * TALL_TRIANGLE_ROWS + 1), "dim")
    canvas.write_text(x + TALL_TRIANGLE_ROWS - len(STATE_NAMES[0]) // 2, 0, STATE_NAMES[0])
    canvas.write_text(x, TALL_TRIANGLE_ROWS + 2, STATE_NAMES[1])
    if options.regret is not None:
        _draw_policy_regions(view, canvas, x, options)
    canvas.write_text(
        x + 2 * TALL_TRIANGLE_ROWS + 1 - len(STATE_NAMES[2]), TALL_TRIANGLE_ROWS + 2, STATE_NAMES[2]
    )
    to_come = options.forecast.beliefs if options.forecast else None
    marks = [(belief, "·", "cyan") for belief in view.beliefs or ()]
    marks += [(belief, "○", "bold yellow") for belief in ([] if to_come is None else to_come)]
    for belief, glyph, style in [*marks, (view.belief, "●", "bold cyan")]:
        column = round(TALL_TRIANGLE_ROWS * (1.0 + float(belief[2] - belief[1])))
        canvas.write_text(
            x + column, 1 + round(TALL_TRIANGLE_ROWS * float(1.0 - belief[0])), glyph, style
        )


def _draw_policy_regions(
    view: View[MachineReplacement], canvas: Canvas, x: int, options: DrawOptions
) -> None:
    """The key of the best action at beliefs all over the triangle."""
    keys = list_action_keys(KEYS, options)
    places = [
        (row, aside) for row in range(2, TALL_TRIANGLE_ROWS) for aside in range(2 - row, row, 2)
    ]
    failed, skew = np.array(places).T / TALL_TRIANGLE_ROWS
    beliefs = np.stack([1.0 - failed, (failed - skew) / 2, (failed + skew) / 2], axis=1)
    left = (
        MAX_PLANNED_TURNS
        if view.turn_limit is None
        else min(view.turn_limit - view.turns_played, MAX_PLANNED_TURNS)
    )
    stage = _plan_stages(view.problem, left)[-1]
    for (row, aside), action in zip(
        places, mark_best_actions(compute_action_values(stage, beliefs)), strict=True
    ):
        number = int(np.argmax(action))
        canvas.write_text(
            x + TALL_TRIANGLE_ROWS + aside, row + 1, keys[number], REGION_STYLES[number]
        )


@lru_cache(maxsize=MAX_PLANNED_TURNS)
def _plan_stages(problem: MachineReplacement, turns: int) -> list[AlphaVectorStage]:
    """The best plans of so many turns."""
    return solve_finite_horizon(tabulate(problem), problem.discount, turns)


def _draw_observation_and_belief(
    view: View[MachineReplacement], options: DrawOptions, canvas: Canvas, y: int
) -> int:
    """The last product and the bars; the row after them."""
    product = format_last_observation(view)
    canvas.write_text(0, 0, "saw  ")
    canvas.write_text(5, 0, product, "bold yellow" if product == "defective" else "bold")
    return draw_belief_bars(
        canvas,
        y,
        STATE_NAMES,
        view.belief,
        options._replace(width=min(options.width, BELIEF_COLUMNS)),
    )


def _draw_small_triangle(canvas: Canvas, x: int, belief: Reals) -> None:
    """The belief as a dot between three corners, each of which is a state for sure."""
    for row in range(1, BASE_ROW + 1):
        canvas.write_text(x + APEX_COLUMN - 2 * row, row, "╱", "dim")
        canvas.write_text(x + APEX_COLUMN + 2 * row, row, "╲", "dim")
    canvas.write_text(x + 3, BASE_ROW, "─" * (SMALL_TRIANGLE_COLUMNS - 6), "dim")
    row = round(BASE_ROW * float(1.0 - belief[0]))
    column = APEX_COLUMN + round(2.0 * BASE_ROW * float(belief[2] - belief[1]))
    canvas.write_text(x + APEX_COLUMN - (2 if row == 0 else 0), 0, "0")
    canvas.write_text(x, BASE_ROW, "1")
    canvas.write_text(x + SMALL_TRIANGLE_COLUMNS - 1, BASE_ROW, "2")
    canvas.write_text(x + column, row, "●", "bold cyan")


def goal_lines(view: View[MachineReplacement]) -> list[str]:
    """What a part pays, what wears unseen, and the price of looking and mending."""
    labels = view.problem.actions[0].labels
    sound, *failed = view.problem.tables.rewards[:, :, 0]
    worse = " or ".join(f"{pays[0]:.3g}" for pays in failed)
    others = [f"{label} pays {pay:.3g}" for label, pay in zip(labels, sound, strict=True)]
    return [
        f"keep the machine producing: {sound[0]:.3g} a turn",
        f"with failed parts {worse}",
        "parts fail unseen",
        *others[:0:-1],
    ]


def lesson(view: View[MachineReplacement]) -> Lesson:
    """The machine, what is to be wanted, and what each action costs."""
    rewards = view.problem.tables.rewards[:, :, 0]
    makes, *others = zip(view.problem.actions[0].labels, rewards.T, strict=True)
    each = [f"{name} {_format_rewards_by_failures(pays)}" for name, pays in others]
    return Lesson(
        "You run a machine of two parts; they fail unseen, and only to examine a product tells",
        "You want it to produce as much as it can: "
        f"{makes[0]} pays {_format_rewards_by_failures(makes[1])} with none, one or two failed",
        f"With as many failed, the others pay: {'; '.join(each)}",
        "examine",
    )


def _format_rewards_by_failures(rewards: Reals) -> str:
    """What an action pays, by how many parts have failed."""
    each = [f"{pay:.3g}" for pay in rewards]
    return each[0] if len(set(each)) == 1 else ", ".join(each)


def panel_rows(view: View[MachineReplacement]) -> list[tuple[str, str]]:
    """What is not on the board; the reward is hidden until the end, as it betrays the state."""
    return crying_baby.panel_rows(view)


def describe_turn(view: View[MachineReplacement]) -> str:
    """The product, what you did, what to believe."""
    return (
        f"{format_last_observation(view)}. chose {view.last_action_label}. {_describe_belief(view)}"
    )


def describe_situation(view: View[MachineReplacement]) -> str:
    """The product, the belief, and the reward to expect of each action."""
    each = ", ".join(
        f"{name} {reward:.3f}" for _, name, reward in _compute_expected_rewards(view, DrawOptions())
    )
    return f"saw {format_last_observation(view)}. {_describe_belief(view)} expected reward at once: {each}."


def _describe_belief(view: View[MachineReplacement]) -> str:
    return f"belief: {format_belief(STATE_NAMES, view.belief)}."

"""The view of machine replacement: the last product, and the belief in bars and a triangle."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from rich.text import Text

from dmplay.core.arrays import Reals
from dmplay.core.session import View
from dmplay.draw import theme
from dmplay.draw.action_hints import (
    format_forecast_rows,
    format_observation,
    format_regret_rows,
    format_regret_with_bar,
    iter_with_and_without_rows,
    list_action_keys,
    rank_actions,
)
from dmplay.draw.bars import (
    draw_belief_bars,
    draw_belief_chart,
    draw_probability_history,
    draw_true_state,
)
from dmplay.draw.canvas import Canvas, format_percent
from dmplay.draw.options import DrawOptions
from dmplay.draw.panels import BeliefMarks, TrianglePanel
from dmplay.draw.triangle import draw_triangle
from dmplay.problems.crying_baby import view as crying_baby
from dmplay.solvers.pomdp.exact_pomdp import solve_stages
from dmplay.views.generic import format_last_observation
from dmplay.views.protocol import FinishedGame, Lesson

from .rules import MachineReplacement

panel_rows = crying_baby.panel_rows
MAX_HISTORY_TURNS = 40  # turns in the belief history
NEEDS_BELIEF = True  # no board hides the belief
HIDDEN_FACT = "how many parts failed"
KEYS = {"m": "manufacture", "e": "examine", "i": "interrupt", "r": "replace"}
PAY_HEADING = "average pay now"
ROUNDING = 1e-9  # makes a half, such as 0.475, round up
REPAIR_EFFECTS = {
    "interrupt": "failed parts are repaired; both parts work",
    "replace": "both parts are new, and work",
}
STATE_NAMES = ("0 failed", "1 failed", "2 failed")
# columns of the belief bars and of the small triangle
BELIEF_COLUMNS, SMALL_TRIANGLE_COLUMNS = 36, 21
TALL_TRIANGLE_ROWS, REGRET_BAR_COLUMNS = 11, 8  # rows of the tall triangle; columns of a regret bar
# rows of the largest triangle; rows of a triangle from which a chart of the belief is beside it
MAX_TRIANGLE_ROWS, MIN_CHART_TRIANGLE_ROWS, MAX_CHART_ROWS = 40, 30, 12
REGRET_COLUMN, PAY_COLUMNS = 20, 6  # first column of regrets or pays; columns of a pay
TRIANGLE_LEGEND = "● belief now; corner: you are sure"
REGION_LEGEND = ("● belief now; letters: best action", "at each belief, for the turns left")
MAX_PLANNED_TURNS = 40  # maximum turns planned for the regions
APEX_COLUMN, BASE_ROW = 10, 4  # column of the small triangle's apex, and row of its base


def _compute_expected_rewards(
    view: View[MachineReplacement], options: DrawOptions
) -> list[tuple[str, str, float]]:
    """Return each action's key, name and expected immediate reward under the belief."""
    expected = (view.belief @ view.problem.tables.rewards[:, :, 0]).tolist()
    return [*zip(list_action_keys(KEYS, options), KEYS.values(), expected, strict=True)]


def iter_boards(view: View[MachineReplacement], options: DrawOptions) -> Iterator[Text]:
    """Yield the boards, the largest first: with a tall triangle, a small one, and none."""
    if options.allow_large:
        columns = options.columns_beside_panel - BELIEF_COLUMNS - 3
        size = min(options.height - 3, columns // 2, MAX_TRIANGLE_ROWS)
        if size >= MIN_CHART_TRIANGLE_ROWS:
            yield _draw_large_board(view, options, size)
        yield _draw_large_board(view, options)
    rows = [
        *format_regret_rows(options, list_action_keys(KEYS, options)),
        *format_forecast_rows(view, options, view.problem.state_names),
    ]
    yield from iter_with_and_without_rows(_iter_small_boards(view, options), rows, options)


def _iter_small_boards(view: View[MachineReplacement], options: DrawOptions) -> Iterator[Text]:
    """Yield small boards: with the triangle, without it, and with all rewards in one row."""
    for with_triangle in (True, False):
        canvas = Canvas()
        y = _draw_observation_and_belief(view, options, canvas, 2)
        if with_triangle:
            _draw_small_triangle(canvas, BELIEF_COLUMNS + 4, view.belief)
        _draw_belief_history(view, canvas, y, options)
        canvas.write_text(0, y + 2, PAY_HEADING, "dim")
        rewards = _compute_expected_rewards(view, options)
        rows = [f"{key} {name:<11} {_format_pay(pay, '+')}" for key, name, pay in rewards]
        canvas.write_rows(y + 3, rows)
        draw_true_state(canvas, y + 8, STATE_NAMES, options)
        yield canvas.to_text()
    canvas = Canvas()
    y = _draw_observation_and_belief(view, options, canvas, 1)
    rewards = _compute_expected_rewards(view, options)
    line = "  ".join(f"{key} {_format_pay(reward, '+')}" for key, _, reward in rewards)
    canvas.write_text(0, y, "" if view.end_reason else line)
    draw_true_state(canvas, y + 1, STATE_NAMES, options)
    yield canvas.to_text()


def _draw_belief_history(
    view: View[MachineReplacement], canvas: Canvas, y: int, options: DrawOptions
) -> None:
    """Draw a sparkline of the past probabilities that at least one part has failed.

    At most MAX_HISTORY_TURNS turns are drawn.
    """
    recent_beliefs = (view.beliefs or ())[-MAX_HISTORY_TURNS - 1 :]  # one more than are drawn
    probabilities = [1.0 - float(b[0]) for b in recent_beliefs]
    draw_probability_history(
        canvas, y, "chance of failed parts", probabilities, options, max_turns=MAX_HISTORY_TURNS
    )


def _draw_large_board(
    view: View[MachineReplacement], options: DrawOptions, size: int = TALL_TRIANGLE_ROWS
) -> Text:
    """Return the large board: bars and rewards at the left, the tall triangle at the right.

    With hints, it also shows the regrets. Beside a triangle of many rows, a chart shows the belief
    by turn.
    """
    canvas = Canvas()
    y = _draw_observation_and_belief(view, options, canvas, 2)
    narrow = options._replace(width=min(options.width, BELIEF_COLUMNS))
    _draw_belief_history(view, canvas, y, narrow)
    canvas.write_text(0, y + 2, PAY_HEADING, "dim")
    has_hint = options.regret is not None
    heading = "value below best" if has_hint else _join_pay_cells("012")
    canvas.write_text(REGRET_COLUMN, y + 2, heading, "dim")
    canvas.write_text(REGRET_COLUMN - 3, y + 2, "" if has_hint else "failed:", "dim")
    rewards_by_action = _compute_expected_rewards(view, options)
    for row, action in enumerate(rank_actions(options, len(rewards_by_action)), y + 3):
        key, name, reward = rewards_by_action[action]
        canvas.write_text(0, row, f"{key} {name:<11} {_format_pay(reward, '+')}")
        regret = format_regret_with_bar(options, action, REGRET_BAR_COLUMNS)
        pays = map(_format_pay, view.problem.tables.rewards[:, action, 0])
        canvas.write_text(REGRET_COLUMN, row, "" if has_hint else _join_pay_cells(pays), "dim")
        canvas.write_text(REGRET_COLUMN, row, regret, theme.REGRET)
    draw_true_state(canvas, y + 7, STATE_NAMES, options)
    default_legend = (TRIANGLE_LEGEND, *_describe_effects(view.problem, options))
    turns_left = math.inf if view.turn_limit is None else view.turn_limit - view.turns_played
    limit_note = (f"(for {MAX_PLANNED_TURNS} turns; more are left)",)
    region_legend = REGION_LEGEND + limit_note * (turns_left > MAX_PLANNED_TURNS)
    legend = default_legend if options.regret is None else region_legend
    notes = format_forecast_rows(view, options, view.problem.state_names) or legend
    top = canvas.write_rows(y + 8, notes, "" if options.forecast else "dim") + 1
    if size >= MIN_CHART_TRIANGLE_ROWS:
        _draw_belief_chart(view, canvas, top, min(size - top - 4, MAX_CHART_ROWS), options)
    _draw_tall_triangle(view, canvas, BELIEF_COLUMNS + 2, size, options)
    return canvas.to_text()


def _describe_effects(problem: MachineReplacement, options: DrawOptions) -> tuple[str, ...]:
    """Return rows with the effects of the actions and the probabilities of bad events."""
    _, one_failed, both_failed = problem.tables.observation_model[1, :, 1]
    clues = f"{format_percent(one_failed)}, {format_percent(both_failed)}"
    make, examine, repair, renew = list_action_keys(KEYS, options)
    return (
        f"{_describe_wear(problem)} ({make}, {examine})",
        f"{examine}: defective {clues} with 1, 2 failed",
        f"{repair} repairs for {_format_cost_range(problem, 'interrupt')}; "
        f"{renew}: new parts for {_format_cost_range(problem, 'replace')}",
    )


def _format_cost_range(problem: MachineReplacement, action: str) -> str:
    """Return the least and the greatest cost of a repair, by failed parts, as `0.5 to 2.5`."""
    costs = -problem.tables.rewards[:, problem.actions[0].labels.index(action), 0]
    return " to ".join(dict.fromkeys((f"{costs.min():g}", f"{costs.max():g}")))


def _format_pay(pay: float, sign: str = "") -> str:
    """Return a pay with two decimals, of which the last is rounded half up, as on paper."""
    return f"{pay + ROUNDING:{sign}.2f}"


def _join_pay_cells(cells: Iterable[str]) -> str:
    """Return a row of cells, one for each number of failed parts."""
    return "".join(f"{cell:>{PAY_COLUMNS}}" for cell in cells)


def _draw_belief_chart(
    view: View[MachineReplacement], canvas: Canvas, y: int, rows: int, options: DrawOptions
) -> None:
    """Draw the probability of a failure by turn, with the keys and products below."""
    keys = list_action_keys(KEYS, options)
    products = [
        format_observation(view.problem, 0, product)[:1] if _is_examined(view, action) else "·"
        for action, product in zip(view.actions, view.observations[1:], strict=True)
    ]
    canvas.write_text(0, y, "P(failure) by turn", "dim")
    bottom = draw_belief_chart(
        canvas,
        y + 1,
        [1.0 - float(belief[0]) for belief in view.beliefs or ()],
        [
            ("turn", [str(turn) for turn in range(len(products) + 1)]),
            ("chose", ["", *(keys[int(action)] for action in view.actions)]),
            ("saw", ["", *products]),
        ],
        rows=rows,
        columns=BELIEF_COLUMNS,
        ascii_only=options.ascii,
    )
    canvas.write_text(0, bottom, "d defective, n nondefective, · none", "dim")


def _draw_tall_triangle(
    view: View[MachineReplacement], canvas: Canvas, x: int, size: int, options: DrawOptions
) -> None:
    """Draw the tall triangle, its corners by name, with past, current and forecast beliefs.

    With hints, it also shows the best action in each region, for the remaining turns; they are at
    most MAX_PLANNED_TURNS.
    """
    marks = [BeliefMarks(np.array([*(view.beliefs or ())]), "past")]
    if options.forecast and options.forecast.beliefs is not None:
        marks.append(BeliefMarks(options.forecast.beliefs, "forecast"))
    marks.append(BeliefMarks(view.belief))
    panel = TrianglePanel("", STATE_NAMES, np.zeros((0, 3)), (), marks=marks)
    if options.regret is not None:
        remaining_turns = MAX_PLANNED_TURNS
        if view.turn_limit is not None:
            remaining_turns = min(view.turn_limit - view.turns_played, MAX_PLANNED_TURNS)
        plans = solve_stages(view.problem, remaining_turns)[-1].plans_by_action
        vectors = [action_plans.alpha_vectors for action_plans in plans]
        actions = np.repeat(list(KEYS.values()), [*map(len, vectors)]).tolist()
        panel = replace(panel, alpha_vectors=np.vstack(vectors), actions=actions)
    keys = enumerate(list_action_keys(KEYS, options))
    glyphs = [(key, theme.choose_style(index)) for index, key in keys]
    draw_triangle(canvas, x, panel, size, dict(zip(KEYS.values(), glyphs, strict=True)))


def _draw_observation_and_belief(
    view: View[MachineReplacement], options: DrawOptions, canvas: Canvas, y: int
) -> int:
    """Draw the last product and the belief bars; return the next free row."""
    product = _format_last_product(view)
    canvas.write_text(0, 0, "saw  ")
    canvas.write_text(5, 0, product, theme.ALERT if product == "defective" else "bold")
    narrow = options._replace(width=min(options.width, BELIEF_COLUMNS))
    return draw_belief_bars(canvas, y, STATE_NAMES, view.belief, narrow)


def _draw_small_triangle(canvas: Canvas, x: int, belief: Reals) -> None:
    """Draw a small triangle with the belief as a dot; each corner is one state with certainty."""
    for row in range(1, BASE_ROW + 1):
        canvas.write_text(x + APEX_COLUMN - 2 * row, row, "╱", "dim")
        canvas.write_text(x + APEX_COLUMN + 2 * row, row, "╲", "dim")
    canvas.write_text(x + 3, BASE_ROW, "─" * (SMALL_TRIANGLE_COLUMNS - 6), "dim")
    row = round(BASE_ROW * float(1.0 - belief[0]))
    column = APEX_COLUMN + round(2.0 * BASE_ROW * float(belief[2] - belief[1]))
    canvas.write_text(x + APEX_COLUMN - (2 if row == 0 else 0), 0, "0")
    canvas.write_text(x, BASE_ROW, "1")
    canvas.write_text(x + SMALL_TRIANGLE_COLUMNS - 1, BASE_ROW, "2")
    canvas.write_text(x + column, row, "●", theme.STRONG_DATA)


def goal_lines(view: View[MachineReplacement]) -> list[str]:
    """Return the goal, the clue, and the effects of failures and of actions, as clauses."""
    return [
        "earn much by a machine whose two parts may fail",
        "only examine gives a clue",
        "failed parts lower what manufacture and examine pay",
        f"interrupt repairs failed parts for {_format_cost_range(view.problem, 'interrupt')}, "
        f"replace puts in new parts for {_format_cost_range(view.problem, 'replace')}",
        _describe_wear(view.problem),
    ]


def _describe_wear(problem: MachineReplacement) -> str:
    """Return a clause with the probability that a working part fails in a turn of production."""
    return f"a working part fails: {format_percent(problem.tables.transition[1, 0, 2])}"


def lesson(view: View[MachineReplacement]) -> Lesson:
    """Return the three sentences that introduce the problem: role, objective and costs."""
    rewards = view.problem.tables.rewards[:, :, 0]
    production, *other_actions = zip(view.problem.actions[0].labels, rewards.T, strict=True)
    clauses = [f"{name} {_format_rewards_by_failures(pays)}" for name, pays in other_actions]
    return Lesson(
        "You run a machine of two parts; failures are hidden. Examine tests a product, interrupt "
        "repairs failed parts, replace puts in two new parts",
        "You want it to produce as much as it can: "
        f"{production[0]} pays {_format_rewards_by_failures(production[1])} "
        "with 0, 1 or 2 failed parts when the turn begins",
        f"With 0, 1 or 2 failed parts, the other actions pay: {'; '.join(clauses)}",
        "examine",
        "with {} failed parts",
        "{} failed",
        _describe_failure_chances(view.problem),
    )


def _describe_failure_chances(problem: MachineReplacement) -> tuple[str, ...]:
    """Return the probabilities of failures in a turn, and of a defective product."""
    wear = problem.tables.transition[:, 0]
    (_, one_of_two, both), (_, _, last) = wear[:2]
    clues = problem.tables.observation_model[problem.actions[0].labels.index("examine"), :, 1]
    return (
        f"In a turn of manufacture or examine, two working parts become one with probability "
        f"{one_of_two:g} and none with {both:g}",
        f"If one part works, it fails with probability {last:g}; interrupt and replace always "
        "lead to 0 failed",
        "Examine sees a defective product with probability "
        f"{', '.join(f'{p:g}' for p in clues)} with 0, 1 or 2 failed parts after the turn",
        "The other actions always see a nondefective one",
    )


def _format_rewards_by_failures(rewards: Reals) -> str:
    """Return the rewards for 0, 1 and 2 failed parts as text, once if they are equal."""
    texts = [f"{pay:.4g}" for pay in rewards]
    return texts[0] if len(set(texts)) == 1 else ", ".join(texts)


def describe_turn(view: View[MachineReplacement]) -> str:
    """Return a description of the last turn: the action, the product and the belief.

    After a repair, the state is certain.
    """
    if effect := REPAIR_EFFECTS.get(view.last_action_label or ""):
        return f"chose {view.last_action_label}: {effect}."
    return f"chose {view.last_action_label}, {_describe_product_and_belief(view)}"


def describe_situation(view: View[MachineReplacement]) -> str:
    """Return a description of the last product, the belief and the expected rewards."""
    rewards = _compute_expected_rewards(view, DrawOptions())
    expected = ", ".join(f"{name} {_format_pay(reward)}" for _, name, reward in rewards)
    return f"{_describe_product_and_belief(view)} expected reward now: {expected}."


def _format_last_product(view: View[MachineReplacement]) -> str:
    """Return the last product as text; only after an examination is it a clue.

    After the other actions, the observation is the same in every state.
    """
    is_clue = not view.turns_played or _is_examined(view, view.actions[-1])
    return f"{format_last_observation(view)}{'' if is_clue else ' (no clue: unexamined)'}"


def _is_examined(view: View[MachineReplacement], action: float) -> bool:
    """Return whether the observation after an action depends on the state."""
    return bool(np.ptp(view.problem.tables.observation_model[int(action)], axis=0).any())


def _describe_product_and_belief(view: View[MachineReplacement]) -> str:
    """Return the last product and the belief about 0, 1 and 2 failed parts, in this order."""
    pairs = zip(STATE_NAMES, view.belief, strict=True)
    belief = ", ".join(f"{name} {probability:.3f}" for name, probability in pairs)
    return f"saw {_format_last_product(view)}. belief: {belief}."


def describe_end(game: FinishedGame[MachineReplacement]) -> str:
    """Return the number of turns of production, with failed parts, and of repairs."""
    produces = game.actions[:, 0] < 2  # manufacture or examine
    failed = int((produces & (game.states[:-1] > 0)).sum())
    text = f"{game.player} ran the machine for {produces.sum()} of {game.turns}"
    return f"{text}, {failed} of them with a failed part, and repaired it in {(~produces).sum()}"

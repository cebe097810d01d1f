"""The alpha vectors of problems of one agent with few hidden states."""

from contextlib import suppress

from dmplay.agents.base import AdviceQuestion
from dmplay.agents.horizon import NEGLIGIBLE_WEIGHT
from dmplay.core import belief
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.core.text import format_count, format_upper_bound, format_value
from dmplay.core.work_budget import limit_total_work
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.evaluation.solutions.options import DEFAULT_TURNS, resolve_horizon
from dmplay.evaluation.solutions.solution import Row, Solution, format_action_names
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage

VECTOR_WORK_LIMIT = 4e9  # to list the vectors


def solve_alpha_vectors(problem: Problem) -> Solution:
    """Return the alpha vectors of an infinite horizon or, if that has no value, of some turns.

    If they are too many, return the value of each first action, which needs no list of them.
    Likewise if states have actions of their own: a vector does not say which of them it is for.
    """
    legal = problem.legal_actions_mask(problem.enumerate_states())
    if legal is None or legal.all():
        with suppress(BadParameter, BudgetExceeded), limit_total_work(VECTOR_WORK_LIMIT):
            return _solve_alpha_vectors(problem)
    from dmplay.evaluation.solutions.first_actions import solve_first_actions

    return solve_first_actions(problem)


def _solve_alpha_vectors(problem: Problem) -> Solution:
    """Return the alpha vectors as a solution; raise BudgetExceeded if they are too many."""
    tables = tabulate(problem)
    start = belief.initial_belief(problem)
    turns = resolve_horizon(problem.horizon)
    has_default_turns = resolve_horizon(None) is None and turns == DEFAULT_TURNS == problem.horizon
    is_default = has_default_turns and not _plans_whole_game(problem)
    is_long = turns is not None and problem.discount**turns < NEGLIGIBLE_WEIGHT
    if problem.discount < 1.0 and (turns is None or is_default or is_long):
        stage: AlphaVectorStage = exact_pomdp.solve_infinite_horizon(tables, problem.discount)
        method = "alpha vectors, infinite horizon"
    else:
        stage = exact_pomdp.solve_stages(problem, turns or DEFAULT_TURNS)[-1]
        method = f"alpha vectors, {format_count(turns or DEFAULT_TURNS, 'turn')}"
    states = [problem.format_state(s) for s in problem.enumerate_states()]
    rows: list[Row] = [
        {f"at {name}": float(value) for name, value in zip(states, vector, strict=True)}
        | {"first": format_action_names(problem, mask)}
        for vector, mask in zip(stage.alpha_vectors, stage.first_action_mask, strict=True)
    ]
    value = float((stage.alpha_vectors @ start).max())
    value_text = format_value(value, problem.reward_scale)
    gap_text = f", error at most {format_upper_bound(stage.gap)}" if stage.gap else ""
    vectors = format_count(len(rows), "vector")
    return Solution(method, f"{vectors}; value {value_text} at the start{gap_text}", rows)


def _plans_whole_game(problem: Problem) -> bool:
    """Return whether the agent that gives hints plans a game to its end."""
    from dmplay.registry.agents import find_hint_provider

    hint_agent = find_hint_provider(problem, AdviceQuestion(0, problem.horizon))
    return hint_agent is not None and hint_agent.policy.plans_whole_game

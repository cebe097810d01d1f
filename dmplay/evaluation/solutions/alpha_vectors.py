"""The alpha vectors of problems of one agent with few hidden states."""

from contextlib import suppress
from typing import TYPE_CHECKING

from dmplay.agents.base import AdviceQuestion
from dmplay.agents.horizon import MIN_PLANNED_WEIGHT
from dmplay.core import belief
from dmplay.core.action_values import Accuracy
from dmplay.core.problem import Problem
from dmplay.core.text import format_count, format_upper_bound, format_value
from dmplay.core.work_budget import limit_total_work
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.evaluation.solutions.options import DEFAULT_TURNS, resolve_horizon
from dmplay.evaluation.solutions.solution import Solution, list_marked_actions
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage

if TYPE_CHECKING:  # It is imported if the solution is asked for values.
    from dmplay.agents.single_agent_planning import PomdpOptimalPolicy

VECTOR_WORK_LIMIT = 4e9  # to list the vectors


def solve_small_pomdp(problem: Problem) -> Solution:
    """Return the alpha vectors of an infinite horizon or, if that has no value, of some turns.

    If they are too many, return the value of each first action, which needs no list of them.
    """
    with suppress(BadParameter, BudgetExceeded), limit_total_work(VECTOR_WORK_LIMIT):
        return solve_alpha_vectors(problem)
    from dmplay.evaluation.solutions.first_actions import solve_first_actions

    return solve_first_actions(problem)


def solve_alpha_vectors(problem: Problem) -> Solution:
    """Return the alpha vectors; raise BudgetExceeded if they are too many.

    Raise BadParameter if states have actions of their own: a vector does not say which of them it
    is for.
    """
    legal = problem.legal_actions_mask(problem.enumerate_states())
    if legal is not None and not legal.all():
        raise BadParameter("alpha vectors: got legal actions that differ between hidden states")
    start = belief.initial_belief(problem)
    turns = resolve_horizon(problem.horizon)
    has_default_turns = resolve_horizon(None) is None and turns == DEFAULT_TURNS == problem.horizon
    is_default = has_default_turns and not _plans_whole_game(problem)
    is_long = turns is not None and problem.discount**turns < MIN_PLANNED_WEIGHT
    horizon = turns or DEFAULT_TURNS
    if problem.discount < 1.0 and (turns is None or is_default or is_long):
        stage: AlphaVectorStage = exact_pomdp.find_infinite_horizon_stage(problem)
        horizon, method = 0, "alpha vectors, infinite horizon"
    else:
        stage = exact_pomdp.solve_stages(problem, horizon)[-1]
        method = f"alpha vectors, {format_count(horizon, 'turn')}"
    states = [problem.format_state(s) for s in problem.enumerate_states()]
    table = [
        {f"at {name}": float(value) for name, value in zip(states, vector, strict=True)}
        | {"first": list_marked_actions(problem, mask)}
        for vector, mask in zip(stage.alpha_vectors, stage.first_action_mask, strict=True)
    ]
    value = float((stage.alpha_vectors @ start).max())
    value_text = format_value(value, problem.reward_scale)
    gap_text = f", error at most {format_upper_bound(stage.gap)}" if stage.gap else ""
    vectors = format_count(len(table), "vector")

    def make_agent(problem: Problem, seat: int) -> "PomdpOptimalPolicy":
        """Return the agent that has all alpha vectors."""
        from dmplay.agents.single_agent_planning import PomdpOptimalPolicy

        return PomdpOptimalPolicy(problem, seat, horizon=horizon)

    return Solution(
        method,
        f"{vectors}; value {value_text} at the start{gap_text}",
        table,
        make_agent,
        Accuracy.EXACT,
        stage.gap,
        start_values=(value,),
    )


def _plans_whole_game(problem: Problem) -> bool:
    """Return whether the agent that gives hints plans a game to its end."""
    from dmplay.registry.agents import find_hint_provider

    hint_agent = find_hint_provider(problem, AdviceQuestion(0, problem.horizon))
    return hint_agent is not None and hint_agent.policy.plans_whole_game

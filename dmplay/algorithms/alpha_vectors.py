"""Exact value iteration of a POMDP: conditional plans, their alpha vectors, and pruning.

Source: sections 20.2 to 20.5, Conditional Plans, Alpha Vectors, Pruning and Value Iteration. An
alpha vector holds the value of a conditional plan in each state; the value of a belief is that of
the best plan for it.
"""

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np

from dmplay.algorithms.formula_text import format_number, format_weighted_sum
from dmplay.algorithms.maximal_belief import find_maximal_belief
from dmplay.algorithms.step import Algorithm, AlphaVectorSet, Step, WatchRequest
from dmplay.core.arrays import Bools, Reals
from dmplay.core.best_actions import compute_reward_scale, compute_tolerance
from dmplay.core.problem import Problem
from dmplay.core.session import Session, belief_size
from dmplay.core.tabular import Tables, tabulate
from dmplay.core.text import format_count, format_score
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadParameter, BudgetExceeded

DEFAULT_STAGES = 8  # turns that the plans of the last stage cover
MAX_NAMED_OBSERVATIONS = 3  # observations of which a sentence names the next action
FORMULA_SENTENCE = (
    "Its alpha(s) = reward + discount x sum of (transition probability x mean value of the plans "
    "that follow)."
)
MAX_STATES = 8
MAX_PLANS = 5000  # plans of one expansion


class ConditionalPlan(NamedTuple):
    """A plan: an action, and the plan to follow after each observation; none for one turn."""

    action: int
    next_plans: tuple[int, ...] = ()  # [O], indices among the plans of one turn less


class PlanSet(NamedTuple):
    """Plans for the same number of turns, with their alpha vectors."""

    plans: list[ConditionalPlan]
    vectors: Reals  # [K, S]


def make_one_step_plans(tables: Tables) -> PlanSet:
    """Return a plan for each action; its alpha vector is the reward R(s, a)."""
    plans = [ConditionalPlan(a) for a in range(tables.rewards.shape[1])]
    return PlanSet(plans, tables.rewards[:, :, 0].T)


def extend_plans(tables: Tables, discount: float, previous: PlanSet) -> PlanSet:
    """Return all plans of one more turn: an action, and an old plan after each observation.

    alpha(s) = R(s, a) + gamma sum_s' T(s' | s, a) sum_o O(o | a, s') alpha_o(s').
    """
    plans, vectors = [], []
    _, action_count, _ = tables.transition.shape
    observation_count = tables.observation_model.shape[2]
    for a in range(action_count):
        for choice in product(range(len(previous.plans)), repeat=observation_count):
            after = _combine_vectors(tables, a, previous.vectors[list(choice)])
            plans.append(ConditionalPlan(a, choice))
            vectors.append(tables.rewards[:, a, 0] + discount * tables.transition[:, a] @ after)
    return PlanSet(plans, np.array(vectors))


def mark_dominated(vectors: Reals) -> Bools:
    """Return a mask `[K]` of the vectors `[K, S]` that are better than all others at no belief.

    As in the book, the set of needed vectors grows: as long as a candidate is above all of them at
    some belief, the candidate that is best at this belief becomes one of them. Candidates that are
    better than it in no state are dominated, which saves most linear programs. A vector that was
    added because of a tie may not be needed, which the last loop finds.
    """
    vectors = vectors / min(compute_reward_scale(vectors), 1.0)
    tolerance = compute_tolerance(vectors)
    needed = [int(np.argmax(vectors[:, 0]))]
    candidates = np.ones(len(vectors), bool)
    candidates[needed] = False
    while candidates.any():
        candidate = int(np.argmax(candidates))
        belief, lead = find_maximal_belief(vectors[candidate], vectors[needed])
        if lead > tolerance:
            candidate = int(np.argmax(np.where(candidates, vectors @ belief, -np.inf)))
            needed.append(candidate)
            candidates &= (vectors > vectors[candidate]).any(axis=1)
        candidates[candidate] = False
    for index in needed.copy():
        others = [other for other in needed if other != index]
        if others and find_maximal_belief(vectors[index], vectors[others])[1] <= tolerance:
            needed = others
    dominated = np.ones(len(vectors), bool)
    dominated[needed] = False
    return dominated


def explain_misfit(problem: Problem) -> str:
    """Return why exact value iteration of alpha vectors does not fit a problem; '' if it fits."""
    mismatch = ""
    if len(problem.agents) > 1:
        mismatch = "one agent, but this problem has several"
    elif not problem.partially_observable:
        mismatch = "hidden states, but here the agent sees the state"
    elif not problem.action_counts[0]:
        mismatch = "actions with names, but here they are real numbers"
    elif belief_size(problem) > MAX_STATES:
        mismatch = f"at most {MAX_STATES} states and named observations, but this problem has more"
    elif problem.legal_actions_mask(problem.enumerate_states()) is not None:
        mismatch = "all actions to be legal in every state, but here some are not"
    elif not _has_tables(problem):
        mismatch = "observations that follow from the action and the next state alone"
    elif (count := problem.action_counts[0] ** (1 + problem.observation_counts[0])) > MAX_PLANS:
        mismatch = f"at most {MAX_PLANS:,} plans of two turns, but this problem may have {count:,}"
    return mismatch and f"alpha vectors need {mismatch}"


def _has_tables(problem: Problem) -> bool:
    """Return whether the arrays T, R and O of a problem exist."""
    try:
        tabulate(problem)
    except (BadParameter, BudgetExceeded):
        return False
    return True


def iterate_steps(request: WatchRequest) -> Iterator[Step]:
    """Yield the plans of each number of turns, before and after the pruning."""
    problem, tables = request.problem, tabulate(request.problem)
    session = request.session or Session(problem, SeededUniforms(request.seed))
    belief = session.view(request.seat).belief
    owner = "now" if request.session else "at the start of a game"
    stage_count = request.iterations or DEFAULT_STAGES
    plan_set = make_one_step_plans(tables)
    yield Step(
        "1 turn: plans",
        (
            "A plan for the last turn is one action a.",
            "Its alpha vector holds its value in each state s: here the reward R(s, a).",
            f"The marked point is the belief {owner}.",
        ),
        _format_vector(problem, tables, plan_set, None, belief),
        (_draw_vectors(problem, plan_set, np.zeros(len(plan_set.plans), bool), belief),),
    )
    for turns in range(1, stage_count + 1):
        dominated = mark_dominated(plan_set.vectors)
        needed = np.flatnonzero(~dominated)
        next_count = int(problem.action_counts[0] * len(needed) ** problem.observation_counts[0])
        is_last = turns == stage_count or next_count > MAX_PLANS
        sentences = _describe_pruning(problem, plan_set, dominated, belief, turns)
        if turns == 1:
            sentences.append("V(b) = sum of (belief x value of the best plan in that state).")
        if is_last and turns < stage_count:
            sentences.append(
                f"The next expansion has {next_count:,} plans, too many to watch, so this is all."
            )
        elif is_last:
            sentences.append("The steps end here; dmplay watch --iterations N shows N turns.")
        yield Step(
            f"{format_count(turns, 'turn')}: pruning",
            tuple(sentences),
            _format_value(plan_set, belief),
            (_draw_vectors(problem, plan_set, dominated, belief),),
        )
        if is_last:
            return
        previous = PlanSet([plan_set.plans[k] for k in needed], plan_set.vectors[needed])
        plan_set = extend_plans(tables, problem.discount, previous)
        observations = format_count(problem.observation_counts[0], "observation")
        yield Step(
            f"{format_count(turns + 1, 'turn')}: expansion",
            (
                f"A plan is one of {format_count(problem.action_counts[0], 'action')} now, then a "
                f"kept plan after each of {observations}: {len(plan_set.plans):,} plans.",
                *_describe_best_plan(problem, plan_set, previous, belief),
                *([FORMULA_SENTENCE] if turns == 1 else []),
            ),
            _format_vector(problem, tables, plan_set, previous, belief),
            (_draw_vectors(problem, plan_set, np.zeros(len(plan_set.plans), bool), belief),),
        )


def _draw_vectors(
    problem: Problem, plan_set: PlanSet, dominated: Bools, belief: Reals
) -> AlphaVectorSet:
    """Return the alpha vectors as a picture, with the names of their first actions."""
    states = [problem.format_state(s) for s in problem.enumerate_states()]
    labels = [problem.format_action(0, plan.action) for plan in plan_set.plans]
    return AlphaVectorSet(states, plan_set.vectors, labels, dominated, belief)


def _describe_pruning(
    problem: Problem, plan_set: PlanSet, dominated: Bools, belief: Reals, turns: int
) -> list[str]:
    """Return sentences on the dominated plans, and on the best at the belief with `turns` left."""
    best = plan_set.plans[int(np.argmax(plan_set.vectors @ belief))]
    action = problem.format_action(0, best.action)
    dominated_count = int(dominated.sum())
    needed_count = len(dominated) - dominated_count
    sentences = ["No plan is removed: each is the best at some belief."]
    if dominated_count:
        kept_plans = f"one of the {needed_count:,} kept plans"
        if needed_count == 1:
            kept_plans = "the kept plan"
        sentences = [
            f"Removed: {dominated_count:,} of {format_count(len(dominated), 'plan', ',')}; at each "
            f"belief, {kept_plans} is at least as good.",
            "This also holds after each observation, so longer plans never need a removed one.",
        ]
    left = f"With {format_count(turns, 'turn')} left"
    return [*sentences, f"{left}, the best plan at the marked belief begins with {action}."]


def _describe_best_plan(
    problem: Problem, plan_set: PlanSet, previous: PlanSet, belief: Reals
) -> list[str]:
    """Return the best plan at the belief in words, if it has few observations."""
    best = plan_set.plans[int(np.argmax(plan_set.vectors @ belief))]
    if len(best.next_plans) > MAX_NAMED_OBSERVATIONS:
        return ["The formula is about the plan that is best at the marked belief."]
    after = [
        f"{problem.format_action(0, previous.plans[plan].action)} after "
        f"{problem.observations[0].format_observation(np.array(observation))}"
        for observation, plan in enumerate(best.next_plans)
    ]
    first = problem.format_action(0, best.action)
    return [f"At the marked belief the best plan is {first}, then {', '.join(after)}."]


def _format_value(plan_set: PlanSet, belief: Reals) -> str:
    """Return the value of the belief as a formula with its numbers."""
    values = plan_set.vectors @ belief
    best = int(np.argmax(values))
    terms = format_weighted_sum(belief.tolist(), plan_set.vectors[best].tolist())
    return f"V(b) = {terms} = {format_score(float(values[best]))}"


def _format_vector(
    problem: Problem, tables: Tables, plan_set: PlanSet, previous: PlanSet | None, belief: Reals
) -> str:
    """Return one number of the best plan's alpha vector, for the likeliest state, as a formula."""
    best = int(np.argmax(plan_set.vectors @ belief))
    (action, choice), s = plan_set.plans[best], int(np.argmax(belief))
    state = problem.format_state(problem.enumerate_states()[s])
    name, value = f"alpha({state})", format_score(float(plan_set.vectors[best, s]))
    if previous is None:
        return f"{name} = R({state}, {problem.format_action(0, action)}) = {value}"
    after = _combine_vectors(tables, action, previous.vectors[list(choice)])
    future = format_weighted_sum(tables.transition[s, action].tolist(), after.tolist())
    reward = format_number(float(tables.rewards[s, action, 0]))
    return f"{name} = {reward} + {format_number(problem.discount)} x ({future}) = {value}"


def _combine_vectors(tables: Tables, action: int, vectors: Reals) -> Reals:
    """Return the mean over observations `[S']` of the next plans' vectors `[O, S']`."""
    return np.asarray((tables.observation_model[action] * vectors.T).sum(axis=1))


ALGORITHM = Algorithm(
    "alpha-vectors",
    "compare plans for hidden states, and remove plans that are best at no belief",
    "sections 20.2 to 20.5, Conditional Plans to Value Iteration",
    explain_misfit,
    iterate_steps,
)

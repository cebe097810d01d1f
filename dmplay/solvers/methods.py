"""The registry of solution methods: which ones fit a problem, by its class and size.

`dmplay solve`, the agents that play a solution, and hints all ask it. It imports no solver; those
who ask load the one method that they use.
"""

from collections.abc import Callable, Iterable
from enum import Enum
from math import prod

from dmplay.core.arrays import Array
from dmplay.core.memoization import memoize
from dmplay.core.problem import (
    Problem,
    enumerate_outcomes,
    initial_state_distribution,
    mark_inactive_agents,
)
from dmplay.core.spaces import Labels
from dmplay.core.tabular import Tabular, tabulate
from dmplay.core.work_budget import limit_total_work
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded
from dmplay.simulation import random_play

MAX_VECTOR_STATES = 3  # states, up to which all alpha vectors are listed
# maximum number of elements of the arrays from which a joint plan is made
MAX_ARRAY_ELEMENTS = 2**25
MAX_HISTORY_WORK = 5e6  # work for some thousand histories
MAX_JOINT_ACTIONS = 4096  # maximum number of joint actions of a game of histories
ZERO_SUM_TEST_TURNS = 120  # turns of random play that test whether two agents' rewards are opposed


class Method(Enum):
    """A solution method; where several fit a problem, the first one solves it."""

    EQUILIBRIUM_ENUMERATION = "all equilibria of one round between two agents"
    REGRET_MATCHING = "approximate equilibrium of one round between several agents"
    JOINT_PLANS = "joint plans of a team whose agents have separate observations"
    FULLY_OBSERVED_TEAM = "upper bound for a team with a shared reward, by one planner who sees all"
    MDP_PLANNING = "value iteration or backward induction for one agent that sees the state"
    ALPHA_VECTORS = "all alpha vectors of a problem with few hidden states"
    POINT_BASED = "bounds on the value of beliefs over hidden states"
    BACKWARD_INDUCTION = "values of a game in which one agent chooses at a time"
    SHAPLEY_ITERATION = "values of a game of two opposed agents that act simultaneously"
    BEST_RESPONSES = "best responses in a discounted game whose agents act simultaneously"


def list_fitting_methods(problem: Problem, candidates: Iterable[Method] = Method) -> list[Method]:
    """Return the methods among `candidates` that fit a problem, in order."""
    return [method for method in candidates if FIT_TESTS[method](problem)]


def find_fitting_method(problem: Problem) -> Method | None:
    """Return the first method that fits a problem; None if only simulation is possible."""
    return next((method for method in Method if FIT_TESTS[method](problem)), None)


def is_simple_game(problem: Problem) -> bool:
    """Return whether a problem is a repeated simple game with all actions legal.

    It has one state, that agents observe, at least two agents, and finitely many actions.
    """
    is_observed = not problem.partially_observable and len(problem.agents) > 1
    if problem.state_count != 1 or not is_observed or not all(problem.action_counts):
        return False
    legal_mask = problem.legal_actions_mask(problem.enumerate_states())
    return legal_mask is None or bool(legal_mask.all())


def can_plan_jointly(problem: Problem) -> bool:
    """Return whether joint plans can be made for a problem.

    It needs several agents that observe separately, share one reward and observe nothing before the
    first turn, few enough states, and all actions legal in every state.
    """
    is_team = len(problem.agents) > 1 and problem.partially_observable and problem.shared_reward
    if not is_team or not isinstance(problem.state_count, int) or not all(problem.action_counts):
        return False
    if not all(isinstance(space, Labels) for space in problem.observations):
        return False
    column_count = problem.state_count + 2 * prod(problem.observation_counts)
    row_count = problem.state_count * prod(problem.action_counts)
    if row_count * column_count > MAX_ARRAY_ELEMENTS:
        return False
    states = problem.enumerate_states()
    # nothing is observed before the first turn
    starts_unobserved = bool((problem.initial_observations(states) == -1).all())
    if not starts_unobserved or problem.legal_actions_mask(states) is not None:
        return False
    return isinstance(problem, Tabular) or can_enumerate(lambda: tabulate(problem))


def can_enumerate(enumerate_part: Callable[[], object]) -> bool:
    """Return whether an enumeration of a part of a problem succeeds."""
    try:
        enumerate_part()
    except (BadParameter, BudgetExceeded):
        return False
    return True


def _is_shared_reward_team(problem: Problem) -> bool:
    """Return whether agents share a discounted reward and the outcomes are few enough to list."""
    if not isinstance(problem.state_count, int) or not problem.shared_reward:
        return False
    from dmplay.solvers.mdp import sparse_mdp

    return problem.discount < 1.0 and sparse_mdp.count_outcomes(problem) <= sparse_mdp.MAX_OUTCOMES


def _is_finite_single_agent(problem: Problem) -> bool:
    """Return whether one agent with labelled actions has finitely many states."""
    has_actions = len(problem.agents) == 1 and bool(problem.action_counts[0])
    return has_actions and isinstance(problem.state_count, int)


def _is_finite_mdp(problem: Problem) -> bool:
    """Return whether one agent sees one of finitely many states."""
    return _is_finite_single_agent(problem) and not problem.partially_observable


def _is_finite_pomdp(problem: Problem) -> bool:
    """Return whether one agent has finitely many hidden states and observations.

    It may not play by its belief if the legal actions reveal hidden information.
    """
    if not _is_finite_single_agent(problem) or not problem.partially_observable:
        return False
    from dmplay.solvers.pomdp.legal_action_leak import has_legal_action_leak

    def enumerate_first_outcomes() -> object:
        """Return the possible observations and the outcomes of one action in one state."""
        first_action = problem.actions[0].candidate_actions()[:1, None]
        outcomes = enumerate_outcomes(problem, problem.enumerate_states()[:1], first_action)
        return problem.observation_counts, outcomes

    return not has_legal_action_leak(problem) and can_enumerate(enumerate_first_outcomes)


def is_turn_based(problem: Problem) -> bool:
    """Return whether several agents see the state and only one of them acts in the first turn.

    If a state is the whole history of a game, the game must also be small enough to enumerate.
    """
    start_states = _list_start_states(problem)
    if start_states is None:
        return False
    inactive_counts = mark_inactive_agents(problem, start_states).sum(axis=1)
    if (inactive_counts < len(problem.agents) - 1).any():
        return False
    if start_states.dtype.kind != "O":
        return True
    return prod(problem.action_counts) <= MAX_JOINT_ACTIONS and _can_enumerate_game(problem)


@memoize
def _can_enumerate_game(problem: Problem) -> bool:
    """Return whether the whole game can be enumerated quickly and one agent decides at a time."""
    from dmplay.solvers.mdp.backward_induction import solve_by_backward_induction

    try:
        with limit_total_work(MAX_HISTORY_WORK):
            solve_by_backward_induction(problem, problem.horizon)
    except (BadParameter, BadPolicy, BudgetExceeded):
        return False
    return True


def is_discounted_simultaneous(problem: Problem) -> bool:
    """Return whether several agents see the state, act at once, and the discount is below 1."""
    is_discounted = problem.discount < 1.0 and _has_numeric_start_states(problem)
    return is_discounted and not is_turn_based(problem)


def is_zero_sum_simultaneous(problem: Problem) -> bool:
    """Return whether two agents see the state, act at once, and have opposed rewards.

    The rewards are tested on turns of random play. The game must have an end or a discount below 1.
    """
    has_finite_values = problem.discount < 1.0 or problem.horizon is not None
    if len(problem.agents) != 2 or not has_finite_values:
        return False
    if not _has_numeric_start_states(problem) or is_turn_based(problem):
        return False
    from dmplay.solvers.games.shapley import compute_loss_ratio

    sampled = random_play.sample_random_turns(problem, ZERO_SUM_TEST_TURNS)
    rewards = problem.step(sampled.s, sampled.a, sampled.u).rewards
    return compute_loss_ratio(rewards) is not None


def _list_start_states(problem: Problem) -> Array | None:
    """Return the possible start states of several agents that see them; None if not listable."""
    if len(problem.agents) == 1 or problem.partially_observable or not all(problem.action_counts):
        return None
    try:
        return initial_state_distribution(problem)[1]
    except (BadParameter, BudgetExceeded):
        return None


def _has_numeric_start_states(problem: Problem) -> bool:
    """Return whether the possible start states can be listed and are numbers."""
    start_states = _list_start_states(problem)
    return start_states is not None and start_states.dtype.kind != "O"


FIT_TESTS: dict[Method, Callable[[Problem], bool]] = {
    Method.EQUILIBRIUM_ENUMERATION: lambda problem: (
        len(problem.agents) == 2 and is_simple_game(problem)
    ),
    Method.REGRET_MATCHING: lambda problem: len(problem.agents) > 2 and is_simple_game(problem),
    Method.JOINT_PLANS: can_plan_jointly,
    Method.FULLY_OBSERVED_TEAM: _is_shared_reward_team,
    Method.MDP_PLANNING: _is_finite_mdp,
    Method.ALPHA_VECTORS: lambda problem: (
        isinstance(problem.state_count, int)
        and problem.state_count <= MAX_VECTOR_STATES
        and _is_finite_pomdp(problem)
    ),
    Method.POINT_BASED: _is_finite_pomdp,
    Method.BACKWARD_INDUCTION: is_turn_based,
    Method.SHAPLEY_ITERATION: is_zero_sum_simultaneous,
    Method.BEST_RESPONSES: is_discounted_simultaneous,
}

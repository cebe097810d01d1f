"""Actions that seem right at first sight, by a rule of thumb, to compare with the best one."""

from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.session import SeatedPolicy, Session
from dmplay.core.text import format_score
from dmplay.game.hints.action_breakdown import ActionBreakdown
from dmplay.views.protocol import load_view_module

MIN_STATE_PROBABILITY = 0.2  # smallest belief in a state that may be assumed to be certain
MIN_LIKELIHOOD_DIFFERENCE = 1e-9  # smaller differences are rounding errors
MAX_BELIEF_STATES = 64  # maximum number of states of which one is assumed to be certain


class ObviousAction(NamedTuple):
    """An action that a simple rule chooses."""

    action: int
    text: str  # the rule, as a clause after the action's name


def find_obvious_action(
    seated_policy: SeatedPolicy, breakdowns: Mapping[int, ActionBreakdown], best_action: int
) -> ObviousAction | None:
    """Return the first rule of thumb whose action is worth less than the best; None if all agree.

    `breakdowns` are those of all legal actions.
    """
    tolerance = VALUE_TOLERANCE * seated_policy.session.problem.reward_scale
    best_value = breakdowns[best_action].value
    for rule in _iter_rules(seated_policy, breakdowns):
        if breakdowns[rule.action].value < best_value - tolerance:
            return rule
    return None


def _iter_rules(
    seated_policy: SeatedPolicy, breakdowns: Mapping[int, ActionBreakdown]
) -> Iterator[ObviousAction]:
    """Yield the rules of thumb that choose an action here."""
    session, seat = seated_policy.session, seated_policy.seat
    tolerance = VALUE_TOLERANCE * session.problem.reward_scale
    if session.problem.partially_observable:
        yield from _trust_observation(seated_policy, breakdowns)
    elif session.problem.state_count != 1:
        action = _find_single_maximum(
            breakdowns, lambda parts: parts.outcome_total(parts.outcomes[0]), tolerance
        )
        if action is not None and len(breakdowns[action].outcomes) > 1:
            yield ObviousAction(action, "the best if every action surely had its likeliest outcome")
    action = _find_single_maximum(breakdowns, lambda parts: parts.reward, tolerance)
    if action is not None:
        yield ObviousAction(action, "which pays the most now")
    yield from _repeat_success(session, seat, breakdowns)


def _find_single_maximum(
    breakdowns: Mapping[int, ActionBreakdown],
    score: Callable[[ActionBreakdown], float],
    tolerance: float,
) -> int | None:
    """Return the action with the greatest score; None if several have it."""
    ranked = sorted(breakdowns, key=lambda action: -score(breakdowns[action]))
    if len(ranked) > 1:
        lead = score(breakdowns[ranked[0]]) - score(breakdowns[ranked[1]])
        if lead <= tolerance:
            return None
    return ranked[0]


def _trust_observation(
    seated_policy: SeatedPolicy, breakdowns: Mapping[int, ActionBreakdown]
) -> Iterator[ObviousAction]:
    """Yield the best action if the state that explains the last observation best were certain.

    There is none if the belief says that this state is unlikely.
    """
    session, seat, policy = seated_policy.session, seated_policy.seat, seated_policy.policy
    problem, view = session.problem, session.view(seat)
    assert isinstance(policy, SeatPolicy)
    memory = seated_policy.current_memory()
    beliefs = policy.current_belief(memory)
    if beliefs is None or not view.turns_played or beliefs.shape[1] > MAX_BELIEF_STATES:
        return
    likelihoods = _compute_likelihoods(session, seat, beliefs.shape[1])
    state = int(likelihoods.argmax())
    certain_belief = np.eye(len(likelihoods))[[state]]
    q = policy.action_values((certain_belief, *memory[1:]))
    if q is None or np.ptp(likelihoods) <= MIN_LIKELIHOOD_DIFFERENCE:
        return
    if beliefs[0, state] < MIN_STATE_PROBABILITY:
        return
    action = max(breakdowns, key=lambda action: q[0, action])
    state_name = load_view_module(problem).lesson(view).state_name
    name = state_name.format(problem.format_state(problem.enumerate_states()[state]))
    yield ObviousAction(action, f"the best if {name} were certain")


def _compute_likelihoods(session: Session, seat: int, state_count: int) -> Reals:
    """Return the probability `[S]` of the last observation in each state after the last turn."""
    problem, view = session.problem, session.view(seat)
    actions: list[int | None] = [None] * len(problem.agents)
    observations = actions.copy()
    actions[seat] = int(view.actions[-1])
    prior = np.full(state_count, 1.0 / state_count)
    reached = problem.joint_belief_update(prior, actions, observations)
    observations[seat] = int(view.observation)
    joint = problem.joint_belief_update(prior, actions, observations)
    return np.where(reached > 0.0, joint / np.where(reached > 0.0, reached, 1.0), 0.0)


def _repeat_success(
    session: Session, seat: int, breakdowns: Mapping[int, ActionBreakdown]
) -> Iterator[ObviousAction]:
    """Yield the last action if its visible reward was positive and it is legal now."""
    view = session.view(seat)
    if view.rewards and view.rewards[-1] > 0.0 and int(view.actions[-1]) in breakdowns:
        reward = format_score(view.rewards[-1])
        yield ObviousAction(int(view.actions[-1]), f"which just paid {reward}")

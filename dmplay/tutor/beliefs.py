"""Beliefs after a history that a lesson's file gives, such as "feed crying"."""

from collections.abc import Sequence

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.core.arrays import Reals
from dmplay.core.belief import initial_belief, update_belief
from dmplay.core.policy import Memory, Percept
from dmplay.core.session import SeatedPolicy
from dmplay.core.spaces import Labels
from dmplay.errors import BadParameter
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.truth import format_number


def parse_history(position: PositionInGame, history: Sequence[str]) -> list[tuple[int, int]]:
    """Return the own action and the observation of each turn of a history."""
    problem, seat = position.problem, position.seat
    observations = problem.observations[seat] if problem.partially_observable else None
    if not isinstance(observations, Labels):
        raise BadParameter(f"history: {position.problem_name} has no observations with labels")
    pairs = []
    for turn in history:
        action, _, observation = turn.strip().rpartition(" ")
        if not action:
            raise BadParameter(f"history: got {turn!r}, expected an action and an observation")
        pairs.append(
            (int(problem.parse_action(seat, action)), observations.parse_action(observation))
        )
    return pairs


def compute_belief(
    position: PositionInGame, history: Sequence[str], *, from_start: bool = False
) -> Reals:
    """Return the belief `[S]` after a history from the start of the game.

    If it is empty, return the belief at the position, or at the start if `from_start` is set.
    """
    problem, seat = position.problem, position.seat
    if not (history or from_start):
        if not position.session.has_visible_beliefs:
            raise BadParameter(f"{position.problem_name} has no beliefs at this position")
        return position.session.view(seat).belief
    belief = initial_belief(problem)
    for action, observation in parse_history(position, history):
        actions: list[int | None] = [None] * len(problem.agents)
        observations = actions.copy()
        actions[seat], observations[seat] = action, observation
        belief = update_belief(problem, belief, actions, observations).belief
    return belief


def remember_history(
    position: PositionInGame, policy: SeatPolicy, history: Sequence[str]
) -> Memory:
    """Return the memory of a policy after a history, or at the position if it is empty."""
    if not history:
        return SeatedPolicy(position.session, position.seat, policy).current_memory()
    pairs = parse_history(position, history)
    null_observation = position.problem.observations[position.seat].null_observation(1)
    memory = policy.initial_memory(null_observation)
    for action, observation in pairs:
        percept = Percept(np.array([action]), np.array([observation]), None, None)
        memory = policy.update_memory(memory, percept)
    return memory


def describe_belief(position: PositionInGame, history: Sequence[str]) -> str:
    """Return the probability of each state after a history as text."""
    belief = compute_belief(position, history)
    names = map(position.problem.format_state, position.problem.enumerate_states())
    pairs = zip(names, belief, strict=True)
    listed = [f"P({name}) = {format_number(float(p))}" for name, p in pairs]
    return f"the probabilities of the hidden states are {', '.join(listed)}"

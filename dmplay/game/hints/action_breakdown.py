"""The parts of an action's value: the reward now, the possible outcomes, and the value after each.

The values after an outcome come from the agent that gives the hints, with its memory after that
outcome. An exact value therefore equals reward + discount x sum(probability x value after).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.belief import apply_bayes_rule
from dmplay.core.chance import FiniteChance
from dmplay.core.policy import Memory, Percept
from dmplay.core.problem import (
    Problem,
    build_percept,
    checked_state_indices,
    enumerate_possible_outcomes,
)
from dmplay.core.session import SeatedPolicy, Session, list_active_seats
from dmplay.errors import BudgetExceeded
from dmplay.game.hints.outcome_forecast import AssumedPlayers, enumerate_joint_actions

MAX_VALUED_OUTCOMES = 2000  # maximum number of outcomes whose values are computed
END_PREFIX = "the end ("
RELATIVE_TOLERANCE = 1e-6  # largest difference, as a share, of parts that sum to the value


class PossibleOutcome(NamedTuple):
    """A possible outcome of an action: the next state, an observation, or the others' actions."""

    text: str
    probability: float
    reward: float  # expected reward of this turn, given the outcome
    value_after: float  # value of playing on; 0 after the end of the game
    belief: Reals | None = None  # [S], the belief after an observation


@dataclass(frozen=True, eq=False)
class ActionBreakdown:
    """The value of an action and its parts."""

    action: int
    value: float
    discount: float
    outcomes: tuple[PossibleOutcome, ...]  # likeliest first
    replies: Reals | None  # [A'], probability of each action of the only other agent, if modelled
    next_replies: Reals | None  # [A'], the same in the next turn
    information_value: float  # part of the value lost if the next action is chosen blindly
    is_last_turn: bool  # whether the value counts no later turn
    scale: float = 1.0  # of the problem's rewards

    @property
    def reward(self) -> float:
        """The expected reward of this turn."""
        return sum(outcome.probability * outcome.reward for outcome in self.outcomes)

    @property
    def value_after(self) -> float:
        """The mean value of playing on, not discounted."""
        return sum(outcome.probability * outcome.value_after for outcome in self.outcomes)

    @property
    def later_value(self) -> float:
        """The part of the value that comes from later turns."""
        return self.discount * self.value_after

    @property
    def mean_belief(self) -> Reals | None:
        """The mean belief `[S]` after the observations; None if no state is hidden."""
        if self.outcomes[0].belief is None:
            return None
        beliefs = np.array([outcome.belief for outcome in self.outcomes])
        return np.asarray(np.array([outcome.probability for outcome in self.outcomes]) @ beliefs)

    def outcome_total(self, outcome: PossibleOutcome) -> float:
        """Return the reward of an outcome plus the discounted value after it."""
        return outcome.reward + self.discount * outcome.value_after

    @property
    def adds_up(self) -> bool:
        """True if the parts sum to the value, as those of exact values do."""
        difference = self.value - self.reward - self.later_value
        return abs(difference) <= RELATIVE_TOLERANCE * max(self.scale, abs(self.value))


class OutcomeShare(NamedTuple):
    """The share of one outcome in the difference between the values of two actions."""

    outcome: PossibleOutcome
    better_probability: float  # after the action with the higher value
    worse_probability: float
    share: float


def compute_outcome_shares(better: ActionBreakdown, worse: ActionBreakdown) -> list[OutcomeShare]:
    """Return the shares of all outcomes in the difference of two values, largest first.

    With the probabilities p of an outcome after both actions, its share is
    (p_better - p_worse) (x - v) / difference. x is its reward plus the discounted value after it,
    and v is the value of the worse action. Outcomes with other rewards or other later values are
    other outcomes. The shares sum to 1 if both values add up.
    """
    difference = better.value - worse.value
    probabilities: list[tuple[PossibleOutcome, list[float]]] = []
    by_text: dict[str, list[tuple[PossibleOutcome, list[float]]]] = {}
    for index, parts in enumerate((better, worse)):
        for outcome in parts.outcomes:
            same_text = by_text.setdefault(outcome.text, [])
            pair = next(
                (item for item in same_text if _is_same(item[0], outcome, better.scale)), None
            )
            if pair is None:
                pair = outcome, [0.0, 0.0]
                same_text.append(pair)
                probabilities.append(pair)
            pair[1][index] += outcome.probability
    shares = [
        OutcomeShare(
            outcome,
            p[0],
            p[1],
            (p[0] - p[1]) * (better.outcome_total(outcome) - worse.value) / difference,
        )
        for outcome, p in probabilities
    ]
    return sorted(shares, key=lambda item: -item.share)


def _is_same(outcome: PossibleOutcome, other: PossibleOutcome, scale: float) -> bool:
    """Return whether two outcomes of the same text have the same reward and later value."""
    atol = RELATIVE_TOLERANCE**2 * scale
    return np.allclose(outcome[2:4], other[2:4], rtol=RELATIVE_TOLERANCE, atol=atol)


class _Consequences(NamedTuple):
    """The K possible consequences of an action; several may have the same text."""

    texts: list[str]
    probabilities: Reals  # [K]
    rewards: Reals  # [K]
    percept: Percept  # of K rows
    states: Array  # [K, ...], a possible next state of each, which decides the legal actions
    is_over: Bools  # [K], whether the game is certainly over
    beliefs: Reals | None = None  # [K, S]
    replies: Reals | None = None  # [A']


def break_down_action(
    seated_policy: SeatedPolicy, action: int, model: AssumedPlayers | None, *, is_last_turn: bool
) -> ActionBreakdown | None:
    """Return the parts of the value of an action; None if they cannot be listed.

    They cannot be listed if the policy has no values, if random events are real numbers, or if the
    policy has no model of the other agents that act in this turn.
    """
    session, seat, policy = seated_policy.session, seated_policy.seat, seated_policy.policy
    assert isinstance(policy, SeatPolicy)
    memory = seated_policy.current_memory()
    values = policy.action_values(memory)
    if values is None or not session.problem.actions[seat].labels:
        return None
    try:
        consequences = (
            _list_observations(session, seat, action, policy, memory)
            if session.problem.partially_observable
            else _list_next_states(session, seat, action, model)
        )
    except BudgetExceeded:
        return None
    if consequences is None or len(consequences.texts) > MAX_VALUED_OUTCOMES:
        return None
    row_count = len(consequences.texts)
    next_memory = policy.update_memory(
        tuple(array.repeat(row_count, axis=0) for array in memory), consequences.percept
    )
    values_after, blind_value = np.zeros(row_count), 0.0
    next_replies = None
    if not is_last_turn:
        legal = session.problem.legal_actions_mask(consequences.states)
        seat_legal = None if legal is None else legal[:, seat]
        values_after = policy.state_values(next_memory, seat_legal)
        values_after = np.where(consequences.is_over, 0.0, values_after)
        if consequences.beliefs is not None:
            blind_value = _compute_blind_value(policy, next_memory, seat_legal, consequences)
        if consequences.replies is not None:
            predicted = policy.predict_actions(next_memory, 1 - seat)
            next_replies = None if predicted is None else consequences.probabilities @ predicted
    discount = session.problem.discount
    seen_value = float(consequences.probabilities @ values_after)
    return ActionBreakdown(
        action,
        float(values[0, action]),
        discount,
        _merge_outcomes(consequences, values_after, has_states=session.problem.state_count != 1),
        consequences.replies,
        next_replies,
        discount * max(seen_value - blind_value, 0.0) if consequences.beliefs is not None else 0.0,
        is_last_turn,
        session.problem.reward_scale,
    )


def _compute_blind_value(
    policy: SeatPolicy, memory: Memory, legal: Bools | None, consequences: _Consequences
) -> float:
    """Return the value of playing on if one action follows whatever is observed.

    `memory` and `legal` have a row for each observation.
    """
    q = policy.action_values(memory)
    assert q is not None
    q = q if legal is None else np.where(legal, q, -np.inf)
    q = np.where(consequences.is_over[:, None], 0.0, q)
    return float((consequences.probabilities[:, None] * q).sum(axis=0).max())


def _list_next_states(
    session: Session, seat: int, action: int, model: AssumedPlayers | None
) -> _Consequences | None:
    """Return the possible next states and the others' actions; None if they are unknown."""
    problem = session.problem
    others = list_active_seats(session, [i for i in range(len(problem.agents)) if i != seat])
    if not all(problem.actions[other].labels for other in others):
        return None
    chances = problem.chance(session.state[None], np.zeros((1, len(problem.agents)), int))
    if not all(isinstance(chance, FiniteChance) for chance in chances):
        return None
    joint = enumerate_joint_actions(session, seat, action, model)
    if others and not joint.is_modelled:
        return None
    states = np.repeat(session.state[None], len(joint.actions), axis=0)
    row, p, outcome = enumerate_possible_outcomes(problem, states, joint.actions)
    probabilities = p * joint.probabilities[row]
    possible = probabilities > 0.0
    row, outcome = row[possible], type(outcome)(*(array[possible] for array in outcome))
    if problem.state_count == 1:
        texts = [_format_other_actions(problem, seat, joint.actions[index]) for index in row]
    else:
        is_end = problem.terminal(outcome.state).tolist()
        texts = [
            f"{END_PREFIX}{problem.describe_state(state)})"
            if ends
            else problem.describe_state(state)
            for state, ends in zip(outcome.state, is_end, strict=True)
        ]
    replies = None
    if others and len(problem.agents) == 2:
        replies = np.zeros(problem.action_counts[1 - seat])
        replies[joint.actions[:, 1 - seat].astype(int)] = joint.probabilities
    return _Consequences(
        texts,
        probabilities[possible],
        outcome.rewards[:, seat],
        build_percept(problem, seat, joint.actions[row], outcome),
        outcome.state,
        problem.terminal(outcome.state),
        replies=replies,
    )


def _format_other_actions(problem: Problem, seat: int, joint_action: Array) -> str:
    """Return the actions of the other agents as text."""
    names = [problem.format_action(i, a) for i, a in enumerate(joint_action) if i != seat]
    return " and ".join(names)


def _list_observations(
    session: Session, seat: int, action: int, policy: SeatPolicy, memory: Memory
) -> _Consequences | None:
    """Return the possible observations of an action; None if there is no belief to use.

    The belief and the other agents' actions are those of the policy; without a model, the others
    act at random.
    """
    problem = session.problem
    predicted = policy.forecast_observations(memory, action)
    if predicted is not None:
        probabilities, beliefs = predicted
        rewards = np.full(len(probabilities), policy.expected_reward(memory, action))
    else:
        belief = _current_belief(session, seat, policy, memory)
        if belief is None:
            return None
        probabilities, beliefs, rewards = _enumerate_observations(problem, seat, action, belief)
    observations = np.flatnonzero(probabilities > 0.0)
    beliefs, rewards = beliefs[observations], rewards[observations]
    states = problem.enumerate_states()
    is_state_over = problem.terminal(states)
    space = problem.observations[seat]
    return _Consequences(
        [space.format_observation(np.asarray(observation)) for observation in observations],
        probabilities[observations],
        rewards,
        Percept(
            np.full(len(observations), action),
            observations,
            None,
            rewards if problem.rewards_observable else None,
        ),
        states[beliefs.argmax(axis=1)],
        np.asarray(~(beliefs[:, ~is_state_over] > 0.0).any(axis=1)),
        beliefs,
    )


def _current_belief(
    session: Session, seat: int, policy: SeatPolicy, memory: Memory
) -> Reals | None:
    """Return the belief `[S]` that a policy's values are about; None if it is not known."""
    beliefs = policy.current_belief(memory)
    if beliefs is not None:
        return np.asarray(beliefs[0])
    if len(session.problem.agents) == 1 and session.has_visible_beliefs:
        return session.view(seat).belief
    return None


def _enumerate_observations(
    problem: Problem, seat: int, action: int, belief: Reals
) -> tuple[Reals, Reals, Reals]:
    """Return the probability, the belief after and the expected reward of each observation.

    The shapes are `[O]`, `[O, S]` and `[O]`. The other agents act uniformly at random.
    """
    support = np.flatnonzero(belief)
    options = [range(count) for count in problem.action_counts]
    options[seat] = range(action, action + 1)
    joint_actions = np.stack(np.meshgrid(*options, indexing="ij"), axis=-1)
    joint_actions = joint_actions.reshape(-1, len(options))
    states = problem.enumerate_states()[support]
    row, p, outcome = enumerate_possible_outcomes(
        problem,
        np.repeat(states, len(joint_actions), axis=0),
        np.tile(joint_actions, (len(states), 1)),
    )
    weights = p * belief[support][row // len(joint_actions)] / len(joint_actions)
    observation_count, state_count = problem.observation_counts[seat], len(belief)
    observed = outcome.observations[:, seat]
    cells = observed * state_count + checked_state_indices(problem, outcome.state)
    joint = np.bincount(cells, weights, observation_count * state_count).astype(float)
    posterior = apply_bayes_rule(joint.reshape(observation_count, state_count))
    rewards = np.bincount(observed, weights * outcome.rewards[:, seat], observation_count)
    likelihood = posterior.likelihood
    return likelihood, posterior.belief, rewards / np.where(likelihood > 0.0, likelihood, 1.0)


def _merge_outcomes(
    consequences: _Consequences, values_after: Reals, *, has_states: bool
) -> tuple[PossibleOutcome, ...]:
    """Return the different outcomes, likeliest first, with means of equal ones.

    They differ in their texts or, in a problem with states, in their rewards.
    """
    rewards_text = [f"{reward:.9g}" * has_states for reward in consequences.rewards.tolist()]
    _, first_rows, indices = np.unique(
        [*map("\n".join, zip(consequences.texts, rewards_text, strict=True))],
        return_index=True,
        return_inverse=True,
    )
    weights = consequences.probabilities
    probabilities = np.bincount(indices, weights)
    rewards = np.bincount(indices, weights * consequences.rewards) / probabilities
    values = np.bincount(indices, weights * values_after) / probabilities
    beliefs = consequences.beliefs
    return tuple(
        PossibleOutcome(
            consequences.texts[first_rows[index]],
            float(probabilities[index]),
            float(rewards[index]),
            float(values[index]),
            None if beliefs is None else beliefs[first_rows[index]],
        )
        for index in np.argsort(-probabilities, kind="stable")
    )

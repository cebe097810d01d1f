"""The possible events of a turn after an action, as one seat perceives them."""

from collections.abc import Callable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.belief import apply_bayes_rule
from dmplay.core.policy import Percept
from dmplay.core.problem import (
    Problem,
    build_percept,
    checked_state_indices,
    enumerate_possible_outcomes,
    validate_outcome,
)
from dmplay.core.work_budget import Budget
from dmplay.draw.options import Forecast
from dmplay.game.action_breakdown import PossibleOutcome

SAMPLE_COUNT = 200  # samples of outcomes that cannot be listed
QUASI_RANDOM_STEPS = np.sqrt(
    np.array([2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0])
)  # irrational steps of quasi-random uniforms

Predict = Callable[[int], Reals | None]  # seat -> probability of each of its actions


class TurnEvents(NamedTuple):
    """The K possible events of a turn, as far as the seat perceives them."""

    probabilities: Reals  # [K]
    rewards: Reals  # [K], the seat's expected reward
    percept: Percept  # of K rows
    states: Array  # [K, ...], a possible next state of each, which decides the legal actions
    is_over: Bools  # [K], whether the problem has certainly ended
    beliefs: Reals | None = None  # [K, S], if states are hidden
    joint_actions: Array | None = None  # [K, n], if all agents see the state
    is_modelled: bool = False  # whether a model predicts the others; else they act at random

    def describe(self, problem: Problem, seat: int) -> list[str]:
        """Return the part of each event that the seat perceives as text."""
        if problem.partially_observable:
            space = problem.observations[seat]
            return [space.format_observation(np.asarray(o)) for o in self.percept.observation]
        if problem.state_count != 1:
            return [problem.describe_state(state) for state in self.states]
        assert self.joint_actions is not None
        return [
            " and ".join(
                problem.format_action(other, action)
                for other, action in enumerate(joint_action)
                if other != seat
            )
            for joint_action in self.joint_actions
        ]

    def merge_outcomes(
        self, problem: Problem, seat: int, values_after: Reals
    ) -> tuple[PossibleOutcome, ...]:
        """Return the different outcomes, likeliest first, with means of equal ones.

        They differ in their texts or, in a problem with states, in their rewards.
        """
        has_states, texts = problem.state_count != 1, self.describe(problem, seat)
        facts = zip(texts, self.rewards.tolist(), self.is_over.tolist(), strict=True)
        keys = [f"{text}\n{r:.9g}\n{over}" if has_states else text for text, r, over in facts]
        _, first_rows, indices = np.unique(keys, return_index=True, return_inverse=True)
        weights, beliefs = self.probabilities, self.beliefs
        probabilities = np.bincount(indices, weights)
        rewards = np.bincount(indices, weights * self.rewards) / probabilities
        values = np.bincount(indices, weights * values_after) / probabilities
        return tuple(
            PossibleOutcome(
                texts[first_rows[index]],
                float(probabilities[index]),
                float(rewards[index]),
                float(values[index]),
                None if beliefs is None else beliefs[first_rows[index]],
                bool(self.is_over[first_rows[index]]),
            )
            for index in np.argsort(-probabilities, kind="stable")
        )


def list_next_states(
    problem: Problem, seat: int, state: Array, predict: Predict, action: float
) -> TurnEvents:
    """Return the possible next states and the others' actions; all agents see the state.

    `predict` returns the probability of each action of another seat, or None if it acts at random.
    Raise BudgetExceeded if they do not fit in memory.
    """
    joint_actions, weights, is_modelled = _list_joint_actions(problem, seat, state, predict, action)
    states = np.repeat(state[None], len(joint_actions), axis=0)
    row, p, outcome = enumerate_possible_outcomes(problem, states, joint_actions)
    probabilities = p * weights[row]
    possible = probabilities > 0.0
    row, outcome = row[possible], type(outcome)(*(array[possible] for array in outcome))
    return TurnEvents(
        probabilities[possible],
        outcome.rewards[:, seat],
        build_percept(problem, seat, joint_actions[row], outcome),
        outcome.state,
        problem.terminal(outcome.state),
        joint_actions=joint_actions[row],
        is_modelled=is_modelled,
    )


def _list_joint_actions(
    problem: Problem, seat: int, state: Array, predict: Predict, action: float
) -> tuple[Array, Reals, bool]:
    """Return the joint actions `[J, n]` with an action of the seat, and their probabilities.

    The third item tells whether a model predicts the other agents; else they act at random.
    """
    legal = problem.legal_actions_mask(state[None])
    options_by_seat: list[Sequence[float]] = []
    probabilities_by_seat: list[Sequence[float]] = []
    is_modelled = False
    for other, action_set in enumerate(problem.actions):
        if other == seat:
            options_by_seat.append([action])
            probabilities_by_seat.append([1.0])
            continue
        weights = (
            np.ones(len(action_set.labels)) if legal is None else legal[0, other].astype(float)
        )
        predicted = predict(other)
        if predicted is not None and (predicted * weights).any():
            weights, is_modelled = predicted * weights, True
        possible = np.flatnonzero(weights)
        options_by_seat.append(possible.tolist())
        probabilities_by_seat.append((weights[possible] / weights.sum()).tolist())
    count = float(np.prod([float(len(options)) for options in options_by_seat]))
    budget = Budget("the forecast of an action", "play the action instead")
    budget.check_memory(8.0 * len(options_by_seat) * count)
    probabilities = np.array([np.prod(row) for row in product(*probabilities_by_seat)])
    return np.array([*product(*options_by_seat)]), probabilities, is_modelled


def sample_next_states(problem: Problem, seat: int, state: Array, action: float) -> Forecast:
    """Return equally likely sampled next states; the other agents' actions are sampled."""
    count = problem.uniform_counts.step
    steps = np.resize(QUASI_RANDOM_STEPS, count + len(problem.agents))
    u = np.outer(np.arange(1, SAMPLE_COUNT + 1), steps) % 1.0
    legal = problem.legal_actions_mask(state[None])
    joint = np.full((SAMPLE_COUNT, len(problem.agents)), action)
    for other, action_set in enumerate(problem.actions):
        if other != seat:
            masks = None if legal is None else np.tile(legal[0, other], (SAMPLE_COUNT, 1))
            joint[:, other] = action_set.sample_actions(u[:, count + other], masks)
    if all(action_set.labels for action_set in problem.actions):
        joint = joint.astype(int)
    states = np.repeat(state[None], SAMPLE_COUNT, axis=0)
    outcome = problem.step(states, joint, u[:, :count])
    validate_outcome(problem, outcome)
    probabilities = np.full(SAMPLE_COUNT, 1.0 / SAMPLE_COUNT)
    return Forecast(action, probabilities, outcome.state, is_sampled=True)


def list_observations(  # noqa: PLR0913, PLR0917 - three arrays describe the observations
    problem: Problem, seat: int, action: int, likelihoods: Reals, beliefs: Reals, rewards: Reals
) -> TurnEvents:
    """Return the possible observations after an action, in the order of their labels.

    They have the probabilities `[O]`, the beliefs after them `[O, S]` and expected rewards `[O]`.
    """
    observations = np.flatnonzero(likelihoods > 0.0)
    beliefs, rewards = beliefs[observations], rewards[observations]
    states = problem.enumerate_states()
    is_state_over = problem.terminal(states)
    percept_rewards = rewards if problem.rewards_observable else None
    return TurnEvents(
        likelihoods[observations],
        rewards,
        Percept(np.full(len(observations), action), observations, None, percept_rewards),
        states[beliefs.argmax(axis=1)],
        np.asarray(~(beliefs[:, ~is_state_over] > 0.0).any(axis=1)),
        beliefs,
    )


def enumerate_observations(
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


def find_unique_states(problem: Problem, states: Array) -> tuple[Array, Array]:
    """Return the different states, and the index of each of the states `[K]` among them."""
    if states.dtype != object:
        unique_states, indices = np.unique(states, axis=0, return_inverse=True)
        return unique_states, indices.reshape(-1)
    names = [problem.format_state(state) for state in states]  # objects may have no order
    _, first, indices = np.unique(names, return_index=True, return_inverse=True)
    return states[first], indices.reshape(-1)

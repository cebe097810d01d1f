"""Reactive stochastic policies for two predators that hunt, by natural gradient (F.15).

The agents take turns to improve their policies by the natural gradient of the team's mean value
over all start states, while the other's policy is fixed (section 27.4). The gradient comes from the
state values and the discounted visits of each state; both follow the policies by sweeps.
"""

from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.errors import BadParameter

from .rules import CAPTURE_REWARD, MOVE_REWARD, SENSE_LABELS, CollaborativePredatorPrey

MAX_STATES = 5000  # states
ROUND_COUNT = 60
SWEEPS_PER_ROUND = 10  # of values and visits; each round continues from the last
GRADIENT_STEP = 1.0  # step of the exponent per unit of a move's advantage
INITIAL_BIAS = 0.2  # of the initial policies
PROBABILITY_DECIMALS = 4  # of a probability in the result
TRUNCATION_TOLERANCE = 1e-12  # relative size of the remainder of a value that is left out


class ReactiveTeam(NamedTuple):
    """A reactive policy for each predator, and the team's mean value."""

    policies: Reals  # [2, observations, 6]
    mean_value: float  # over all states, with the first observation of the state itself


def optimize_reactive_team(problem: CollaborativePredatorPrey) -> ReactiveTeam:
    """Return the best reactive policies found by natural gradient ascent; `discount` is below 1.

    The candidates are the initial policies, those with the best estimated value, and the last ones.
    """
    check_supported(problem)
    arrays = _PredatorPreyArrays(problem)
    policies = _make_initial_policies()
    values: Reals = np.zeros(arrays.rewards.shape)
    visits: Reals = np.zeros(arrays.rewards.shape)
    candidates, best_value = [policies.copy()], -np.inf
    for round_index in range(ROUND_COUNT):
        for seat in (0, 1):
            work = ARRAY_CALL_WORK + 2 * arrays.operations_per_sweep
            progress = (2 * round_index + seat) / (2 * ROUND_COUNT)
            walks = [arrays.compute_walks(policy) for policy in policies]
            for _ in range(SWEEPS_PER_ROUND):
                arrays.budget.spend_work(work, progress)
                values = arrays.backup_values(values, *walks)
                visits = arrays.propagate_visits(visits, *walks)
            gradient = arrays.compute_policy_gradient(seat, values, visits, walks[1 - seat])
            advantages = gradient - gradient.max(axis=1, keepdims=True)
            policies[seat] *= np.exp(GRADIENT_STEP * advantages)
            policies[seat] /= policies[seat].sum(axis=1, keepdims=True)
        if values.mean() > best_value:  # approximately the value of the policies before this round
            best_value, candidates[1:] = values.mean(), [policies.copy()]
    teams = [_evaluate_rounded_team(arrays, candidate) for candidate in [*candidates, policies]]
    return max(teams, key=lambda team: team.mean_value)


def _evaluate_rounded_team(arrays: "_PredatorPreyArrays", policies: Reals) -> ReactiveTeam:
    """Return the team of these policies, with probabilities rounded and its value computed."""
    policies = np.round(policies, PROBABILITY_DECIMALS)
    policies /= policies.sum(axis=2, keepdims=True)
    return ReactiveTeam(policies, arrays.evaluate_policies(policies))


def check_supported(problem: CollaborativePredatorPrey) -> None:
    """Raise BadParameter unless the hunt has two predators, few states and a discount below 1."""
    if problem.predators != 2 or problem.state_count > MAX_STATES:
        actual = f"{problem.predators} predators in {problem.state_count} states"
        raise BadParameter(f"got {actual}, expected 2 in at most {MAX_STATES} states")
    if problem.discount >= 1.0:
        raise BadParameter("an infinite horizon needs a discount below 1")


def compute_state_rewards(problem: CollaborativePredatorPrey) -> Reals:
    """Return the reward `[i, j, p]` of each state."""
    is_captured = problem.is_prey_captured(problem.enumerate_states())
    rewards = np.where(is_captured, CAPTURE_REWARD, MOVE_REWARD)
    return rewards.reshape((len(problem.hexes),) * 3)


def _make_initial_policies() -> Reals:
    """Return uniform policies with a small bias of each predator to a direction of its own.

    Without a bias, symmetric directions would leave the gradient nothing to choose.
    """
    policies: Reals = np.ones((2, len(SENSE_LABELS), 6))
    policies[0, :, 0] += INITIAL_BIAS
    policies[1, :, 1] += INITIAL_BIAS
    return np.asarray(policies / policies.sum(axis=2, keepdims=True))


class _PredatorPreyArrays:
    """The hunt of two predators as arrays over their hexes i and j and the prey's hex p."""

    def __init__(self, problem: CollaborativePredatorPrey) -> None:
        hex_count = len(problem.hexes)
        self.budget = Budget("reactive team", "try a smaller map or discount", 2e10)
        self.operations_per_sweep = 20.0 * hex_count**4  # operations
        self.discount = problem.discount
        self.walk_transitions = problem.walk_probabilities  # [6, i, i']
        # [i, j, p, p']
        self.prey_transitions = problem.prey_move_probabilities.reshape((hex_count,) * 4)
        observations = problem.observation_table[:, 0].reshape((hex_count,) * 3)[:, 0]
        labels_per_sense = problem.observation_counts[0] // len(SENSE_LABELS)
        self.observations: Ints = observations // labels_per_sense  # [i, p]
        self.feeding_mask = np.eye(hex_count, dtype=bool)
        self.rewards = compute_state_rewards(problem)

    def compute_walks(self, policy: Reals) -> Reals:
        """Return the move probabilities `[p, i, i']` of a predator with a reactive policy.

        On the prey's hex the predator stays.
        """
        moves = np.einsum("ipa,air->pir", policy[self.observations], self.walk_transitions)
        return np.where(self.feeding_mask[:, :, None], np.eye(len(self.feeding_mask)), moves)

    def backup_values(self, values: Reals, first_walks: Reals, second_walks: Reals) -> Reals:
        """Return the values `[i, j, p]` one turn earlier."""
        next_values = _average_over_walks(
            second_walks, _average_over_walks(first_walks, values[None]).swapaxes(1, 2)
        ).swapaxes(1, 2)
        expected = np.einsum("pijz,ijpz->ijp", next_values, self.prey_transitions)
        return np.asarray(self.rewards + self.discount * expected)

    def propagate_visits(self, visits: Reals, first_walks: Reals, second_walks: Reals) -> Reals:
        """Return the discounted visits `[i, j, p]` of each state, one sweep further.

        A game begins in each state with equal probability.
        """
        prey_moved = np.einsum("ijp,ijpz->pijz", visits, self.prey_transitions)
        reversed_walks = first_walks.swapaxes(1, 2), second_walks.swapaxes(1, 2)
        all_moved = _average_over_walks(
            reversed_walks[1], _average_over_walks(reversed_walks[0], prey_moved).swapaxes(1, 2)
        ).swapaxes(1, 2)
        return np.asarray(1.0 / visits.size + self.discount * all_moved.sum(axis=0))

    def compute_policy_gradient(
        self, seat: int, values: Reals, visits: Reals, partner_walks: Reals
    ) -> Reals:
        """Return the value `[observations, 6]` of each move, averaged over the discounted visits.

        The average is over the visits in which the predator has the observation and may move.
        """
        axes = (0, 1, 2) if seat == 0 else (1, 0, 2)
        values, visits = values.transpose(axes), visits.transpose(axes)
        flights = self.prey_transitions if seat == 0 else self.prey_transitions.swapaxes(0, 1)
        next_values = np.einsum("pjy,xyz->pjxz", partner_walks, values)
        prey_moved = np.einsum("ijp,ijpz->pijz", visits, flights)
        gains = self.discount * np.einsum(
            "pijz,pjxz,aix->pia", prey_moved, next_values, self.walk_transitions, optimize=True
        )
        gains[self.feeding_mask] = 0.0  # A predator on the prey's hex does not move.
        visit_rates = np.where(self.feeding_mask.T, 0.0, visits.sum(axis=1))
        gradient = np.zeros((len(SENSE_LABELS), len(self.walk_transitions)))
        for sense in range(len(SENSE_LABELS)):
            has_sense = self.observations == sense
            visit_rate = visit_rates[has_sense].sum()
            if visit_rate > 0:
                gradient[sense] = gains.swapaxes(0, 1)[has_sense].sum(axis=0) / visit_rate
        return gradient

    def evaluate_policies(self, policies: Reals) -> float:
        """Return the mean value over all start states of a team with these policies."""
        values: Reals = np.zeros(self.rewards.shape)
        walks = [self.compute_walks(policy) for policy in policies]
        log_discount = np.log(max(self.discount, TRUNCATION_TOLERANCE))
        sweeps = int(np.ceil(np.log(TRUNCATION_TOLERANCE) / log_discount))
        self.budget.check_work(sweeps * (ARRAY_CALL_WORK + self.operations_per_sweep))
        for _ in range(sweeps):
            self.budget.spend_work(ARRAY_CALL_WORK + self.operations_per_sweep)
            values = self.backup_values(values, *walks)
        return float(values.mean())


def _average_over_walks(walks: Reals, values: Reals) -> Reals:
    """Return the mean of values `[p or 1, i', k, z]` over one predator's moves `[p, i, i']`."""
    hex_count = walks.shape[0]
    flat = values.reshape(values.shape[0], hex_count, -1)
    return np.asarray(np.matmul(walks, flat).reshape(hex_count, *values.shape[1:]))

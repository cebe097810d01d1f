"""Mixed rules from what a predator senses to where it goes, for a team of two that hunts (F.15).

Each in turn mixes what pays into its rule, by the natural gradient of what the team earns on
average from anywhere, while the other's rule stands (section 27.4). The gradient comes from the
values of all states and how often, discounted, each is met; both follow the rules by sweeps.
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Ints, Reals
from dmplay.errors import BadParameter
from dmplay.problems.collaborative_predator_prey import (
    CAPTURE_REWARD,
    MOVE_REWARD,
    SENSE_LABELS,
    CollaborativePredatorPrey,
)

MAX_STATES = 5000  # states
ROUND_COUNT = 60
SWEEPS_PER_ROUND = 10  # of values and visits, a round: each goes on from the last
GRADIENT_STEP = 1.0  # how much a move that is worth 1 more than the rule gains on it
INITIAL_BIAS = 0.2  # of the first rules
PROBABILITY_DECIMALS = 4  # kept of a probability
TRUNCATION_TOLERANCE = 1e-12  # of a value that is left out


class ReactiveTeam(NamedTuple):
    """A rule for each predator, and what both earn."""

    policies: Reals  # [2, senses, 6]
    mean_value: float  # mean over all states, where the first sense too is of the state


def optimize_reactive_team(problem: CollaborativePredatorPrey) -> ReactiveTeam:
    """The best of the rules that the gradient comes by from random moves: the first, those that
    seemed best and the last; `discount` below 1.
    """
    check_supported(problem)
    hunt = _PredatorPreyArrays(problem)
    rules = _make_initial_policies()
    values: Reals = np.zeros(hunt.rewards.shape)
    visits: Reals = np.zeros(hunt.rewards.shape)
    tried, most = [rules.copy()], -np.inf
    for turn in range(ROUND_COUNT):
        for seat in (0, 1):
            walks = [hunt.compute_walks(rule) for rule in rules]
            for _ in range(SWEEPS_PER_ROUND):
                hunt.budget.spend_work(
                    ARRAY_CALL_WORK + 2 * hunt.operations_per_sweep,
                    (2 * turn + seat) / (2 * ROUND_COUNT),
                )
                values, visits = (
                    hunt.backup_values(values, *walks),
                    hunt.propagate_visits(visits, *walks),
                )
            worth = hunt.compute_policy_gradient(seat, values, visits, walks[1 - seat])
            rules[seat] *= np.exp(GRADIENT_STEP * (worth - worth.max(axis=1, keepdims=True)))
            rules[seat] /= rules[seat].sum(axis=1, keepdims=True)
        if values.mean() > most:  # about what the rules before these earn
            most, tried[1:] = values.mean(), [rules.copy()]
    return max(
        (_evaluate_rounded_team(hunt, one) for one in [*tried, rules]),
        key=lambda team: team.mean_value,
    )


def _evaluate_rounded_team(arrays: "_PredatorPreyArrays", policies: Reals) -> ReactiveTeam:
    """A team of these rules, of a few digits, with what it earns."""
    policies = np.round(policies, PROBABILITY_DECIMALS)
    policies /= policies.sum(axis=2, keepdims=True)
    return ReactiveTeam(policies, arrays.evaluate_policies(policies))


def check_supported(problem: CollaborativePredatorPrey) -> None:
    """Refuses a hunt of other than two, of too many hexes, or without discount."""
    if problem.predators != 2 or problem.state_count > MAX_STATES:
        got = f"{problem.predators} predators in {problem.state_count} states"
        raise BadParameter(f"got {got}, expected 2 in at most {MAX_STATES}")
    if problem.discount >= 1.0:
        raise BadParameter("a hunt without end needs a discount below 1")


def compute_state_rewards(problem: CollaborativePredatorPrey) -> Reals:
    """The reward `[i, j, p]` of each state."""
    size = len(problem.hexes)
    caught = problem.is_prey_captured(problem.enumerate_states()).reshape(size, size, size)
    return np.where(caught, CAPTURE_REWARD, MOVE_REWARD)


def _make_initial_policies() -> Reals:
    """Random moves but for a lean of each predator's own: where all directions are alike, chance
    alone would leave nothing to choose.
    """
    rules: Reals = np.ones((2, len(SENSE_LABELS), 6))
    rules[0, :, 0] += INITIAL_BIAS
    rules[1, :, 1] += INITIAL_BIAS
    return np.asarray(rules / rules.sum(axis=2, keepdims=True))


class _PredatorPreyArrays:
    """The hunt of two as arrays over their hexes i and j and the prey's p."""

    def __init__(self, problem: CollaborativePredatorPrey) -> None:
        size = len(problem.hexes)
        self.budget = Budget("a reactive team", "try a smaller map or discount", 2e10)
        self.operations_per_sweep = 20.0 * size**4  # operations of one
        states = problem.enumerate_states()
        self.discount = problem.discount
        self.walk_transitions = problem.walk_probabilities  # [6, i, i']
        self.prey_transitions = problem.prey_move_probabilities.reshape(
            size, size, size, size
        )  # [i, j, p, p']
        seen = problem.observe(states)[:, 0].reshape(size, size, size)[:, 0]
        self.observations: Ints = seen // (
            problem.observation_counts[0] // len(SENSE_LABELS)
        )  # [i, p]
        self.feeding_mask = np.eye(size, dtype=bool)
        self.rewards = compute_state_rewards(problem)

    def compute_walks(self, policy: Reals) -> Reals:
        """Where a predator with this rule goes `[p, i, i']`; on the prey it stays."""
        walked = np.einsum("ipa,air->pir", policy[self.observations], self.walk_transitions)
        return np.where(self.feeding_mask[:, :, None], np.eye(len(self.feeding_mask)), walked)

    def backup_values(self, values: Reals, first_walks: Reals, second_walks: Reals) -> Reals:
        """The values `[i, j, p]` one turn earlier."""
        met = _average_over_walks(
            second_walks, _average_over_walks(first_walks, values[None]).swapaxes(1, 2)
        ).swapaxes(1, 2)
        return np.asarray(
            self.rewards + self.discount * np.einsum("pijz,ijpz->ijp", met, self.prey_transitions)
        )

    def propagate_visits(self, visits: Reals, first_walks: Reals, second_walks: Reals) -> Reals:
        """How often each state is met `[i, j, p]`, discounted, from visits that begin anywhere."""
        left = np.einsum("ijp,ijpz->pijz", visits, self.prey_transitions)
        back = first_walks.swapaxes(1, 2), second_walks.swapaxes(1, 2)
        moved = _average_over_walks(
            back[1], _average_over_walks(back[0], left).swapaxes(1, 2)
        ).swapaxes(1, 2)
        return np.asarray(1.0 / visits.size + self.discount * moved.sum(axis=0))

    def compute_policy_gradient(
        self, seat: int, values: Reals, visits: Reals, partner_walks: Reals
    ) -> Reals:
        """What each move `[senses, 6]` is worth on average where a sense is had."""
        turned = (0, 1, 2) if seat == 0 else (1, 0, 2)
        values, visits = values.transpose(turned), visits.transpose(turned)
        flights = self.prey_transitions if seat == 0 else self.prey_transitions.swapaxes(0, 1)
        met = np.einsum("pjy,xyz->pjxz", partner_walks, values)
        left = np.einsum("ijp,ijpz->pijz", visits, flights)
        gain = self.discount * np.einsum(
            "pijz,pjxz,aix->pia", left, met, self.walk_transitions, optimize=True
        )
        gain[self.feeding_mask] = 0.0  # who feeds does not move
        often = np.where(self.feeding_mask.T, 0.0, visits.sum(axis=1))
        worth = np.zeros((len(SENSE_LABELS), len(self.walk_transitions)))
        for sense in range(len(SENSE_LABELS)):
            here = self.observations == sense
            met_here = often[here].sum()
            if met_here > 0:
                worth[sense] = gain.swapaxes(0, 1)[here].sum(axis=0) / met_here
        return worth

    def evaluate_policies(self, policies: Reals) -> float:
        """What a team with these rules earns, on average from anywhere."""
        values: Reals = np.zeros(self.rewards.shape)
        walks = [self.compute_walks(rule) for rule in policies]
        sweeps = int(
            np.ceil(np.log(TRUNCATION_TOLERANCE) / np.log(max(self.discount, TRUNCATION_TOLERANCE)))
        )
        self.budget.check_work(sweeps * (ARRAY_CALL_WORK + self.operations_per_sweep))
        for _ in range(sweeps):
            self.budget.spend_work(ARRAY_CALL_WORK + self.operations_per_sweep)
            values = self.backup_values(values, *walks)
        return float(values.mean())


def _average_over_walks(walks: Reals, values: Reals) -> Reals:
    """The mean of values `[p or 1, i', k, z]` over where walks `[p, i, i']` lead."""
    size = walks.shape[0]
    flat = values.reshape(values.shape[0], size, -1)
    return np.asarray(np.matmul(walks, flat).reshape(size, *values.shape[1:]))

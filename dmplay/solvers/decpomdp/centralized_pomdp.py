"""The centralized relaxation of a Dec-POMDP: one planner that sees all agents' observations.

Its values are upper bounds on those of the team. They are exact over as many turns of joint
histories as can be expanded; later turns have the fast informed bound (section 21.2), and the last
resort is the bound of the MDP in which the state is seen. Beliefs are expanded on demand.
"""

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.solvers.decpomdp.dec_pomdp_model import PROBABILITY_DECIMALS, DecPomdp
from dmplay.solvers.mdp.transition_graph import index_distinct_keys

MAX_EXACT_HISTORIES = 300_000  # joint histories whose values are exact
# for the fast informed bound; turns beyond it have the bound of the MDP
INFORMED_WORK_LIMIT = 1.5e9
MIN_PROBABILITY = 1e-12  # of an observation, below which it counts as impossible
NOT_EXPANDED = IMPOSSIBLE = -1  # markers of what follows a belief


class _TurnBeliefs:
    """The beliefs of one turn, and the outcomes of the belief-action pairs expanded so far."""

    def __init__(self, team: DecPomdp, bound: Reals) -> None:
        state_count, action_count = team.rewards.shape
        observation_count = team.observation_model.shape[2]
        self.state_action_bounds = bound  # [S, A]
        self.belief_index: dict[bytes, int] = {}
        self.beliefs = np.empty((1, state_count))  # grows by doubling
        self.action_upper_bounds = np.empty((1, action_count))
        # row of each belief and action in the next two arrays
        self.outcome_rows = np.full((1, action_count), NOT_EXPANDED)
        self.next_beliefs = np.empty((0, observation_count), np.int64)
        self.observation_probabilities = np.empty((0, observation_count))

    @property
    def byte_count(self) -> float:
        """The approximate memory of the turn in bytes."""
        bound_count, outcome_count = self.action_upper_bounds.size, self.next_beliefs.size
        return 8.0 * (self.beliefs.size + 2 * bound_count + 2 * outcome_count)

    def find_or_add_beliefs(self, beliefs: Reals) -> Ints:
        """Return the indices `[N]` of beliefs `[N, S]`, adding new ones with a quick bound."""
        keys = np.round(beliefs, PROBABILITY_DECIMALS) + 0.0
        old_count = len(self.belief_index)
        indices, new = index_distinct_keys([key.tobytes() for key in keys], self.belief_index)
        added = slice(old_count, len(self.belief_index))
        while len(self.belief_index) > len(self.beliefs):
            self.beliefs = np.concatenate([self.beliefs, np.empty_like(self.beliefs)])
            unknown_bounds = np.empty_like(self.action_upper_bounds)
            self.action_upper_bounds = np.concatenate([self.action_upper_bounds, unknown_bounds])
            unknown_rows = np.full_like(self.outcome_rows, NOT_EXPANDED)
            self.outcome_rows = np.concatenate([self.outcome_rows, unknown_rows])
        self.beliefs[added] = beliefs[new]
        self.action_upper_bounds[added] = beliefs[new] @ self.state_action_bounds
        return indices

    def add_outcomes(
        self, pairs: Ints, next_beliefs: Ints, observation_probabilities: Reals
    ) -> None:
        """Add the outcomes of pairs of a belief and a joint action `[M, 2]`."""
        self.outcome_rows[pairs[:, 0], pairs[:, 1]] = len(self.next_beliefs) + np.arange(len(pairs))
        self.next_beliefs = np.concatenate([self.next_beliefs, next_beliefs])
        self.observation_probabilities = np.concatenate(
            [self.observation_probabilities, observation_probabilities]
        )


class CentralizedPomdp:
    """The POMDP of one planner over a number of turns, with upper bounds on its action values."""

    def __init__(
        self,
        team: DecPomdp,
        turns: int,
        budget: Budget,
        informed_work_limit: float = INFORMED_WORK_LIMIT,
    ) -> None:
        self.team, self.budget, self.turns = team, budget, turns
        self._turns = [
            _TurnBeliefs(team, bound)
            for bound in _bound_action_values_by_turn(team, turns, budget, informed_work_limit)
        ]
        self._turns[0].find_or_add_beliefs(team.initial_belief[None])
        self._backup_exact_turns(self._expand_first_turns())

    @property
    def upper_bound(self) -> float:
        """The upper bound on the value at the start."""
        return float(self._turns[0].action_upper_bounds[0].max())

    def get_action_upper_bounds(self, turn: int, belief_indices: Ints) -> Reals:
        """Return upper bounds `[N, A]` on the values of joint actions at beliefs of a turn."""
        return self._turns[turn].action_upper_bounds[belief_indices]

    def compute_expected_rewards(self, turn: int, belief_indices: Ints, actions: Ints) -> Reals:
        """Return the expected rewards `[N]` of joint actions at beliefs of a turn."""
        rewards = self.team.rewards[:, actions].T
        return np.asarray((self._turns[turn].beliefs[belief_indices] * rewards).sum(axis=1))

    def compute_next_beliefs(
        self, turn: int, belief_indices: Ints, actions: Ints
    ) -> tuple[Ints, Reals]:
        """Return the next beliefs `[N, O]` by joint observation, and the observation probabilities.

        Impossible observations have the index -1 and probability 0.
        """
        current, next_turn = self._turns[turn], self._turns[turn + 1]
        missing = current.outcome_rows[belief_indices, actions] == NOT_EXPANDED
        if missing.any():
            pairs = np.unique(np.stack([belief_indices[missing], actions[missing]], axis=1), axis=0)
            probabilities = np.zeros((len(pairs), self.team.observation_model.shape[2]))
            next_beliefs = np.full(probabilities.shape, IMPOSSIBLE)
            for pair_index, (belief_index, action) in enumerate(pairs.tolist()):
                self.budget.spend_work(ARRAY_CALL_WORK + 2.0 * self.team.propagation_work)
                self.budget.check_memory(2 * sum(beliefs.byte_count for beliefs in self._turns))
                belief = current.beliefs[belief_index : belief_index + 1]
                propagated = self.team.propagate_states(belief, action)[0]
                joint = propagated[:, None] * self.team.observation_model[action]
                probabilities[pair_index] = joint.sum(axis=0)
                is_possible = probabilities[pair_index] > MIN_PROBABILITY
                posteriors = joint[:, is_possible] / probabilities[pair_index, is_possible]
                next_beliefs[pair_index, is_possible] = next_turn.find_or_add_beliefs(posteriors.T)
            probabilities[probabilities <= MIN_PROBABILITY] = 0.0
            current.add_outcomes(pairs, next_beliefs, probabilities)
        rows = current.outcome_rows[belief_indices, actions]
        return current.next_beliefs[rows], current.observation_probabilities[rows]

    def _expand_first_turns(self) -> int:
        """Expand all beliefs of the first turns, and return the number of complete turns."""
        states, action_count = self.team.rewards.shape
        observation_count = self.team.observation_model.shape[2]
        bytes_per_history = 64 * (states + 2 * action_count + observation_count)
        remaining = min(MAX_EXACT_HISTORIES, self.budget.memory_limit / bytes_per_history)
        for turn, current in enumerate(self._turns[:-1]):
            count = len(current.belief_index)
            remaining -= count * action_count * observation_count
            if remaining < 0:
                return turn
            pairs = np.divmod(np.arange(count * action_count), action_count)
            self.compute_next_beliefs(turn, *pairs)
        return self.turns - 1

    def _backup_exact_turns(self, exact_turn_count: int) -> None:
        """Replace the bounds of the expanded turns by exact values, from the last one back."""
        for turn in reversed(range(exact_turn_count)):
            current, next_turn = self._turns[turn], self._turns[turn + 1]
            self.budget.spend_work(ARRAY_CALL_WORK + 4.0 * current.next_beliefs.size)
            count, next_count = len(current.belief_index), len(next_turn.belief_index)
            best_values = np.append(next_turn.action_upper_bounds[:next_count].max(axis=1), 0.0)
            weighted_values = current.observation_probabilities * best_values[current.next_beliefs]
            next_values = weighted_values.sum(axis=1)[current.outcome_rows[:count]]
            rewards = current.beliefs[:count] @ self.team.rewards
            current.action_upper_bounds[:count] = rewards + self.team.discount * next_values


def _bound_action_values_by_turn(
    team: DecPomdp, turns: int, budget: Budget, informed_work_limit: float
) -> list[Reals]:
    """Return an upper bound `[S, A]` on the action values of each turn.

    It is the fast informed bound as far as its work limit allows, else the MDP bound.
    """
    action_count, observation_count = len(team.joint_actions), team.observation_model.shape[2]
    mdp_work = action_count * (ARRAY_CALL_WORK + 2.0 * team.propagation_work)
    informed_work = observation_count * (mdp_work + 2.0 * action_count**2 * team.propagation_work)
    budget.check_memory(8.0 * turns * team.rewards.size)
    bounds = [team.rewards]
    for turn in reversed(range(turns - 1)):
        is_informed = (turn + 1) * informed_work <= informed_work_limit
        budget.spend_work(informed_work if is_informed else mdp_work)
        backup_bound = _backup_informed_bound if is_informed else _backup_mdp_bound
        bounds.append(team.rewards + team.discount * backup_bound(team, bounds[-1]))
    return bounds[::-1]


def _backup_informed_bound(team: DecPomdp, bound: Reals) -> Reals:
    """Return the fast informed bound `[S, A]` on the value of the next turn.

    It is the mean over observations of the best next action, given that the current state is known.
    """
    next_values = np.zeros_like(team.rewards)
    for action in range(next_values.shape[1]):
        for probabilities in team.observation_model[action].T:
            if probabilities.any():
                values = team.backup_values(bound.T * probabilities, action)
                next_values[:, action] += values.max(axis=0)
    return next_values


def _backup_mdp_bound(team: DecPomdp, bound: Reals) -> Reals:
    """Return the MDP bound `[S, A]` on the next turn: the mean of each next state's best value."""
    best_values, actions = bound.max(axis=1)[None], range(len(team.joint_actions))
    return np.stack([team.backup_values(best_values, a)[0] for a in actions], axis=1)

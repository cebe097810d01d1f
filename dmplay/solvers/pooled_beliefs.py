"""What a team would believe and earn if one planner saw all that its agents observe.

No team earns more than such a planner, so its values bound what the agents earn apart. They are
exact over as many turns of joint histories as can be listed; beyond, the fast informed bound holds
(section 21.2), and far off that of seeing the state. Beliefs are found when they are asked for.
"""

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Ints, Reals
from dmplay.solvers.team import PROBABILITY_DECIMALS, DecPomdp

MAX_EXACT_HISTORIES = 300_000  # joint histories whose values are exact
INFORMED_WORK_LIMIT = 1.5e9  # work for the fast informed bound; for turns beyond the state is seen
MIN_PROBABILITY = 1e-12  # a probability below which nothing is seen
NOT_EXPANDED = IMPOSSIBLE = -1  # what follows: not yet found, or what cannot be


class _TurnBeliefs:
    """The beliefs met with some turns done, and what follows those that were asked for."""

    def __init__(self, team: DecPomdp, bound: Reals) -> None:
        states, many, kinds = (
            len(team.initial_belief),
            len(team.joint_actions),
            team.observation_model.shape[2],
        )
        self.state_action_bounds = bound  # [S, A]
        self.belief_index: dict[bytes, int] = {}
        self.beliefs = np.empty((1, states))  # room for more than are known
        self.action_upper_bounds = np.empty((1, many))
        self.outcome_rows = np.full((1, many), NOT_EXPANDED)  # in the next two
        self.next_beliefs = np.empty((0, kinds), np.int64)
        self.observation_probabilities = np.empty((0, kinds))

    @property
    def byte_count(self) -> float:
        """How many bytes it takes, about."""
        return 8.0 * (
            self.beliefs.size + 2 * self.action_upper_bounds.size + 2 * self.next_beliefs.size
        )

    def find_or_add_beliefs(self, beliefs: Reals) -> Ints:
        """The places `[N]` of beliefs `[N, S]`, new ones with the quick bound."""
        keys = np.round(beliefs, PROBABILITY_DECIMALS) + 0.0
        before = len(self.belief_index)
        place = [
            self.belief_index.setdefault(key.tobytes(), len(self.belief_index)) for key in keys
        ]
        found, first = np.unique(place, return_index=True)
        fresh = first[found >= before]
        while len(self.belief_index) > len(self.beliefs):
            self.beliefs = np.concatenate([self.beliefs, np.empty_like(self.beliefs)])
            self.action_upper_bounds = np.concatenate(
                [self.action_upper_bounds, np.empty_like(self.action_upper_bounds)]
            )
            self.outcome_rows = np.concatenate(
                [self.outcome_rows, np.full_like(self.outcome_rows, NOT_EXPANDED)]
            )
        self.beliefs[before : len(self.belief_index)] = beliefs[fresh]
        self.action_upper_bounds[before : len(self.belief_index)] = (
            beliefs[fresh] @ self.state_action_bounds
        )
        return np.array(place)

    def add_outcomes(
        self, pairs: Ints, next_beliefs: Ints, observation_probabilities: Reals
    ) -> None:
        """What follows pairs of a belief and a joint action `[M, 2]`."""
        self.outcome_rows[pairs[:, 0], pairs[:, 1]] = len(self.next_beliefs) + np.arange(len(pairs))
        self.next_beliefs = np.concatenate([self.next_beliefs, next_beliefs])
        self.observation_probabilities = np.concatenate(
            [self.observation_probabilities, observation_probabilities]
        )


class CentralizedPomdp:
    """The beliefs of one planner with so many turns, and the most that each action is worth."""

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
            for bound in _compute_turn_bounds(team, turns, budget, informed_work_limit)
        ]
        self._turns[0].find_or_add_beliefs(team.initial_belief[None])
        self._backup_exact_turns(self._expand_first_turns())

    @property
    def upper_bound(self) -> float:
        """The most that one planner earns."""
        return float(self._turns[0].action_upper_bounds[0].max())

    def get_action_upper_bounds(self, turn: int, belief_indices: Ints) -> Reals:
        """No less than joint actions `[N, A]` and the best of all later are worth."""
        return self._turns[turn].action_upper_bounds[belief_indices]

    def compute_expected_rewards(self, turn: int, belief_indices: Ints, actions: Ints) -> Reals:
        """The rewards `[N]` expected."""
        rewards = self.team.rewards[:, actions].T
        return np.asarray((self._turns[turn].beliefs[belief_indices] * rewards).sum(axis=1))

    def expand_actions(self, turn: int, belief_indices: Ints, actions: Ints) -> tuple[Ints, Reals]:
        """The beliefs `[N, O]` that follow by joint observation, and how likely these are."""
        now, later = self._turns[turn], self._turns[turn + 1]
        unknown = now.outcome_rows[belief_indices, actions] == NOT_EXPANDED
        if unknown.any():
            pairs = np.unique(np.stack([belief_indices[unknown], actions[unknown]], axis=1), axis=0)
            likely = np.zeros((len(pairs), self.team.observation_model.shape[2]))
            after = np.full(likely.shape, IMPOSSIBLE)
            for number, (place, action) in enumerate(pairs.tolist()):
                self.budget.spend_work(ARRAY_CALL_WORK + 2.0 * self.team.propagation_work)
                self.budget.check_memory(2 * sum(one.byte_count for one in self._turns))
                came = self.team.propagate_states(now.beliefs[place : place + 1], action)[0]
                joint = came[:, None] * self.team.observation_model[action]
                likely[number] = joint.sum(axis=0)
                able = likely[number] > MIN_PROBABILITY
                after[number, able] = later.find_or_add_beliefs(
                    (joint[:, able] / likely[number, able]).T
                )
            now.add_outcomes(pairs, after, np.where(likely > MIN_PROBABILITY, likely, 0.0))
        row = now.outcome_rows[belief_indices, actions]
        return now.next_beliefs[row], now.observation_probabilities[row]

    def _expand_first_turns(self) -> int:
        """Lists all beliefs of the first turns; of how many what follows is known."""
        (states, many), kinds = self.team.rewards.shape, self.team.observation_model.shape[2]
        left = min(
            MAX_EXACT_HISTORIES, self.budget.memory_limit / (64 * (states + 2 * many + kinds))
        )
        for turn, now in enumerate(self._turns[:-1]):
            left -= len(now.belief_index) * many * kinds
            if left < 0:
                return turn
            places = np.repeat(np.arange(len(now.belief_index)), many)
            self.expand_actions(turn, places, np.tile(np.arange(many), len(now.belief_index)))
        return self.turns - 1

    def _backup_exact_turns(self, exact_turn_count: int) -> None:
        """Makes exact what the turns that are listed are worth."""
        for turn in reversed(range(exact_turn_count)):
            now, later = self._turns[turn], self._turns[turn + 1]
            self.budget.spend_work(ARRAY_CALL_WORK + 4.0 * now.next_beliefs.size)
            best = np.append(later.action_upper_bounds[: len(later.belief_index)].max(axis=1), 0.0)
            ahead = (now.observation_probabilities * best[now.next_beliefs]).sum(axis=1)[
                now.outcome_rows[: len(now.belief_index)]
            ]
            paid = now.beliefs[: len(now.belief_index)] @ self.team.rewards
            now.action_upper_bounds[: len(now.belief_index)] = paid + self.team.discount * ahead


def _compute_turn_bounds(
    team: DecPomdp, turns: int, budget: Budget, informed_work_limit: float
) -> list[Reals]:
    """A bound `[S, A]` for each turn: the fast informed one where the work for it lasts."""
    many, kinds = len(team.joint_actions), team.observation_model.shape[2]
    quick = many * (ARRAY_CALL_WORK + 2.0 * team.propagation_work)
    work = kinds * (quick + 2.0 * many**2 * team.propagation_work)
    budget.check_memory(8.0 * turns * team.rewards.size)
    bounds = [team.rewards]
    for turn in reversed(range(turns - 1)):
        near = (turn + 1) * work <= informed_work_limit
        budget.spend_work(work if near else quick)
        ahead = (
            _backup_informed_bound(team, bounds[-1])
            if near
            else _backup_mdp_bound(team, bounds[-1])
        )
        bounds.append(team.rewards + team.discount * ahead)
    return bounds[::-1]


def _backup_informed_bound(team: DecPomdp, bound: Reals) -> Reals:
    """The mean `[S, A]` of the best next action for each observation, had the state been seen."""
    ahead = np.zeros_like(team.rewards)
    for action in range(ahead.shape[1]):
        for likely in team.observation_model[action].T:
            if likely.any():
                ahead[:, action] += team.backup_values(bound.T * likely, action).max(axis=0)
    return ahead


def _backup_mdp_bound(team: DecPomdp, bound: Reals) -> Reals:
    """The mean `[S, A]` of the best next action for each state."""
    best = bound.max(axis=1)[None]
    return np.stack(
        [team.backup_values(best, a)[0] for a in range(len(team.joint_actions))], axis=1
    )

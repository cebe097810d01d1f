"""What a team would believe and earn if one planner saw all that its agents observe.

No team earns more than such a planner, so its values bound what the agents earn apart. They are
exact over as many turns of joint histories as can be listed; beyond, the fast informed bound holds
(section 21.2), and far off that of seeing the state. Beliefs are found when they are asked for.
"""

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Ints, Reals
from dmplay.solvers.team import CERTAIN, Team

LISTED = 300_000  # joint histories whose values are exact
INFORMED = 1.5e9  # work for the fast informed bound; for turns beyond the state is seen
LEAST = 1e-12  # a probability below which nothing is seen
UNKNOWN = NEVER = -1  # what follows: not yet found, or what cannot be


class _Turn:
    """The beliefs met with some turns done, and what follows those that were asked for."""

    def __init__(self, team: Team, bound: Reals) -> None:
        states, many, kinds = len(team.start), len(team.joint_actions), team.seen.shape[2]
        self.bound = bound  # [S, A]
        self.known: dict[bytes, int] = {}
        self.beliefs = np.empty((1, states))  # room for more than are known
        self.worth = np.empty((1, many))
        self.row = np.full((1, many), UNKNOWN)  # in the next two
        self.after = np.empty((0, kinds), np.int64)
        self.likely = np.empty((0, kinds))

    @property
    def size(self) -> float:
        """How many bytes it takes, about."""
        return 8.0 * (self.beliefs.size + 2 * self.worth.size + 2 * self.after.size)

    def find(self, beliefs: Reals) -> Ints:
        """The places `[N]` of beliefs `[N, S]`, new ones with the quick bound."""
        keys = np.round(beliefs, CERTAIN) + 0.0
        before = len(self.known)
        place = [self.known.setdefault(key.tobytes(), len(self.known)) for key in keys]
        found, first = np.unique(place, return_index=True)
        fresh = first[found >= before]
        while len(self.known) > len(self.beliefs):
            self.beliefs = np.concatenate([self.beliefs, np.empty_like(self.beliefs)])
            self.worth = np.concatenate([self.worth, np.empty_like(self.worth)])
            self.row = np.concatenate([self.row, np.full_like(self.row, UNKNOWN)])
        self.beliefs[before : len(self.known)] = beliefs[fresh]
        self.worth[before : len(self.known)] = beliefs[fresh] @ self.bound
        return np.array(place)

    def told(self, pairs: Ints, after: Ints, likely: Reals) -> None:
        """What follows pairs of a belief and a joint action `[M, 2]`."""
        self.row[pairs[:, 0], pairs[:, 1]] = len(self.after) + np.arange(len(pairs))
        self.after = np.concatenate([self.after, after])
        self.likely = np.concatenate([self.likely, likely])


class Pooled:
    """The beliefs of one planner with so many turns, and the most that each action is worth."""

    def __init__(self, team: Team, turns: int, budget: Budget, informed: float = INFORMED) -> None:
        self.team, self.budget, self.turns = team, budget, turns
        self._turns = [_Turn(team, bound) for bound in _bounds(team, turns, budget, informed)]
        self._turns[0].find(team.start[None])
        self._back(self._listed())

    @property
    def most(self) -> float:
        """The most that one planner earns."""
        return float(self._turns[0].worth[0].max())

    def worth(self, turn: int, places: Ints) -> Reals:
        """No less than joint actions `[N, A]` and the best of all later are worth."""
        return self._turns[turn].worth[places]

    def paid(self, turn: int, places: Ints, actions: Ints) -> Reals:
        """The rewards `[N]` expected."""
        rewards = self.team.rewards[:, actions].T
        return np.asarray((self._turns[turn].beliefs[places] * rewards).sum(axis=1))

    def after(self, turn: int, places: Ints, actions: Ints) -> tuple[Ints, Reals]:
        """The beliefs `[N, O]` that follow by joint observation, and how likely these are."""
        now, later = self._turns[turn], self._turns[turn + 1]
        unknown = now.row[places, actions] == UNKNOWN
        if unknown.any():
            pairs = np.unique(np.stack([places[unknown], actions[unknown]], axis=1), axis=0)
            likely = np.zeros((len(pairs), self.team.seen.shape[2]))
            after = np.full(likely.shape, NEVER)
            for number, (place, action) in enumerate(pairs.tolist()):
                self.budget.spend(ROUND + 2.0 * self.team.work)
                self.budget.hold(2 * sum(one.size for one in self._turns))
                came = self.team.onward(now.beliefs[place : place + 1], action)[0]
                joint = came[:, None] * self.team.seen[action]
                likely[number] = joint.sum(axis=0)
                able = likely[number] > LEAST
                after[number, able] = later.find((joint[:, able] / likely[number, able]).T)
            now.told(pairs, after, np.where(likely > LEAST, likely, 0.0))
        row = now.row[places, actions]
        return now.after[row], now.likely[row]

    def _listed(self) -> int:
        """Lists all beliefs of the first turns; of how many what follows is known."""
        (states, many), kinds = self.team.rewards.shape, self.team.seen.shape[2]
        left = min(LISTED, self.budget.memory / (64 * (states + 2 * many + kinds)))
        for turn, now in enumerate(self._turns[:-1]):
            left -= len(now.known) * many * kinds
            if left < 0:
                return turn
            places = np.repeat(np.arange(len(now.known)), many)
            self.after(turn, places, np.tile(np.arange(many), len(now.known)))
        return self.turns - 1

    def _back(self, listed: int) -> None:
        """Makes exact what the turns that are listed are worth."""
        for turn in reversed(range(listed)):
            now, later = self._turns[turn], self._turns[turn + 1]
            self.budget.spend(ROUND + 4.0 * now.after.size)
            best = np.append(later.worth[: len(later.known)].max(axis=1), 0.0)
            ahead = (now.likely * best[now.after]).sum(axis=1)[now.row[: len(now.known)]]
            paid = now.beliefs[: len(now.known)] @ self.team.rewards
            now.worth[: len(now.known)] = paid + self.team.discount * ahead


def _bounds(team: Team, turns: int, budget: Budget, informed: float) -> list[Reals]:
    """A bound `[S, A]` for each turn: the fast informed one where the work for it lasts."""
    many, kinds = len(team.joint_actions), team.seen.shape[2]
    quick = many * (ROUND + 2.0 * team.work)
    work = kinds * (quick + 2.0 * many**2 * team.work)
    budget.hold(8.0 * turns * team.rewards.size)
    bounds = [team.rewards]
    for turn in reversed(range(turns - 1)):
        near = (turn + 1) * work <= informed
        budget.spend(work if near else quick)
        ahead = _informed(team, bounds[-1]) if near else _sighted(team, bounds[-1])
        bounds.append(team.rewards + team.discount * ahead)
    return bounds[::-1]


def _informed(team: Team, bound: Reals) -> Reals:
    """The mean `[S, A]` of the best next action for each observation, had the state been seen."""
    ahead = np.zeros_like(team.rewards)
    for action in range(ahead.shape[1]):
        for likely in team.seen[action].T:
            if likely.any():
                ahead[:, action] += team.back(bound.T * likely, action).max(axis=0)
    return ahead


def _sighted(team: Team, bound: Reals) -> Reals:
    """The mean `[S, A]` of the best next action for each state."""
    best = bound.max(axis=1)[None]
    return np.stack([team.back(best, a)[0] for a in range(len(team.joint_actions))], axis=1)

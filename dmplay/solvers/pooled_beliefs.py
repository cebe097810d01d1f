"""What a team would believe and earn if one planner saw all that its agents observe.

No team earns more than such a planner, so its values bound what the agents earn apart. They are
exact over as many turns of joint histories as can be listed; beyond, the fast informed bound holds
(section 21.3), and beliefs are found when they are asked for.
"""

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Ints, Reals
from dmplay.solvers.team import CERTAIN, Team

LISTED = 300_000  # joint histories whose values are exact
INFORMED = 5e9  # work for the fast informed bound; for more the state is taken to be seen
LEAST = 1e-12  # a probability below which nothing is seen
UNKNOWN, NEVER = -2, -1  # what follows a belief: not yet found, cannot be


class _Turn:
    """The beliefs met with some turns done; the arrays grow as they are."""

    def __init__(self, team: Team, bound: Reals) -> None:
        states, many, kinds = len(team.start), len(team.joint_actions), team.seen.shape[2]
        self.bound = bound  # [S, A]
        self.known: dict[bytes, int] = {}
        self.beliefs = np.empty((1, states))
        self.worth = np.empty((1, many))
        self.after = np.full((1, many, kinds), UNKNOWN)
        self.likely = np.zeros((1, many, kinds))

    def find(self, beliefs: Reals) -> Ints:
        """The places `[N]` of beliefs `[N, S]`, new ones with the quick bound."""
        keys = np.round(beliefs, CERTAIN) + 0.0
        before = len(self.known)
        place = [self.known.setdefault(key.tobytes(), len(self.known)) for key in keys]
        found, first = np.unique(place, return_index=True)
        fresh = first[found >= before]
        while len(self.known) > len(self.beliefs):
            self._grow()
        self.beliefs[before : len(self.known)] = beliefs[fresh]
        self.worth[before : len(self.known)] = beliefs[fresh] @ self.bound
        return np.array(place)

    def _grow(self) -> None:
        twice = np.empty_like(self.beliefs), np.empty_like(self.worth)
        self.beliefs = np.concatenate([self.beliefs, twice[0]])
        self.worth = np.concatenate([self.worth, twice[1]])
        self.after = np.concatenate([self.after, np.full_like(self.after, UNKNOWN)])
        self.likely = np.concatenate([self.likely, np.zeros_like(self.likely)])


class Pooled:
    """The beliefs of one planner with so many turns, and the most that each action is worth."""

    def __init__(self, team: Team, turns: int, budget: Budget) -> None:
        self.team, self.budget, self.turns = team, budget, turns
        self._turns = [_Turn(team, bound) for bound in _bounds(team, turns, budget)]
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
        now = self._turns[turn]
        unknown = now.after[places, actions, 0] == UNKNOWN
        pairs = np.unique(np.stack([places[unknown], actions[unknown]], axis=1), axis=0)
        for place, action in pairs.tolist():
            self.budget.spend(ROUND + self.team.size / len(self.team.joint_actions))
            came = now.beliefs[place] @ self.team.transition[:, action]
            joint = came[:, None] * self.team.seen[action]
            likely = joint.sum(axis=0)
            able = likely > LEAST
            now.after[place, action] = NEVER
            now.likely[place, action, able] = likely[able]
            found = self._turns[turn + 1].find((joint[:, able] / likely[able]).T)
            now.after[place, action, able] = found
        return now.after[places, actions], now.likely[places, actions]

    def _listed(self) -> int:
        """Lists all beliefs of the first turns; of how many what follows is known."""
        many, kinds = self._turns[0].after.shape[1:]
        left = float(LISTED)
        for turn, now in enumerate(self._turns[:-1]):
            left -= len(now.known) * many * kinds
            if left < 0:
                return turn
            self.budget.hold(8.0 * LISTED * (len(self.team.start) + 2))
            places = np.repeat(np.arange(len(now.known)), many)
            self.after(turn, places, np.tile(np.arange(many), len(now.known)))
        return self.turns - 1

    def _back(self, listed: int) -> None:
        """Makes exact what the turns that are listed are worth."""
        for turn in reversed(range(listed)):
            now, later = self._turns[turn], self._turns[turn + 1]
            size = len(now.known)
            self.budget.spend(ROUND + 4.0 * now.after.size)
            best = np.append(later.worth[: len(later.known)].max(axis=1), 0.0)
            ahead = (now.likely[:size] * best[now.after[:size]]).sum(axis=2)
            now.worth[:size] = now.beliefs[:size] @ self.team.rewards + self.team.discount * ahead


def _bounds(team: Team, turns: int, budget: Budget) -> list[Reals]:
    """The fast informed bound `[S, A]` of each turn, the last of which is exact."""
    states, many, kinds = len(team.start), len(team.joint_actions), team.seen.shape[2]
    work = 2.0 * states**2 * many * (many * kinds + ROUND / states**2)
    budget.hold(8.0 * turns * states * many)
    ahead = _informed if work * turns <= INFORMED else _sighted
    bounds = [team.rewards]
    for _ in range(turns - 1):
        budget.spend(ROUND + (work if ahead is _informed else 2.0 * states**2 * many))
        bounds.append(team.rewards + team.discount * ahead(team, bounds[-1]))
    return bounds[::-1]


def _informed(team: Team, bound: Reals) -> Reals:
    """The mean `[S, A]` of the best next action for each observation, had the state been seen."""
    ahead = np.zeros_like(team.rewards)
    for action in range(ahead.shape[1]):
        for likely in team.seen[action].T:
            if likely.any():
                flow = team.transition[:, action] * likely
                ahead[:, action] += (flow @ bound).max(axis=1)
    return ahead


def _sighted(team: Team, bound: Reals) -> Reals:
    """The mean `[S, A]` of the best next action for each state."""
    return np.asarray(team.transition @ bound.max(axis=1))

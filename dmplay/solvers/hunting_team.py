"""Two predators that sense apart, as a team whose walkers are led on one by one, without tables."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay import belief
from dmplay.chance import Bools, Ints, Reals
from dmplay.problems.collaborative_predator_prey import CollaborativePredatorPrey
from dmplay.solvers.reactive_team import check, paid
from dmplay.solvers.team import Team


@dataclass(frozen=True, eq=False)
class HuntingTeam(Team):
    """The hunt of two: a state is the hexes i and j of the predators, and the prey's p."""

    hunt: CollaborativePredatorPrey

    @classmethod
    def hunting(cls, hunt: CollaborativePredatorPrey) -> "HuntingTeam":
        """The team of a hunt; refuses other than two predators, and too many hexes."""
        check(hunt)
        first, second = hunt.observation_counts
        observed = hunt.observe(hunt.enumerated()) @ np.array([second, 1])
        seen, many = np.eye(first * second)[observed], len(hunt.walks) ** 2
        return cls(
            np.zeros((hunt.states, many, 0)),
            np.tile(paid(hunt).reshape(-1, 1), many),
            np.broadcast_to(seen, (many, *seen.shape)),
            belief.prior(hunt),
            hunt.discount,
            hunt.action_counts,
            hunt.observation_counts,
            hunt,
        )

    @property
    def work(self) -> float:
        """Each of the three moves by itself."""
        return 3.0 * len(self.hunt.hexes) ** 4

    @cached_property
    def _caught(self) -> Bools:
        """Whether the prey is caught `[i, j, p]`."""
        size = len(self.hunt.hexes)
        return self.hunt.captured(self.hunt.enumerated()).reshape(size, size, size)

    @cached_property
    def _flights(self) -> Reals:
        """Where a free prey goes `[i * j, p, p']`."""
        size = len(self.hunt.hexes)
        free = np.where(self._caught.reshape(-1, 1), 0.0, self.hunt.flights)
        return free.reshape(size * size, size, size)

    @cached_property
    def _fed(self) -> Reals:
        """Where a predator goes `[6, p, i, i']` that stays on the prey's hex."""
        stays = np.eye(len(self.hunt.hexes))
        return np.where(stays[:, :, None] > 0, stays, self.hunt.walks[:, None])

    def onward(self, joint: Reals, action: int) -> Reals:
        """As of any team."""
        first, second = self.joint_actions[action]
        return np.asarray(self._led(joint, first[None], second[None])[0, 0])

    def onward_each(self, joint: Reals, action: int, seat: int) -> Reals:
        """As of any team; what one predator does is all that differs."""
        first, second = self.joint_actions[action][:, None]
        every = np.arange(len(self.hunt.walks))
        if seat == 0:
            return np.asarray(self._led(joint, every, second)[:, 0])
        return np.asarray(self._led(joint, first, every)[0])

    def _led(self, joint: Reals, first: Ints, second: Ints) -> Reals:
        """How likely next states are by the directions of both `[A1, A2, N, S']`."""
        size, rows, walks = len(self.hunt.hexes), len(joint), self.hunt.walks.swapaxes(1, 2)
        fled = np.matmul(joint.reshape(rows, size**2, size).swapaxes(0, 1), self._flights)
        fled = fled.swapaxes(0, 1).reshape(rows, size, size**2)
        went = np.matmul(walks[first, None], fled).reshape(len(first), 1, rows, size, size, size)
        went = np.matmul(walks[second, None, None], went)
        caught = np.where(self._caught, joint.reshape(rows, size, size, size), 0.0)
        met = np.matmul(self._fed[first, None].swapaxes(-1, -2), caught.transpose(0, 3, 1, 2))
        fed = np.matmul(met[:, None], self._fed[second, None]).sum(axis=3)
        led = went + fed[..., None] / size
        return np.asarray(led.reshape(len(first), len(second), rows, size**3))

    def back(self, values: Reals, action: int) -> Reals:
        """As of any team."""
        size, rows = len(self.hunt.hexes), len(values)
        first, second = self.hunt.walks[self.joint_actions[action]]
        ahead = np.ascontiguousarray(values.T)  # [S', N]: what is told apart goes side by side
        went = np.matmul(first, ahead.reshape(size, -1)).reshape(size, size, -1)
        went = np.matmul(second, went).reshape(size**2, size, rows)
        found = np.matmul(self._flights, went).reshape(size, size, size, rows)
        born = ahead.reshape(size, size, size, rows).mean(axis=2)
        feeds = np.arange(size)
        found[feeds, :, feeds] = np.matmul(second, born)
        found[:, feeds, feeds] = np.matmul(first, born.reshape(size, -1)).reshape(born.shape)
        found[feeds, feeds, feeds] = born[feeds, feeds]
        return np.asarray(found.reshape(-1, rows).T)

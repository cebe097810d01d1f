"""Two predators that sense apart, as a team whose walkers are led on one by one, without tables."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay import belief
from dmplay.chance import Bools, Ints, Reals
from dmplay.problems.collaborative_predator_prey import CollaborativePredatorPrey
from dmplay.solvers.reactive_team import check_supported, compute_state_rewards
from dmplay.solvers.team import DecPomdp


@dataclass(frozen=True, eq=False)
class PredatorPreyDecPomdp(DecPomdp):
    """The hunt of two: a state is the hexes i and j of the predators, and the prey's p."""

    problem: CollaborativePredatorPrey

    @classmethod
    def from_predator_prey(cls, problem: CollaborativePredatorPrey) -> "PredatorPreyDecPomdp":
        """The team of a hunt; refuses other than two predators, and too many hexes."""
        check_supported(problem)
        first, second = problem.observation_counts
        observed = problem.observe(problem.enumerate_states()) @ np.array([second, 1])
        seen, many = (
            np.eye(first * second)[observed],
            len(problem.walk_probabilities) ** 2,
        )
        return cls(
            np.zeros((problem.state_count, many, 0)),
            np.tile(compute_state_rewards(problem).reshape(-1, 1), many),
            np.broadcast_to(seen, (many, *seen.shape)),
            belief.initial_belief(problem),
            problem.discount,
            problem.action_counts,
            problem.observation_counts,
            problem,
        )

    @property
    def propagation_work(self) -> float:
        """Each of the three moves by itself."""
        return 3.0 * len(self.problem.hexes) ** 4

    @cached_property
    def _capture_mask(self) -> Bools:
        """Whether the prey is caught `[i, j, p]`."""
        size = len(self.problem.hexes)
        return self.problem.is_prey_captured(self.problem.enumerate_states()).reshape(
            size, size, size
        )

    @cached_property
    def _prey_transitions(self) -> Reals:
        """Where a free prey goes `[i * j, p, p']`."""
        size = len(self.problem.hexes)
        free = np.where(
            self._capture_mask.reshape(-1, 1), 0.0, self.problem.prey_move_probabilities
        )
        return free.reshape(size * size, size, size)

    @cached_property
    def _feeding_transitions(self) -> Reals:
        """Where a predator goes `[6, p, i, i']` that stays on the prey's hex."""
        stays = np.eye(len(self.problem.hexes))
        return np.where(stays[:, :, None] > 0, stays, self.problem.walk_probabilities[:, None])

    def propagate_states(self, joint: Reals, action: int) -> Reals:
        """As of any team."""
        first, second = self.joint_actions[action]
        return np.asarray(self._propagate_directions(joint, first[None], second[None])[0, 0])

    def propagate_seat_actions(self, joint: Reals, action: int, seat: int) -> Reals:
        """As of any team; what one predator does is all that differs."""
        first, second = self.joint_actions[action][:, None]
        every = np.arange(len(self.problem.walk_probabilities))
        if seat == 0:
            return np.asarray(self._propagate_directions(joint, every, second)[:, 0])
        return np.asarray(self._propagate_directions(joint, first, every)[0])

    def _propagate_directions(
        self, joint: Reals, first_directions: Ints, second_directions: Ints
    ) -> Reals:
        """How likely next states are by the directions of both `[A1, A2, N, S']`."""
        size, rows, walks = (
            len(self.problem.hexes),
            len(joint),
            self.problem.walk_probabilities.swapaxes(1, 2),
        )
        fled = np.matmul(joint.reshape(rows, size**2, size).swapaxes(0, 1), self._prey_transitions)
        fled = fled.swapaxes(0, 1).reshape(rows, size, size**2)
        went = np.matmul(walks[first_directions, None], fled).reshape(
            len(first_directions), 1, rows, size, size, size
        )
        went = np.matmul(walks[second_directions, None, None], went)
        caught = np.where(self._capture_mask, joint.reshape(rows, size, size, size), 0.0)
        met = np.matmul(
            self._feeding_transitions[first_directions, None].swapaxes(-1, -2),
            caught.transpose(0, 3, 1, 2),
        )
        fed = np.matmul(met[:, None], self._feeding_transitions[second_directions, None]).sum(
            axis=3
        )
        led = went + fed[..., None] / size
        return np.asarray(led.reshape(len(first_directions), len(second_directions), rows, size**3))

    def backup_values(self, values: Reals, action: int) -> Reals:
        """As of any team."""
        size, rows = len(self.problem.hexes), len(values)
        first, second = self.problem.walk_probabilities[self.joint_actions[action]]
        ahead = np.ascontiguousarray(values.T)  # [S', N]: what is told apart goes side by side
        went = np.matmul(first, ahead.reshape(size, -1)).reshape(size, size, -1)
        went = np.matmul(second, went).reshape(size**2, size, rows)
        found = np.matmul(self._prey_transitions, went).reshape(size, size, size, rows)
        born = ahead.reshape(size, size, size, rows).mean(axis=2)
        feeds = np.arange(size)
        found[feeds, :, feeds] = np.matmul(second, born)
        found[:, feeds, feeds] = np.matmul(first, born.reshape(size, -1)).reshape(born.shape)
        found[feeds, feeds, feeds] = born[feeds, feeds]
        return np.asarray(found.reshape(-1, rows).T)

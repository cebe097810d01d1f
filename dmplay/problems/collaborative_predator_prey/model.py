"""Collaborative predator-prey for two predators as a Dec-POMDP, without dense tables.

The two predators and the prey are moved one after another.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.core import belief
from dmplay.core.arrays import Bools, Ints, Reals
from dmplay.solvers.decpomdp.dec_pomdp_model import DecPomdp

from .reactive_team import check_supported, compute_state_rewards
from .rules import CollaborativePredatorPrey


@dataclass(frozen=True, eq=False)
class PredatorPreyDecPomdp(DecPomdp):
    """The hunt of two predators; a state is the hexes i and j of the predators and the prey's p."""

    problem: CollaborativePredatorPrey

    @classmethod
    def from_predator_prey(cls, problem: CollaborativePredatorPrey) -> "PredatorPreyDecPomdp":
        """Return the Dec-POMDP of a predator-prey problem.

        Raises BadParameter unless it has two predators, a discount below 1 and few enough states.
        """
        check_supported(problem)
        first_count, second_count = problem.observation_counts
        observation_indices = problem.observation_table @ np.array([second_count, 1])
        observation_table = np.eye(first_count * second_count)[observation_indices]
        joint_action_count = len(problem.walk_probabilities) ** 2
        return cls(
            np.zeros((problem.state_count, joint_action_count, 0)),
            np.tile(compute_state_rewards(problem).reshape(-1, 1), joint_action_count),
            np.broadcast_to(observation_table, (joint_action_count, *observation_table.shape)),
            belief.initial_belief(problem),
            problem.discount,
            problem.action_counts,
            problem.observation_counts,
            problem,
        )

    @property
    def propagation_work(self) -> float:
        """The number of operations of moving the two predators and the prey."""
        return 3.0 * len(self.problem.hexes) ** 4

    @cached_property
    def _capture_mask(self) -> Bools:
        """The mask `[i, j, p]` of states in which the prey is captured."""
        is_captured = self.problem.is_prey_captured(self.problem.enumerate_states())
        return is_captured.reshape((len(self.problem.hexes),) * 3)

    @cached_property
    def _prey_transitions(self) -> Reals:
        """The probabilities `[i * j, p, p']` of moves of a free prey."""
        hex_count, moves = len(self.problem.hexes), self.problem.prey_move_probabilities
        free_moves = np.where(self._capture_mask.reshape(-1, 1), 0.0, moves)
        return free_moves.reshape(hex_count * hex_count, hex_count, hex_count)

    @cached_property
    def _feeding_transitions(self) -> Reals:
        """The probabilities `[6, p, i, i']` of a predator's moves; on the prey's hex it stays."""
        stays = np.eye(len(self.problem.hexes))
        return np.where(stays[:, :, None] > 0, stays, self.problem.walk_probabilities[:, None])

    def propagate_states(self, weights: Reals, action: int) -> Reals:
        """Return the probabilities `[N, S']` of next states, as in DecPomdp."""
        first, second = self.joint_actions[action]
        return np.asarray(self._propagate_directions(weights, first[None], second[None])[0, 0])

    def propagate_seat_actions(self, weights: Reals, action: int, seat: int) -> Reals:
        """Return the probabilities `[A, N, S']` of next states for each action of one seat."""
        first, second = self.joint_actions[action][:, None]
        directions = np.arange(len(self.problem.walk_probabilities))
        if seat == 0:
            return np.asarray(self._propagate_directions(weights, directions, second)[:, 0])
        return np.asarray(self._propagate_directions(weights, first, directions)[0])

    def _propagate_directions(
        self, joint: Reals, first_directions: Ints, second_directions: Ints
    ) -> Reals:
        """Return the next-state probabilities `[A1, A2, N, S']` for pairs of directions."""
        hex_count, row_count = len(self.problem.hexes), len(joint)
        cube = (row_count, hex_count, hex_count, hex_count)
        walks = self.problem.walk_probabilities.swapaxes(1, 2)
        by_predators = joint.reshape(row_count, hex_count**2, hex_count).swapaxes(0, 1)
        prey_moved = np.matmul(by_predators, self._prey_transitions)
        prey_moved = prey_moved.swapaxes(0, 1).reshape(row_count, hex_count, hex_count**2)
        all_moved = np.matmul(walks[first_directions, None], prey_moved)
        all_moved = all_moved.reshape(len(first_directions), 1, *cube)
        all_moved = np.matmul(walks[second_directions, None, None], all_moved)
        captured = np.where(self._capture_mask, joint.reshape(cube), 0.0).transpose(0, 3, 1, 2)
        first_feeding = self._feeding_transitions[first_directions, None].swapaxes(-1, -2)
        first_fed = np.matmul(first_feeding, captured)[:, None]
        both_fed = np.matmul(first_fed, self._feeding_transitions[second_directions, None])
        result = all_moved + both_fed.sum(axis=3)[..., None] / hex_count
        return np.asarray(result.reshape(*result.shape[:2], row_count, hex_count**3))

    def backup_values(self, values: Reals, action: int) -> Reals:
        """Return the expected values `[N, S]` of next states, as in DecPomdp."""
        hex_count, row_count = len(self.problem.hexes), len(values)
        first, second = self.problem.walk_probabilities[self.joint_actions[action]]
        # [S', N], with the value functions side by side
        next_values = np.ascontiguousarray(values.T)
        cube = (hex_count, hex_count, hex_count, row_count)
        expected = np.matmul(first, next_values.reshape(hex_count, -1))
        expected = np.matmul(second, expected.reshape(hex_count, hex_count, -1))
        expected = expected.reshape(hex_count**2, hex_count, row_count)
        result = np.matmul(self._prey_transitions, expected).reshape(cube)
        respawned = next_values.reshape(cube).mean(axis=2)
        hexes = np.arange(hex_count)
        result[hexes, :, hexes] = np.matmul(second, respawned)
        first_moved = np.matmul(first, respawned.reshape(hex_count, -1))
        result[:, hexes, hexes] = first_moved.reshape(respawned.shape)
        result[hexes, hexes, hexes] = respawned[hexes, hexes]
        return np.asarray(result.reshape(-1, row_count).T)

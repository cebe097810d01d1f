"""Hunt a prey as a team; each predator senses it only on its own hex or a neighbouring one.

Source: appendix F.15; CollaborativePredatorPreyHexWorld.jl. Decisions: A free prey moves to a
neighbouring hex without a predator; it stays only if there is none (in the package it may always
stay). These hexes and the captures are those before the move; the observations are those after it,
without noise. The team gets one reward: 10 if any predator captures the prey, else -1. A predator
that captures the prey stays. All start on uniformly random hexes. A predator does not see its own
hex, except in the variant `sighted`, which is dmplay's own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.chance import Chance, DiscreteUniform
from dmplay.core.hexgrid import format_hex, move_destinations
from dmplay.core.parameters import parameter
from dmplay.core.problem import Outcome, StatePart, StateParts
from dmplay.core.spaces import Labels
from dmplay.core.work_budget import Budget
from dmplay.problems._shared.hex_hunt import (
    CIRCLE_HEXES,
    TRIANGLE_HEXES,
    HexHunt,
    make_numbered_names,
)

CAPTURE_REWARD, MOVE_REWARD = 10.0, -1.0
SENSE_LABELS = Labels(("prey", "nothing"))
# bit above those of the directions, set if no predator is on the hex of the prey
PREY_FREE_BIT = 64
ALL_BITS = 127  # all of these bits
STAY_DIRECTION = 6  # index of the prey's own hex, used if no direction is open


@dataclass(frozen=True)
class CollaborativePredatorPrey(HexHunt):
    """A hunt with one shared reward; chance moves the prey, the last of the walkers."""

    predators: int = parameter(2, "number of predators", 1, 26)
    sighted: bool = parameter(False, "each predator sees its own hex")

    shared_reward = True
    reward_bounds = MOVE_REWARD, CAPTURE_REWARD

    @property
    def agents(self) -> tuple[str, ...]:
        """The names `predator1`, `predator2` ..., or `predator` if there is one."""
        names = make_numbered_names("predator", self.predators)
        return names if self.predators > 1 else ("predator",)

    @property
    def walker_count(self) -> int:
        """The number of predators and the prey."""
        return self.predators + 1

    @property
    def observations(self) -> tuple[Labels, ...]:
        """The labels `prey` and `nothing`; if sighted, each with the predator's own hex."""
        if not self.sighted:
            return (SENSE_LABELS,) * self.predators
        hexes = [format_hex(hex_) for hex_ in self.hexes]
        pairs = Labels(tuple(f"{sense} {hex_}" for sense in SENSE_LABELS for hex_ in hexes))
        return (pairs,) * self.predators

    @cached_property
    def _neighbour_table(self) -> Ints:
        """The neighbour of a hex in each direction, then the hex itself: `[H, 7]`, flat."""
        destinations = move_destinations(self.hexes)[:, :, 0]
        return np.hstack([destinations, np.arange(len(self.hexes))[:, None]]).reshape(-1)

    @cached_property
    def _open_direction_bits(self) -> Ints:
        """The bits that a predator leaves set, by the prey's hex and the predator's `[H, H]`, flat.

        There is a bit for each direction in which the map continues and the predator is not, and
        PREY_FREE_BIT unless both are on the same hex.
        """
        around = self._neighbour_table.reshape(-1, 7)
        is_on_map = around[:, :6] != around[:, 6:]
        map_bits = (is_on_map << np.arange(6)).sum(axis=1)
        predator_bits = self._neighbour_direction_bits.reshape(-1, len(self.hexes))
        free_bit = PREY_FREE_BIT * ~np.eye(len(self.hexes), dtype=bool)
        return np.asarray(map_bits[:, None] & ~predator_bits | free_bit).reshape(-1)

    @cached_property
    def _neighbour_direction_bits(self) -> Ints:
        """The bit of the direction from one hex to its neighbour, else 0: `[H, H]`, flat."""
        indices = np.arange(len(self.hexes))
        bits = np.zeros((len(indices), len(indices)), np.int64)
        for direction in range(6):
            bits[indices, self._neighbour_table[direction::7]] |= 1 << direction
        bits[indices, indices] = 0
        return bits.reshape(-1)

    @cached_property
    def _sense_table(self) -> Ints:
        """The observation of a predator, by its hex and the prey's `[H, H]`, flat."""
        neighbour_bits = self._neighbour_direction_bits.reshape(-1, len(self.hexes))
        is_far = (neighbour_bits == 0) & ~np.eye(len(self.hexes), dtype=bool)
        if not self.sighted:
            return np.asarray(is_far, np.int64).reshape(-1)
        hexes = np.arange(len(self.hexes))[:, None]
        return np.asarray(is_far * len(hexes) + hexes).reshape(-1)

    def is_prey_captured(self, s: Array) -> Bools:
        """Return whether any predator is on the prey's hex `[B]`."""
        return np.asarray(self._free_direction_bits(s.T) < PREY_FREE_BIT)

    def _free_direction_bits(self, hexes: Ints) -> Ints:
        """Return the bits of the directions open to the prey; PREY_FREE_BIT unless caught."""
        *predators, prey = hexes
        free_bits: Ints = np.full_like(prey, ALL_BITS)
        row_start = prey * len(self.hexes)
        for hex_ in predators:
            free_bits = free_bits & self._open_direction_bits.take(row_start + hex_)
        return free_bits

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Return the distributions of each predator's slip and of the prey's next hex."""
        free_bits = self._free_direction_bits(np.ascontiguousarray(s.T))
        hex_count = np.where(
            free_bits < PREY_FREE_BIT, len(self.hexes), _DIRECTION_COUNT.take(free_bits)
        )
        prey_chance = DiscreteUniform(hex_count, max(len(self.hexes), 6))
        return (*(self.slip_chance,) * self.predators, prey_chance)

    def resolve_events(self, s: Array, a: Array, events: Sequence[Array]) -> Outcome:
        """Return the outcome: predators move as in hex world unless they feed, then all observe."""
        hexes = np.ascontiguousarray(s.T)
        free_bits = self._free_direction_bits(hexes)
        *predators, prey = hexes
        *slips, event = events
        is_caught = free_bits < PREY_FREE_BIT
        moves = zip(predators, np.ascontiguousarray(a.T), slips, strict=True)
        next_hexes = [  # a predator that feeds stays
            np.where(hex_ == prey, prey, self.find_move_ends(hex_, *move)) for hex_, *move in moves
        ]
        direction = _KTH_DIRECTION.take(free_bits * 6 + np.where(is_caught, 0, event))
        free_move_end = self._neighbour_table.take(prey * 7 + direction)
        next_hexes.append(np.where(is_caught, event, free_move_end))
        reward = np.where(is_caught, CAPTURE_REWARD, MOVE_REWARD)
        next_states, rewards = np.stack(next_hexes, axis=1), np.stack([reward] * self.predators, 1)
        return Outcome(next_states, rewards, self._look_up_observations(next_states.T))

    def get_observations(self, s: Array) -> Ints:
        """Return the observation of each predator in these states, `[B, n]`."""
        return self._look_up_observations(np.ascontiguousarray(s.T))

    def _look_up_observations(self, hexes: Ints) -> Ints:
        """Return the observations `[B, n]`, given the hex of each walker as a column."""
        *predators, prey = hexes
        observations = [self._sense_table.take(hex_ * len(self.hexes) + prey) for hex_ in predators]
        return np.stack(observations, axis=1)

    @cached_property
    def observation_table(self) -> Ints:
        """The observation of each predator in every state, `[S, n]`."""
        return self.get_observations(self.enumerate_states())

    def state_parts(self, seat: int) -> StateParts:
        """Return the hex of each walker: of the prey, of the seat, and then of its partners."""
        states, hexes = self.enumerate_states(), [format_hex(hex_) for hex_ in self.hexes]
        names = (*self.agents, "prey")
        order = dict.fromkeys((len(self.agents), seat, *range(len(self.agents))))
        parts = [StatePart([f"{names[w]} {hex_}" for hex_ in hexes], states[:, w]) for w in order]
        return StateParts("walkers", parts)

    @cached_property
    def walk_probabilities(self) -> Reals:
        """The probability `[6, H, H]` of getting from one hex to another by a direction."""
        hexes, destinations = np.arange(len(self.hexes)), move_destinations(self.hexes)
        probabilities = np.zeros((6, len(hexes), len(hexes)))
        for slip, p in enumerate(self.slip_chance.probabilities()[0]):
            for direction in range(6):
                probabilities[direction, hexes, destinations[:, direction, slip]] += p
        return probabilities

    @cached_property
    def prey_move_probabilities(self) -> Reals:
        """The probability `[S, H]` of each next hex of the prey in every state."""
        hex_count = len(self.hexes)
        budget = Budget("a table of the prey's moves", "try a smaller map")
        budget.check_memory(16.0 * self.state_count * hex_count)
        s = self.enumerate_states()
        zeros = np.zeros((len(s), self.predators), np.int64)
        prey_chance = self.chance(s, zeros)[-1]
        assert isinstance(prey_chance, DiscreteUniform)
        prey_moves = np.zeros((len(s), hex_count))
        for event, p in enumerate(prey_chance.probabilities().T):
            rows = np.flatnonzero(p)
            events = *zeros[rows].T, np.full(len(rows), event)
            next_states = self.resolve_events(s[rows], zeros[rows], events).state
            prey_moves[rows, next_states[:, -1]] += p[rows]
        return prey_moves

    def joint_belief_update(
        self, belief: Reals, actions: Sequence[int | None], observations: Sequence[int | None]
    ) -> Reals:
        """Return the joint belief update of beliefs `[S]` or `[B, S]`, one walker after the other.

        Each walker moves independently of the others. If a predator feeds, it stays and the prey's
        next hex is uniform; otherwise no predator's move depends on the hex of the prey. A row has
        the same bits in any batch, as its products are computed separately.
        """
        hex_count = len(self.hexes)
        walks, feeding_walks = (
            [matrices[-1 if a is None else a] for a in actions] for matrices in self._walk_matrices
        )
        joint = belief.reshape(-1, self.state_count // hex_count, hex_count)
        uncaught = np.where(self._captured_mask, 0.0, joint)
        caught = np.where(self._captured_mask, joint, 0.0)
        prey_moves = self.prey_move_probabilities.reshape(-1, hex_count, hex_count)
        moved = np.matmul(uncaught[:, :, None], prey_moves)
        updated: Reals = _apply_walks(moved, walks).reshape(len(joint), -1, hex_count)
        fed = _apply_walks(caught.swapaxes(1, 2), feeding_walks).sum(axis=1)
        updated += fed[:, :, None] / hex_count
        updated = updated.reshape(belief.shape)
        for seat, observation in enumerate(observations):
            if observation is not None:
                updated = updated * (self.observation_table[:, seat] == observation)
        return updated

    @cached_property
    def _walk_matrices(self) -> tuple[Reals, Reals]:
        """The probability of each direction, and of a random one, to lead to a hex from another.

        The first array `[7, 1, H, H]` is for predators that walk; the second `[7, H, H, H]` is by
        the hex of the prey, on which a predator feeds and stays.
        """
        hex_count = len(self.hexes)
        walks = self.walk_probabilities
        walks = np.vstack([walks, walks.mean(axis=0)[None]]).swapaxes(1, 2)[:, None]
        at_prey = np.eye(hex_count, dtype=bool)[:, None]  # moves from the hex of the prey
        return walks, np.where(at_prey, np.eye(hex_count), walks)

    @cached_property
    def _captured_mask(self) -> Bools:
        """The mask `[S / H, H]` of the states in which the prey is caught."""
        return self.is_prey_captured(self.enumerate_states()).reshape(-1, len(self.hexes))


def _apply_walks(joint: Reals, walks: Sequence[Reals]) -> Reals:
    """Return probabilities `[B, P, ...]` by each predator's hex, after their walks `[P, H, H]`."""
    for seat, walk in enumerate(walks):
        matrix_count, size, _ = walk.shape
        blocks = joint.reshape(len(joint), matrix_count, size**seat, size, -1)
        joint = np.matmul(walk[:, None], blocks)
    return joint.reshape(len(joint), len(walks[0]), -1)


def _tabulate_directions() -> tuple[Ints, Ints]:
    """Return the number of directions in each bit mask `[128]`, and the k-th of them `[128, 6]`.

    The number is at least 1. The second array is flat; if there is no k-th direction its entry is
    STAY_DIRECTION.
    """
    count, kth = np.ones(ALL_BITS + 1, np.int64), np.full((ALL_BITS + 1, 6), STAY_DIRECTION)
    for mask in range(ALL_BITS + 1):
        directions = [direction for direction in range(6) if mask >> direction & 1]
        count[mask] = max(len(directions), 1)
        kth[mask, : len(directions)] = directions
    return count, kth.reshape(-1)


_DIRECTION_COUNT, _KTH_DIRECTION = _tabulate_directions()

VARIANTS = {
    "circle": CollaborativePredatorPrey(hexes=CIRCLE_HEXES),
    "triangle": CollaborativePredatorPrey(hexes=TRIANGLE_HEXES),
    "sighted": CollaborativePredatorPrey(sighted=True),
}

"""A team of predators hunts a prey that it only senses from the next hex.

Source: appendix F.15; CollaborativePredatorPreyHexWorld.jl. Decisions: a free prey moves to one of
the hexes around it that no predator was on, and stays only where there is none (the package lets it
stay anywhere); captures and these hexes are judged on the state acted in, observations on the next;
a predator senses a prey on its own hex too, without noise; the team gets one reward, 10 for a
capture by anyone, else -1; a predator that captures stays; the start is uniform over the hexes, and
a predator does not see where it stands, but in `sighted` (dmplay's own) it does.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import repeat

import numpy as np

from dmplay.budget import Budget
from dmplay.chance import Array, Bools, Chance, DiscreteUniform, Ints, Reals, sample_unbatched
from dmplay.columns import (
    Column,
    IntColumn,
    select_where,
    split_columns,
    stack_columns,
    take_values,
    to_column,
)
from dmplay.core import Labels, Outcome, parameter
from dmplay.hexes import format_hex, move_destinations
from dmplay.problems._hunt import CIRCLE_HEXES, TRIANGLE_HEXES, HexHunt, make_numbered_names

CAPTURE_REWARD, MOVE_REWARD = 10.0, -1.0
SENSE_LABELS = Labels(("prey", "nothing"))
PREY_FREE_BIT = 64  # the bit above those of the directions: no predator is on the hex of the prey
ALL_BITS = 127  # these bits
STAY_DIRECTION = 6  # where no direction is free


@dataclass(frozen=True)
class CollaborativePredatorPrey(HexHunt):
    """A hunt with one reward for all; the prey is nature's, the last of the walkers."""

    predators: int = parameter(2, "how many predators", 1, 26)
    sighted: bool = parameter(False, "whether a predator sees its own hex")

    shared_reward = True

    @property
    def agents(self) -> tuple[str, ...]:
        """`predator1`, `predator2` ..., or `predator` alone."""
        return (
            make_numbered_names("predator", self.predators) if self.predators > 1 else ("predator",)
        )

    @property
    def walker_count(self) -> int:
        """The predators and the prey."""
        return self.predators + 1

    @property
    def observations(self) -> tuple[Labels, ...]:
        """Whether a prey is near, and where sighted from which hex that was sensed."""
        if not self.sighted:
            return (SENSE_LABELS,) * self.predators
        hexes = [format_hex(hex_) for hex_ in self.hexes]
        pairs = Labels(tuple(f"{sense} {hex_}" for sense in SENSE_LABELS for hex_ in hexes))
        return (pairs,) * self.predators

    @cached_property
    def _neighbours(self) -> Ints:
        """The hex in each direction of a hex, the last being the hex itself: `[H, 7]`, flat."""
        reached = move_destinations(self.hexes)[:, :, 0]
        return np.hstack([reached, np.arange(len(self.hexes))[:, None]]).reshape(-1)

    @cached_property
    def _open_direction_bits(self) -> Ints:
        """What a predator on another hex leaves open to the prey on a hex `[H, H]`, flat.

        A bit for each direction in which the map goes on, and one unless both hexes are the same.
        """
        around = self._neighbours.reshape(-1, 7)
        goes_on = around[:, :6] != around[:, 6:]
        ways = (goes_on << np.arange(6)).sum(axis=1)
        toward = self._direction_bits.reshape(-1, len(self.hexes))
        alone = PREY_FREE_BIT * ~np.eye(len(self.hexes), dtype=bool)
        return np.asarray(ways[:, None] & ~toward | alone).reshape(-1)

    @cached_property
    def _direction_bits(self) -> Ints:
        """The bit of the direction from one hex to its neighbour, else 0: `[H, H]`, flat."""
        here = np.arange(len(self.hexes))
        bits = np.zeros((len(here), len(here)), np.int64)
        for direction in range(6):
            bits[here, self._neighbours[direction::7]] |= 1 << direction
        bits[here, here] = 0
        return bits.reshape(-1)

    @cached_property
    def _sense_table(self) -> Ints:
        """What a predator on one hex observes `[H, H]` with the prey on another, flat."""
        toward = self._direction_bits.reshape(-1, len(self.hexes))
        far = (toward == 0) & ~np.eye(len(self.hexes), dtype=bool)
        if not self.sighted:
            return np.asarray(far, np.int64).reshape(-1)
        return np.asarray(
            far * len(self.hexes) + np.arange(len(self.hexes))[:, None]
        ).reshape(-1)

    @cached_property
    def _max_prey_hexes(self) -> int:
        """Of how many hexes the prey takes one at most."""
        return max(len(self.hexes), 6)

    @cached_property
    def _slip_chances(self) -> tuple[Chance, ...]:
        """The slip of each predator."""
        return (self.slip_chance,) * self.predators

    def is_prey_captured(self, s: Array) -> Bools:
        """Whether any predator is on the prey's hex `[B]`."""
        return np.asarray(self._free_direction_bits(tuple(s.T)) < PREY_FREE_BIT)

    def _free_direction_bits(self, hexes: Sequence[Column]) -> IntColumn:
        """The directions open to the prey, and AT_LARGE unless it is caught, a bit each."""
        *predators, prey = hexes
        free: IntColumn = ALL_BITS
        begins = prey * len(self.hexes)
        for hex_ in predators:
            free = free & take_values(self._open_direction_bits, begins + hex_)
        return free

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """The slip of each predator; which of the hexes open to it the prey takes."""
        return self._make_chances(self._free_direction_bits(split_columns(s)))

    def _make_chances(self, free_bits: IntColumn) -> tuple[Chance, ...]:
        """The same by what is open to the prey."""
        many = select_where(
            free_bits < PREY_FREE_BIT, len(self.hexes), take_values(_DIRECTION_COUNT, free_bits)
        )
        return (*self._slip_chances, DiscreteUniform.from_counts(many, self._max_prey_hexes))

    def resolve_events(self, s: Array, a: Array, events: Sequence[Array | int]) -> Outcome:
        """Predators move as in hex world unless they feed, then all look around."""
        hexes = split_columns(s)
        return self._resolve_moves(hexes, self._free_direction_bits(hexes), a, events)

    def step(self, s: Array, a: Array, u: Reals) -> Outcome:
        """One turn, as it is derived; what is open to the prey is found once."""
        hexes = split_columns(s)
        free = self._free_direction_bits(hexes)
        return self._resolve_moves(hexes, free, a, sample_unbatched(self._make_chances(free), u))

    def _resolve_moves(
        self, hexes: Sequence[Column], free_bits: IntColumn, a: Array, events: Sequence[Array | int]
    ) -> Outcome:
        """As `move`, by what is open to the prey."""
        *predators, prey = hexes
        *slips, event = map(to_column, events)
        caught = free_bits < PREY_FREE_BIT
        moved = [*map(self._move_predator, repeat(prey), predators, split_columns(a), slips)]
        way = take_values(_KTH_DIRECTION, free_bits * 6 + select_where(caught, 0, event))
        moved.append(select_where(caught, event, take_values(self._neighbours, prey * 7 + way)))
        pay = select_where(caught, CAPTURE_REWARD, MOVE_REWARD)
        after = stack_columns(moved, np.int64)
        return Outcome(after, stack_columns([pay] * self.predators), self._observe_columns(moved))

    def _move_predator(self, prey: Column, hex_: Column, direction: Column, slip: Column) -> Column:
        """Where a predator ends: as in hex world unless it feeds."""
        return select_where(hex_ == prey, prey, self.move_walker(hex_, direction, slip))

    def observe(self, s: Array) -> Ints:
        """What each predator `[B, n]` observes in these states."""
        return self._observe_columns(split_columns(s))

    def _observe_columns(self, hexes: Sequence[Column]) -> Ints:
        """As `observe`."""
        *predators, prey = hexes
        seen = [take_values(self._sense_table, hex_ * len(self.hexes) + prey) for hex_ in predators]
        return stack_columns(seen, np.int64)

    @cached_property
    def _observation_table(self) -> Ints:
        """What each predator observes `[S, n]` in every state."""
        return self.observe(self.enumerate_states())

    @cached_property
    def walk_probabilities(self) -> Reals:
        """The probability `[6, H, H]` of getting from one hex to another by a direction."""
        size = len(self.hexes)
        ends = move_destinations(self.hexes)
        walks = np.zeros((6, size, size))
        for slip, p in enumerate(self.slip_chance.probabilities()[0]):
            for direction in range(6):
                walks[direction, np.arange(size), ends[:, direction, slip]] += p
        return walks

    @cached_property
    def prey_move_probabilities(self) -> Reals:
        """The probability `[S, H]` of each next hex of the prey in every state."""
        size = len(self.hexes)
        Budget("where the prey goes", "try a smaller map").check_memory(
            16.0 * self.state_count * size
        )
        s = self.enumerate_states()
        still = np.zeros((len(s), self.predators), np.int64)
        pick = self.chance(s, still)[-1]
        assert isinstance(pick, DiscreteUniform)
        flights = np.zeros((len(s), size))
        for way, p in enumerate(pick.probabilities().T):
            taken = np.flatnonzero(p)
            stays = still[taken]
            moved = self.resolve_events(
                s[taken], stays, (*stays.T, np.full(len(taken), way))
            ).state[:, -1]
            flights[taken, moved] += p[taken]
        return flights

    def joint_belief_update(
        self, belief: Reals, actions: Sequence[int | None], observations: Sequence[int | None]
    ) -> Reals:
        """Walker by walker, beliefs `[S]` or `[B, S]`: each moves by itself.

        Where a predator feeds, it stays and the prey is anywhere next; else nobody's walk depends
        on where the prey was. A row has the same bits in any batch: its products are its own.
        """
        size = len(self.hexes)
        taken = [-1 if a is None else a for a in actions]
        walks, fed = ([led[a] for a in taken] for led in self._walk_matrices)
        before = belief.reshape(-1, self.state_count // size, size)
        hunted, caught = (
            np.where(self._captured_mask, 0.0, before),
            np.where(self._captured_mask, before, 0.0),
        )
        fled = np.matmul(hunted[:, :, None], self.prey_move_probabilities.reshape(-1, size, size))
        after: Reals = _apply_walks(fled, walks).reshape(len(before), -1, size)
        after += _apply_walks(caught.swapaxes(1, 2), fed).sum(axis=1)[:, :, None] / size
        after = after.reshape(belief.shape)
        for seat, observation in enumerate(observations):
            if observation is not None:
                after = after * (self._observation_table[:, seat] == observation)
        return after

    @cached_property
    def _walk_matrices(self) -> tuple[Reals, Reals]:
        """How likely each direction, and any of them, leads to a hex from another: `[7, 1, H, H]`,
        and `[7, H, H, H]` with a prey on each hex, on which a predator feeds and stays.
        """
        size = len(self.hexes)
        walks = np.vstack(
            [self.walk_probabilities, self.walk_probabilities.mean(axis=0)[None]]
        ).swapaxes(1, 2)[:, None]
        stays = np.eye(size, dtype=bool)[:, None]  # from the hex of the prey
        return walks, np.where(stays, np.eye(size), walks)

    @cached_property
    def _captured_mask(self) -> Bools:
        """Whether the prey on each hex is caught `[S / H, H]`."""
        return self.is_prey_captured(self.enumerate_states()).reshape(-1, len(self.hexes))


def _apply_walks(joint: Reals, walks: Sequence[Reals]) -> Reals:
    """Probabilities `[B, P, ...]` by the hex of each predator, after walks `[P, H, H]` of each."""
    for seat, walk in enumerate(walks):
        many, size, _ = walk.shape
        parts = joint.reshape(len(joint), many, size**seat, size, -1)
        joint = np.matmul(walk[:, None], parts)
    return joint.reshape(len(joint), len(walks[0]), -1)


def _tabulate_directions() -> tuple[Ints, Ints]:
    """How many directions some bits are `[128]`, 1 for none, and the k-th `[128, 6]`, flat."""
    count, kth = np.ones(ALL_BITS + 1, np.int64), np.full((ALL_BITS + 1, 6), STAY_DIRECTION)
    for mask in range(ALL_BITS + 1):
        held = [direction for direction in range(6) if mask >> direction & 1]
        count[mask] = max(len(held), 1)
        kth[mask, : len(held)] = held
    return count, kth.reshape(-1)


_DIRECTION_COUNT, _KTH_DIRECTION = _tabulate_directions()

VARIANTS = {
    "circle": CollaborativePredatorPrey(hexes=CIRCLE_HEXES),
    "triangle": CollaborativePredatorPrey(hexes=TRIANGLE_HEXES),
    "sighted": CollaborativePredatorPrey(sighted=True),
}

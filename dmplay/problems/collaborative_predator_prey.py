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
from dmplay.chance import Array, Bools, Chance, Ints, Pick, Reals, drawn
from dmplay.columns import Column, Whole, chosen, column, columns, joined, listed
from dmplay.core import Labels, Outcome, parameter
from dmplay.hexes import arrivals, notation_of
from dmplay.problems._hunt import CIRCLE, TRIANGLE, Hunt, numbered

CAPTURED, MOVED = 10.0, -1.0
SENSES = Labels(("prey", "nothing"))
AT_LARGE = 64  # the bit above those of the directions: no predator is on the hex of the prey
ALL = 127  # these bits
STAYS = 6  # where no direction is free


@dataclass(frozen=True)
class CollaborativePredatorPrey(Hunt):
    """A hunt with one reward for all; the prey is nature's, the last of the walkers."""

    predators: int = parameter(2, "how many predators", 1, 26)
    sighted: bool = parameter(False, "whether a predator sees its own hex")

    shared_reward = True

    @property
    def agents(self) -> tuple[str, ...]:
        """`predator1`, `predator2` ..., or `predator` alone."""
        return numbered("predator", self.predators) if self.predators > 1 else ("predator",)

    @property
    def walkers(self) -> int:
        """The predators and the prey."""
        return self.predators + 1

    @property
    def observations(self) -> tuple[Labels, ...]:
        """Whether a prey is near, and where sighted from which hex that was sensed."""
        if not self.sighted:
            return (SENSES,) * self.predators
        hexes = [notation_of(hex_) for hex_ in self.hexes]
        pairs = Labels(tuple(f"{sense} {hex_}" for sense in SENSES for hex_ in hexes))
        return (pairs,) * self.predators

    @cached_property
    def _around(self) -> Ints:
        """The hex in each direction of a hex, the last being the hex itself: `[H, 7]`, flat."""
        reached = arrivals(self.hexes)[:, :, 0]
        return np.hstack([reached, np.arange(len(self.hexes))[:, None]]).reshape(-1)

    @cached_property
    def _open(self) -> Ints:
        """What a predator on another hex leaves open to the prey on a hex `[H, H]`, flat.

        A bit for each direction in which the map goes on, and one unless both hexes are the same.
        """
        around = self._around.reshape(-1, 7)
        goes_on = around[:, :6] != around[:, 6:]
        ways = (goes_on << np.arange(6)).sum(axis=1)
        toward = self._toward.reshape(-1, len(self.hexes))
        alone = AT_LARGE * ~np.eye(len(self.hexes), dtype=bool)
        return np.asarray(ways[:, None] & ~toward | alone).reshape(-1)

    @cached_property
    def _toward(self) -> Ints:
        """The bit of the direction from one hex to its neighbour, else 0: `[H, H]`, flat."""
        here = np.arange(len(self.hexes))
        bits = np.zeros((len(here), len(here)), np.int64)
        for direction in range(6):
            bits[here, self._around[direction::7]] |= 1 << direction
        bits[here, here] = 0
        return bits.reshape(-1)

    @cached_property
    def _sensed(self) -> Ints:
        """What a predator on one hex observes `[H, H]` with the prey on another, flat."""
        toward = self._toward.reshape(-1, len(self.hexes))
        far = (toward == 0) & ~np.eye(len(self.hexes), dtype=bool)
        if not self.sighted:
            return np.asarray(far, np.int64).reshape(-1)
        return np.asarray(far * len(self.hexes) + np.arange(len(self.hexes))[:, None]).reshape(-1)

    @cached_property
    def _most(self) -> int:
        """Of how many hexes the prey takes one at most."""
        return max(len(self.hexes), 6)

    @cached_property
    def _slips(self) -> tuple[Chance, ...]:
        """The slip of each predator."""
        return (self.slips,) * self.predators

    def captured(self, s: Array) -> Bools:
        """Whether any predator is on the prey's hex `[B]`."""
        return np.asarray(self._free(tuple(s.T)) < AT_LARGE)

    def _free(self, hexes: Sequence[Column]) -> Whole:
        """The directions open to the prey, and AT_LARGE unless it is caught, a bit each."""
        *predators, prey = hexes
        free: Whole = ALL
        begins = prey * len(self.hexes)
        for hex_ in predators:
            free = free & listed(self._open, begins + hex_)
        return free

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """The slip of each predator; which of the hexes open to it the prey takes."""
        return self._draws(self._free(columns(s)))

    def _draws(self, free: Whole) -> tuple[Chance, ...]:
        """The same by what is open to the prey."""
        many = chosen(free < AT_LARGE, len(self.hexes), listed(_COUNT, free))
        return (*self._slips, Pick.of(many, self._most))

    def move(self, s: Array, a: Array, events: Sequence[Array | int]) -> Outcome:
        """Predators move as in hex world unless they feed, then all look around."""
        hexes = columns(s)
        return self._moves(hexes, self._free(hexes), a, events)

    def step(self, s: Array, a: Array, u: Reals) -> Outcome:
        """One turn, as it is derived; what is open to the prey is found once."""
        hexes = columns(s)
        free = self._free(hexes)
        return self._moves(hexes, free, a, drawn(self._draws(free), u))

    def _moves(
        self, hexes: Sequence[Column], free: Whole, a: Array, events: Sequence[Array | int]
    ) -> Outcome:
        """As `move`, by what is open to the prey."""
        *predators, prey = hexes
        *slips, event = map(column, events)
        caught = free < AT_LARGE
        moved = [*map(self._hunted, repeat(prey), predators, columns(a), slips)]
        way = listed(_KTH, free * 6 + chosen(caught, 0, event))
        moved.append(chosen(caught, event, listed(self._around, prey * 7 + way)))
        pay = chosen(caught, CAPTURED, MOVED)
        after = joined(moved, np.int64)
        return Outcome(after, joined([pay] * self.predators), self._senses(moved))

    def _hunted(self, prey: Column, hex_: Column, direction: Column, slip: Column) -> Column:
        """Where a predator ends: as in hex world unless it feeds."""
        return chosen(hex_ == prey, prey, self.walk(hex_, direction, slip))

    def observe(self, s: Array) -> Ints:
        """What each predator `[B, n]` observes in these states."""
        return self._senses(columns(s))

    def _senses(self, hexes: Sequence[Column]) -> Ints:
        """As `observe`."""
        *predators, prey = hexes
        seen = [listed(self._sensed, hex_ * len(self.hexes) + prey) for hex_ in predators]
        return joined(seen, np.int64)

    @cached_property
    def _observed(self) -> Ints:
        """What each predator observes `[S, n]` in every state."""
        return self.observe(self.enumerated())

    @cached_property
    def walks(self) -> Reals:
        """The probability `[6, H, H]` of getting from one hex to another by a direction."""
        size = len(self.hexes)
        ends = arrivals(self.hexes)
        walks = np.zeros((6, size, size))
        for slip, p in enumerate(self.slips.probabilities()[0]):
            for direction in range(6):
                walks[direction, np.arange(size), ends[:, direction, slip]] += p
        return walks

    @cached_property
    def flights(self) -> Reals:
        """The probability `[S, H]` of each next hex of the prey in every state."""
        size = len(self.hexes)
        Budget("where the prey goes", "try a smaller map").hold(16.0 * self.states * size)
        s = self.enumerated()
        still = np.zeros((len(s), self.predators), np.int64)
        pick = self.chance(s, still)[-1]
        assert isinstance(pick, Pick)
        flights = np.zeros((len(s), size))
        for way, p in enumerate(pick.probabilities().T):
            taken = np.flatnonzero(p)
            stays = still[taken]
            moved = self.move(s[taken], stays, (*stays.T, np.full(len(taken), way))).state[:, -1]
            flights[taken, moved] += p[taken]
        return flights

    def carry(
        self, belief: Reals, actions: Sequence[int | None], observations: Sequence[int | None]
    ) -> Reals:
        """Walker by walker, beliefs `[S]` or `[B, S]`: each moves by itself.

        Where a predator feeds, it stays and the prey is anywhere next; else nobody's walk depends
        on where the prey was. A row has the same bits in any batch: its products are its own.
        """
        size = len(self.hexes)
        taken = [-1 if a is None else a for a in actions]
        walks, fed = ([led[a] for a in taken] for led in self._led)
        before = belief.reshape(-1, self.states // size, size)
        hunted, caught = np.where(self._caught, 0.0, before), np.where(self._caught, before, 0.0)
        fled = np.matmul(hunted[:, :, None], self.flights.reshape(-1, size, size))
        after: Reals = _walked(fled, walks).reshape(len(before), -1, size)
        after += _walked(caught.swapaxes(1, 2), fed).sum(axis=1)[:, :, None] / size
        after = after.reshape(belief.shape)
        for seat, observation in enumerate(observations):
            if observation is not None:
                after = after * (self._observed[:, seat] == observation)
        return after

    @cached_property
    def _led(self) -> tuple[Reals, Reals]:
        """How likely each direction, and any of them, leads to a hex from another: `[7, 1, H, H]`,
        and `[7, H, H, H]` with a prey on each hex, on which a predator feeds and stays.
        """
        size = len(self.hexes)
        walks = np.vstack([self.walks, self.walks.mean(axis=0)[None]]).swapaxes(1, 2)[:, None]
        stays = np.eye(size, dtype=bool)[:, None]  # from the hex of the prey
        return walks, np.where(stays, np.eye(size), walks)

    @cached_property
    def _caught(self) -> Bools:
        """Whether the prey on each hex is caught `[S / H, H]`."""
        return self.captured(self.enumerated()).reshape(-1, len(self.hexes))


def _walked(joint: Reals, walks: Sequence[Reals]) -> Reals:
    """Probabilities `[B, P, ...]` by the hex of each predator, after walks `[P, H, H]` of each."""
    for seat, walk in enumerate(walks):
        many, size, _ = walk.shape
        parts = joint.reshape(len(joint), many, size**seat, size, -1)
        joint = np.matmul(walk[:, None], parts)
    return joint.reshape(len(joint), len(walks[0]), -1)


def _directions() -> tuple[Ints, Ints]:
    """How many directions some bits are `[128]`, 1 for none, and the k-th `[128, 6]`, flat."""
    count, kth = np.ones(ALL + 1, np.int64), np.full((ALL + 1, 6), STAYS)
    for mask in range(ALL + 1):
        held = [direction for direction in range(6) if mask >> direction & 1]
        count[mask] = max(len(held), 1)
        kth[mask, : len(held)] = held
    return count, kth.reshape(-1)


_COUNT, _KTH = _directions()

VARIANTS = {
    "circle": CollaborativePredatorPrey(hexes=CIRCLE),
    "triangle": CollaborativePredatorPrey(hexes=TRIANGLE),
    "sighted": CollaborativePredatorPrey(sighted=True),
}

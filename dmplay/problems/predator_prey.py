"""Predators chase prey over a slippery hex map; a devoured prey is born again somewhere.

Source: appendix F.13; PredatorPreyHexWorld.jl. Decisions: captures are judged on the state acted
in, hex by hex; a predator that feeds stays and gets m/n (the package pays 10), any other pays 1,
also when it bumps; a prey moves for free; a devoured prey pays 100 and is born on any hex, occupied
or not. One against one on the standard map starts as in figure F.16, anything else anywhere.
`circle` is the ring of six hexes, `triangle` that of three.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Categorical, Chance, Reals
from dmplay.columns import Column, chosen, column, columns, joined, least
from dmplay.core import Outcome, parameter
from dmplay.hexes import slips
from dmplay.problems._hunt import CIRCLE, STANDARD, TRIANGLE, Hunt, numbered, sharing

FIRST_PREDATOR, FIRST_PREY = (1, 2), (2, 0)  # figure F.16
DEVOURED, MOVED = -100.0, -1.0


@dataclass(frozen=True)
class PredatorPrey(Hunt):
    """A hunt in which everyone sees everyone."""

    predators: int = parameter(1, "how many predators", 1, 26)
    prey: int = parameter(1, "how many prey", 1, 26)

    @property
    def agents(self) -> tuple[str, ...]:
        """`predator` and `prey`, numbered where there are several."""
        if self.predators == self.prey == 1:
            return ("predator", "prey")
        return numbered("predator", self.predators) + numbered("prey", self.prey)

    @property
    def walkers(self) -> int:
        """Every agent."""
        return self.predators + self.prey

    @cached_property
    def hunters(self) -> range:
        """The seats of the predators."""
        return range(self.predators)

    @cached_property
    def hunted(self) -> range:
        """The seats of the prey."""
        return range(self.predators, self.walkers)

    @cached_property
    def _births(self) -> Reals:
        """Cumulative probabilities of a prey's event: its hex if devoured, its slip if free."""
        size = max(len(self.hexes), 3)
        births = np.ones((2, size - 1))
        births[1, :2] = slips(self.slip).cumulative
        births[0, : len(self.hexes) - 1] = np.arange(1, len(self.hexes)) / len(self.hexes)
        return births

    @cached_property
    def _born(self) -> tuple[Categorical, ...]:
        """What a prey draws alone in its row: devoured, or free."""
        return tuple(Categorical(births[None]) for births in self._births)

    def _fate(self, hexes: Sequence[Column], prey: int) -> Categorical:
        """What a prey draws."""
        free = sharing(hexes, prey, self.hunters) == 0
        if isinstance(free, np.ndarray):
            return Categorical(self._births.take(free, axis=0))
        return self._born[free]

    @property
    def _drawn(self) -> bool:
        """Whether the game starts as in the figure."""
        return self.predators == self.prey == 1 and self.hexes == STANDARD

    def opening(self, rows: int) -> tuple[Chance, ...]:
        """Nothing where the figure says it all, else the hex of each agent."""
        return () if self._drawn else super().opening(rows)

    def place(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The hexes drawn, or those of the figure."""
        if not self._drawn:
            return super().place(rows, events)
        figure = [self.hexes.index(FIRST_PREDATOR), self.hexes.index(FIRST_PREY)]
        return np.tile(np.array(figure), (rows, 1))

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """The slip of each agent; of a devoured prey, where it is born."""
        hexes = columns(s)
        fates = [self._fate(hexes, prey) for prey in self.hunted]
        return (*(self.slips,) * self.predators, *fates)

    def move(self, s: Array, a: Array, events: Sequence[Array | int]) -> Outcome:
        """Everyone moves as in hex world, but those that feed and those that are fed on."""
        hexes = columns(s)
        moved, rewards = [], []
        each = zip(hexes, columns(a), map(column, events), strict=True)
        for seat, (hex_, direction, event) in enumerate(each):
            hunters = sharing(hexes, seat, self.hunters)
            if seat in self.hunters:
                prey = sharing(hexes, seat, self.hunted)
                feeds, walked = prey > 0, self.walk(hex_, direction, event)
                rewards.append(chosen(feeds, prey / hunters, MOVED))
                moved.append(chosen(feeds, hex_, walked))
            else:
                caught, walked = hunters > 0, self.walk(hex_, direction, least(event, 2))
                rewards.append(chosen(caught, DEVOURED, 0.0))
                moved.append(chosen(caught, event, walked))
        after = joined(moved, np.int64)
        return Outcome(after, joined(rewards), after)


VARIANTS = {"circle": PredatorPrey(hexes=CIRCLE), "triangle": PredatorPrey(hexes=TRIANGLE)}

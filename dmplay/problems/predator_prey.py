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
from dmplay.columns import Column, minimum, select_where, split_columns, stack_columns, to_column
from dmplay.core import Outcome, parameter
from dmplay.hexes import slip_chance
from dmplay.problems._hunt import (
    CIRCLE_HEXES,
    STANDARD_HEXES,
    TRIANGLE_HEXES,
    HexHunt,
    count_on_same_hex,
    make_numbered_names,
)

PREDATOR_START_HEX, PREY_START_HEX = (1, 2), (2, 0)  # figure F.16
DEVOURED_REWARD, MOVE_REWARD = -100.0, -1.0


@dataclass(frozen=True)
class PredatorPrey(HexHunt):
    """A hunt in which everyone sees everyone."""

    predators: int = parameter(1, "how many predators", 1, 26)
    prey: int = parameter(1, "how many prey", 1, 26)

    @property
    def agents(self) -> tuple[str, ...]:
        """`predator` and `prey`, numbered where there are several."""
        if self.predators == self.prey == 1:
            return ("predator", "prey")
        return make_numbered_names("predator", self.predators) + make_numbered_names(
            "prey", self.prey
        )

    @property
    def walker_count(self) -> int:
        """Every agent."""
        return self.predators + self.prey

    @cached_property
    def predator_seats(self) -> range:
        """The seats of the predators."""
        return range(self.predators)

    @cached_property
    def prey_seats(self) -> range:
        """The seats of the prey."""
        return range(self.predators, self.walker_count)

    @cached_property
    def _prey_event_cumulative(self) -> Reals:
        """Cumulative probabilities of a prey's event: its hex if devoured, its slip if free."""
        size = max(len(self.hexes), 3)
        births = np.ones((2, size - 1))
        births[1, :2] = slip_chance(self.slip).cumulative
        births[0, : len(self.hexes) - 1] = np.arange(1, len(self.hexes)) / len(self.hexes)
        return births

    @cached_property
    def _prey_event_chances(self) -> tuple[Categorical, ...]:
        """What a prey draws alone in its row: devoured, or free."""
        return tuple(Categorical(births[None]) for births in self._prey_event_cumulative)

    def _select_prey_chance(self, hexes: Sequence[Column], prey: int) -> Categorical:
        """What a prey draws."""
        free = count_on_same_hex(hexes, prey, self.predator_seats) == 0
        if isinstance(free, np.ndarray):
            return Categorical(self._prey_event_cumulative.take(free, axis=0))
        return self._prey_event_chances[free]

    @property
    def _has_fixed_start(self) -> bool:
        """Whether the game starts as in the figure."""
        return self.predators == self.prey == 1 and self.hexes == STANDARD_HEXES

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Nothing where the figure says it all, else the hex of each agent."""
        return () if self._has_fixed_start else super().initial_chance(rows)

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The hexes drawn, or those of the figure."""
        if not self._has_fixed_start:
            return super().initial_states(rows, events)
        figure = [self.hexes.index(PREDATOR_START_HEX), self.hexes.index(PREY_START_HEX)]
        return np.tile(np.array(figure), (rows, 1))

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """The slip of each agent; of a devoured prey, where it is born."""
        hexes = split_columns(s)
        fates = [self._select_prey_chance(hexes, prey) for prey in self.prey_seats]
        return (*(self.slip_chance,) * self.predators, *fates)

    def resolve_events(self, s: Array, a: Array, events: Sequence[Array | int]) -> Outcome:
        """Everyone moves as in hex world, but those that feed and those that are fed on."""
        hexes = split_columns(s)
        moved, rewards = [], []
        each = zip(hexes, split_columns(a), map(to_column, events), strict=True)
        for seat, (hex_, direction, event) in enumerate(each):
            hunters = count_on_same_hex(hexes, seat, self.predator_seats)
            if seat in self.predator_seats:
                prey = count_on_same_hex(hexes, seat, self.prey_seats)
                feeds, walked = prey > 0, self.move_walker(hex_, direction, event)
                rewards.append(select_where(feeds, prey / hunters, MOVE_REWARD))
                moved.append(select_where(feeds, hex_, walked))
            else:
                caught, walked = hunters > 0, self.move_walker(hex_, direction, minimum(event, 2))
                rewards.append(select_where(caught, DEVOURED_REWARD, 0.0))
                moved.append(select_where(caught, event, walked))
        after = stack_columns(moved, np.int64)
        return Outcome(after, stack_columns(rewards), after)


VARIANTS = {
    "circle": PredatorPrey(hexes=CIRCLE_HEXES),
    "triangle": PredatorPrey(hexes=TRIANGLE_HEXES),
}

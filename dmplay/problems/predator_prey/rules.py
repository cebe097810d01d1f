"""Predators hunt prey on a slippery map of hexes; a caught prey reappears on a random hex.

Source: appendix F.13; PredatorPreyHexWorld.jl. Decisions: A capture depends on the hexes before the
move. If n predators and m prey are on the same hex, each of these predators stays there and gets
m/n (10 in the package). Every other predator loses 1, also if it bumps. A prey moves at no cost. A
caught prey loses 100 and reappears on any hex, occupied or not. One predator and one prey on the
standard map start as in figure F.16; all others start on uniformly random hexes. The variant
`circle` is the ring of six hexes, `triangle` the ring of three.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.core.arrays import Array, Ints, Reals
from dmplay.core.chance import Categorical, Chance
from dmplay.core.hexgrid import slip_chance
from dmplay.core.parameters import parameter
from dmplay.core.problem import Outcome
from dmplay.problems._shared.hex_hunt import (
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
    """A hunt in which every agent sees all hexes."""

    predators: int = parameter(1, "number of predators", 1, 26)
    prey: int = parameter(1, "number of prey", 1, 26)

    @property
    def agents(self) -> tuple[str, ...]:
        """The names `predator` and `prey`, numbered unless there is one of each."""
        if self.predators == self.prey == 1:
            return ("predator", "prey")
        predators = make_numbered_names("predator", self.predators)
        return predators + make_numbered_names("prey", self.prey)

    @property
    def reward_bounds(self) -> tuple[float, float]:
        """The reward of a devoured prey, and that of a predator on a hex with all prey."""
        return DEVOURED_REWARD, float(self.prey)

    @property
    def walker_count(self) -> int:
        """The number of walkers: every agent is one."""
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
        """Cumulative probabilities of a prey's event: its next hex if devoured, else its slip."""
        event_count = max(len(self.hexes), 3)
        cumulative = np.ones((2, event_count - 1))
        cumulative[1, :2] = slip_chance(self.slip).cumulative
        cumulative[0, : len(self.hexes) - 1] = np.arange(1, len(self.hexes)) / len(self.hexes)
        return cumulative

    def _select_prey_chance(self, hexes: Ints, prey: int) -> Categorical:
        """Return the distribution of a prey's event: its next hex if devoured, its slip if free."""
        is_free = count_on_same_hex(hexes, prey, self.predator_seats) == 0
        return Categorical(self._prey_event_cumulative.take(is_free, axis=0))

    @property
    def _has_fixed_start(self) -> bool:
        """True if the game starts as in figure F.16."""
        return self.predators == self.prey == 1 and self.hexes == STANDARD_HEXES

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return nothing if the start is fixed, else a uniform distribution for each agent."""
        return () if self._has_fixed_start else super().initial_chance(rows)

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """Return the sampled hexes of all agents as states `[B, n]`, or those of figure F.16."""
        if not self._has_fixed_start:
            return super().initial_states(rows, events)
        start_hexes = [self.hexes.index(PREDATOR_START_HEX), self.hexes.index(PREY_START_HEX)]
        return np.tile(np.array(start_hexes), (rows, 1))

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Return the distributions of each agent's slip, or of a devoured prey's next hex."""
        hexes = np.ascontiguousarray(s.T)
        prey_chances = [self._select_prey_chance(hexes, prey) for prey in self.prey_seats]
        return (*(self.slip_chance,) * self.predators, *prey_chances)

    def resolve_events(self, s: Array, a: Array, events: Sequence[Array]) -> Outcome:
        """Return the outcome: all move as in hex world, except eating predators and eaten prey."""
        hexes = np.ascontiguousarray(s.T)
        next_hexes, rewards = [], []
        agents = zip(hexes, np.ascontiguousarray(a.T), events, strict=True)
        for seat, (hex_, direction, event) in enumerate(agents):
            predator_count = count_on_same_hex(hexes, seat, self.predator_seats)
            if seat in self.predator_seats:
                prey_count = count_on_same_hex(hexes, seat, self.prey_seats)
                feeds, move_end = prey_count > 0, self.find_move_ends(hex_, direction, event)
                rewards.append(np.where(feeds, prey_count / predator_count, MOVE_REWARD))
                next_hexes.append(np.where(feeds, hex_, move_end))
            else:
                is_caught = predator_count > 0
                move_end = self.find_move_ends(hex_, direction, np.minimum(event, 2))
                rewards.append(np.where(is_caught, DEVOURED_REWARD, 0.0))
                next_hexes.append(np.where(is_caught, event, move_end))
        next_states = np.stack(next_hexes, axis=1)
        return Outcome(next_states, np.stack(rewards, axis=1), next_states)


VARIANTS = {
    "circle": PredatorPrey(hexes=CIRCLE_HEXES),
    "triangle": PredatorPrey(hexes=TRIANGLE_HEXES),
}

"""Policies for hex world."""

from dataclasses import dataclass

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import StationaryPolicy
from dmplay.agents.single_agent_planning import MdpOptimalPolicy
from dmplay.core.arrays import Array, Bools
from dmplay.core.hexgrid import hex_neighbours, path_lengths

from .rules import HexWorld


@dataclass(frozen=True)
class NearestExit(StationaryPolicy):
    """Walks by a shortest path to the nearest good exit, as if no step slipped."""

    problem: HexWorld

    def choose_from_states(self, s: Array, legal: Bools | None) -> Array:
        """Return the first step that leads nearer to an exit; any action on an exit."""
        hexes = self.problem.hexes
        goals = [hexes.index(hex_) for hex_, reward in self.problem.rewards if reward > 0]
        lengths = path_lengths(hexes)[:, goals].min(axis=1, initial=len(hexes))
        index_by_hex = {hex_: index for index, hex_ in enumerate(hexes)}
        steps = np.zeros(len(hexes) + 1, np.int64)  # the last state is the end of the game
        for index, hex_ in enumerate(hexes):
            neighbours = [index_by_hex.get(other) for other in hex_neighbours(hex_)]
            steps[index] = np.argmin([np.inf if n is None else lengths[n] for n in neighbours])
        return np.asarray(steps[s])


AGENTS = Roster(
    {"optimal": MdpOptimalPolicy, "nearest-exit": NearestExit},
    hint_provider="optimal",
    rule_of_thumb="nearest-exit",
)

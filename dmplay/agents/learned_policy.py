"""The policy that a learner has learned: the best action by the weights of active features."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.agents.belief_policy import SeatBeliefs
from dmplay.algorithms.exploration import choose_greedy
from dmplay.algorithms.features import (
    AfterstateFeatures,
    Features,
    NumberFeatures,
    StateFeatures,
    rate_actions,
)
from dmplay.algorithms.tile_coding import TileFeatures
from dmplay.core.arrays import Array, Bools, Reals, readonly_copy
from dmplay.core.policy import GameFollower, Memory, Percept, requires_fields
from dmplay.core.problem import Problem
from dmplay.core.uniforms import make_numpy_generator
from dmplay.errors import BadParameter
from dmplay.simulation.learning_games import LearningGames

SAMPLED_GAMES, SAMPLED_TURNS = 64, 100  # of random play, to measure numbers without bounds
MAX_WEIGHTS = 4_000_000
MAX_TILED_BELIEF_STATES = 3


@dataclass(frozen=True)
class LearnedPolicy(SeatPolicy):
    """Takes the action whose features have the greatest weight."""

    features: Features
    weights: Reals
    follower: GameFollower | None = None

    def initial_memory(self, observation: Array) -> Memory:
        """Return the state, or the belief if it is hidden."""
        if self.follower is None:
            return (readonly_copy(observation),)
        return self.follower.initial_memory(observation)

    @requires_fields("action", "observation")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the state or the belief after a turn."""
        if self.follower is None:
            return (readonly_copy(percept.observation),)
        return self.follower.update_memory(memory, percept)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the first of the actions with the greatest sum of weights."""
        return choose_greedy(rate_actions(self.weights, self.features.activate(memory[0])), legal)


def make_follower(problem: Problem) -> GameFollower | None:
    """Return the beliefs of a hidden state; None if the agent sees the state."""
    return SeatBeliefs(problem, 0) if problem.partially_observable else None


def describe_features(
    problem: Problem, kind: str = "tiles", tilings: int = 8, tiles: int = 8
) -> dict[str, Any]:
    """Return the features of a problem as data: their kind, and its numbers.

    States that can be listed have one feature each, whatever the kind.
    """
    state_count = problem.state_count
    if kind == "afterstates":
        return {"kind": kind}
    if problem.partially_observable:
        if not isinstance(state_count, int):
            raise BadParameter("its hidden states cannot be listed, so there is no belief")
        low, high = np.zeros(state_count), np.ones(state_count)
        if state_count > MAX_TILED_BELIEF_STATES:
            kind = "numbers"
        elif kind == "tiles":  # the probability of the last state is the rest
            low, high = low[:-1], high[:-1]
    elif isinstance(state_count, int):
        return {"kind": "states", "count": state_count}
    else:
        low, high = find_number_bounds(problem)
    if kind == "numbers":
        return {"kind": "numbers", "scales": np.maximum(abs(low), abs(high)).tolist()}
    grid = {"low": low.tolist(), "high": high.tolist(), "tilings": tilings, "tiles": tiles}
    return {"kind": "tiles", **grid}


def build_features(problem: Problem, description: Mapping[str, Any]) -> Features:
    """Return the features that `describe_features` describes; raise BadParameter if too many."""
    match description:
        case {"kind": "states", "count": int(count)}:
            features: Features = StateFeatures(problem, count)
        case {"kind": "afterstates"} if problem.afterstates is not None:
            return AfterstateFeatures(problem.afterstates)
        case {"kind": "numbers", "scales": scales}:
            features = NumberFeatures(np.array(scales, float))
        case {"kind": "tiles", "low": low, "high": high, "tilings": tilings, "tiles": tiles}:
            features = TileFeatures(np.array(low, float), np.array(high, float), tilings, tiles)
        case _:
            raise BadParameter(f"features: got {description!r}, expected states, numbers or tiles")
    if features.count * problem.action_counts[0] > MAX_WEIGHTS:
        raise BadParameter(
            f"{features.count} features with {problem.action_counts[0]} actions: expected at most "
            f"{MAX_WEIGHTS} weights; use fewer tiles"
        )
    return features


def find_number_bounds(problem: Problem) -> tuple[Reals, Reals]:
    """Return the lowest and the highest value of each number of a state.

    Numbers without bounds are measured in games of random play with a fixed seed.
    """
    if problem.state_bounds is not None and np.isfinite(problem.state_bounds).all():
        return np.array(problem.state_bounds[0], float), np.array(problem.state_bounds[1], float)
    if problem.state_grid is not None:
        ends = np.array([(axis.points[0], axis.points[-1]) for axis in problem.state_grid.axes])
        return ends[:, 0], ends[:, 1]
    games = LearningGames(problem, SAMPLED_GAMES, make_numpy_generator(0))
    sample = []
    for _ in range(SAMPLED_TURNS):
        sample.append(games.inputs)
        games.step(games.generator.integers(problem.action_counts[0], size=SAMPLED_GAMES))
    numbers = np.concatenate(sample)
    return numbers.min(axis=0), numbers.max(axis=0)

"""Tree search for any problem."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay import belief
from dmplay.chance import Array, Bools, Reals, among
from dmplay.core import Memory, Percept, exact, parameter
from dmplay.dice import spread
from dmplay.errors import BadParameter, BadPolicy, TooMuch
from dmplay.policies._believing import Believing
from dmplay.solvers.uct import Tree
from dmplay.solvers.value_iteration import best


@dataclass(frozen=True)
class Search(Believing):
    """Simulates many games ahead and does what went best (UCT).

    It takes the others to act uniformly at random. Where states are hidden it starts its games in
    states drawn from its belief, never in the true one. An interval is searched on a grid.
    """

    simulations: int = parameter(200, "games simulated before a choice", 1, 1e6)
    depth: int = parameter(20, "turns that each of them looks ahead", 1, 1e5)
    exploration: float = parameter(1.0, "weight of trying what was tried seldom", 0.0)

    draws = 1  # from which all of its own luck follows

    def __post_init__(self) -> None:
        """Refuses numbers out of bounds, and problems without a belief to search from."""
        super().__post_init__()
        if self.problem.hidden:
            try:
                belief.prior(self.problem)
                _ = self.problem.observation_counts
                first = self.problem.enumerated()[:1]
                exact(self.problem, first, np.zeros((1, len(self.problem.agents)), np.int64))
            except (BadParameter, TooMuch) as error:
                raise BadPolicy(f"search needs a belief, as states are hidden: {error}") from None

    @cached_property
    def _tree(self) -> Tree:
        return Tree(self.problem, self.seat, self.simulations, self.depth, self.exploration)

    def begin(self, observation: Array) -> Memory:
        """The state, or the belief where it is hidden."""
        return super().begin(observation) if self.problem.hidden else (observation,)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The new state, or belief."""
        return super().update(memory, percept) if self.problem.hidden else (percept.observation,)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """An action with the greatest mean return; of several, any."""
        (known,) = memory
        parts = [
            self._chosen(known[some], None if legal is None else legal[some], u[some, 0])
            for some in (
                slice(first, first + self._tree.rows)
                for first in range(0, len(known), self._tree.rows)
            )
        ]
        return np.concatenate(parts) if parts else self._tree.actions[:0]

    def _chosen(self, known: Array, legal: Bools | None, u: Reals) -> Array:
        """The actions `[B]` for some rows that are searched together."""
        self._tree.budget(len(u))  # refuses too much before it is drawn for
        told = spread(u, self.simulations + self._tree.draws)
        if self.problem.hidden:
            roots = self._drawn(known, told[:, : self.simulations])
        else:
            roots = np.repeat(known[:, None], self.simulations, axis=1)
        values = self._tree.values(roots, told[:, self.simulations :])
        if legal is not None:
            values[~legal] = -np.inf
        return np.asarray(self._tree.actions[among(best(values), u)])

    def _drawn(self, beliefs: Reals, u: Reals) -> Array:
        """States `[B, N, ...]` by uniforms `[B, N]`."""
        places = np.empty(u.shape, np.int64)
        for row, likely in enumerate(beliefs):
            possible = np.flatnonzero(likely)
            edges = np.cumsum(likely[possible])[:-1]
            places[row] = possible[np.searchsorted(edges, u[row], side="right")]
        return np.asarray(self.problem.enumerated()[places])

"""Tree search for any problem."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Self

import numpy as np

from dmplay import belief
from dmplay.chance import Array, Bools, Ints, Reals, among
from dmplay.core import Memory, Percept, Policy, exact, parameter
from dmplay.dice import spread
from dmplay.errors import BadParameter, BadPolicy, TooMuch
from dmplay.policies._believing import Believing
from dmplay.policies.kinds import Company
from dmplay.policies.roster import ADVISER, PARTNER
from dmplay.solvers import rewards_ahead, uct
from dmplay.solvers.rewards_ahead import RewardsAhead
from dmplay.solvers.search_tree import Asked, Cast, Tree, Worth
from dmplay.solvers.value_iteration import best

FEW_HIDDEN = 30  # states that random play comes to soon: there it tells more than seeing them all
USUAL = "usual"
FAR = 10**9  # turns left where a game has no end of its own


@dataclass(frozen=True)
class Advised:
    """What an adviser that knows values holds of a state."""

    adviser: Policy

    def __call__(self, s: Array, memory: Memory, left: Ints) -> Reals:
        """The value of its best action."""
        q = self.adviser.values(memory)
        assert q is not None
        return np.asarray(q.max(axis=1))


@dataclass(frozen=True)
class Search(Believing):
    """Simulates many games ahead and does what went best (UCT).

    Where all is seen it takes the others to act as their usual partners do, else at random. Where
    states are hidden it starts its games in states drawn from its belief, never in the true one.
    What lies beyond its tree is worth what a few sweeps over a small problem say, else what the
    adviser says or earns, else what random play earns.
    """

    simulations: int = parameter(400, "games simulated before a choice", 1, 1e6)
    depth: int = parameter(20, "turns that each of them looks ahead", 1, 1e5)
    exploration: float = parameter(1.0, "weight of trying what was tried seldom", 0.0)
    others: str = parameter(USUAL, "who the others are taken to be: usual, random or an agent")
    rollout: str = parameter(USUAL, "who plays on beyond the tree: usual, random or an agent")
    company: Company | None = field(default=None, compare=False, repr=False)

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
        for part, name in (("others", self.others), ("rollout", self.rollout)):
            if name.partition(":")[0] == "search":
                raise BadParameter(f"{part}: got {name!r}, expected an agent that does not search")
        if self.others not in (USUAL, "random") and self.problem.hidden:
            raise BadParameter("others: where states are hidden they are taken to act at random")

    def among(self, company: Company) -> Self:
        """The same, who finds other agents there."""
        found = replace(self, company=company)
        if (self.others, self.rollout) != (USUAL, USUAL):
            _ = found._cast  # refuses names that nobody has
        return found

    @cached_property
    def _tree(self) -> Tree:
        parts = self.simulations, self.depth, self.exploration
        return Tree(self.problem, self.seat, *parts, self._cast, self._worth)

    @cached_property
    def _ahead(self) -> RewardsAhead | None:
        problem = self.problem
        many = isinstance(problem.states, int) and problem.states > FEW_HIDDEN
        asked = many if problem.hidden else len(problem.agents) == 1
        return rewards_ahead.found(problem, self.seat) if asked and self.rollout == USUAL else None

    @cached_property
    def _cast(self) -> Cast:
        """Who acts in each seat, the own one beyond the tree."""
        return tuple(map(self._actor, range(len(self.problem.agents))))

    def _actor(self, seat: int) -> Policy | None:
        if seat == self.seat:
            unasked = self._ahead is not None or self.problem.hidden or self.problem.states == 1
            return self._found(seat, self.rollout, "random" if unasked else ADVISER)
        return None if self.problem.hidden else self._found(seat, self.others, PARTNER)

    def _found(self, seat: int, name: str, usual: str) -> Policy | None:
        """Who acts in a seat; None for any action, each as likely."""
        wanted = usual if name == USUAL else name
        return self.company(seat, wanted) if self.company and wanted != "random" else None

    @property
    def _worth(self) -> Worth | None:
        """What a state beyond the tree is worth; None where the simulation plays on."""
        ahead, actor = self._ahead, self._cast[self.seat]
        if ahead or actor is None or self.rollout != USUAL or len(self.problem.agents) > 1:
            return ahead
        sight = self.problem.first_sight(self._start, self.seat)
        return None if actor.values(actor.begin(sight)) is None else Advised(actor)

    @property
    def _start(self) -> Array:
        """Some state, `[1, ...]`."""
        return self.problem.start(np.zeros((1, self.problem.draws.start)))

    @cached_property
    def _parts(self) -> list[slice]:
        """Where the memory of each of the cast is."""
        sights = [self.problem.first_sight(self._start, i) for i in range(len(self._cast))]
        each = [len(one.begin(o)) if one else 0 for one, o in zip(self._cast, sights, strict=True)]
        ends = np.cumsum([2, *each]).tolist()
        return [slice(a, b) for a, b in pairwise(ends)]

    def begin(self, observation: Array) -> Memory:
        """The state, or the belief where it is hidden; no turn done; what the cast remembers."""
        known = super().begin(observation) if self.problem.hidden else (observation,)
        cast = [part for one in self._cast if one for part in one.begin(observation)]
        return (*known, np.zeros(len(observation), np.int64), *cast)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The same after one more turn."""
        hidden = self.problem.hidden
        known = super().update(memory[:1], percept) if hidden else (percept.observation,)
        cast = [
            part
            for seat, (one, kept) in enumerate(zip(self._cast, self._parts, strict=True))
            if one
            for part in one.update(memory[kept], self._told(seat, percept))
        ]
        return (*known, memory[1] + 1, *cast)

    def _told(self, seat: int, percept: Percept) -> Percept:
        """What a turn taught another seat, as far as this one knows."""
        if seat == self.seat:
            return percept
        assert percept.actions is not None  # where all is seen
        return percept._replace(action=percept.actions[:, seat], reward=None)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """An action with the greatest mean return; of several, any."""
        tree = self._tree
        parts = [
            self._chosen(
                tuple(part[some] for part in memory),
                None if legal is None else legal[some],
                u[some, 0],
            )
            for some in (slice(first, first + tree.rows) for first in range(0, len(u), tree.rows))
        ]
        return np.concatenate(parts) if parts else self.problem.actions[self.seat].grid()[:0]

    def _chosen(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The actions `[B]` for some rows that are searched together."""
        self._tree.budget(len(u))  # refuses too much before it is drawn for
        told = spread(u, self.simulations + self._tree.draws)
        known, done = memory[:2]
        if self.problem.hidden:
            roots = self._drawn(known, told[:, : self.simulations])
        else:
            roots = np.repeat(known[:, None], self.simulations, axis=1)
        horizon = self.problem.horizon
        left = np.full(len(u), FAR) if horizon is None else horizon - done % horizon
        cast = tuple(memory[part] for part in self._parts)
        found = uct.search(self._tree, Asked(roots, left, cast, legal), told[:, self.simulations :])
        able = best(found.means)
        actor = self._cast[self.seat]
        if actor:
            usual = actor.choose(cast[self.seat], legal, told[:, : actor.draws])
            able = found.kept(able, usual)
        return np.asarray(found.actions[np.arange(len(u)), among(able, u)])

    def _drawn(self, beliefs: Reals, u: Reals) -> Array:
        """States `[B, N, ...]` by uniforms `[B, N]`."""
        places = np.empty(u.shape, np.int64)
        for row, likely in enumerate(beliefs):
            possible = np.flatnonzero(likely)
            edges = np.cumsum(likely[possible])[:-1]
            places[row] = possible[np.searchsorted(edges, u[row], side="right")]
        return np.asarray(self.problem.enumerated()[places])

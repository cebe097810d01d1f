"""Tree search for any problem."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain
from typing import Self

import numpy as np

from dmplay import belief
from dmplay.chance import Array, Bools, Ints, Reals, among
from dmplay.core import Memory, Percept, Policy, exact, parameter
from dmplay.dice import spread
from dmplay.errors import BadParameter, BadPolicy, TooMuch
from dmplay.policies._believing import Believing
from dmplay.policies._guessing import GUESSES, Guessing, drawn
from dmplay.policies.kinds import Company
from dmplay.policies.roster import ADVISER, PARTNER
from dmplay.solvers import rewards_ahead, uct
from dmplay.solvers.cast import Actors, Cast, some
from dmplay.solvers.rewards_ahead import RewardsAhead
from dmplay.solvers.search_nodes import Nodes
from dmplay.solvers.search_subtree import packed, under
from dmplay.solvers.search_tree import GOLDEN, Asked, Tree, Worth
from dmplay.solvers.uct import Found
from dmplay.solvers.value_iteration import best

FEW_HIDDEN = 30  # states that random play comes to soon: there it tells more than seeing them all
LONGEST = 10**6  # turns of a game that are counted
USUAL = "usual"
FOUND = len(Found._fields)
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

    It takes the others to act as their usual partners do, a team to follow its plan, else at
    random. Where states are hidden it starts its games in states drawn from its belief, never in
    the true one, and guesses what its partners saw and remember. What lies beyond its tree is worth
    what a few sweeps over a small problem say, else what the adviser says or earns, else what
    random play earns.
    """

    simulations: int = parameter(400, "games simulated before a choice", 1, 1e6)
    depth: int = parameter(20, "turns that each of them looks ahead", 1, 1e5)
    exploration: float = parameter(1.0, "weight of trying what was tried seldom", 0.0)
    others: str = parameter(USUAL, "who the others are taken to be: usual, random or an agent")
    rollout: str = parameter(USUAL, "who plays on beyond the tree: usual, random or an agent")
    horizon: int = parameter(0, "turns of a game; 0: those of the problem, if any", 0, LONGEST)
    reuse: bool = parameter(False, "whether a turn goes on with the tree of the turn before")
    company: Company | None = field(default=None, compare=False, repr=False)

    whole_game = True
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
            if self.reuse and self.problem.legal(first) is not None:
                raise BadPolicy("search: reuse needs states that are seen, or all actions legal")
        for part, name in (("others", self.others), ("rollout", self.rollout)):
            if name.partition(":")[0] == "search":
                raise BadParameter(f"{part}: got {name!r}, expected an agent that does not search")

    @property
    def turns(self) -> int | None:
        """How many turns a game has; None for no end."""
        return self.horizon or self.problem.horizon

    def in_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """One that searches to the end of the game."""
        if turns is None or turns == self.turns or turns > LONGEST:
            return self
        return replace(self, horizon=turns)

    def among(self, company: Company) -> Self:
        """The same, who finds other agents there."""
        found = replace(self, company=company)
        if (self.others, self.rollout) != (USUAL, USUAL):
            _ = found._cast  # refuses names that nobody has
        return found

    @cached_property
    def _tree(self) -> Tree:
        parts = self.simulations, self.depth, self.exploration
        return Tree(self.problem, self.seat, *parts, self._cast.actors, self._worth, self.reuse)

    @cached_property
    def _ahead(self) -> RewardsAhead | None:
        problem = self.problem
        many = isinstance(problem.states, int) and problem.states > FEW_HIDDEN
        asked = many and not any(self._others) if problem.hidden else len(problem.agents) == 1
        asked = asked and self.rollout == USUAL
        return rewards_ahead.found(problem, self.seat, self.turns) if asked else None

    @cached_property
    def _others(self) -> Actors:
        """Who acts in the other seats; nobody in the own one."""
        seats = range(len(self.problem.agents))
        return tuple(
            None if seat == self.seat else self._found(seat, self.others, PARTNER) for seat in seats
        )

    @cached_property
    def _own(self) -> Policy | None:
        """Who plays on in the own seat beyond the tree; nobody where one alone cannot plan that."""
        alone = self.problem.hidden and not any(self._others)
        unasked = self._ahead is not None or alone or self.problem.states == 1
        found = self._found(self.seat, self.rollout, "random" if unasked else ADVISER)
        if found and self.rollout == USUAL and len(self.problem.agents) == 1:
            try:
                found.values(found.begin(self.problem.first_sight(some(self.problem), self.seat)))
            except TooMuch:
                return None
        return found

    @cached_property
    def _cast(self) -> Cast:
        """Who acts in each seat."""
        before, after = self._others[: self.seat], self._others[self.seat + 1 :]
        return Cast(self.problem, self.seat, (*before, self._own, *after))

    def _found(self, seat: int, name: str, usual: str) -> Policy | None:
        """Who acts in a seat; None for any action, each as likely."""
        wanted = usual if name == USUAL else name
        found = self.company(seat, wanted) if self.company and wanted != "random" else None
        return found.in_game(self.turns, ()) if found and self.horizon else found

    @property
    def _worth(self) -> Worth | None:
        """What a state beyond the tree is worth; None where the simulation plays on.

        A plan is worth what it is as long as all of a team follow it: here it is played.
        """
        ahead, actor = self._ahead, self._own
        planned = self.problem.shared_reward and any(self._others)
        if ahead or actor is None or planned or (self.rollout, self.others) != (USUAL, USUAL):
            return ahead
        first = self._cast.begun(some(self.problem))[self.seat]
        return None if actor.values(first) is None else Advised(actor)

    @cached_property
    def _guessing(self) -> Guessing | None:
        """What partners remember who see something else; None where they act at random."""
        cast = Cast(self.problem, self.seat, self._others)
        return Guessing(cast) if self.problem.hidden and any(self._others) else None

    def begin(self, observation: Array) -> Memory:
        """The state, or the belief where it is hidden; no turn done; what the cast remembers.

        Where states are hidden that is what the own part of it does, and guesses of the rest.
        Where trees are used again, also the tree, and what it tells of the choice to come.
        """
        memory = self._begun(observation)
        return self._planned(memory) if self.reuse else memory

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The same after one more turn."""
        if not self.reuse:
            return self._updated(memory, percept)
        tree, saw = self._tree, percept.observation
        first = len(memory) - tree.packed - FOUND
        memory, trees = memory[:first], memory[first:-FOUND]
        if not tree.seen:
            saw = uct.key_of(self.problem, saw)
        elif not self.problem.hidden:
            saw = self.problem.index(saw)
        trees = under(tree, trees, percept.action, saw)
        return self._planned(self._updated(memory, percept), trees)

    def _planned(self, memory: Memory, trees: Memory = ()) -> Memory:
        """What is known, then the trees that grow from some that were kept, and what they tell.

        Their luck is the same in all games, so that the same history always leads to the same ones.
        """
        luck = (1 + memory[1]) * GOLDEN % 1.0
        self._tree.hold(len(luck))
        grown = []
        for rows in self._tree.blocks(len(luck)):
            now, before = (tuple(part[rows] for part in each) for each in (memory, trees))
            found, nodes, _ = self._searched(now, None, luck[rows], before)
            grown.append((*packed(nodes), *found))
        return (*memory, *map(np.concatenate, zip(*grown, strict=True)))

    def _begun(self, observation: Array) -> Memory:
        """What is known before the first turn."""
        done = np.zeros(len(observation), np.int64)
        if not self.problem.hidden:
            return (observation, done, *chain(*self._cast.begun(observation)))
        (beliefs,) = super().begin(observation)
        own = self._own.begin(observation) if self._own else ()
        guesses = self._guessing.begin(beliefs) if self._guessing else ()
        return (beliefs, done, *own, *guesses)

    def _updated(self, memory: Memory, percept: Percept) -> Memory:
        """What is known after one more turn."""
        known, done, *rest = memory
        if not self.problem.hidden:
            cast = zip(self._cast.actors, self._cast.split(tuple(rest)), strict=True)
            told = (
                one.update(kept, self._told(seat, percept))
                for seat, (one, kept) in enumerate(cast)
                if one
            )
            return (percept.observation, done + 1, *chain(*told))
        (beliefs,) = super().update((known,), percept)
        own, guesses = self._parted(tuple(rest))
        own = self._own.update(own, percept) if self._own else ()
        if self._guessing:
            guesses = self._guessing.update(guesses, percept, done, beliefs)
        return (beliefs, done + 1, *own, *guesses)

    def _parted(self, rest: Memory) -> tuple[Memory, Memory]:
        """What the own part of the cast remembers, and the guesses."""
        part = self._cast.parts[self.seat]
        many = part.stop - part.start
        return rest[:many], rest[many:]

    def _told(self, seat: int, percept: Percept) -> Percept:
        """What a turn taught another seat, as far as this one knows."""
        if seat == self.seat:
            return percept
        assert percept.actions is not None  # where all is seen
        return percept._replace(action=percept.actions[:, seat], reward=None)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """An action with the greatest mean return; of several, any."""
        parts = [
            self._chosen(
                tuple(part[some] for part in memory),
                None if legal is None else legal[some],
                u[some, 0],
            )
            for some in self._tree.blocks(len(u))
        ]
        return np.concatenate(parts)

    def _chosen(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The actions `[B]` for some rows that are searched together."""
        if self.reuse:
            found = Found(*memory[-FOUND:])
            told = spread(u, self._own.draws if self._own else 0)
        else:
            found, _, told = self._searched(memory, legal, u)
        able = best(found.means)
        if self._own:
            usual = self._own.choose(self._mine(memory), legal, told[:, : self._own.draws])
            able = found.kept(able, usual)
        return np.asarray(found.actions[np.arange(len(u)), among(able, u)])

    def _searched(
        self, memory: Memory, legal: Bools | None, u: Reals, trees: Memory = ()
    ) -> tuple[Found, Nodes, Reals]:
        """What a search finds out, the trees that it grows, and what its uniforms `[B]` told."""
        tree, problem, turns = self._tree, self.problem, self.turns
        tree.budget(len(u))  # refuses too much before it is drawn for
        told = spread(u, self.simulations + tree.draws)
        roots, cast = self._started(memory, told[:, : self.simulations])
        left = np.full(len(u), FAR) if turns is None else turns - memory[1] % turns
        if self.reuse:
            able = problem.legal(roots[:, 0])
            legal = None if able is None else able[:, self.seat]
            over = problem.terminal(roots.reshape(-1, *roots.shape[2:])).reshape(len(u), -1)
            left = np.where(over.all(axis=1), 0, left)
        asked = Asked(roots, left, cast, legal, trees)
        return *uct.search(tree, asked, told[:, self.simulations :]), told

    def _mine(self, memory: Memory) -> Memory:
        """What the own part of the cast remembers."""
        rest = memory[2:]
        return self._parted(rest)[0] if self.problem.hidden else self._cast.split(rest)[self.seat]

    def _started(self, memory: Memory, u: Reals) -> tuple[Array, tuple[Memory, ...]]:
        """States `[B, N, ...]` in which simulations start, and what the cast remembers there."""
        known, _, *rest = memory
        each = range(len(self.problem.agents))
        if not self.problem.hidden:
            copies = (_copies(part, u.shape[1]) for part in rest)
            return _copies(known, u.shape[1]), self._cast.split(tuple(copies))
        own, guesses = self._parted(tuple(rest))
        mine = tuple(_copies(part, u.shape[1]) for part in own)
        if not self._guessing:
            return drawn(self.problem, known, u), tuple(
                mine if seat == self.seat else () for seat in each
            )
        row, place = np.arange(len(u))[:, None], (u * GUESSES).astype(np.int64)
        s, *parts = (part[row, place] for part in guesses)
        others = self._guessing.cast.split(tuple(parts))
        return s, tuple(mine if seat == self.seat else others[seat] for seat in each)


def _copies(part: Array, many: int) -> Array:
    """The same in each of so many simulations `[B, N, ...]`."""
    return np.broadcast_to(part[:, None], (len(part), many, *part.shape[1:]))

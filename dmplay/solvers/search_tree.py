"""The tree of a search: how large it is, which simulations grow it, and from where."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from math import ceil, gcd, sqrt
from typing import NamedTuple

from dmplay.budget import ROUND, Budget
from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Interval, Memory, Problem
from dmplay.solvers.cast import Actors, Cast

FIRST, WIDEST = 25, 1024  # simulations of the first wave, as it knows nothing, and at most;
GROWS = 2  # times what was done are in each other
FEW_SEEN = 64  # things to see that nodes tell apart from the start;
SOME_SEEN = 16  # of more, so many
FEW_ACTIONS = 32  # actions that a node tries from the start; of more, the root of its visits
GOLDEN = (sqrt(5) - 1) / 2  # whose multiples fill an interval evenly
WORK = 1e10
ENTRIES = 4_000_000  # of the table of children, or draws, which bounds the rows searched together

Worth = Callable[[Array, Memory, Ints], Reals]  # of states, by the own memory and the turns left


@dataclass(frozen=True)
class Tree:
    """A search for one seat.

    `actors` play the others, and what is simulated beyond the tree; its own one is not asked
    where `worth` knows what a state is worth.
    """

    problem: Problem
    seat: int
    simulations: int
    depth: int
    exploration: float
    actors: Actors = ()
    worth: Worth | None = field(default=None, compare=False)
    reuse: bool = False  # whether it goes on with trees that were kept

    @cached_property
    def cast(self) -> Cast:
        """Who acts in each seat."""
        return Cast(self.problem, self.seat, self.actors)

    @cached_property
    def choices(self) -> int:
        """How many actions the seat has to choose from; 0 where it chooses a number."""
        return self.problem.action_counts[self.seat]

    @cached_property
    def slots(self) -> int:
        """How many actions a node has room for."""
        if 0 < self.choices <= FEW_ACTIONS:
            return self.choices
        most = ceil(sqrt(self.simulations)) + 1
        return min(most, self.choices or most)

    @property
    def widens(self) -> bool:
        """Whether a node begins with few of its actions."""
        return not 0 < self.choices <= FEW_ACTIONS

    @cached_property
    def seen(self) -> int:
        """How many things the seat can see after a turn; 0 where they are too many."""
        problem = self.problem
        many = problem.observation_counts[self.seat] if problem.hidden else problem.states
        return many if isinstance(many, int) and many <= FEW_SEEN else 0

    @property
    def kinds(self) -> int:
        """How many things seen after an action a node tells apart."""
        return self.seen or SOME_SEEN

    @property
    def places(self) -> bool:
        """Whether a node is one of the many states that are seen."""
        return not self.seen and not self.problem.hidden

    @property
    def nodes(self) -> int:
        """How many nodes a row has room for: a simulation adds at most one to those kept."""
        return self.simulations * (1 + self.reuse) + 1

    @property
    def packed(self) -> int:
        """How many arrays packed trees are."""
        return 4 + 3 * self.widens + 2 * self.places

    @property
    def rows(self) -> int:
        """How many rows can be searched together."""
        table = self.nodes * self.slots * self.kinds
        return max(1, ENTRIES // max(table, self.draws))

    def blocks(self, rows: int) -> list[slice]:
        """The rows that are searched together, one block after another."""
        return [slice(at, at + self.rows) for at in range(0, max(rows, 1), self.rows)]

    @property
    def draws(self) -> int:
        """How many uniforms one row consumes."""
        return self.simulations * self.depth * self.cast.draws

    @cached_property
    def waves(self) -> list[range]:
        """The simulations of each wave: few at first, as they know little."""
        found, done = [], 0
        while done < self.simulations:
            end = min(done + min(max(FIRST, GROWS * done), WIDEST), self.simulations)
            found.append(range(done, end))
            done = end
        return found

    def budget(self, rows: int) -> Budget:
        """What a search of so many rows may cost; refuses one that would be too much."""
        budget = Budget("search", "try fewer simulations, or a smaller depth", WORK)
        table = self.nodes * self.slots * (2 + 2 * self.kinds)
        budget.hold(8.0 * rows * (table + 2 * self.draws))
        budget.expect(sum(self.depth * self.turn(rows, wave) for wave in self.waves))
        return budget

    def hold(self, rows: int) -> None:
        """Refuses to remember the trees of too many rows."""
        budget = Budget("search", "try fewer games at a time, or fewer simulations")
        budget.hold(8.0 * rows * self.nodes * (self.packed + 2 * self.slots))

    def turn(self, rows: int, wave: range) -> float:
        """What one turn of one wave takes."""
        return 10 * ROUND + 1000.0 * rows * len(wave)

    def suggested(self, place: Ints) -> Array:
        """The actions of the slots `[N]` of a node where it has few of them: spread evenly."""
        own = self.problem.actions[self.seat]
        if isinstance(own, Interval):
            share = ((place * GOLDEN + 0.5) % 1.0).astype(float)
            return own.nearest(own.low + (own.high - own.low) * share)
        return (place * self._stride + self.choices // 2) % self.choices

    @cached_property
    def _stride(self) -> int:
        """A step through the actions that comes to each of them, far from the last."""
        steps = range(max(round(self.choices * GOLDEN), 1), self.choices + 1)
        return next((one for one in steps if gcd(one, self.choices) == 1), 1)


class Asked(NamedTuple):
    """From where it is searched, for B rows."""

    roots: Array  # [B, simulations, ...], the states that simulations start from
    left: Ints  # [B], turns to come
    memories: tuple[Memory, ...]  # [B, simulations, ...], of each of the cast
    legal: Bools | None = None  # [B, A]
    trees: Memory = ()  # that were kept, if any

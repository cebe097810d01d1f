"""The tree of a search: how large it is, which simulations grow it, and from where."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from math import ceil, gcd, sqrt
from typing import NamedTuple

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Interval, Memory, Problem
from dmplay.solvers.cast import OpponentModel, SeatPolicies

FIRST_WAVE_SIMULATIONS, MAX_WAVE_SIMULATIONS = (
    25,
    1024,
)  # simulations of the first wave, as it knows nothing, and at most;
WAVE_GROWTH = 2  # times what was done are in each other
MAX_UNWIDENED_OBSERVATIONS = 64  # things to see that nodes tell apart from the start;
WIDENED_OBSERVATIONS = 16  # of more, so many
MAX_UNWIDENED_ACTIONS = (
    32  # actions that a node tries from the start; of more, the root of its visits
)
GOLDEN_RATIO = (sqrt(5) - 1) / 2  # whose multiples fill an interval evenly
WORK_LIMIT = 1e10
MAX_TABLE_ENTRIES = (
    4_000_000  # of the table of children, or draws, which bounds the rows searched together
)

LeafEvaluator = Callable[
    [Array, Memory, Ints], Reals
]  # of states, by the own memory and the turns left


@dataclass(frozen=True)
class SearchConfig:
    """A search for one seat.

    `actors` play the others, and what is simulated beyond the tree; its own one is not asked
    where `worth` knows what a state is worth.
    """

    problem: Problem
    seat: int
    simulations: int
    depth: int
    ucb_constant: float
    seat_policies: SeatPolicies = ()
    leaf_evaluator: LeafEvaluator | None = field(default=None, compare=False)
    reuse_trees: bool = False  # whether it goes on with trees that were kept

    @cached_property
    def opponent_model(self) -> OpponentModel:
        """Who acts in each seat."""
        return OpponentModel(self.problem, self.seat, self.seat_policies)

    @cached_property
    def action_count(self) -> int:
        """How many actions the seat has to choose from; 0 where it chooses a number."""
        return self.problem.action_counts[self.seat]

    @cached_property
    def action_slots(self) -> int:
        """How many actions a node has room for."""
        if 0 < self.action_count <= MAX_UNWIDENED_ACTIONS:
            return self.action_count
        most = ceil(sqrt(self.simulations)) + 1
        return min(most, self.action_count or most)

    @property
    def widens_actions(self) -> bool:
        """Whether a node begins with few of its actions."""
        return not 0 < self.action_count <= MAX_UNWIDENED_ACTIONS

    @cached_property
    def observation_count(self) -> int:
        """How many things the seat can see after a turn; 0 where they are too many."""
        problem = self.problem
        many = (
            problem.observation_counts[self.seat]
            if problem.partially_observable
            else problem.state_count
        )
        return many if isinstance(many, int) and many <= MAX_UNWIDENED_OBSERVATIONS else 0

    @property
    def observation_slots(self) -> int:
        """How many things seen after an action a node tells apart."""
        return self.observation_count or WIDENED_OBSERVATIONS

    @property
    def stores_states(self) -> bool:
        """Whether a node is one of the many states that are seen."""
        return not self.observation_count and not self.problem.partially_observable

    @property
    def nodes_per_tree(self) -> int:
        """How many nodes a row has room for: a simulation adds at most one to those kept."""
        return self.simulations * (1 + self.reuse_trees) + 1

    @property
    def packed_array_count(self) -> int:
        """How many arrays packed trees are."""
        return 4 + 3 * self.widens_actions + 2 * self.stores_states

    @property
    def rows_per_block(self) -> int:
        """How many rows can be searched together."""
        table = self.nodes_per_tree * self.action_slots * self.observation_slots
        return max(1, MAX_TABLE_ENTRIES // max(table, self.uniforms_per_row))

    def split_rows(self, row_count: int) -> list[slice]:
        """The rows that are searched together, one block after another."""
        return [
            slice(at, at + self.rows_per_block)
            for at in range(0, max(row_count, 1), self.rows_per_block)
        ]

    @property
    def uniforms_per_row(self) -> int:
        """How many uniforms one row consumes."""
        return self.simulations * self.depth * self.opponent_model.uniforms_per_turn

    @cached_property
    def simulation_waves(self) -> list[range]:
        """The simulations of each wave: few at first, as they know little."""
        found, done = [], 0
        while done < self.simulations:
            end = min(
                done + min(max(FIRST_WAVE_SIMULATIONS, WAVE_GROWTH * done), MAX_WAVE_SIMULATIONS),
                self.simulations,
            )
            found.append(range(done, end))
            done = end
        return found

    def make_budget(self, row_count: int) -> Budget:
        """What a search of so many rows may cost; refuses one that would be too much."""
        budget = Budget("search", "try fewer simulations, or a smaller depth", WORK_LIMIT)
        table = self.nodes_per_tree * self.action_slots * (2 + 2 * self.observation_slots)
        budget.check_memory(8.0 * row_count * (table + 2 * self.uniforms_per_row))
        budget.check_work(
            sum(
                self.depth * self.estimate_turn_work(row_count, wave)
                for wave in self.simulation_waves
            )
        )
        return budget

    def check_memory(self, row_count: int) -> None:
        """Refuses to remember the trees of too many rows."""
        budget = Budget("search", "try fewer games at a time, or fewer simulations")
        budget.check_memory(
            8.0
            * row_count
            * self.nodes_per_tree
            * (self.packed_array_count + 2 * self.action_slots)
        )

    def estimate_turn_work(self, row_count: int, wave: range) -> float:
        """What one turn of one wave takes."""
        return 10 * ARRAY_CALL_WORK + 1000.0 * row_count * len(wave)

    def suggest_actions(self, positions: Ints) -> Array:
        """The actions of the slots `[N]` of a node where it has few of them: spread evenly."""
        own = self.problem.actions[self.seat]
        if isinstance(own, Interval):
            share = ((positions * GOLDEN_RATIO + 0.5) % 1.0).astype(float)
            return own.clip_actions(own.low + (own.high - own.low) * share)
        return (positions * self._action_stride + self.action_count // 2) % self.action_count

    @cached_property
    def _action_stride(self) -> int:
        """A step through the actions that comes to each of them, far from the last."""
        steps = range(max(round(self.action_count * GOLDEN_RATIO), 1), self.action_count + 1)
        return next((one for one in steps if gcd(one, self.action_count) == 1), 1)


class SearchRequest(NamedTuple):
    """From where it is searched, for B rows."""

    root_states: Array  # [B, simulations, ...], the states that simulations start from
    turns_left: Ints  # [B], turns to come
    memories: tuple[Memory, ...]  # [B, simulations, ...], of each of the cast
    legal_actions_mask: Bools | None = None  # [B, A]
    packed_trees: Memory = ()  # that were kept, if any

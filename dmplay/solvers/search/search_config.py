"""The configuration of a tree search: its size, simulation waves, budget and start."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from math import ceil, gcd, sqrt
from typing import NamedTuple

from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.policy import Memory
from dmplay.core.problem import Problem
from dmplay.core.spaces import Interval
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.solvers.search.simulated_opponents import OpponentModel, SeatPolicies

# simulations of the first wave, and maximum
FIRST_WAVE_SIMULATIONS, MAX_WAVE_SIMULATIONS = 25, 1024
WAVE_GROWTH = 2  # maximum size of a wave, relative to all before it
MAX_UNWIDENED_OBSERVATIONS = 64  # observations that nodes distinguish from the start
WIDENED_OBSERVATIONS = 16  # observations per action if there are more than that
# actions offered from the start; if there are more, the root of the visits
MAX_UNWIDENED_ACTIONS = 32
GOLDEN_RATIO = (sqrt(5) - 1) / 2  # Its multiples fill an interval evenly.
WORK_LIMIT = 1e10
# in the table of children, or uniforms, of the rows searched together
MAX_TABLE_ENTRIES = 4_000_000

# (states, the seat's memory, turns left) -> values
LeafEvaluator = Callable[[Array, Memory, Ints], Reals]


@dataclass(frozen=True)
class SearchConfig:
    """The parameters of a tree search for one seat.

    `seat_policies` play the other seats, and all seats in playouts beyond the tree. There are no
    playouts if a `leaf_evaluator` returns the value of a state.
    """

    problem: Problem
    seat: int
    simulations: int
    depth: int
    ucb_constant: float
    seat_policies: SeatPolicies = ()
    leaf_evaluator: LeafEvaluator | None = field(default=None, compare=False)

    @cached_property
    def opponent_model(self) -> OpponentModel:
        """The players of all seats in simulated games."""
        return OpponentModel(self.problem, self.seat, self.seat_policies)

    @cached_property
    def action_count(self) -> int:
        """The number of actions of the seat; 0 if its actions are real numbers."""
        return self.problem.action_counts[self.seat]

    @cached_property
    def action_slots(self) -> int:
        """The maximum number of actions per node."""
        if 0 < self.action_count <= MAX_UNWIDENED_ACTIONS:
            return self.action_count
        limit = ceil(sqrt(self.simulations)) + 1
        return min(limit, self.action_count or limit)

    @property
    def widens_actions(self) -> bool:
        """True if a node begins with few of its actions and adds more with its visits."""
        return not 0 < self.action_count <= MAX_UNWIDENED_ACTIONS

    @cached_property
    def observation_count(self) -> int:
        """The number of observations possible after a turn; 0 if there are too many."""
        count = self.problem.state_count
        if self.problem.partially_observable:
            count = self.problem.observation_counts[self.seat]
        return count if isinstance(count, int) and count <= MAX_UNWIDENED_OBSERVATIONS else 0

    @property
    def observation_slots(self) -> int:
        """The number of observations that a node distinguishes after an action."""
        return self.observation_count or WIDENED_OBSERVATIONS

    @property
    def stores_states(self) -> bool:
        """True if nodes store states: they are observed and too many to list."""
        return not self.observation_count and not self.problem.partially_observable

    @property
    def nodes_per_tree(self) -> int:
        """The maximum number of nodes per row: a simulation adds at most one to the root."""
        return self.simulations + 1

    @property
    def rows_per_block(self) -> int:
        """The number of rows that can be searched together."""
        table = self.nodes_per_tree * self.action_slots * self.observation_slots
        return max(1, MAX_TABLE_ENTRIES // max(table, self.uniforms_per_row))

    def make_row_slices(self, row_count: int) -> list[slice]:
        """Return slices of a batch, each of at most `rows_per_block` rows to search together."""
        step = self.rows_per_block
        return [slice(start, start + step) for start in range(0, max(row_count, 1), step)]

    @property
    def uniforms_per_row(self) -> int:
        """The number of uniforms that one row consumes."""
        return self.simulations * self.depth * self.opponent_model.uniforms_per_turn

    @cached_property
    def simulation_waves(self) -> list[range]:
        """The indices of the simulations of each wave; the first waves are small."""
        waves, done = [], 0
        while done < self.simulations:
            size = min(max(FIRST_WAVE_SIMULATIONS, WAVE_GROWTH * done), MAX_WAVE_SIMULATIONS)
            end = min(done + size, self.simulations)
            waves.append(range(done, end))
            done = end
        return waves

    def make_budget(self, row_count: int) -> Budget:
        """Return the budget of a search of `row_count` rows.

        Raise BudgetExceeded if the search would exceed the limit of work or memory.
        """
        budget = Budget("search", "try fewer simulations or a smaller depth", WORK_LIMIT)
        table_entries = self.nodes_per_tree * self.action_slots * (2 + 2 * self.observation_slots)
        budget.check_memory(8.0 * row_count * (table_entries + 2 * self.uniforms_per_row))
        turn_works = (self.estimate_turn_work(row_count, wave) for wave in self.simulation_waves)
        budget.check_work(sum(self.depth * turn_work for turn_work in turn_works))
        return budget

    def estimate_turn_work(self, row_count: int, wave: range) -> float:
        """Return the estimated work of one turn of one wave, in elementary operations."""
        return 10 * ARRAY_CALL_WORK + 1000.0 * row_count * len(wave)

    def suggest_actions(self, positions: Ints) -> Array:
        """Return the actions to try at these positions `[N]` of a node, spread evenly."""
        action_space = self.problem.actions[self.seat]
        if isinstance(action_space, Interval):
            fractions = ((positions * GOLDEN_RATIO + 0.5) % 1.0).astype(float)
            span = action_space.high - action_space.low
            return action_space.clip_actions(action_space.low + span * fractions)
        return (positions * self._action_stride + self.action_count // 2) % self.action_count

    @cached_property
    def _action_stride(self) -> int:
        """A step through the actions that reaches each of them, far from the previous one."""
        steps = range(max(round(self.action_count * GOLDEN_RATIO), 1), self.action_count + 1)
        return next((step for step in steps if gcd(step, self.action_count) == 1), 1)


class SearchRequest(NamedTuple):
    """The start of a search, for B rows."""

    root_states: Array  # [B, simulations, ...], where simulations start
    turns_left: Ints  # [B]
    memories: tuple[Memory, ...]  # [B, simulations, ...], of each seat
    legal_actions_mask: Bools | None = None  # [B, A]

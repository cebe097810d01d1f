"""Sweeps over many states, against every policy that there is and against closed forms."""

import tracemalloc
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
import pytest

from dmplay import Labels, Outcome, Tabular, load_agent, rollout
from dmplay.budget import limit_total_work
from dmplay.chance import Array, Bools, Categorical, Chance, Reals
from dmplay.core import parameter
from dmplay.errors import BudgetExceeded
from dmplay.policies import _solved
from dmplay.rows import SparseMatrix
from dmplay.solutions.every import solve_problem
from dmplay.solvers import backward_sweeps, graph, value_iteration
from dmplay.tabular import SparseTables, tabulate
from tests.support.brought import Counted, Heap
from tests.support.drawn import Drawn, some_and_ten
from tests.support.field import Field, InRows


def worth(problem: Drawn, choice: Array) -> Reals:
    """The values of each way to choose `[..., 5]`, by a linear solve."""
    here = np.arange(5), choice
    over = problem.terminal(np.arange(5))
    going = np.where(over[:, None], 0.0, problem.transition[here])
    paid = np.where(over, 0.0, problem.rewards[here][..., 0])
    return np.asarray(np.linalg.solve(np.eye(5) - problem.discount * going, paid[..., None]))[
        ..., 0
    ]


def best(problem: Drawn) -> Reals:
    """The greatest value of each state, of all ways to choose what is legal."""
    able = [np.flatnonzero(row[0]) for row in problem.able]
    return np.asarray(worth(problem, np.array([*product(*able)])).max(axis=0))


@some_and_ten
def test_drawn_problems_are_worth_what_the_best_of_all_policies_is(
    monkeypatch: pytest.MonkeyPatch, seeds: range
) -> None:
    monkeypatch.setattr(_solved, "MAX_TABULAR_STATES", 0)
    for seed in seeds:
        ends = seed % 2 == 0
        problem = Drawn(seed=seed, ends=ends, discount=1.0 if seed in (2, 4) else 0.9)
        swept = backward_sweeps.run_backward_value_iteration(
            graph.build_full_graph(problem), problem.discount
        )
        wanted = best(problem)
        np.testing.assert_allclose(swept.values, wanted, atol=1e-7)
        assert swept.gap < 1e-6
        if problem.discount < 1.0:
            told = [float(str(row["value"])) for row in solve_problem(problem).rows]
            np.testing.assert_allclose(told, wanted, atol=1e-7)
        optimal = load_agent(problem, 0, "optimal")
        states = np.arange(5)
        did = optimal.choose(
            optimal.initial_memory(states),
            problem.legal_actions_mask(states)[:, 0],
            np.zeros((5, 0)),
        )
        np.testing.assert_allclose(worth(problem, did), wanted, atol=1e-7)
        played = rollout(problem, [optimal], episodes=200, seed=seed, turn_limit=80).returns[:, 0]
        error = played.std(ddof=1) / np.sqrt(len(played))
        assert abs(played.mean() - wanted[0]) < 3 * error + 0.9**80


@dataclass(frozen=True)
class Stairs(Counted):
    """So many steps up, each of which costs one and is taken in one try of two."""

    steps: int = parameter(200, "of the stairs", 1)
    reward: float = parameter(0.0, "at the top")
    actions = (Labels(("up", "down")),)

    @property
    def state_count(self) -> int:
        return self.steps + 1

    @property
    def placed(self) -> int:
        return 0

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return (Categorical(np.full((len(s), 1), 0.5)),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        moved = np.clip(s + (1 - 2 * a[:, 0]) * events[0], 0, self.steps)
        rewards = np.where(s == self.steps, 0.0, np.where(moved == self.steps, self.reward, 0) - 1)
        return Outcome(moved, rewards[:, None], moved)

    def terminal(self, s: Array) -> Bools:
        return np.asarray(s == self.steps)


def test_stairs_cost_two_turns_a_step() -> None:
    """Undiscounted, 1 / p turns a step; discounted, a geometric series of them."""
    steps = np.arange(200, -1, -1)
    for problem in (Stairs(), Stairs(reward=500.0)):
        swept = backward_sweeps.run_backward_value_iteration(graph.build_full_graph(problem), 1.0)
        wanted = np.where(steps > 0, problem.reward - 2.0 * steps, 0.0)
        np.testing.assert_allclose(swept.values, wanted, rtol=1e-9)
        assert swept.sweep_count < 5
    swept = backward_sweeps.run_backward_value_iteration(graph.build_full_graph(Stairs()), 0.99)
    climbed = 0.5 * 0.99 / (1 - 0.5 * 0.99)  # what a step leaves of what comes
    np.testing.assert_allclose(swept.values, -(1 - climbed**steps) / 0.01, atol=1e-5)
    assert swept.gap < 1e-5
    assert swept.sweep_count < 60


@dataclass(frozen=True)
class Ring(Tabular):
    """Many places in a ring without an end, each with a price of its own to stay or to go on."""

    discount: float = 0.999
    actions = (Labels(("stay", "go", "leap")),)
    state_names = tuple(f"place{n}" for n in range(300))
    initial_belief = np.eye(300)[0]

    @cached_property
    def tables(self) -> SparseTables:
        rows = np.arange(900)
        here, far = rows // 3, np.array([0, 1, 7])[rows % 3]
        after = np.sort(np.stack([(here + far) % 300, (here + far * here + 8) % 300], axis=1))
        flow = SparseMatrix(np.arange(901) * 2, after.ravel(), np.full(1800, 0.5))
        paid = np.random.default_rng(3).normal(size=(900, 1))
        return SparseTables(flow, paid)


@dataclass(frozen=True)
class Corridor(Tabular):
    """A long walk to a treasure that is paid for ever."""

    discount: float = 0.9
    actions = (Labels(("back", "on")),)
    state_names = tuple(f"place{n}" for n in range(2000))

    @cached_property
    def tables(self) -> SparseTables:
        place = np.arange(4000) // 2
        after = np.clip(place + np.array([-1, 1] * 2000), 0, 1999)
        paid = (np.arange(4000) == 3999)[:, None].astype(float)
        return SparseTables(SparseMatrix(np.arange(4001), after, np.ones(4000)), paid)


def test_all_of_a_long_walk_without_an_end_is_swept_at_once() -> None:
    with limit_total_work(1e9):
        swept = backward_sweeps.run_backward_value_iteration(
            graph.build_full_graph(Corridor()), 0.9
        )
    np.testing.assert_allclose(swept.values, 10 * 0.9 ** np.arange(1999, -1, -1), atol=1e-6)
    assert solve_problem(Corridor()).method == "value iteration over 2000 states"


def test_the_bounds_hold_in_a_ring_without_an_end() -> None:
    ring = Ring()
    swept = backward_sweeps.run_backward_value_iteration(
        graph.build_full_graph(ring), ring.discount
    )
    wanted = value_iteration.compute_optimal_q(tabulate(ring), ring.discount).max(axis=1)
    assert np.abs(swept.values - wanted).max() <= swept.gap / 2 + 1e-9
    assert swept.gap < 1e-4
    assert swept.sweep_count < 100
    by_turns = graph.build_full_graph(TurnByTurn())
    for one, other in zip(graph.build_full_graph(ring)[1:7], by_turns[1:7], strict=True):
        np.testing.assert_allclose(one, other)


@dataclass(frozen=True)
class TurnByTurn(Ring):
    """The same, asked turn by turn what is legal."""

    def legal_actions_mask(self, s: Array) -> Bools:
        return np.ones((len(s), 1, 3), bool)


class Idle(Stairs):
    """One that pays to stay."""

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        moved, rewards, _ = super().resolve_events(s, a, events)
        return Outcome(moved, -rewards, moved)


def test_who_is_paid_at_the_top_alone_climbs_without_a_discount(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each way is worth the same wherever it leads to the top, if not at once."""
    monkeypatch.setattr(_solved, "MAX_TABULAR_STATES", 0)
    free = Free(steps=40)
    climber = load_agent(free, 0, "optimal")
    played = rollout(free, [climber], episodes=20, turn_limit=400)
    assert (played.returns == 1.0).all()
    assert (played.turn_counts < 200).all()


class Free(Stairs):
    """One whose top pays 1, and nothing costs."""

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        moved, _, _ = super().resolve_events(s, a, events)
        paid = np.where((moved == self.steps) & (s < self.steps), 1.0, 0.0)
        return Outcome(moved, paid[:, None], moved)


def test_what_has_no_value_is_refused_in_one_line() -> None:
    idle, told = (
        Idle(steps=4),
        r"^value iteration: .* give a discount below 1, or a last turn: --turns N,",
    )
    with pytest.raises(BudgetExceeded, match=told):
        solve_problem(idle)
    with pytest.raises(BudgetExceeded, match=told):
        backward_sweeps.run_backward_value_iteration(graph.build_full_graph(idle), 1.0)
    assert solve_problem(replace(idle, discount=0.5)).rows


def test_of_many_states_the_start_is_told() -> None:
    found = solve_problem(Stairs(steps=1100))
    assert found.method == "value iteration over 1101 states, backwards from where games end"
    assert found.result.startswith("value -2200 at the start, the last change 0, ")
    assert found.rows == [{"state": "0", "value": pytest.approx(-2200), "best": "up"}]
    heap = backward_sweeps.run_backward_value_iteration(graph.build_full_graph(Heap()), 0.9)
    assert heap.values[0] == 0.0


def test_a_graph_is_let_go_once_its_states_are_in_order() -> None:
    """At most 48 bytes of each outcome beside those of who brought it, where it was 56."""
    field = InRows(side=60)
    outcomes = len(field.sparse_tables.transition.values)
    tracemalloc.start()
    swept = backward_sweeps.run_backward_value_iteration(graph.build_full_graph(field), 0.0)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 48 * outcomes
    assert len(swept.graph.probabilities) == len(swept.graph.next_states) == 0
    assert swept.graph.action_starts[-1] == len(swept.graph.joint_actions) == len(swept.q)


def test_a_field_told_by_its_moves_is_that_told_in_rows() -> None:
    by_moves = backward_sweeps.run_backward_value_iteration(
        graph.build_full_graph(Field(side=32)), 0.99
    )
    told = solve_problem(InRows(side=32))
    assert told.result.startswith(f"value {by_moves.values[0]:.6g} at the start, at most ")
    assert told.rows == [
        {"state": "0", "value": pytest.approx(by_moves.values[0]), "best": "east south"}
    ]
    assert by_moves.sweep_count <= 40

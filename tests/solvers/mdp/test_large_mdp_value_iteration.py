"""Tests of value iteration by backward sweeps, against all policies and closed forms."""

import tracemalloc
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
import pytest

from dmplay import Labels, Outcome, Tabular, load_agent, rollout
from dmplay.agents import single_agent_planning
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.chance import Categorical, Chance
from dmplay.core.parameters import parameter
from dmplay.core.sparse_matrix import SparseMatrix
from dmplay.core.tabular import SparseTables, tabulate
from dmplay.core.work_budget import limit_total_work
from dmplay.errors import BudgetExceeded
from dmplay.evaluation.solutions.solve import solve_problem
from dmplay.solvers.mdp import large_mdp_value_iteration, mdp_values, transition_graph
from tests.support.grid_field import Field, InRows
from tests.support.random_problems import RandomProblem, with_two_or_ten_seeds
from tests.support.user_problems import Heap, IntegerStateProblem


def evaluate_choices(problem: RandomProblem, choice: Array) -> Reals:
    """Return the values of deterministic policies `[..., 5]`, by a linear solve."""
    index = np.arange(5), choice
    terminal = problem.terminal(np.arange(5))
    transition = np.where(terminal[:, None], 0.0, problem.transition[index])
    rewards = np.where(terminal, 0.0, problem.rewards[index][..., 0])
    return np.asarray(
        np.linalg.solve(np.eye(5) - problem.discount * transition, rewards[..., None])
    )[..., 0]


def compute_best_values(problem: RandomProblem) -> Reals:
    """Return the greatest value of each state over all legal deterministic policies."""
    legal_actions = [np.flatnonzero(row[0]) for row in problem.legal_mask]
    return np.asarray(evaluate_choices(problem, np.array([*product(*legal_actions)])).max(axis=0))


@with_two_or_ten_seeds
def test_random_problems_have_the_values_of_the_best_policy(
    monkeypatch: pytest.MonkeyPatch, seeds: range
) -> None:
    monkeypatch.setattr(single_agent_planning, "MAX_TABULAR_STATES", 0)
    for seed in seeds:
        ends = seed % 2 == 0
        problem = RandomProblem(seed=seed, ends=ends, discount=1.0 if seed in (2, 4) else 0.9)
        result = large_mdp_value_iteration.run_backward_value_iteration(
            transition_graph.build_full_graph(problem), problem.discount
        )
        expected = compute_best_values(problem)
        np.testing.assert_allclose(result.values, expected, atol=1e-7)
        assert result.gap < 1e-6
        if problem.discount < 1.0:
            reported = [float(str(row["value"])) for row in solve_problem(problem).rows]
            np.testing.assert_allclose(reported, expected, atol=1e-7)
        optimal = load_agent(problem, 0, "optimal")
        states = np.arange(5)
        actions = optimal.choose(
            optimal.initial_memory(states),
            problem.legal_actions_mask(states)[:, 0],
            np.zeros((5, 0)),
        )
        np.testing.assert_allclose(evaluate_choices(problem, actions), expected, atol=1e-7)
        returns = rollout(problem, [optimal], episodes=200, seed=seed, turn_limit=80).returns[:, 0]
        error = returns.std(ddof=1) / np.sqrt(len(returns))
        assert abs(returns.mean() - expected[0]) < 3 * error + 0.9**80


@dataclass(frozen=True)
class Stairs(IntegerStateProblem):
    """A staircase on which each try of a step costs 1 and succeeds half the time."""

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
        next_states = np.clip(s + (1 - 2 * a[:, 0]) * events[0], 0, self.steps)
        rewards = np.where(
            s == self.steps, 0.0, np.where(next_states == self.steps, self.reward, 0) - 1
        )
        return Outcome(next_states, rewards[:, None], next_states)

    def terminal(self, s: Array) -> Bools:
        return np.asarray(s == self.steps)


def test_each_stair_costs_two_turns() -> None:
    """Expect 1 / p turns per step without a discount, and a geometric series with one."""
    steps = np.arange(200, -1, -1)
    for problem in (Stairs(), Stairs(reward=500.0)):
        result = large_mdp_value_iteration.run_backward_value_iteration(
            transition_graph.build_full_graph(problem), 1.0
        )
        expected = np.where(steps > 0, problem.reward - 2.0 * steps, 0.0)
        np.testing.assert_allclose(result.values, expected, rtol=1e-9)
        assert result.sweep_count < 5
    result = large_mdp_value_iteration.run_backward_value_iteration(
        transition_graph.build_full_graph(Stairs()), 0.99
    )
    step_discount = 0.5 * 0.99 / (1 - 0.5 * 0.99)  # expected discount per step
    np.testing.assert_allclose(result.values, -(1 - step_discount**steps) / 0.01, atol=1e-5)
    assert result.gap < 1e-5
    assert result.sweep_count < 60


@dataclass(frozen=True)
class Ring(Tabular):
    """A ring of 300 places without an end, with random rewards."""

    discount: float = 0.999
    actions = (Labels(("stay", "go", "leap")),)
    state_names = tuple(f"place{n}" for n in range(300))
    initial_belief = np.eye(300)[0]

    @cached_property
    def tables(self) -> SparseTables:
        rows = np.arange(900)
        places, distances = rows // 3, np.array([0, 1, 7])[rows % 3]
        next_places = np.sort(
            np.stack([(places + distances) % 300, (places + distances * places + 8) % 300], axis=1)
        )
        transition = SparseMatrix(np.arange(901) * 2, next_places.ravel(), np.full(1800, 0.5))
        rewards = np.random.default_rng(3).normal(size=(900, 1))
        return SparseTables(transition, rewards)


@dataclass(frozen=True)
class Corridor(Tabular):
    """A long corridor to a reward that is paid in every turn."""

    discount: float = 0.9
    actions = (Labels(("back", "on")),)
    state_names = tuple(f"place{n}" for n in range(2000))

    @cached_property
    def tables(self) -> SparseTables:
        places = np.arange(4000) // 2
        next_places = np.clip(places + np.array([-1, 1] * 2000), 0, 1999)
        rewards = (np.arange(4000) == 3999)[:, None].astype(float)
        return SparseTables(SparseMatrix(np.arange(4001), next_places, np.ones(4000)), rewards)


def test_a_long_corridor_without_an_end_is_solved_within_the_budget() -> None:
    with limit_total_work(1e9):
        result = large_mdp_value_iteration.run_backward_value_iteration(
            transition_graph.build_full_graph(Corridor()), 0.9
        )
    np.testing.assert_allclose(result.values, 10 * 0.9 ** np.arange(1999, -1, -1), atol=1e-6)
    assert solve_problem(Corridor()).method == "value iteration over 2000 states"


def test_the_bounds_are_valid_in_a_ring_without_an_end() -> None:
    ring = Ring()
    result = large_mdp_value_iteration.run_backward_value_iteration(
        transition_graph.build_full_graph(ring), ring.discount
    )
    expected = mdp_values.compute_optimal_q(tabulate(ring), ring.discount).max(axis=1)
    assert np.abs(result.values - expected).max() <= result.gap / 2 + 1e-9
    assert result.gap < 1e-4
    assert result.sweep_count < 100
    other_graph = transition_graph.build_full_graph(RingWithLegalActions())
    for field, expected_field in zip(
        transition_graph.build_full_graph(ring)[1:7], other_graph[1:7], strict=True
    ):
        np.testing.assert_allclose(field, expected_field)


@dataclass(frozen=True)
class RingWithLegalActions(Ring):
    """The same ring, with legal actions that are computed state by state."""

    def legal_actions_mask(self, s: Array) -> Bools:
        return np.ones((len(s), 1, 3), bool)


class RewardedStairs(Stairs):
    """A staircase that rewards staying."""

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        next_states, rewards, _ = super().resolve_events(s, a, events)
        return Outcome(next_states, -rewards, next_states)


def test_an_undiscounted_reward_at_the_top_is_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    """Expect ties between policies of equal value to be broken in favour of reaching the top."""
    monkeypatch.setattr(single_agent_planning, "MAX_TABULAR_STATES", 0)
    free = FreeStairs(steps=40)
    climber = load_agent(free, 0, "optimal")
    result = rollout(free, [climber], episodes=20, turn_limit=400)
    assert (result.returns == 1.0).all()
    assert (result.turn_counts < 200).all()


class FreeStairs(Stairs):
    """A staircase that costs nothing and pays 1 at the top."""

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        next_states, _, _ = super().resolve_events(s, a, events)
        rewards = np.where((next_states == self.steps) & (s < self.steps), 1.0, 0.0)
        return Outcome(next_states, rewards[:, None], next_states)


def test_a_problem_without_finite_values_raises_a_one_line_error() -> None:
    problem = RewardedStairs(steps=4)
    message = r"^value iteration: .* set a discount below 1, or a turn limit \(--turns N,"
    with pytest.raises(BudgetExceeded, match=message):
        solve_problem(problem)
    with pytest.raises(BudgetExceeded, match=message):
        large_mdp_value_iteration.run_backward_value_iteration(
            transition_graph.build_full_graph(problem), 1.0
        )
    assert solve_problem(replace(problem, discount=0.5)).rows


def test_a_solution_with_many_states_reports_only_the_start() -> None:
    report = solve_problem(Stairs(steps=1100))
    assert report.method == "value iteration over 1101 states, backward from the terminal states"
    assert report.result.startswith("value -2200 at the start, last change 0, ")
    assert report.rows == [{"state": "0", "value": pytest.approx(-2200), "best": "up"}]
    heap_result = large_mdp_value_iteration.run_backward_value_iteration(
        transition_graph.build_full_graph(Heap()), 0.9
    )
    assert heap_result.values[0] == 0.0


def test_the_graph_is_freed_once_its_states_are_ordered() -> None:
    """Expect at most 48 bytes per outcome, besides the arrays of the caller; it once was 56."""
    field = InRows(side=60)
    outcomes = len(field.sparse_tables.transition.values)
    tracemalloc.start()
    result = large_mdp_value_iteration.run_backward_value_iteration(
        transition_graph.build_full_graph(field), 0.0
    )
    _, peak_bytes = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak_bytes < 48 * outcomes
    assert len(result.graph.probabilities) == len(result.graph.next_states) == 0
    assert result.graph.action_starts[-1] == len(result.graph.joint_actions) == len(result.q)


def test_a_field_defined_by_functions_equals_one_defined_by_tables() -> None:
    function_result = large_mdp_value_iteration.run_backward_value_iteration(
        transition_graph.build_full_graph(Field(side=32)), 0.99
    )
    report = solve_problem(InRows(side=32))
    assert report.result.startswith(
        f"value {function_result.values[0]:.6g} at the start, error at most "
    )
    assert report.rows == [
        {"state": "0", "value": pytest.approx(function_result.values[0]), "best": "east south"}
    ]
    assert function_result.sweep_count <= 40

from dataclasses import dataclass

import numpy as np
import pytest

import dmplay
from dmplay.core import belief
from dmplay.core.arrays import Array, Ints, Reals
from dmplay.core.problem import Problem
from dmplay.core.tabular import Tables, tabulate
from dmplay.core.work_budget import DEFAULT_MEMORY_BYTES, Budget
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.formats.file_problems import FileProblem
from dmplay.solvers.pomdp import exact_pomdp, point_based
from dmplay.solvers.pomdp.point_based import PointBasedSolver
from dmplay.solvers.pomdp.sparse_pomdp import build_sparse_pomdp
from tests.support.literature_pomdps import (
    make_cheese_maze,
    make_four_by_three,
    make_hallway,
    make_random_problem,
    make_rock_sample,
    make_tiger,
)

TIGER_VALUE = 19.3713683744  # value of the infinite-horizon tiger problem with discount 0.95
SMALL_HALLWAY_MAP = (" + ", "***")
HALLWAY_MAP = ("***********", "  * * * +  ")
HALLWAY_LANDMARKS = [((x, 0), 2) for x in (2, 4, 6, 8)]


def make_solver(
    problem: Problem, horizon: int | None = None, memory: float = DEFAULT_MEMORY_BYTES
) -> PointBasedSolver:
    budget = Budget("a search", "try less", 1e9, memory)
    return PointBasedSolver(build_sparse_pomdp(problem, budget), horizon, budget)


def compute_best_value(tables: Tables, discount: float, b: Reals, turns: int) -> float:
    """Return the optimal value of an unnormalised belief, by enumeration of all histories."""
    if not turns:
        return 0.0
    joint = np.einsum("s,saot->aot", b, tables.joint_probabilities)
    return max(
        float(b @ tables.rewards[:, a, 0])
        + discount
        * sum(
            compute_best_value(tables, discount, next_belief, turns - 1) for next_belief in joint[a]
        )
        for a in range(joint.shape[0])
    )


def test_bounds_contain_the_exact_value_and_the_agent_earns_it() -> None:
    for seed in range(6):
        problem = make_random_problem(seed, (0.9, 1.0)[seed % 2])
        exact = compute_best_value(tabulate(problem), problem.discount, problem.initial_belief, 4)
        bounds = point_based.solve_point_based(problem, 4, 0.0)
        assert bounds.is_gap_closed
        assert bounds.lower_bound - 1e-9 <= exact <= bounds.upper_bound + 1e-9
        assert bounds.upper_bound - bounds.lower_bound <= point_based.MIN_GAP
        agent = dmplay.load_agent(problem, 0, "optimal:horizon=4")
        returns = dmplay.rollout(problem, [agent], episodes=300, turn_limit=4, seed=seed).returns[
            :, 0
        ]
        assert abs(returns.mean() - exact) <= 2 * returns.std() / np.sqrt(len(returns)), seed


def test_bounds_are_valid_at_every_belief_and_their_gap_only_shrinks() -> None:
    for problem in (make_tiger(0.75), make_random_problem(5, 0.6)):
        exact = exact_pomdp.solve_infinite_horizon(tabulate(problem), problem.discount)
        search, gap = make_solver(problem), np.inf
        for _ in range(12):
            assert search.gap <= gap + 1e-9
            gap = search.gap
            search.run_trial_or_game(0.0)
        tree = search.tree
        b = np.array([tree.get_dense_belief(node) for node in range(len(tree.turns_left))])
        values = exact_pomdp.compute_belief_values(exact.alpha_vectors, b)
        assert (tree.lower_bounds[: len(b)] <= values + exact.gap + 1e-9).all()
        assert (tree.upper_bounds[: len(b)] >= values - 1e-9).all()
        assert len(b) > 10


def test_the_value_of_the_tiger_problem_matches_the_literature() -> None:
    bounds = point_based.solve_point_based(make_tiger(), None, 0.01)
    assert bounds.lower_bound <= TIGER_VALUE <= bounds.upper_bound
    assert bounds.is_gap_closed
    assert bounds.upper_bound - bounds.lower_bound <= 0.01 * bounds.upper_bound


def test_a_finite_horizon_tiger_problem_is_solved_exactly() -> None:
    problem = make_tiger(1.0)
    stages = exact_pomdp.solve_finite_horizon(tabulate(problem), 1.0, 10)
    value_of_6_turns, value_of_10_turns = (
        exact_pomdp.compute_belief_values(
            stages[turns - 1].alpha_vectors, problem.initial_belief[None]
        )[0]
        for turns in (6, 10)
    )
    assert value_of_10_turns == pytest.approx(9.438, abs=5e-4)
    bounds = point_based.solve_point_based(problem, 6, 0.0)
    assert [bounds.lower_bound, bounds.upper_bound] == pytest.approx(
        [value_of_6_turns, value_of_6_turns]
    )
    assert len(bounds.plans_by_turns_left) == 7


def test_the_values_of_mazes_match_the_literature() -> None:
    for problem, published in ((make_cheese_maze(), 3.48), (make_four_by_three(), 1.9)):
        bounds = point_based.solve_point_based(problem, None, 0.1)
        assert bounds.is_gap_closed
        assert bounds.lower_bound - 0.01 <= published <= bounds.upper_bound + 0.01


def test_benchmark_problems_have_the_published_sizes() -> None:
    for problem, states, observation_count in (
        (make_rock_sample(4, [(3, 1), (2, 1), (1, 3), (1, 0)], (0, 2)), 257, 3),
        (make_hallway(SMALL_HALLWAY_MAP), 14, 17),
        (make_four_by_three(), 11, 6),
    ):
        assert (problem.state_count, problem.observation_counts) == (states, (observation_count,))
        transition, _, observation = problem.tables
        assert observation
        for rows in (transition, observation):
            np.testing.assert_allclose(rows.sum_by_row(rows.values), 1.0)
        assert problem.initial_belief.sum() == pytest.approx(1.0)


def test_a_search_that_reaches_its_work_limit_returns_valid_bounds() -> None:
    rooms = make_hallway(SMALL_HALLWAY_MAP)
    short_search, long_search = (
        point_based.solve_point_based(rooms, None, 0.0, work) for work in (3e7, 1e8)
    )
    assert not short_search.is_gap_closed
    assert (
        short_search.lower_bound
        <= long_search.lower_bound
        < long_search.upper_bound
        <= short_search.upper_bound
    )
    with pytest.raises(
        BudgetExceeded, match=r"^point-based planning: more than the limit of 1e\+06 operations"
    ):
        point_based.solve_point_based(rooms, None, 0.0, 1e6)


def test_a_search_that_exhausts_its_memory_reports_it() -> None:
    small = make_solver(make_hallway(SMALL_HALLWAY_MAP), memory=2**21)
    large = make_solver(make_hallway(SMALL_HALLWAY_MAP))
    while small.run_trial_or_game(0.0):
        large.run_trial_or_game(0.0)
    assert small.collect_bounds(0.0).is_memory_full
    assert not large.collect_bounds(0.0).is_memory_full


@dataclass(frozen=True)
class ProblemWithInitialObservation(FileProblem):
    """A problem whose state is observed once, before the first action."""

    def initial_observations(self, s: Array) -> Ints:
        return np.asarray(s[:, None])


def test_initial_observations_are_used() -> None:
    hidden = make_tiger(1.0)
    problem = ProblemWithInitialObservation(1.0, model=hidden.model)
    bounds = point_based.solve_point_based(problem, 1, 0.0)
    assert bounds.lower_bound == bounds.upper_bound == pytest.approx(10.0)
    assert bounds.action_lower_bounds.tolist() == pytest.approx([-1.0, -45.0, -45.0])
    assert belief.initial_belief(problem).tolist() == [0.5, 0.5]
    solution = dmplay.solve(problem, turns=1, method="point-based")
    assert solution.value() == solution.value([0.0, 1.0]) == pytest.approx(10.0)
    with pytest.raises(BadParameter, match="games start with an observation; name a belief"):
        solution.action_values()


@pytest.mark.slow
def test_a_short_search_of_the_hallway_matches_the_literature() -> None:
    bounds = point_based.solve_point_based(
        make_hallway(HALLWAY_MAP, signs=HALLWAY_LANDMARKS), None, 0.0, 5e9
    )
    assert 0.98 <= bounds.lower_bound <= 1.02 <= bounds.upper_bound <= 1.206

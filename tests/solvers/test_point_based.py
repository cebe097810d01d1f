from dataclasses import dataclass

import numpy as np
import pytest

import dmplay
from dmplay import belief
from dmplay.budget import DEFAULT_MEMORY_BYTES, Budget
from dmplay.chance import Array, Ints, Reals
from dmplay.core import Problem
from dmplay.errors import BudgetExceeded
from dmplay.files.problem import FileProblem
from dmplay.solvers import alpha_vectors, point_based
from dmplay.solvers.hidden_rows import build_sparse_pomdp
from dmplay.solvers.point_based import PointBasedSolver
from dmplay.tabular import Tables, tabulate
from tests.support.hidden import cheese, drawn, four_by_three, hallway, rock_sample, tiger

EXACT = 19.3713683744  # the tiger without end, at 0.95
ROOMS = (" + ", "***")
HALLWAY = ("***********", "  * * * +  ")
SIGNS = [((x, 0), 2) for x in (2, 4, 6, 8)]


def searched(
    problem: Problem, horizon: int | None = None, memory: float = DEFAULT_MEMORY_BYTES
) -> PointBasedSolver:
    budget = Budget("a search", "try less", 1e9, memory)
    return PointBasedSolver(build_sparse_pomdp(problem, budget), horizon, budget)


def best(tables: Tables, discount: float, b: Reals, turns: int) -> float:
    """The value of a belief, not brought to 1, by every history there can be."""
    if not turns:
        return 0.0
    joint = np.einsum("s,saot->aot", b, tables.joint_probabilities)
    return max(
        float(b @ tables.rewards[:, a, 0])
        + discount * sum(best(tables, discount, after, turns - 1) for after in joint[a])
        for a in range(joint.shape[0])
    )


def test_what_is_claimed_is_the_best_of_all_histories_and_is_earned() -> None:
    for seed in range(6):
        problem = drawn(seed, (0.9, 1.0)[seed % 2])
        exact = best(tabulate(problem), problem.discount, problem.initial_belief, 4)
        found = point_based.solve_point_based(problem, 4, 0.0)
        assert found.is_gap_closed
        assert found.lower_bound - 1e-9 <= exact <= found.upper_bound + 1e-9
        assert found.upper_bound - found.lower_bound <= point_based.MIN_GAP
        agent = dmplay.load_agent(problem, 0, "optimal:horizon=4")
        returns = dmplay.rollout(problem, [agent], episodes=300, turn_limit=4, seed=seed).returns[
            :, 0
        ]
        assert abs(returns.mean() - exact) <= 2 * returns.std() / np.sqrt(len(returns)), seed


def test_both_bounds_hold_at_every_belief_and_only_get_closer() -> None:
    for problem in (tiger(0.75), drawn(5, 0.6)):
        exact = alpha_vectors.solve_infinite_horizon(tabulate(problem), problem.discount)
        search, apart = searched(problem), np.inf
        for _ in range(12):
            assert search.gap <= apart + 1e-9
            apart = search.gap
            search.run_trial_or_game(0.0)
        tree = search.tree
        b = np.array([tree.get_dense_belief(node) for node in range(len(tree.turns_left))])
        worth = alpha_vectors.compute_belief_values(exact.alpha_vectors, b)
        assert (tree.lower_bounds[: len(b)] <= worth + exact.gap + 1e-9).all()
        assert (tree.upper_bounds[: len(b)] >= worth - 1e-9).all()
        assert len(b) > 10


def test_the_tiger_is_worth_what_the_literature_says() -> None:
    found = point_based.solve_point_based(tiger(), None, 0.01)
    assert found.lower_bound <= EXACT <= found.upper_bound
    assert found.is_gap_closed
    assert found.upper_bound - found.lower_bound <= 0.01 * found.upper_bound


def test_a_tiger_of_some_turns_is_solved_to_the_end() -> None:
    problem = tiger(1.0)
    stages = alpha_vectors.solve_finite_horizon(tabulate(problem), 1.0, 10)
    of_6, of_10 = (
        alpha_vectors.compute_belief_values(
            stages[turns - 1].alpha_vectors, problem.initial_belief[None]
        )[0]
        for turns in (6, 10)
    )
    assert of_10 == pytest.approx(9.438, abs=5e-4)
    found = point_based.solve_point_based(problem, 6, 0.0)
    assert [found.lower_bound, found.upper_bound] == pytest.approx([of_6, of_6])
    assert len(found.plans_by_turns_left) == 7


def test_mazes_are_worth_what_the_literature_says() -> None:
    for problem, published in ((cheese(), 3.48), (four_by_three(), 1.9)):
        found = point_based.solve_point_based(problem, None, 0.1)
        assert found.is_gap_closed
        assert found.lower_bound - 0.01 <= published <= found.upper_bound + 0.01


def test_problems_are_made_as_they_are_defined() -> None:
    for problem, states, seen in (
        (rock_sample(4, [(3, 1), (2, 1), (1, 3), (1, 0)], (0, 2)), 257, 3),
        (hallway(ROOMS), 14, 17),
        (four_by_three(), 11, 6),
    ):
        assert (problem.state_count, problem.observation_counts) == (states, (seen,))
        flow, _, shown = problem.tables
        assert shown
        for rows in (flow, shown):
            np.testing.assert_allclose(rows.row_sums(rows.values), 1.0)
        assert problem.initial_belief.sum() == pytest.approx(1.0)


def test_what_is_stopped_says_how_far_it_came() -> None:
    rooms = hallway(ROOMS)
    some, more = (point_based.solve_point_based(rooms, None, 0.0, work) for work in (3e7, 1e8))
    assert not some.is_gap_closed
    assert some.lower_bound <= more.lower_bound < more.upper_bound <= some.upper_bound
    with pytest.raises(
        BudgetExceeded, match=r"^a plan for what is believed: more than 1e\+06 operations"
    ):
        point_based.solve_point_based(rooms, None, 0.0, 1e6)


def test_what_memory_ends_says_so() -> None:
    small, large = searched(hallway(ROOMS), memory=2**21), searched(hallway(ROOMS))
    while small.run_trial_or_game(0.0):
        large.run_trial_or_game(0.0)
    assert small.collect_bounds(0.0).is_memory_full
    assert not large.collect_bounds(0.0).is_memory_full


@dataclass(frozen=True)
class Shown(FileProblem):
    """One whose state is shown before the first action, if never again."""

    def initial_observations(self, s: Array) -> Ints:
        return np.asarray(s[:, None])


def test_what_is_seen_at_the_start_counts() -> None:
    hidden = tiger(1.0)
    shown = Shown(1.0, model=hidden.model)
    found = point_based.solve_point_based(shown, 1, 0.0)
    assert found.lower_bound == found.upper_bound == pytest.approx(10.0)
    assert found.action_lower_bounds.tolist() == pytest.approx([-1.0, -45.0, -45.0])
    assert belief.initial_belief(shown).tolist() == [0.5, 0.5]


@pytest.mark.slow
def test_the_hallway_is_worth_what_the_literature_earns_with_little_work() -> None:
    found = point_based.solve_point_based(hallway(HALLWAY, signs=SIGNS), None, 0.0, 5e9)
    assert 0.98 <= found.lower_bound <= 1.02 <= found.upper_bound <= 1.206

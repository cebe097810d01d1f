from dataclasses import dataclass

import numpy as np
import pytest

import dmplay
from dmplay import belief
from dmplay.budget import MEMORY, Budget
from dmplay.chance import Array, Ints, Reals
from dmplay.core import Problem
from dmplay.errors import TooMuch
from dmplay.files.problem import FromFile
from dmplay.solvers import alpha_vectors, point_based
from dmplay.solvers.hidden_rows import listed
from dmplay.solvers.point_based import PointBased
from dmplay.tabular import Tables, tabulate
from tests.support.hidden import cheese, drawn, four_by_three, hallway, rock_sample, tiger

EXACT = 19.3713683744  # the tiger without end, at 0.95
ROOMS = (" + ", "***")
HALLWAY = ("***********", "  * * * +  ")
SIGNS = [((x, 0), 2) for x in (2, 4, 6, 8)]


def searched(problem: Problem, horizon: int | None = None, memory: float = MEMORY) -> PointBased:
    budget = Budget("a search", "try less", 1e9, memory)
    return PointBased(listed(problem, budget), horizon, budget)


def best(tables: Tables, discount: float, b: Reals, turns: int) -> float:
    """The value of a belief, not brought to 1, by every history there can be."""
    if not turns:
        return 0.0
    joint = np.einsum("s,saot->aot", b, tables.joint)
    return max(
        float(b @ tables.rewards[:, a, 0])
        + discount * sum(best(tables, discount, after, turns - 1) for after in joint[a])
        for a in range(joint.shape[0])
    )


def test_what_is_claimed_is_the_best_of_all_histories_and_is_earned() -> None:
    for seed in range(6):
        problem = drawn(seed, (0.9, 1.0)[seed % 2])
        exact = best(tabulate(problem), problem.discount, problem.start_belief, 4)
        found = point_based.solved(problem, 4, 0.0)
        assert found.close
        assert found.at_least - 1e-9 <= exact <= found.at_most + 1e-9
        assert found.at_most - found.at_least <= point_based.LEAST
        agent = dmplay.agent(problem, 0, "optimal:horizon=4")
        returns = dmplay.rollout(problem, [agent], episodes=300, turns=4, seed=seed).returns[:, 0]
        assert abs(returns.mean() - exact) <= 2 * returns.std() / np.sqrt(len(returns)), seed


def test_both_bounds_hold_at_every_belief_and_only_get_closer() -> None:
    for problem in (tiger(0.75), drawn(5, 0.6)):
        exact = alpha_vectors.infinite(tabulate(problem), problem.discount)
        search, apart = searched(problem), np.inf
        for _ in range(12):
            assert search.apart <= apart + 1e-9
            apart = search.apart
            search.tried(0.0)
        tree = search.tree
        b = np.array([tree.whole(node) for node in range(len(tree.left))])
        worth = alpha_vectors.values(exact.vectors, b)
        assert (tree.low[: len(b)] <= worth + exact.gap + 1e-9).all()
        assert (tree.high[: len(b)] >= worth - 1e-9).all()
        assert len(b) > 10


def test_the_tiger_is_worth_what_the_literature_says() -> None:
    found = point_based.solved(tiger(), None, 0.01)
    assert found.at_least <= EXACT <= found.at_most
    assert found.close
    assert found.at_most - found.at_least <= 0.01 * found.at_most


def test_a_tiger_of_some_turns_is_solved_to_the_end() -> None:
    problem = tiger(1.0)
    stages = alpha_vectors.stages(tabulate(problem), 1.0, 10)
    of_6, of_10 = (
        alpha_vectors.values(stages[turns - 1].vectors, problem.start_belief[None])[0]
        for turns in (6, 10)
    )
    assert of_10 == pytest.approx(9.438, abs=5e-4)
    found = point_based.solved(problem, 6, 0.0)
    assert [found.at_least, found.at_most] == pytest.approx([of_6, of_6])
    assert len(found.plans) == 7


def test_mazes_are_worth_what_the_literature_says() -> None:
    for problem, published in ((cheese(), 3.48), (four_by_three(), 1.9)):
        found = point_based.solved(problem, None, 0.1)
        assert found.close
        assert found.at_least - 0.01 <= published <= found.at_most + 0.01


def test_problems_are_made_as_they_are_defined() -> None:
    for problem, states, seen in (
        (rock_sample(4, [(3, 1), (2, 1), (1, 3), (1, 0)], (0, 2)), 257, 3),
        (hallway(ROOMS), 14, 17),
        (four_by_three(), 11, 6),
    ):
        assert (problem.states, problem.observation_counts) == (states, (seen,))
        flow, _, shown = problem.tables
        assert shown
        for rows in (flow, shown):
            np.testing.assert_allclose(rows.sums(rows.values), 1.0)
        assert problem.start_belief.sum() == pytest.approx(1.0)


def test_what_is_stopped_says_how_far_it_came() -> None:
    rooms = hallway(ROOMS)
    some, more = (point_based.solved(rooms, None, 0.0, work) for work in (3e7, 1e8))
    assert not some.close
    assert some.at_least <= more.at_least < more.at_most <= some.at_most
    with pytest.raises(TooMuch, match=r"^a plan for what is believed: more than 1e\+06 operations"):
        point_based.solved(rooms, None, 0.0, 1e6)


def test_what_memory_ends_says_so() -> None:
    small, large = searched(hallway(ROOMS), memory=2**21), searched(hallway(ROOMS))
    while small.tried(0.0):
        large.tried(0.0)
    assert small.bounds(0.0).full
    assert not large.bounds(0.0).full


@dataclass(frozen=True)
class Shown(FromFile):
    """One whose state is shown before the first action, if never again."""

    def first(self, s: Array) -> Ints:
        return np.asarray(s[:, None])


def test_what_is_seen_at_the_start_counts() -> None:
    hidden = tiger(1.0)
    shown = Shown(1.0, model=hidden.model)
    found = point_based.solved(shown, 1, 0.0)
    assert found.at_least == found.at_most == pytest.approx(10.0)
    assert found.lower.tolist() == pytest.approx([-1.0, -45.0, -45.0])
    assert belief.prior(shown).tolist() == [0.5, 0.5]


@pytest.mark.slow
def test_the_hallway_is_worth_what_the_literature_earns_with_little_work() -> None:
    found = point_based.solved(hallway(HALLWAY, signs=SIGNS), None, 0.0, 5e9)
    assert 0.98 <= found.at_least <= 1.02 <= found.at_most <= 1.206

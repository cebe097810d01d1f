"""Best replies among several: what could be gained is what every policy is worth at most."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import pytest

from dmplay import load_agent, rollout
from dmplay.budget import limit_total_work
from dmplay.chance import Reals
from dmplay.errors import BadPolicy
from dmplay.solutions.every import solve_problem
from dmplay.solvers import best_replies, graph
from tests.support.drawn import Pair, some_and_ten


def best(problem: Pair, other: Reals, seat: int) -> float:
    """What the best of all policies of a seat earns at the start against a mix `[5, 3]`."""
    rewards = problem.rewards[..., seat].reshape(5, 3, 3)
    flow = problem.transition.reshape(5, 3, 3, 5)
    paid = np.einsum("sab,sb->sa", np.moveaxis(rewards, 1 + seat, 1), other)
    going = np.einsum("sabt,sb->sat", np.moveaxis(flow, 1 + seat, 1), other)
    over = problem.terminal(np.arange(5))
    every = np.array([*product(*(np.flatnonzero(row[seat]) for row in problem.able))])
    here = np.arange(5), every
    stays = np.where(over[:, None], 0.0, going[here])
    earned = np.where(over, 0.0, paid[here])[..., None]
    return float(np.linalg.solve(np.eye(5) - problem.discount * stays, earned)[:, 0].max())


@some_and_ten
def test_the_gains_of_drawn_pairs_are_those_of_the_best_of_all_policies(seeds: range) -> None:
    pure = 0
    for seed in seeds:
        problem = Pair(seed=seed, ends=seed % 2 == 0, discount=0.3)
        found = best_replies.find_equilibrium(problem, graph.build_reachable_graph(problem))
        pure += found.regrets.max() < 1e-8
        assert found.regrets.max() < 0.1
        for seat in range(2):
            other = np.eye(3)[np.zeros(5, int)]
            other[found.graph.states] = found.policies[1 - seat]
            gain = best(problem, other, seat) - found.values[0, seat]
            assert gain == pytest.approx(found.regrets[seat], abs=1e-6)
    assert pure >= len(seeds) / 2


@dataclass(frozen=True)
class Dear(Pair):
    """The same, paid in millions."""

    @cached_property
    def rewards(self) -> Reals:
        """A million times as much."""
        return 1e6 * super().rewards


def test_who_is_paid_in_millions_knows_as_soon_that_nobody_gains() -> None:
    with limit_total_work(2e9):
        few, many = (
            best_replies.find_equilibrium(problem, graph.build_reachable_graph(problem))
            for problem in (Pair(seed=0), Dear(seed=0))
        )
    assert many.values == pytest.approx(1e6 * few.values)
    assert many.regrets.max() < 1e-6


@dataclass(frozen=True)
class Dilemma(Pair):
    """The prisoner's dilemma in every state: the first action is to defect."""

    @cached_property
    def rewards(self) -> Reals:
        """The third action is as bad as to cooperate."""
        kind = [[0, 3], [2, 2], [2, 2]]
        table = np.array([[[1, 1], [3, 0], [3, 0]], kind, kind])
        return np.tile(table.reshape(1, 9, 2), (5, 1, 1)).astype(float)

    @cached_property
    def transition(self) -> Reals:
        """Nothing depends on what is done."""
        return np.tile(np.full(5, 0.2), (5, 9, 1))


def test_all_defect_and_are_told_that_nobody_gains() -> None:
    dilemma = Dilemma(ends=False)
    told = solve_problem(dilemma)
    assert told.method == "best replies over 5 states, 1 round"
    worth = "value 10 to one, 10 to two at the start; to be gained by another policy: "
    assert told.result.startswith(worth)
    assert {row["one"] for row in told.rows} == {"a"}
    seated = [load_agent(dilemma, seat, "equilibrium") for seat in range(2)]
    returns = rollout(dilemma, seated, episodes=2, turn_limit=100).returns
    np.testing.assert_allclose(returns, 10, atol=1e-3)
    values = seated[0].action_values(seated[0].initial_memory(np.zeros(1, int)))
    assert values is not None
    np.testing.assert_allclose(values[0][dilemma.able[0, 0]].max(), 10)


def test_a_game_of_several_at_once_without_end_is_refused() -> None:
    problem = Pair(discount=1.0)
    with pytest.raises(BadPolicy, match="expected a discount below 1"):
        best_replies.find_equilibrium(problem, graph.build_reachable_graph(problem))

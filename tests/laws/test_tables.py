"""What is listed sums to one, and is what tables and beliefs say."""

import numpy as np
import pytest

from dmplay.chance import Array, Bools
from dmplay.core import Problem, exact
from dmplay.tabular import Tables, Tabular, tabulate
from tests.support.brought import Heap, Key
from tests.support.cases import anything, every_problem, load
from tests.support.pools import WALK, lists, pool

FEW_STATES = 300  # tabulated by the laws on arrays


@every_problem
def test_probabilities_sum_to_one(name: str) -> None:
    problem, found = load(name), pool(name)
    s, a = found.s[:24], found.a[:24]
    if lists(problem.chance(s, a)):
        p = exact(problem, s, a).probabilities
        assert (p >= -1e-15).all()
        np.testing.assert_allclose(p.sum(axis=1), 1, atol=1e-12)
    if isinstance(problem.states, int) and problem.states <= FEW_STATES:
        tables = tabulate(problem)
        np.testing.assert_allclose(tables.transition.sum(axis=2), 1, atol=1e-12)
        assert (tables.transition >= -1e-15).all()
        if tables.observation is not None:
            np.testing.assert_allclose(tables.observation.sum(axis=2), 1, atol=1e-12)
            assert (tables.observation >= -1e-15).all()


@every_problem
def test_the_tables_are_what_the_outcomes_amount_to(name: str) -> None:
    problem, s = load(name), pool(name).s[:24]
    if isinstance(problem.states, int) and problem.states <= FEW_STATES:
        amounts_to(problem, s, anything(problem, s, WALK, len(s)))


@pytest.mark.parametrize("problem", [Key(), Heap()])
def test_the_tables_are_what_the_outcomes_of_legal_actions_amount_to(problem: Problem) -> None:
    s, a = np.nonzero(allowed(problem)[:, 0])
    amounts_to(problem, problem.enumerated()[s], a[:, None])


@pytest.mark.parametrize("problem", [Key(), Heap()])
def test_an_action_that_is_not_legal_stands_in_the_tables_for_the_first_that_is(
    problem: Problem,
) -> None:
    transition, rewards, _ = tabulate(problem)
    closed = np.argwhere(~allowed(problem)[:, 0])
    assert len(closed)
    for s, a in closed:
        first = int(np.flatnonzero(allowed(problem)[s, 0])[0])
        assert transition[s, a].tolist() == transition[s, first].tolist()
        assert rewards[s, a] == rewards[s, first]


def allowed(problem: Problem) -> Bools:
    """What every state of a problem that forbids something allows `[S, n, A]`."""
    legal = problem.legal(problem.enumerated())
    assert legal is not None
    return legal


def amounts_to(problem: Problem, s: Array, a: Array) -> None:
    """The rows of the tables for these turns are sums over the listed outcomes."""
    tables = tabulate(problem)
    p, outcome = exact(problem, s, a)
    joint = np.ravel_multi_index(tuple(a.T), problem.action_counts)
    rewards = (p[:, :, None] * outcome.rewards).sum(axis=1)
    np.testing.assert_allclose(tables.rewards[problem.index(s), joint], rewards, atol=1e-12)
    for row, transition in enumerate(tables.transition[problem.index(s), joint]):
        reached = np.bincount(problem.index(outcome.state[row]), p[row], len(transition))
        np.testing.assert_allclose(transition, reached, atol=1e-12)


@every_problem
def test_a_belief_is_carried_as_the_listed_outcomes_say(name: str) -> None:
    problem, found = load(name), pool(name)
    if not problem.hidden or not isinstance(problem.states, int):
        return
    some = problem.index(found.s[:: len(found.s) // 29])
    belief = np.bincount(some, minlength=problem.states) / len(some)
    agents = len(problem.agents)
    for seat, labels in enumerate(problem.observations):
        action: list[int | None] = [None] * agents
        action[seat] = int(found.a[seat, seat])
        for kind in (0, len(labels) - 1):
            observation: list[int | None] = [None] * agents
            observation[seat] = kind
            for actions, seen in ((action, observation), (action, [None] * agents)):
                told = problem.carry(belief, actions, seen)
                listed = Problem.carry(problem, belief, actions, seen)
                np.testing.assert_allclose(told, listed, atol=1e-15)
    everyone: list[int | None] = [int(a) for a in found.a[0]]
    told = problem.carry(belief, everyone, [None] * agents)
    np.testing.assert_allclose(told.sum(), 1, atol=1e-12)


def test_nobody_writes_into_the_tables_of_a_game() -> None:
    for name in ("machine-replacement", "catch", "crying-baby"):
        problem = load(name)
        assert isinstance(problem, Tabular)
        assert isinstance(problem.tables, Tables)
        for array in problem.tables:
            assert array is None or not array.flags.writeable

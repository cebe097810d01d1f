"""Tables by what can happen: the same game as dense ones, in far less room."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest

from dmplay import Labels, SeededUniforms, Session, Tables, Tabular
from dmplay.chance import Reals
from dmplay.core import Problem, enumerate_outcomes
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.finding.agents import load_roster
from dmplay.finding.problems import load_problem
from dmplay.laws.sound import check_playable
from dmplay.rows import SparseMatrix
from dmplay.tabular import SparseTables, tabulate
from dmplay.transcript.format import collect_turn_facts
from dmplay.views import generic
from dmplay.views.style import DrawOptions, fit_board

STATES, ACTIONS, SEEN, REACHED = 5000, 10, 20, 6


@dataclass(frozen=True)
class Maze(Tabular):
    """Many states of which each leads to a few."""

    discount: float = 0.9
    actions = (Labels(f"go{n}" for n in range(ACTIONS)),)
    observations = (Labels(f"see{n}" for n in range(SEEN)),)
    state_names = tuple(f"room{n}" for n in range(STATES))

    @cached_property
    def tables(self) -> SparseTables:
        """Rooms in a ring, whose numbers are seen up to a multiple."""
        rows = np.arange(STATES * ACTIONS)
        step = rows % ACTIONS + 1
        after = (rows[:, None] // ACTIONS + np.arange(REACHED) * step[:, None]) % STATES
        after = np.sort(after, axis=1)
        flow = SparseMatrix(
            np.arange(len(rows) + 1) * REACHED, after.ravel(), _even(len(rows), REACHED)
        )
        places = np.arange(ACTIONS * STATES)
        shown = np.sort((places[:, None] + np.arange(2) * 7) % SEEN, axis=1)
        seen = SparseMatrix(np.arange(len(places) + 1) * 2, shown.ravel(), _even(len(places), 2))
        return SparseTables(flow, np.zeros((len(rows), 1)), seen)


def _even(rows: int, each: int) -> Reals:
    return np.full(rows * each, 1.0 / each)


def played(problem: Problem, turns: int = 40) -> Session:
    """A game in which every action is taken in turn."""
    game = Session(problem, SeededUniforms(7), turn_limit=turns)
    while not game.over:
        game.advance([len(game.turns) % many for many in problem.action_counts])
    return game


def numbers(problem: Tabular) -> int:
    """How many numbers say what can happen."""
    flow, rewards, seen = problem.sparse_tables
    return len(flow.values) + rewards.size + (0 if seen is None else len(seen.values))


def test_many_states_take_as_many_numbers_as_can_happen() -> None:
    maze = Maze()
    check_playable("maze", maze)
    assert numbers(maze) == STATES * ACTIONS * (REACHED + 2 + 1)
    chance, *_ = maze.chance(np.zeros(1, int), np.zeros((1, 1), int))
    assert chance.probabilities().shape == (1, REACHED * 2)  # type: ignore[union-attr]
    game = played(maze, 12)
    belief = game.view(0).belief
    assert len(belief) == STATES
    assert np.count_nonzero(belief) < STATES / 2
    np.testing.assert_allclose(belief.sum(), 1)
    assert belief[int(game.state)] > 0


def test_of_many_states_the_likeliest_ten_are_shown_and_what_is_left() -> None:
    view = played(Maze(), 3).view(0)
    drawn = fit_board(generic, view, DrawOptions(80, 24)).plain.splitlines()
    told = [row.split() for row in drawn if row.startswith("room")]
    others = next(row.split() for row in drawn if " others " in row)
    assert len(told) == 10
    assert int(others[0]) == np.count_nonzero(view.belief) - 10
    shown = sum(float(row[-1]) for row in told)
    np.testing.assert_allclose(float(others[-1]), 1 - shown, atol=0.006)
    assert generic.describe_situation(view).count("room") == 3
    transcribed = played(Maze(), 1)
    assert "belief" not in collect_turn_facts(transcribed)


def test_what_needs_arrays_refuses_many_states_in_one_line() -> None:
    with pytest.raises(BudgetExceeded, match=r"^tables: .* MB, more than 512; fewer states"):
        tabulate(Maze())
    assert [*load_roster(Maze()).agents] == ["optimal", "point-based", "random", "search"]


@pytest.mark.parametrize("name", ["crying-baby", "machine-replacement"])
def test_the_same_draws_give_the_same_game_as_dense_tables(name: str) -> None:
    dense = load_problem(name)
    assert isinstance(dense, Tabular)
    transition, rewards, observation = tabulate(dense)
    s = np.repeat(np.arange(dense.state_count), len(transition[0]))
    joint = (transition[:, :, :, None] * np.asarray(observation)[None]).reshape(len(s), -1)
    u = np.linspace(0, 0.999999999, 601)
    for row, a in enumerate(np.tile(np.arange(len(transition[0])), dense.state_count)):
        here = np.full(len(u), s[row]), np.full((len(u), 1), a)
        got = dense.step(*here, u[:, None])
        event = (np.cumsum(joint[row])[:-1] <= u[:, None]).sum(axis=1)
        moved, seen = np.divmod(event, joint.shape[1] // dense.state_count)
        np.testing.assert_array_equal(got.state, moved)
        np.testing.assert_array_equal(got.observations[:, 0], seen)
        np.testing.assert_array_equal(got.rewards, rewards[here[0], a])


@dataclass(frozen=True)
class Toll(Tabular):
    """A bridge that takes a toll of who gets over, and more of who is seen."""

    actions = (Labels(("wait", "cross")),)
    observations = (Labels(("dark", "lit")),)
    state_names = ("here", "there")
    tables = Tables(
        np.array([[[1, 0], [0.25, 0.75]], [[0, 1], [0.25, 0.75]]]),
        np.zeros((2, 2, 2, 2, 1)) + np.array([[[0, 0], [-1, -5]]])[..., None],
        np.tile([0.8, 0.2], (2, 2, 1)),
    )


def test_rewards_may_depend_on_the_next_state_and_on_what_is_seen() -> None:
    toll = Toll()
    check_playable("toll", toll)
    s, a = np.array([0, 0]), np.array([[0], [1]])
    p, outcome = enumerate_outcomes(toll, s, a)
    paid = (p[:, :, None] * outcome.rewards).sum(axis=1)
    np.testing.assert_allclose(paid[:, 0], [0.0, 0.75 * (-0.8 - 1)])
    np.testing.assert_allclose(tabulate(toll).rewards[0], paid)
    pairs = {(int(t), int(o), float(r)) for t, o, r in zip(
        outcome.state[1], outcome.observations[1, :, 0], outcome.rewards[1, :, 0], strict=True
    )}  # fmt: skip
    assert pairs == {(0, 0, 0.0), (0, 1, 0.0), (1, 0, -1.0), (1, 1, -5.0)}


def test_sparse_tables_that_cannot_be_are_refused_in_one_sentence() -> None:
    flow, rewards, seen = Toll().sparse_tables
    assert seen is not None
    other = r"tables\.transition: got other rows or columns than there are names"
    wrong = {
        r"tables\.transition\[here, wait\] sums to 0\.5, expected 1": [
            flow._replace(values=flow.values / 2)
        ],
        other: [
            flow._replace(columns=np.full(6, 9)),
            flow._replace(row_starts=flow.row_starts[:-1]),
        ],
    }
    for told, rows in ((told, one) for told, each in wrong.items() for one in each):
        bad = type("Bad", (Toll,), {"tables": SparseTables(rows, rewards, seen)})()
        with pytest.raises(BadParameter, match=told):
            check_playable("bad", bad)


def test_arrays_that_pay_all_alike_are_those_of_a_team() -> None:
    one = Toll().tables
    for shares, kind in (([1.0, 1.0], "Dec-POMDP"), ([1.0, 2.0], "POMG")):
        seen = np.repeat(one.observation_model, 2, axis=2) / 2  # the second agent sees a coin
        pair = Tables(one.transition, np.repeat(one.rewards, 2, axis=3) * shares, seen)
        two = {"agents": ("a", "b"), "actions": (*Toll.actions, Labels(("look",)))}
        told = {"observations": (*Toll.observations, Labels(("head", "tail"))), "tables": pair}
        assert type("Pair", (Toll,), two | told)().kind == kind

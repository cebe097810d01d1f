"""Tests of sparse tables: the same game as with dense tables, in far less memory."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest

from dmplay import Labels, SeededUniforms, Session, Tables, Tabular
from dmplay.core.arrays import Reals
from dmplay.core.playability_checks import check_playable
from dmplay.core.problem import Problem, enumerate_outcomes
from dmplay.core.sparse_matrix import SparseMatrix
from dmplay.core.tabular import SparseTables, tabulate
from dmplay.draw.options import DrawOptions
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.registry.agents import load_roster
from dmplay.registry.problems import load_problem
from dmplay.transcript.format import collect_turn_facts
from dmplay.views import generic
from dmplay.views.protocol import fit_board

STATE_COUNT, ACTION_COUNT, OBSERVATION_COUNT, SUCCESSOR_COUNT = 5000, 10, 20, 6


@dataclass(frozen=True)
class Maze(Tabular):
    """A problem of many states, each of which leads to a few."""

    discount: float = 0.9
    actions = (Labels(f"go{n}" for n in range(ACTION_COUNT)),)
    observations = (Labels(f"see{n}" for n in range(OBSERVATION_COUNT)),)
    state_names = tuple(f"room{n}" for n in range(STATE_COUNT))

    @cached_property
    def tables(self) -> SparseTables:
        """Sparse tables of rooms in a ring, observed as their number plus 0 or 7, modulo 20."""
        rows = np.arange(STATE_COUNT * ACTION_COUNT)
        step = rows % ACTION_COUNT + 1
        next_states = (
            rows[:, None] // ACTION_COUNT + np.arange(SUCCESSOR_COUNT) * step[:, None]
        ) % STATE_COUNT
        next_states = np.sort(next_states, axis=1)
        transitions = SparseMatrix(
            np.arange(len(rows) + 1) * SUCCESSOR_COUNT,
            next_states.ravel(),
            _equal_probabilities(len(rows), SUCCESSOR_COUNT),
        )
        rows_observed = np.arange(ACTION_COUNT * STATE_COUNT)
        observed = np.sort((rows_observed[:, None] + np.arange(2) * 7) % OBSERVATION_COUNT, axis=1)
        observation_rows = SparseMatrix(
            np.arange(len(rows_observed) + 1) * 2,
            observed.ravel(),
            _equal_probabilities(len(rows_observed), 2),
        )
        return SparseTables(transitions, np.zeros((len(rows), 1)), observation_rows)


def _equal_probabilities(rows: int, count: int) -> Reals:
    return np.full(rows * count, 1.0 / count)


def play_in_rotation(problem: Problem, turns: int = 40) -> Session:
    """Play a game in which each seat takes its actions in rotation."""
    game = Session(problem, SeededUniforms(7), turn_limit=turns)
    while not game.over:
        game.advance([len(game.turns) % action_count for action_count in problem.action_counts])
    return game


def count_stored_numbers(problem: Tabular) -> int:
    """Count the numbers that the sparse tables store."""
    transitions, rewards, observation_rows = problem.sparse_tables
    return (
        len(transitions.values)
        + rewards.size
        + (0 if observation_rows is None else len(observation_rows.values))
    )


def test_sparse_tables_store_only_possible_outcomes() -> None:
    maze = Maze()
    check_playable("maze", maze)
    assert count_stored_numbers(maze) == STATE_COUNT * ACTION_COUNT * (SUCCESSOR_COUNT + 2 + 1)
    chance, *_ = maze.chance(np.zeros(1, int), np.zeros((1, 1), int))
    assert chance.probabilities().shape == (1, SUCCESSOR_COUNT * 2)  # type: ignore[union-attr]
    game = play_in_rotation(maze, 12)
    belief = game.view(0).belief
    assert len(belief) == STATE_COUNT
    assert np.count_nonzero(belief) < STATE_COUNT / 2
    np.testing.assert_allclose(belief.sum(), 1)
    assert belief[int(game.state)] > 0


def test_the_view_lists_the_ten_likeliest_states_and_the_remainder() -> None:
    view = play_in_rotation(Maze(), 3).view(0)
    rows = fit_board(generic, view, DrawOptions(80, 24)).plain.splitlines()
    state_rows = [row.split() for row in rows if row.startswith("room")]
    others = next(row.split() for row in rows if " others " in row)
    assert len(state_rows) == 10
    assert int(others[0]) == np.count_nonzero(view.belief) - 10
    shown_probability = sum(float(row[-1]) for row in state_rows)
    np.testing.assert_allclose(float(others[-1]), 1 - shown_probability, atol=0.006)
    assert generic.describe_situation(view).count("room") == 3
    short_game = play_in_rotation(Maze(), 1)
    assert "belief" not in collect_turn_facts(short_game)


def test_dense_tables_refuse_too_many_states_in_one_line() -> None:
    with pytest.raises(
        BudgetExceeded, match=r"^tables: .* MB, more than the limit of 512 MB; use fewer states"
    ):
        tabulate(Maze())
    assert [*load_roster(Maze()).agents] == ["optimal", "point-based", "random", "search"]


@pytest.mark.parametrize("name", ["crying-baby", "machine-replacement"])
def test_the_same_uniforms_give_the_same_game_as_dense_tables(name: str) -> None:
    dense = load_problem(name)
    assert isinstance(dense, Tabular)
    transition, rewards, observation = tabulate(dense)
    s = np.repeat(np.arange(dense.state_count), len(transition[0]))
    joint = (transition[:, :, :, None] * np.asarray(observation)[None]).reshape(len(s), -1)
    u = np.linspace(0, 0.999999999, 601)
    for row, a in enumerate(np.tile(np.arange(len(transition[0])), dense.state_count)):
        state_and_action = np.full(len(u), s[row]), np.full((len(u), 1), a)
        outcome = dense.step(*state_and_action, u[:, None])
        event = (np.cumsum(joint[row])[:-1] <= u[:, None]).sum(axis=1)
        next_state, observed = np.divmod(event, joint.shape[1] // dense.state_count)
        np.testing.assert_array_equal(outcome.state, next_state)
        np.testing.assert_array_equal(outcome.observations[:, 0], observed)
        np.testing.assert_array_equal(outcome.rewards, rewards[state_and_action[0], a])


@dataclass(frozen=True)
class Toll(Tabular):
    """A bridge with a toll for crossing, which is higher for a crossing that is lit."""

    actions = (Labels(("wait", "cross")),)
    observations = (Labels(("dark", "lit")),)
    state_names = ("here", "there")
    tables = Tables(
        np.array([[[1, 0], [0.25, 0.75]], [[0, 1], [0.25, 0.75]]]),
        np.zeros((2, 2, 2, 2, 1)) + np.array([[[0, 0], [-1, -5]]])[..., None],
        np.tile([0.8, 0.2], (2, 2, 1)),
    )


def test_rewards_may_depend_on_the_next_state_and_the_observation() -> None:
    toll = Toll()
    check_playable("toll", toll)
    s, a = np.array([0, 0]), np.array([[0], [1]])
    p, outcome = enumerate_outcomes(toll, s, a)
    expected_rewards = (p[:, :, None] * outcome.rewards).sum(axis=1)
    np.testing.assert_allclose(expected_rewards[:, 0], [0.0, 0.75 * (-0.8 - 1)])
    np.testing.assert_allclose(tabulate(toll).rewards[0], expected_rewards)
    pairs = {(int(t), int(o), float(r)) for t, o, r in zip(
        outcome.state[1], outcome.observations[1, :, 0], outcome.rewards[1, :, 0], strict=True
    )}  # fmt: skip
    assert pairs == {(0, 0, 0.0), (0, 1, 0.0), (1, 0, -1.0), (1, 1, -5.0)}


def test_invalid_sparse_tables_are_refused_in_one_sentence() -> None:
    transitions, rewards, observation_rows = Toll().sparse_tables
    assert observation_rows is not None
    other = r"tables\.transition: got rows or columns that do not match the names"
    faulty_tables = {
        r"tables\.transition\[here, wait\] sums to 0\.5, expected 1": [
            transitions._replace(values=transitions.values / 2)
        ],
        other: [
            transitions._replace(columns=np.full(6, 9)),
            transitions._replace(row_starts=transitions.row_starts[:-1]),
        ],
    }
    for message, rows in (
        (message, variant) for message, variants in faulty_tables.items() for variant in variants
    ):
        bad = type("Bad", (Toll,), {"tables": SparseTables(rows, rewards, observation_rows)})()
        with pytest.raises(BadParameter, match=message):
            check_playable("bad", bad)


def test_equal_rewards_for_all_agents_make_a_dec_pomdp() -> None:
    single = Toll().tables
    for shares, kind in (([1.0, 1.0], "Dec-POMDP"), ([1.0, 2.0], "POMG")):
        # the second agent sees a coin
        observation_table = np.repeat(single.observation_model, 2, axis=2) / 2
        pair = Tables(
            single.transition, np.repeat(single.rewards, 2, axis=3) * shares, observation_table
        )
        agents_and_actions = {"agents": ("a", "b"), "actions": (*Toll.actions, Labels(("look",)))}
        observations_and_tables = {
            "observations": (*Toll.observations, Labels(("head", "tail"))),
            "tables": pair,
        }
        assert type("Pair", (Toll,), agents_and_actions | observations_and_tables)().kind == kind

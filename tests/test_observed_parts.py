"""Tests of the parts that an environment observes: belief, history, state and turns."""

import re
import warnings
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="needs the extra gymnasium")
pytest.importorskip("pettingzoo", reason="needs the extra pettingzoo")

from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import FlattenObservation

from dmplay.core.session import has_visible_beliefs
from dmplay.errors import BadParameter, UnknownName
from dmplay.gym import Env, VectorEnv
from dmplay.simulation.observed_parts import OBSERVED_PARTS
from dmplay.zoo import ParallelEnv
from dmplay.zoo import env as make_turn_based
from tests.support.problem_cases import CASE_NAMES, load_problem, load_small_problem
from tests.support.turn_based_games import Nim

pytestmark = pytest.mark.extra("gymnasium", "pettingzoo")


def list_parts(name: str) -> list[str]:
    """List the parts that a problem has."""
    has_belief = has_visible_beliefs(load_problem(name))
    return [part for part in OBSERVED_PARTS if part != "belief" or has_belief]


def is_equal(row: dict[str, Any], single: dict[str, Any]) -> bool:
    """Return whether two observations are equal to the last bit."""
    return all(np.array_equal(row[part], single[part]) for part in single)


def test_rows_observe_what_single_games_observe() -> None:
    for name in CASE_NAMES:
        problem, parts = load_small_problem(name), list_parts(name)
        envs = VectorEnv(problem, 2, turns=2, observe=parts, others="random")
        singles = [Env(problem, turns=2, observe=parts, others="random") for _ in range(2)]
        observations, _ = envs.reset(seed=7)
        expected = [single.reset(seed=7, options={"episode": row})[0]
                    for row, single in enumerate(singles)]  # fmt: skip
        episodes, over, actions = [0, 1], [False, False], envs.action_space.sample()
        for step in range(6):
            assert envs.observation_space.contains(observations), name
            for row, single in enumerate(singles):
                assert single.observation_space.contains(expected[row]), name
                values = {part: observations[part][row] for part in parts}
                assert is_equal(values, expected[row]), (name, row, step)
            observations, _, terminated, truncated, _ = envs.step(actions)
            for row, single in enumerate(singles):
                if over[row]:
                    episodes[row] += 2
                    options = {"episode": episodes[row]}
                    expected[row] = single.reset(seed=7, options=options)[0]
                else:
                    expected[row] = single.step(actions[row])[0]
            over = (terminated | truncated).tolist()


def test_each_part_is_what_the_seat_knows_or_asked_for() -> None:
    env = Env("crying-baby", turns=3, observe="belief + history+state + turns")
    observed, info = env.reset(seed=7)
    assert env.session is not None
    for action in (0, 2, 1):
        view = env.session.view(0)
        assert np.allclose(observed["belief"], view.belief, rtol=0.0, atol=1e-12)
        assert observed["state"] == env.session.state
        assert observed["turns"].tolist() == [info["turns_left"]]
        # Label 2 is an observation of nothing yet.
        values = [2, *(int(label) for label in view.observations[1:])]
        rows = [[1, int(a), o] for a, o in zip([0, *view.actions], values, strict=True)]
        assert observed["history"].tolist() == rows + [[0, 0, 0]] * (4 - len(rows))
        observed, _, _, _, info = env.step(action)
    (row,) = Env("prisoners-dilemma", turns=1, observe="history").reset(seed=7)[0][:1]
    assert row.tolist() == [1, 0, 0]


def test_the_history_of_a_visible_game_has_all_actions_and_states() -> None:
    env = Env("predator-prey", turns=2, observe="history")
    start, _ = env.reset(seed=7)
    after, *_ = env.step(1)
    assert env.session is not None
    turn = env.session.turns[0]
    assert start[0].tolist() == [1, 0, 0, *env.session.initial_state.tolist()]
    assert after[1].tolist() == [1, *turn.actions.tolist(), *turn.state.tolist()]
    assert after[2].tolist() == [0, 0, 0, 0, 0]


def test_an_illegal_action_takes_a_turn_but_no_row_of_the_history() -> None:
    for env in (Env("2048", turns=3, observe="history+turns"),
                VectorEnv("2048", 1, turns=3, observe="history+turns")):  # fmt: skip
        start, _ = env.reset(seed=5)
        after, *_ = env.step(np.array(1) if isinstance(env, Env) else np.array([1]))
        assert np.array_equal(after["history"], start["history"])
        assert after["turns"].ravel().tolist() == [2]


def test_a_hidden_state_is_observed_only_if_the_caller_names_it() -> None:
    for name in CASE_NAMES:
        if load_problem(name).partially_observable:
            assert "state" not in str(Env(name, others="random").observation_space)
    env = Env("crying-baby", observe=["state"])
    states = {int(env.reset(seed=seed)[0]) for seed in range(30)}
    assert states == {0, 1}


@pytest.mark.parametrize(
    ("name", "observe", "message"),
    [
        ("crying-baby", "belif", "observe: unknown part of an observation 'belif'; did you mean"),
        ("crying-baby", "belief|turns", "observe: unknown part of an observation 'belief|turns';"),
        ("crying-baby", "", "observe: unknown part of an observation ''; expected one of obser"),
        ("crying-baby", "turns+turns", "observe: got turns more than once, expected it once"),
        ("crying-baby", [], "observe: got [], expected one or several of observation, belief,"),
        ("crying-baby", None, "observe: got None, expected one or several of observation, belief"),
        ("crying-baby", [1], "observe: got [1], expected one or several of observation, belief,"),
        ("hexworld", "belief", "observe: got belief, but the problem has no hidden states; obser"),
        ("hexworld", "history", "observe: got a history of 10000 turns, expected turns= of at mo"),
    ],
)
def test_a_wrong_part_is_refused_in_one_line(name: str, observe: Any, message: str) -> None:
    for environment in (Env, VectorEnv, ParallelEnv):
        with pytest.raises((BadParameter, UnknownName), match=f"^{re.escape(message)}[^\n]*$"):
            environment(name, observe=observe)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"observ": "state"}, "unknown parameter 'observ'; did you mean observe"),
        ({"discont": 0.5}, "unknown parameter 'discont'; did you mean discount?"),
    ],
)
def test_the_error_for_a_wrong_option_names_the_nearest_one(
    options: dict[str, Any], message: str
) -> None:
    for environment in (Env, VectorEnv, ParallelEnv):
        with pytest.raises(UnknownName, match=f"^{re.escape(message)}"):
            environment("prisoners-dilemma", **options)


def test_a_problem_of_ones_own_is_observed_in_parts() -> None:
    parallel = ParallelEnv(Nim(), turns=4, observe="observation+history+turns+state")
    observations, _ = parallel.reset(seed=1)
    for agent, observation in observations.items():
        assert parallel.observation_space(agent).contains(observation)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # unbounded spaces, no images
def test_every_part_passes_the_checks_of_gymnasium_and_pettingzoo() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from pettingzoo.test import api_test, parallel_api_test
    for name in CASE_NAMES:
        problem, parts = load_small_problem(name), list_parts(name)
        for observe in [[part] for part in parts] + [parts]:
            for agent in problem.agents:
                env = Env(problem, seat=agent, turns=3, observe=observe, others="random")
                check_env(env, skip_render_check=True)
                if len(observe) > 1:
                    check_env(FlattenObservation(env), skip_render_check=True)
            parallel_api_test(ParallelEnv(problem, turns=3, observe=observe), 8)
            api_test(make_turn_based(problem, turns=3, observe=observe), 8)

"""Tests of the Gymnasium environments: Gymnasium's own checks, and equality with rollouts."""

import importlib.util
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="needs the extra gymnasium")
pytest.importorskip("pettingzoo", reason="needs the extra pettingzoo")

import gymnasium
from gymnasium.utils.env_checker import check_env

import dmplay
from dmplay.agents.base import ReactivePolicy
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Memory
from dmplay.core.problem import Problem
from dmplay.core.spaces import Interval
from dmplay.errors import BadParameter, EpisodeOver, IllegalAction, UnknownName
from dmplay.evaluation.many_games import rollout
from dmplay.guide.topics import read_topic
from dmplay.gym import Env, VectorEnv, sb3_vec_env
from dmplay.registry import agents
from dmplay.registry.builtin_names import problem_names
from dmplay.simulation.rollouts import Rollout
from dmplay.simulation.seat_spaces import TurnLimit
from dmplay.zoo import ParallelEnv
from tests.formats.sources import BALLET_TEXT, TEAM_TEXT, TIGER_TEXT, write_text_file
from tests.support.problem_cases import (
    CASE_NAMES,
    SHORT_GAME_TURNS,
    load_problem,
    load_small_problem,
)

pytestmark = pytest.mark.extra("gymnasium", "pettingzoo")

ENV_COUNT, SEED = 3, 7


@dataclass(frozen=True)
class FirstActionPolicy(ReactivePolicy):
    """A policy that chooses the first legal action, or the lowest number."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        first_legal = np.zeros(len(u), int) if legal is None else legal.argmax(axis=1)
        space = self.problem.actions[self.seat]
        return np.full(len(u), space.low) if isinstance(space, Interval) else first_legal


def roll_out_first_actions(problem: Problem, seat: int, episodes: int) -> Rollout:
    """Return a rollout of the first-action policy against the usual partners."""
    partners = [agents.load_roster(problem, i).default_partner for i in range(len(problem.agents))]
    policies = [dmplay.load_agent(problem, i, name) for i, name in enumerate(partners)]
    policies[seat] = FirstActionPolicy(problem, seat)
    return rollout(problem, policies, episodes=episodes, turn_limit=SHORT_GAME_TURNS, seed=SEED)


def choose_first_action(problem: Problem, seat: int, mask: Array | None) -> Array:
    """Return the first legal action as a value of the space, for each row of the mask."""
    space = problem.actions[seat]
    if isinstance(space, Interval):
        return np.full((ENV_COUNT, 1), space.low)
    assert mask is not None
    return np.asarray(mask.argmax(axis=1))


def list_all_seats() -> list[tuple[str, int]]:
    """List every seat of every problem."""
    return [(name, seat) for name in CASE_NAMES for seat in range(len(load_problem(name).agents))]


def check_episodes_equal_rollout(problem: Problem, seat: int) -> None:
    """Check that the episodes of a seat equal the rows of a rollout."""
    env = Env(problem, seat=problem.agents[seat], turns=SHORT_GAME_TURNS)
    expected_rollout = roll_out_first_actions(problem, seat, ENV_COUNT)
    for episode in range(ENV_COUNT):
        _, info = env.reset(seed=SEED if not episode else None)
        total, weight, over, turns = 0.0, 1.0, False, 0
        while not over:
            mask = info.get("action_mask")
            action = choose_first_action(problem, seat, None if mask is None else mask[None])[0]
            _, reward, terminated, truncated, info = env.step(action)
            over, turns = terminated or truncated, turns + 1
            total, weight = total + weight * reward, weight * problem.discount
        result = (total, turns, terminated)
        expected = (
            expected_rollout.returns[episode, seat],
            expected_rollout.turn_counts[episode],
            expected_rollout.terminated[episode],
        )
        assert result == expected, (problem, seat, episode)


def test_episodes_equal_the_rows_of_a_rollout_to_the_last_bit() -> None:
    for name, seat in list_all_seats():
        check_episodes_equal_rollout(load_small_problem(name), seat)


def test_a_vector_env_plays_the_games_of_a_rollout_in_order() -> None:
    for name, seat in list_all_seats():
        problem = load_small_problem(name)
        envs = VectorEnv(problem, ENV_COUNT, seat=problem.agents[seat], turns=SHORT_GAME_TURNS)
        expected = (
            roll_out_first_actions(problem, seat, 2 * ENV_COUNT)
            .returns[:, seat]
            .reshape(2, ENV_COUNT)
        )
        returns: list[list[float]] = [[0.0] for _ in range(ENV_COUNT)]
        weights: Reals = np.ones(ENV_COUNT)
        finished: Bools = np.zeros(ENV_COUNT, bool)
        _, info = envs.reset(seed=SEED)
        while min(map(len, returns)) < 3:
            action = choose_first_action(problem, seat, info.get("action_mask"))
            _, rewards, terminated, truncated, info = envs.step(action)
            weights[finished] = 1.0
            for row in range(ENV_COUNT):
                returns[row][-1] += weights[row] * rewards[row]
            weights *= np.where(finished, 1.0, problem.discount)
            finished = terminated | truncated
            for row in np.flatnonzero(finished).tolist():
                returns[row].append(0.0)
        assert np.array_equal([games[:2] for games in returns], expected.T), (name, seat)


def test_every_observation_is_in_the_observation_space() -> None:
    for name in CASE_NAMES:
        problem = load_small_problem(name)
        env = Env(problem, turns=2)
        envs = VectorEnv(problem, ENV_COUNT, turns=2, uniforms="fast", others="random")
        observation, info = envs.reset(seed=SEED)
        for _ in range(4):
            assert envs.observation_space.contains(observation), name
            observation, _, _, _, info = envs.step(
                choose_first_action(problem, 0, info.get("action_mask"))
            )
        assert env.observation_space.contains(env.reset(seed=SEED)[0])


def test_every_game_of_fast_uniforms_has_a_start_of_its_own() -> None:
    envs, starts = VectorEnv("cart-pole", 3, uniforms="fast", turns=1), list[Array]()
    starts.append(envs.reset(seed=SEED)[0])
    for step in range(400):  # more starts than are made at once
        observations, *_ = envs.step(np.zeros(3, int))
        if step % 2:
            starts.append(observations)
    assert len(np.unique(np.concatenate(starts), axis=0)) == 3 * len(starts)
    assert np.array_equal(starts[0], envs.reset(seed=SEED)[0])


def test_an_illegal_action_changes_nothing_and_uses_no_turn() -> None:
    env, envs = Env("2048"), VectorEnv("2048", 2)
    before, info = env.reset(seed=5)
    (illegal_action,) = np.flatnonzero(info["action_mask"] == 0)
    after, reward, terminated, truncated, info_after = env.step(illegal_action)
    assert (reward, terminated, truncated) == (0.0, False, False)
    assert np.array_equal(before, after)
    assert np.array_equal(info["action_mask"], info_after["action_mask"])
    initial, _ = envs.reset(seed=5)
    legal_action = np.flatnonzero(info["action_mask"])[0]
    after_illegal, *_ = envs.step(np.array([illegal_action, 3]))
    assert np.array_equal(after_illegal[0], before)
    assert not np.array_equal(after_illegal[1], initial[1])
    after_legal, *_ = envs.step(np.array([legal_action, 3]))
    assert np.array_equal(after_legal[0], env.step(legal_action)[0])  # uses the uniforms of turn 1


# In 2048 with seed 5, action 1 is illegal at the start, and action 0 is legal.
@pytest.mark.parametrize(
    ("illegal", "rewards", "terminated", "truncated"),
    [
        ("noop", [0.0, 0.0, 0.0], [False, False, False], [False, False, True]),
        ("penalty", [-5.0, -5.0, -5.0], [False, False, False], [False, False, True]),
        ("end", [-5.0], [True], [False]),
    ],
)
def test_an_episode_of_illegal_actions_only_ends(
    illegal: str, rewards: list[float], terminated: list[bool], truncated: list[bool]
) -> None:
    env = Env("2048", turns=3, illegal=illegal, illegal_reward=-5.0)
    envs = VectorEnv("2048", 1, turns=3, illegal=illegal, illegal_reward=-5.0)
    env.reset(seed=5)
    envs.reset(seed=5)
    steps = [env.step(1)[1:4] for _ in rewards]
    assert steps == [*zip(rewards, terminated, truncated, strict=True)]
    batches = [envs.step(np.array([1]))[1:4] for _ in rewards]
    assert [tuple(column.item() for column in batch) for batch in batches] == steps
    assert env.session is not None
    assert not env.session.turns
    with pytest.raises(EpisodeOver, match="the episode is over; call reset"):
        env.step(0)
    env.reset()
    assert env.step(0)[2:4] == (False, False)
    *ending, _ = envs.step(np.array([1]))[1:]
    assert [column.item() for column in ending] == [0.0, False, False]  # the next game starts


def test_legal_and_illegal_steps_count_together() -> None:
    env, envs = Env("2048", turns=3), VectorEnv("2048", 2, turns=3)
    env.reset(seed=5)
    envs.reset(seed=5)
    truncated = [env.step(action)[3] for action in (1, 0, 1)]
    assert truncated == [False, False, True]
    rows = [envs.step(np.array([action, 3]))[3].tolist() for action in (1, 0, 1)]
    assert rows == [[False, False], [False, False], [True, True]]
    assert env.session is not None
    assert len(env.session.turns) >= 1


def test_action_masks_are_the_legal_actions_as_booleans() -> None:
    env, envs = Env("2048"), VectorEnv("2048", 2)
    env.reset(seed=5)
    envs.reset(seed=5)
    assert env.action_masks().tolist() == [True, False, True, True]
    assert envs.action_masks()[0].tolist() == [True, False, True, True]
    assert envs.action_masks().dtype == env.action_masks().dtype == np.bool_
    lake = Env("hexworld")
    lake.reset(seed=5)
    assert lake.action_masks().tolist() == [True] * 6
    continuous = Env("simple-regulator")
    continuous.reset(seed=5)
    with pytest.raises(BadParameter, match="got real-valued actions, which have no mask"):
        continuous.action_masks()


@pytest.mark.parametrize("environment", [Env, VectorEnv])
def test_an_unknown_rule_for_illegal_actions_is_refused(environment: type) -> None:
    with pytest.raises(UnknownName, match="did you mean penalty"):
        environment("2048", illegal="penalti")
    with pytest.raises(BadParameter, match="illegal_reward: got nan, expected a finite number"):
        environment("2048", illegal="penalty", illegal_reward=float("nan"))
    with pytest.raises(BadParameter, match="illegal: got None, expected one of noop, penalty, end"):
        environment("2048", illegal=None)
    for value in ("x", None, True, [1.0], 10**400, 1j, np.complex128(1)):
        expected = re.escape(f"illegal_reward: got {value!r}, expected a finite number")
        with pytest.raises(BadParameter, match=expected):
            environment("2048", illegal_reward=value)


def test_illegal_actions_without_a_turn_limit_end_after_10000_steps() -> None:
    env, envs = Env("2048"), VectorEnv("2048", 1)
    env.reset(seed=5)
    envs.reset(seed=5)
    ends = list[tuple[bool, bool]]()
    while not any(map(any, ends[-1:])):
        *_, terminated, truncated, _ = env.step(1)  # slides no tile
        ends.append((terminated, truncated))
        *_, row_terminated, row_truncated, _ = envs.step(np.array([1]))
        assert ends[-1] == (row_terminated.item(), row_truncated.item())
    assert (len(ends), ends[-1]) == (10_000, (False, True))


@pytest.mark.parametrize(
    ("name", "turns", "limit"),
    [
        ("2048", None, 10_000),
        ("mountain-car", None, 10_000),
        ("hexworld", None, 10_000),
        ("hexworld", 20_000, 20_000),
        ("catch", None, 10),
        ("catch", 3, 3),
    ],
)
def test_the_turn_limit_is_that_of_the_caller_or_the_problem(
    name: str, turns: int | None, limit: int
) -> None:
    assert TurnLimit.from_option(load_problem(name), turns).steps == limit


@pytest.mark.parametrize(
    ("name", "turns", "is_terminated"),
    [
        ("catch", None, True),
        ("catch", 10, False),
        ("crying-baby", None, False),
        ("rock-paper-scissors", None, True),
        (dmplay.load_problem("prisoners-dilemma", discount=0.9), None, False),
    ],
)
def test_the_horizon_terminates_only_as_a_rule_of_the_problem(
    name: str | Problem, turns: int | None, is_terminated: bool
) -> None:
    env, envs, zoo = Env(name, turns=turns), VectorEnv(name, 2, turns=turns), ParallelEnv(name)
    _, info = env.reset(seed=1)
    _, batch_info = envs.reset(seed=1)
    assert batch_info["turns_left"].tolist() == [info["turns_left"]] * 2
    while True:
        turns_left = info["turns_left"]
        *_, terminated, truncated, info = env.step(0)
        *_, row_terminated, row_truncated, batch_info = envs.step(np.zeros(2, int))
        assert [*row_terminated] == [terminated] * 2
        assert [*row_truncated] == [truncated] * 2
        assert info["turns_left"] == batch_info["turns_left"][0] == turns_left - 1
        if terminated or truncated:
            break
    assert (terminated, truncated) == (is_terminated, not is_terminated)
    assert info["turns_left"] == 0
    if turns is None:
        zoo.reset(seed=1)
        while zoo.agents:
            *_, terminations, truncations, _ = zoo.step(dict.fromkeys(zoo.agents, 0))
        assert {*terminations.values()} == {is_terminated}
        assert {*truncations.values()} == {not is_terminated}


def test_the_guide_lists_the_horizon_of_every_problem() -> None:
    rows = re.findall(r"^\| ([\w-]+) \| (\d+|none)( rule)? \|$", read_topic("python"), re.M)
    expected = list[tuple[str, str, str]]()
    for name in problem_names():
        problem = dmplay.load_problem(name)
        rule = " rule" if problem.is_finite_horizon else ""
        expected.append((name, str(problem.horizon or "none"), rule))
    assert rows == expected


@pytest.mark.parametrize("turns", [-1, 2.5, "3"])
@pytest.mark.parametrize("environment", [Env, VectorEnv])
def test_an_invalid_turn_limit_of_an_environment_is_refused(
    environment: type, turns: object
) -> None:
    expected = f"^turns: got {turns!r}, expected a whole number, 0 or more$"
    with pytest.raises(BadParameter, match=expected):
        environment("2048", turns=turns)


@pytest.mark.parametrize("environment", [Env, VectorEnv])
def test_a_game_of_text_has_no_environment(environment: type) -> None:
    pytest.importorskip("pyspiel")
    with pytest.raises(BadParameter, match=r"^the observation is text, which has no Gymnasium spa"):
        environment("openspiel:tic_tac_toe", others="random")


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        ([0, 1, 9], "step: got action 9, expected 0 to 5"),
        ([0, -1, 1], "step: got action -1, expected 0 to 5"),
        ([0, 0.5, 1], "step: got action 0.5, expected 0 to 5"),
        (["e", "w", "e"], "step: got action e, expected 0 to 5"),
        ([0, 1], "step: got shape (2,), expected 3 actions"),
        (0, "step: got shape (), expected 3 actions"),
    ],
)
def test_an_invalid_action_is_refused_and_no_game_advances(actions: object, message: str) -> None:
    envs = VectorEnv("hexworld", 3)
    envs.reset(seed=SEED)
    with pytest.raises(IllegalAction) as error:
        envs.step(np.asarray(actions))
    assert str(error.value) == message
    observations, *_ = envs.step(np.array([0, 1.0, 2]))
    envs.reset(seed=SEED)
    np.testing.assert_array_equal(envs.step(np.array([0, 1, 2]))[0], observations)


def test_a_finished_game_restarts_whatever_its_action() -> None:
    envs = VectorEnv("rock-paper-scissors", ENV_COUNT, turns=1)
    envs.reset(seed=SEED)
    *_, truncated, _ = envs.step(np.zeros(ENV_COUNT, int))
    assert truncated.all()
    observations, rewards, *_, truncated, _ = envs.step(np.array([-1, 99, None]))
    assert [observations.any(), rewards.any(), truncated.any()] == [False] * 3
    with pytest.raises(IllegalAction):
        envs.step(np.array([0, 99, 0]))


def test_a_continuous_action_must_be_a_single_number() -> None:
    env = Env("simple-regulator")
    env.reset(seed=SEED)
    observation, *_ = env.step(0.5)
    env.reset(seed=SEED)
    np.testing.assert_array_equal(env.step([0.5])[0], observation)
    with pytest.raises(IllegalAction, match="step: got 2 numbers, expected 1"):
        env.step([1, 2])


def test_gymnasium_make_creates_an_environment_that_renders_its_board() -> None:
    env = gymnasium.make("dmplay.gym:dmplay/HexworldStraightLine-v0", render_mode="ansi")
    env.reset(seed=1)
    board = env.render()
    assert isinstance(board, str)
    assert "@" in board
    envs = gymnasium.make_vec(
        "dmplay/CryingBaby-v0", num_envs=2, vectorization_mode="vector_entry_point"
    )
    assert envs.reset(seed=1)[0].tolist() == [2, 2]


def test_the_board_is_rendered_as_pixels_of_one_size() -> None:
    pytest.importorskip("matplotlib")

    env = gymnasium.make("dmplay/CartPole-v0", render_mode="rgb_array")
    env.reset(seed=1)
    first: Any = env.render()
    env.step(0)
    second: Any = env.render()
    assert first.shape == second.shape == (480, 800, 3)
    assert first.dtype == np.uint8
    assert first.min() < 128
    assert not np.array_equal(first, second)
    zoo = ParallelEnv("catch", render_mode="rgb_array")
    zoo.reset(seed=1)
    pixels: Any = zoo.render()
    assert pixels.shape == first.shape


def test_invalid_options_and_a_missing_reset_raise_bad_parameter() -> None:
    with pytest.raises(BadParameter, match="uniforms: got 'slow', expected recorded or fast"):
        VectorEnv("hexworld", uniforms="slow")
    for env in (Env("hexworld"), VectorEnv("hexworld")):
        with pytest.raises(BadParameter, match="call reset first"):
            env.step(np.array([0]))


EVERY_ENVIRONMENT = [Env, VectorEnv, ParallelEnv]


@pytest.mark.parametrize("environment", EVERY_ENVIRONMENT)
@pytest.mark.parametrize("method", ["step", "render", "action_masks"])
def test_a_call_before_reset_is_named_in_the_error(environment: type, method: str) -> None:
    env = environment("hexworld")
    arguments = [np.array([0])] if method == "step" else []
    with pytest.raises(BadParameter, match=f"^{method}: no game has started; call reset first$"):
        getattr(env, method)(*arguments)


@pytest.mark.parametrize("environment", [Env, ParallelEnv])
@pytest.mark.parametrize("mode", ["bogus", "human", 1, np.array([1, 2])])
def test_an_unknown_render_mode_is_refused(environment: type, mode: object) -> None:
    with pytest.raises(BadParameter, match=r"^render_mode: got .*, expected 'ansi', 'rgb"):
        environment("hexworld", render_mode=mode)


@pytest.mark.parametrize("count", [-1, 0, 1.5, "3", None, 10**20])
def test_a_wrong_number_of_environments_is_refused(count: object) -> None:
    expected = re.escape(f"num_envs: got {count!r}, expected a whole number from 1 to ")
    with pytest.raises(BadParameter, match=expected):
        VectorEnv("hexworld", count)  # type: ignore[arg-type]


@pytest.mark.parametrize("environment", EVERY_ENVIRONMENT)
def test_wrong_seeds_and_options_of_a_reset_are_refused(environment: type) -> None:
    env = environment("hexworld")
    for seed in (-1, "x", 1.5, [1.5], np.array(["x"]), {}, object()):
        with pytest.raises(BadParameter, match=r"^seed: got "):
            env.reset(seed=seed)
    wrong_options: list[object] = [[], "episode", 5]
    for options in wrong_options:
        with pytest.raises(BadParameter, match=r"^options: got .*, expected a dict with '"):
            env.reset(options=options)


@pytest.mark.parametrize("environment", EVERY_ENVIRONMENT)
def test_unknown_options_are_ignored_only_where_pettingzoo_sends_them(environment: type) -> None:
    env = environment("hexworld")
    if environment is ParallelEnv:
        ignored, _ = env.reset(seed=0, options={"options": 1})
        assert ignored == env.reset(seed=0)[0]
        return
    for key in ("episodes", "options", 1):
        with pytest.raises(UnknownName, match=rf"^unknown option of reset '{key}'; "):
            env.reset(seed=0, options={key: 1})


@pytest.mark.parametrize("environment", [Env, ParallelEnv])
def test_a_refused_reset_leaves_the_game_and_its_seed_as_they_are(environment: type) -> None:
    env, expected = environment("hexworld"), environment("hexworld")
    for game_env in (env, expected):
        game_env.reset(seed=5)
    session = env.session
    for options in ({"episode": -1}, {"episode": "x"}):
        with pytest.raises(BadParameter, match=r"^episode: got .*, expected a whole number"):
            env.reset(seed=8, options=options)
    assert env.session is session
    assert env.reset()[0] == expected.reset()[0]


@pytest.mark.parametrize("make_seeds", [list, tuple, np.array])
def test_each_row_plays_the_episodes_of_its_own_seed(make_seeds: Callable[..., Any]) -> None:
    for name in ("hexworld", "crying-baby", "cart-pole", "predator-prey"):
        problem = load_small_problem(name)
        envs, seeds = VectorEnv(problem, ENV_COUNT, turns=3), [4, 10**20, 4]
        if make_seeds is np.array:
            seeds = [4, 7, 4]
        singles = [Env(problem, turns=3) for _ in seeds]
        observations, info = envs.reset(seed=make_seeds(seeds))
        expected = [single.reset(seed=seed) for single, seed in zip(singles, seeds, strict=True)]
        assert np.array_equal(observations, np.stack([start for start, _ in expected]))
        over: Bools = np.zeros(ENV_COUNT, bool)
        for _ in range(12):  # some games after the first
            actions = choose_first_action(problem, 0, info.get("action_mask"))
            observations, rewards, terminated, truncated, info = envs.step(actions)
            for row, single in enumerate(singles):
                if over[row]:
                    assert np.array_equal(observations[row], single.reset()[0])
                else:
                    step = single.step(actions[row])
                    assert np.array_equal(observations[row], step[0])
                    assert (rewards[row], terminated[row], truncated[row]) == step[1:4]
            over = terminated | truncated


def test_a_row_without_a_seed_continues_with_its_last_one() -> None:
    envs, single = VectorEnv("hexworld", 2), Env("hexworld")
    envs.reset(seed=[3, 4])
    observations, _ = envs.reset(seed=[None, 9])
    single.reset(seed=3)
    assert observations.tolist() == [single.reset()[0], single.reset(seed=9)[0]]


def test_a_reset_mask_restarts_only_the_rows_that_it_marks() -> None:
    envs, single = VectorEnv("2048", 3, turns=2), Env("2048", turns=2)
    initial, _ = envs.reset(seed=[1, 2, 3])
    for _ in range(2):
        last, *_, truncated, _ = envs.step(np.array([3, 3, 3]))
    assert truncated.all()
    options = {"reset_mask": np.array([True, False, True])}
    observations, info = envs.reset(seed=[5, 6, None], options=options)
    assert [*options] == ["reset_mask"]
    assert np.array_equal(observations[0], single.reset(seed=5)[0])
    assert np.array_equal(info["action_mask"][0], single.reset(seed=5)[1]["action_mask"])
    assert np.array_equal(observations[1], last[1])
    assert np.array_equal(observations[2], single.reset(seed=3, options={"episode": 1})[0])
    observations, rewards, *_, truncated, _ = envs.step(np.array([3, 3, 3]))
    single.reset(seed=5)
    assert np.array_equal(observations[0], single.step(3)[0])
    assert truncated.tolist() == [False, False, False]  # row 1 began its next game
    assert rewards[1] == 0.0
    assert np.array_equal(observations[1], single.reset(seed=2, options={"episode": 1})[0])
    observations, _ = envs.reset(seed=8, options={"reset_mask": np.array([False, True, False])})
    assert np.array_equal(observations[1], single.reset(seed=8, options={"episode": 1})[0])
    assert not np.array_equal(observations[1], initial[1])


@pytest.mark.parametrize(
    "mask",
    [[True, False], np.array([1, 0]), np.array([True]), np.zeros(2, bool), None, "x",
     np.ones((2, 1), bool)],
)  # fmt: skip
def test_a_wrong_reset_mask_is_refused(mask: object) -> None:
    envs = VectorEnv("hexworld", 2)
    envs.reset(seed=1)
    expected = r"^reset_mask: got .*, expected a NumPy array of 2 booleans, at least one of them"
    with pytest.raises(BadParameter, match=re.compile(expected, re.DOTALL)):
        envs.reset(options={"reset_mask": mask})


def test_seeds_of_rows_and_masks_need_what_they_refer_to() -> None:
    envs = VectorEnv("hexworld", 2)
    with pytest.raises(BadParameter, match=r"^reset_mask: no game has started; call reset first"):
        envs.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(BadParameter, match=r"^seed: got 3 seeds, expected 2$"):
        envs.reset(seed=[1, 2, 3])
    with pytest.raises(BadParameter, match=r"expected one seed for all rows"):
        VectorEnv("hexworld", 2, uniforms="fast").reset(seed=[1, 2])


@pytest.mark.parametrize("name", ["hexworld", "simple-regulator"])
@pytest.mark.parametrize(
    "action", [None, "e", [[0], [1, 2]], {}, 1j, float("nan"), [0.5, 1], 10**30]
)
def test_a_step_with_nonsense_is_one_kind_of_error(name: str, action: object) -> None:
    env, zoo, envs = Env(name), ParallelEnv(name), VectorEnv(name, 2)
    for game_env in (env, zoo, envs):
        game_env.reset(seed=1)
    for step in (
        lambda: env.step(action),
        lambda: zoo.step({"agent": action}),
        lambda: envs.step([action, action]),  # type: ignore[arg-type]
    ):
        with pytest.raises(IllegalAction, match=r"^step: got "):
            step()
    with pytest.raises(IllegalAction, match=r"^step: got 5, expected a dict with an action"):
        zoo.step(5)  # type: ignore[arg-type]


def test_stable_baselines3_gets_terminal_observations_of_the_same_games() -> None:
    if not importlib.util.find_spec("stable_baselines3"):
        with pytest.raises(BadParameter, match=r"^sb3_vec_env: needs Stable-Baselines3: pip "):
            sb3_vec_env("hexworld", 2)
        return
    games = sb3_vec_env("hexworld", 2, turns=3)
    singles = [Env("hexworld", turns=3) for _ in range(2)]
    games.seed(SEED)
    observations = games.reset()
    for row, single in enumerate(singles):
        assert single.reset(seed=SEED, options={"episode": row})[0] == observations[row]
    episodes = [0, 1]
    for _ in range(20):
        observations, rewards, done, infos = games.step(np.array([0, 1]))
        for row, single in enumerate(singles):
            last, reward, terminated, truncated, _ = single.step(row)
            assert (reward, terminated or truncated) == (rewards[row], done[row])
            if done[row]:
                assert infos[row]["terminal_observation"] == last
                assert infos[row]["TimeLimit.truncated"] == truncated
                episodes[row] += 2
                last, _ = single.reset(seed=SEED, options={"episode": episodes[row]})
            assert observations[row] == last
    masks = games.env_method("action_masks")
    assert np.shape(masks) == (2, 6)


def check_every_seat(problem: Problem) -> None:
    """Run Gymnasium's environment check on every seat."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # warnings about unbounded spaces
        for agent in problem.agents:
            check_env(Env(problem, seat=agent, turns=SHORT_GAME_TURNS), skip_render_check=True)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASE_NAMES)
def test_every_seat_passes_gymnasiums_check(name: str) -> None:
    check_every_seat(load_small_problem(name))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*infinity:UserWarning")  # unbounded spaces
def test_registered_environments_pass_the_check_with_rendering() -> None:
    env_names = [name for name in gymnasium.registry if name.startswith("dmplay/")]
    assert len(env_names) == len(CASE_NAMES)
    for name in ("dmplay/Hexworld-v0", "dmplay/CryingBaby-v0", "dmplay/CartPole-v0"):
        check_env(gymnasium.make(name, turns=SHORT_GAME_TURNS).unwrapped)


def test_problems_from_files_pass_the_check_and_equal_rollouts(tmp_path: Path) -> None:
    for name, text in {
        "tiger.pomdp": TIGER_TEXT,
        "team.dpomdp": TEAM_TEXT,
        "ballet.nfg": BALLET_TEXT,
    }.items():
        problem = dmplay.load_problem(write_text_file(tmp_path, name, text))
        check_every_seat(problem)
        for seat in range(len(problem.agents)):
            check_episodes_equal_rollout(problem, seat)

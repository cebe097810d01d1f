"""The problems in Gymnasium's loop: its own checks pass, and the games are those of rollouts."""

import warnings
from dataclasses import dataclass
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import dmplay
from dmplay.chance import Array, Bools, Reals
from dmplay.core import Interval, Memory, Problem
from dmplay.errors import BadParameter, IllegalAction
from dmplay.finding import agents
from dmplay.gym import Env, VectorEnv
from dmplay.policies.kinds import ReactivePolicy
from dmplay.rollouts import Rollout, rollout
from tests.files.sources import BALLET, TEAM, TIGER, kept
from tests.support.cases import CASES, SOME, load, small

ROWS, SEED = 3, 7


@dataclass(frozen=True)
class First(ReactivePolicy):
    """Takes the first legal action, or the least."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        able = np.zeros(len(u), int) if legal is None else legal.argmax(axis=1)
        known = self.problem.actions[self.seat]
        return np.full(len(u), known.low) if isinstance(known, Interval) else able


def rolled(problem: Problem, seat: int, episodes: int) -> Rollout:
    """The games of somebody who takes the first action, among the usual others."""
    partners = [agents.load_roster(problem, i).default_partner for i in range(len(problem.agents))]
    policies = [dmplay.load_agent(problem, i, name) for i, name in enumerate(partners)]
    policies[seat] = First(problem, seat)
    return rollout(problem, policies, episodes=episodes, turn_limit=SOME, seed=SEED)


def first(problem: Problem, seat: int, mask: Array | None) -> Array:
    """The same action as a value of the space, for each row of the masks."""
    known = problem.actions[seat]
    if isinstance(known, Interval):
        return np.full((ROWS, 1), known.low)
    assert mask is not None
    return np.asarray(mask.argmax(axis=1))


def seats() -> list[tuple[str, int]]:
    """Every seat of every problem."""
    return [(name, seat) for name in CASES for seat in range(len(load(name).agents))]


def plays_rows(problem: Problem, seat: int) -> None:
    """The episodes of a seat are rows of a rollout."""
    env = Env(problem, seat=problem.agents[seat], turns=SOME)
    wanted = rolled(problem, seat, ROWS)
    for episode in range(ROWS):
        _, info = env.reset(seed=SEED if not episode else None)
        total, weight, over, turns = 0.0, 1.0, False, 0
        while not over:
            mask = info.get("action_mask")
            action = first(problem, seat, None if mask is None else mask[None])[0]
            _, reward, terminated, truncated, info = env.step(action)
            over, turns = terminated or truncated, turns + 1
            total, weight = total + weight * reward, weight * problem.discount
        got = (total, turns, terminated)
        told = (
            wanted.returns[episode, seat],
            wanted.turn_counts[episode],
            wanted.terminated[episode],
        )
        assert got == told, (problem, seat, episode)


def test_episodes_are_rows_of_a_rollout_to_the_last_bit() -> None:
    for name, seat in seats():
        plays_rows(small(name), seat)


def test_the_games_of_rows_are_those_of_a_rollout_one_after_another() -> None:
    for name, seat in seats():
        problem = small(name)
        rows = VectorEnv(problem, ROWS, seat=problem.agents[seat], turns=SOME)
        wanted = rolled(problem, seat, 2 * ROWS).returns[:, seat].reshape(2, ROWS)
        found: list[list[float]] = [[0.0] for _ in range(ROWS)]
        weights: Reals = np.ones(ROWS)
        begins: Bools = np.zeros(ROWS, bool)
        _, info = rows.reset(seed=SEED)
        while min(map(len, found)) < 3:
            action = first(problem, seat, info.get("action_mask"))
            _, rewards, terminated, truncated, info = rows.step(action)
            weights[begins] = 1.0
            for row in range(ROWS):
                found[row][-1] += weights[row] * rewards[row]
            weights *= np.where(begins, 1.0, problem.discount)
            begins = terminated | truncated
            for row in np.flatnonzero(begins).tolist():
                found[row].append(0.0)
        assert np.array_equal([games[:2] for games in found], wanted.T), (name, seat)


def test_what_is_seen_is_in_the_space_from_the_first() -> None:
    for name in CASES:
        problem = small(name)
        env = Env(problem, turns=2)
        rows = VectorEnv(problem, ROWS, turns=2, uniforms="fast", others="random")
        seen, info = rows.reset(seed=SEED)
        for _ in range(4):
            assert rows.observation_space.contains(seen), name
            seen, _, _, _, info = rows.step(first(problem, 0, info.get("action_mask")))
        assert env.observation_space.contains(env.reset(seed=SEED)[0])


def test_a_move_that_is_not_legal_changes_nothing_and_no_turn_passes() -> None:
    env, rows = Env("2048"), VectorEnv("2048", 2)
    before, info = env.reset(seed=5)
    (stuck,) = np.flatnonzero(info["action_mask"] == 0)
    after, reward, terminated, truncated, again = env.step(stuck)
    assert (reward, terminated, truncated) == (0.0, False, False)
    assert np.array_equal(before, after)
    assert np.array_equal(info["action_mask"], again["action_mask"])
    first, _ = rows.reset(seed=5)
    able = np.flatnonzero(info["action_mask"])[0]
    held, *_ = rows.step(np.array([stuck, 3]))
    assert np.array_equal(held[0], before)
    assert not np.array_equal(held[1], first[1])
    moved, *_ = rows.step(np.array([able, 3]))
    assert np.array_equal(moved[0], env.step(able)[0])  # by the dice of turn 1


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
def test_what_is_no_action_is_refused_and_no_row_moves(actions: object, message: str) -> None:
    rows = VectorEnv("hexworld", 3)
    rows.reset(seed=SEED)
    with pytest.raises(IllegalAction) as refused:
        rows.step(np.asarray(actions))
    assert str(refused.value) == message
    seen, *_ = rows.step(np.array([0, 1.0, 2]))
    rows.reset(seed=SEED)
    np.testing.assert_array_equal(rows.step(np.array([0, 1, 2]))[0], seen)


def test_a_row_that_is_over_begins_anew_whatever_its_action() -> None:
    rows = VectorEnv("rock-paper-scissors", ROWS, turns=1)
    rows.reset(seed=SEED)
    *_, truncated, _ = rows.step(np.zeros(ROWS, int))
    assert truncated.all()
    seen, rewards, *_, truncated, _ = rows.step(np.array([-1, 99, None]))
    assert [seen.any(), rewards.any(), truncated.any()] == [False] * 3
    with pytest.raises(IllegalAction):
        rows.step(np.array([0, 99, 0]))


def test_a_number_is_one_number() -> None:
    env = Env("simple-regulator")
    env.reset(seed=SEED)
    seen, *_ = env.step(0.5)
    env.reset(seed=SEED)
    np.testing.assert_array_equal(env.step([0.5])[0], seen)
    with pytest.raises(IllegalAction, match="step: got 2 numbers, expected one"):
        env.step([1, 2])


def test_an_environment_is_made_by_name_and_draws_its_board() -> None:
    made = gymnasium.make("dmplay.gym:dmplay/HexworldStraightLine-v0", render_mode="ansi")
    made.reset(seed=1)
    drawn = made.render()
    assert isinstance(drawn, str)
    assert "@" in drawn
    rows = gymnasium.make_vec(
        "dmplay/CryingBaby-v0", num_envs=2, vectorization_mode="vector_entry_point"
    )
    assert rows.reset(seed=1)[0].tolist() == [2, 2]


def test_what_cannot_be_is_said() -> None:
    with pytest.raises(BadParameter, match="dice: got 'slow', expected recorded or fast"):
        VectorEnv("hexworld", uniforms="slow")
    for env in (Env("hexworld"), VectorEnv("hexworld")):
        with pytest.raises(BadParameter, match="call reset first"):
            env.step(np.array([0]))


def checked(problem: Problem) -> None:
    """Every seat passes Gymnasium's check."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of spaces without bounds
        for agent in problem.agents:
            check_env(Env(problem, seat=agent, turns=SOME), skip_render_check=True)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_every_seat_passes_gymnasiums_check(name: str) -> None:
    checked(small(name))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*infinity:UserWarning")  # of spaces without bounds
def test_what_is_registered_passes_the_check_with_its_drawings() -> None:
    made = [name for name in gymnasium.registry if name.startswith("dmplay/")]
    assert len(made) == len(CASES)
    for name in ("dmplay/Hexworld-v0", "dmplay/CryingBaby-v0", "dmplay/CartPole-v0"):
        check_env(gymnasium.make(name, turns=SOME).unwrapped)


def test_every_seat_of_a_problem_of_a_file_passes_the_check_and_plays_rows_of_a_rollout(
    tmp_path: Path,
) -> None:
    for name, text in {"tiger.pomdp": TIGER, "team.dpomdp": TEAM, "ballet.nfg": BALLET}.items():
        problem = dmplay.load_problem(kept(tmp_path, name, text))
        checked(problem)
        for seat in range(len(problem.agents)):
            plays_rows(problem, seat)

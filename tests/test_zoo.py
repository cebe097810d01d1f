"""Tests of the PettingZoo environments: PettingZoo's own checks, and equality with sessions."""

import warnings
from functools import partial
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="needs the extra gymnasium")
pytest.importorskip("pettingzoo", reason="needs the extra pettingzoo")

import dmplay
from dmplay.core.spaces import Interval
from dmplay.errors import BadParameter, IllegalAction
from dmplay.zoo import ParallelEnv
from dmplay.zoo import env as make_turn_based
from tests.formats.sources import BALLET_TEXT, TEAM_TEXT, write_text_file
from tests.support.problem_cases import CASE_NAMES, SHORT_GAME_TURNS, load_problem
from tests.support.turn_based_games import Nim

pytestmark = pytest.mark.extra("gymnasium", "pettingzoo")

CYCLE_COUNT = 30


def test_an_environment_plays_the_same_game_as_a_session() -> None:
    for name in CASE_NAMES:
        problem = load_problem(name)
        env = ParallelEnv(name, turns=SHORT_GAME_TURNS)
        game = dmplay.Session(problem, dmplay.SeededUniforms(7), turn_limit=SHORT_GAME_TURNS)
        env.reset(seed=7)
        while not game.over:
            masks = [game.legal_actions_mask(seat) for seat in range(len(problem.agents))]
            joint: list[float]
            joint = [space.candidate_actions()[0] if mask is None else int(mask.argmax())
                     for space, mask in zip(problem.actions, masks, strict=True)]  # fmt: skip
            actions = {
                agent: np.array([a]) if isinstance(space, Interval) else np.int64(a)
                for agent, space, a in zip(problem.agents, problem.actions, joint, strict=True)
            }
            observations, rewards, terminated, truncated, _ = env.step(actions)
            turn = game.advance([*joint])
            assert [*rewards.values()] == turn.rewards.tolist(), name
            assert {*terminated.values()} == {game.end_reason == "terminal"}
            assert {*truncated.values()} == {game.end_reason in ("horizon", "turn limit")}
            for agent, observation in observations.items():
                assert env.observation_space(agent).contains(observation), name
        assert env.agents == []
        assert env.step({}) == ({}, {}, {}, {}, {})


def test_an_illegal_action_uses_no_turn() -> None:
    env = ParallelEnv("2048")
    before, infos = env.reset(seed=5)
    (illegal_action,) = np.flatnonzero(infos["agent"]["action_mask"] == 0)
    after, rewards, *_ = env.step({"agent": illegal_action})
    assert np.array_equal(before["agent"], after["agent"])
    assert rewards == {"agent": 0.0}


@pytest.mark.parametrize(
    ("illegal", "steps"),
    [
        ("noop", [(0.0, False, False), (0.0, False, True)]),
        ("penalty", [(-5.0, False, False), (-5.0, False, True)]),
        ("end", [(-5.0, True, False)]),
    ],
)
def test_an_episode_of_illegal_actions_only_ends(
    illegal: str, steps: list[tuple[float, bool, bool]]
) -> None:
    env = ParallelEnv("2048", turns=2, illegal=illegal, illegal_reward=-5.0)
    env.reset(seed=5)
    assert env.action_masks()["agent"].tolist() == [True, False, True, True]
    for step in steps:
        assert env.agents == ["agent"]
        assert tuple(by_agent["agent"] for by_agent in env.step({"agent": 1})[1:4]) == step
    assert env.agents == []
    env.reset()
    assert env.agents == ["agent"]


def test_only_the_agent_that_acts_illegally_is_penalized() -> None:
    env = ParallelEnv(Nim(), illegal="penalty", turns=5)
    env.reset(seed=5)
    rewards = env.step({"left": 2, "right": 2})[1]  # left has to move and may not wait
    assert rewards == {"left": -1.0, "right": 0.0}


def test_a_step_without_an_action_for_every_agent_is_refused() -> None:
    env = ParallelEnv("rock-paper-scissors")
    env.reset(seed=5)
    with pytest.raises(
        IllegalAction, match=r"^step: got no action for agent2, expected one for each agent$"
    ):
        env.step({"agent1": 0})
    assert env.session is not None
    assert not env.session.turns


def test_illegal_actions_without_a_turn_limit_end_after_10000_steps() -> None:
    env = ParallelEnv("2048")
    env.reset(seed=5)
    steps, truncated = 0, {"agent": False}
    while env.agents:
        truncated = env.step({"agent": 1})[3]  # slides no tile
        steps += 1
    assert (steps, truncated) == (10_000, {"agent": True})


def test_a_game_of_text_has_no_environment() -> None:
    pytest.importorskip("pyspiel")
    with pytest.raises(BadParameter, match=r"^the observation is text, which has no Gymnasium spa"):
        ParallelEnv("openspiel:tic_tac_toe")


def test_agents_act_one_after_another_in_an_aec_environment() -> None:
    turn_based, parallel = (
        make_turn_based("prisoners-dilemma", turns=2),
        ParallelEnv("prisoners-dilemma"),
    )
    turn_based.reset(seed=3)
    parallel.reset(seed=3)
    for action in (0, 1):
        turn_based.step(action)
    expected = parallel.step({"agent1": 0, "agent2": 1})
    assert turn_based.rewards == expected[1]
    assert turn_based.last()[0].tolist() == expected[0]["agent1"].tolist()
    for action in (0, 1):
        turn_based.step(action)
    assert turn_based.truncations == {"agent1": True, "agent2": True}


def test_the_state_of_an_environment_may_be_hidden_from_agents() -> None:
    parallel = ParallelEnv("crying-baby")
    with pytest.raises(BadParameter, match=r"^state: no game has started; call reset first$"):
        parallel.state()
    for seed in range(4):
        parallel.reset(seed=seed)
        assert parallel.session is not None
        assert parallel.state() == parallel.session.state
        assert parallel.state_space.contains(parallel.state())
    hunt = make_turn_based("predator-prey")
    hunt.reset(seed=3)
    assert hunt.state_space.contains(hunt.state())


def test_render_before_reset_is_refused() -> None:
    with pytest.raises(BadParameter, match="call reset first"):
        ParallelEnv("catch", render_mode="ansi").render()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:The old environment creation API:DeprecationWarning")
def test_every_problem_passes_pettingzoos_checks(tmp_path: Path) -> None:
    # these modules warn about their own imports
    from pettingzoo.test import api_test, parallel_api_test
    from pettingzoo.utils.conversions import parallel_to_aec

    with warnings.catch_warnings():
        # about observations that are not images, and about its imports
        warnings.simplefilter("ignore")
        from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test
        from pettingzoo.utils.conversions import parallel_to_aec

        files = [
            write_text_file(tmp_path, "team.dpomdp", TEAM_TEXT),
            write_text_file(tmp_path, "ballet.nfg", BALLET_TEXT),
        ]
        for name in [*CASE_NAMES, *files]:
            parallel_api_test(ParallelEnv(name), CYCLE_COUNT)
            parallel_seed_test(partial(ParallelEnv, name), CYCLE_COUNT)
            api_test(parallel_to_aec(ParallelEnv(name)), CYCLE_COUNT)

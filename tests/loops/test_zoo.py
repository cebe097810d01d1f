"""The problems in PettingZoo's loop: its own checks pass, and the games are those of sessions."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.core import Interval
from dmplay.errors import BadParameter, IllegalAction
from dmplay.zoo import ParallelEnv
from tests.files.sources import BALLET, TEAM, kept
from tests.support.cases import CASES, SOME, load

CYCLES = 30


def test_its_games_are_those_of_a_session() -> None:
    for name in CASES:
        problem = load(name)
        env = ParallelEnv(name, turns=SOME)
        game = dmplay.Session(problem, dmplay.SeededUniforms(7), turn_limit=SOME)
        env.reset(seed=7)
        while not game.over:
            able = [game.legal_actions_mask(seat) for seat in range(len(problem.agents))]
            joint: list[float]
            joint = [known.candidate_actions()[0] if legal is None else int(legal.argmax())
                     for known, legal in zip(problem.actions, able, strict=True)]  # fmt: skip
            told = {
                agent: np.array([a]) if isinstance(known, Interval) else np.int64(a)
                for agent, known, a in zip(problem.agents, problem.actions, joint, strict=True)
            }
            seen, rewards, terminated, truncated, _ = env.step(told)
            turn = game.advance([*joint])
            assert [*rewards.values()] == turn.rewards.tolist(), name
            assert {*terminated.values()} == {game.end_reason == "terminal"}
            assert {*truncated.values()} == {game.end_reason in ("horizon", "turn limit")}
            for agent, one in seen.items():
                assert env.observation_space(agent).contains(one), name
        assert env.agents == []
        assert env.step({}) == ({}, {}, {}, {}, {})


def test_where_one_move_is_not_legal_no_turn_passes() -> None:
    env = ParallelEnv("2048")
    before, infos = env.reset(seed=5)
    (stuck,) = np.flatnonzero(infos["agent"]["action_mask"] == 0)
    after, rewards, *_ = env.step({"agent": stuck})
    assert np.array_equal(before["agent"], after["agent"])
    assert rewards == {"agent": 0.0}


def test_every_agent_has_an_action_or_no_turn_passes() -> None:
    env = ParallelEnv("rock-paper-scissors")
    env.reset(seed=5)
    with pytest.raises(IllegalAction, match=r"^step: no action of agent2; expected one of each$"):
        env.step({"agent1": 0})
    assert env.session is not None
    assert not env.session.turns


def test_a_game_is_begun_before_a_turn() -> None:
    with pytest.raises(BadParameter, match="call reset first"):
        ParallelEnv("catch", render_mode="ansi").render()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:The old environment creation API:DeprecationWarning")
def test_every_problem_passes_pettingzoos_checks(tmp_path: Path) -> None:
    from pettingzoo.test import api_test, parallel_api_test  # which warn of their own imports
    from pettingzoo.utils.conversions import parallel_to_aec

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of observations that are no images, and its own imports
        from pettingzoo.test import api_test, parallel_api_test
        from pettingzoo.utils.conversions import parallel_to_aec

        files = [kept(tmp_path, "team.dpomdp", TEAM), kept(tmp_path, "ballet.nfg", BALLET)]
        for name in [*CASES, *files]:
            parallel_api_test(ParallelEnv(name), CYCLES)
            api_test(parallel_to_aec(ParallelEnv(name)), CYCLES)

"""Tests of ManualGame: play from Python with labels and numbers, without hidden information."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.errors import BadPolicy, DmplayError, EpisodeOver, UnknownName


def test_a_python_caller_plays_with_labels() -> None:
    game = dmplay.play("crying-baby", seed=7, turns=3)
    assert game.legal_actions() == ["feed", "sing", "ignore"]
    assert game._repr_html_() == game.session._repr_html_()
    assert game.last_observation() is None
    result = game.act("ignore")
    assert result == {"action": "ignore", "observation": "crying"}
    assert (game.last_observation(), game.last_percept("agent")) == ("crying", result)
    assert game.returns == {}
    game.undo()
    assert game.act("ignore") == result
    game.act("feed")
    game.act("feed")
    assert game.over
    assert game.returns == {"agent": float(game.session.returns()[0])}
    with pytest.raises(EpisodeOver):
        game.act("feed")


def test_agents_play_the_other_seats() -> None:
    game = dmplay.play("prisoners-dilemma", [None, "tit-for-tat"], seed=7)
    game.act("defect")
    assert game.act("cooperate")["actions"] == {"agent1": "cooperate", "agent2": "defect"}
    walk = dmplay.play("hexworld", ["optimal"], seed=7)
    while not walk.over:
        walk.act()
    batch = dmplay.rollout(
        walk.session.problem,
        [dmplay.load_agent(walk.session.problem, 0, "optimal")],
        episodes=1,
        seed=7,
    )
    assert walk.returns["agent"] == batch.returns[0, 0]


def test_interval_actions_are_numbers() -> None:
    game = dmplay.play("simple-regulator", seed=7)
    bounds = game.legal_actions()
    assert isinstance(bounds, dict)
    assert game.act(bounds["low"])["action"] == bounds["low"]


HEXWORLD = dmplay.load_problem("hexworld")
WALKER = dmplay.load_agent(HEXWORLD, 0, "random")
PROBLEM_NAME: Any = "hexworld"  # a name where an object is expected
NON_INTEGER: Any = 2.5
WRONG_TYPE: Any = object
HEXWORLD_OBJECT: Any = HEXWORLD  # a problem where a name is expected
HEXWORLD_CLASS: Any = type(HEXWORLD)
DILEMMA = dmplay.load_problem("prisoners-dilemma")
AGENT_NAMES: Any = ["grim", "random"]  # names where policies are expected


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: dmplay.rollout(PROBLEM_NAME, [WALKER], episodes=1),
         "got 'hexworld', expected a problem"),
        (lambda: dmplay.Session(PROBLEM_NAME, dmplay.SeededUniforms(1)),
         "got 'hexworld', expected a problem, such as dmplay.load_problem(NAME)"),
        (lambda: dmplay.run(PROBLEM_NAME, [WALKER]),
         "got 'hexworld', expected a problem, such as dmplay.load_problem(NAME)"),
        (lambda: dmplay.load_agent(PROBLEM_NAME, 0, "random"),
         "got 'hexworld', expected a problem"),
        (lambda: dmplay.compare(PROBLEM_NAME, [[WALKER]] * 2),
         "got 'hexworld', expected a problem"),
        (lambda: dmplay.run_tournament(PROBLEM_NAME, {}), "got 'hexworld', expected a problem"),
        (lambda: dmplay.rollout(HEXWORLD, [PROBLEM_NAME], episodes=1),
         "seat 0: got 'hexworld', expected"),
        (lambda: dmplay.Session(HEXWORLD, dmplay.SeededUniforms(1), [PROBLEM_NAME]),
         "seat 0: got 'hexworld', expe"),
        (lambda: dmplay.Session(HEXWORLD, dmplay.SeededUniforms(1), [WALKER] * 2),
         "got 2 policies, exp"),
        (lambda: dmplay.rollout(HEXWORLD, [WALKER], episodes=1, turn_limit=-1),
         "turns: got -1, expect"),
        (lambda: dmplay.Session(HEXWORLD, dmplay.SeededUniforms(1), turn_limit=NON_INTEGER),
         "turns: got 2.5, expec"),
        (lambda: dmplay.rollout(HEXWORLD, [WALKER], episodes=1, turn_limit=PROBLEM_NAME),
         "turns: got 'hexwo"),
        (lambda: dmplay.rollout(HEXWORLD, [WALKER], episodes=1, seed=-1), "seed: got -1, expected"),
        (lambda: dmplay.rollout(HEXWORLD, [WALKER], episodes=1, first_episode=-1),
         "episode: got -1, exp"),
        (lambda: dmplay.play("hexworld", turns=-1), "turns: got -1, expected a whole number, 0 or"),
        (lambda: dmplay.play("hexworld", seed=PROBLEM_NAME),
         "seed: got 'hexworld', expected a whole num"),
        (lambda: dmplay.play("hexworld").last_percept(), "no turn has been played yet"),
        (lambda: dmplay.play("hexworld").session.advance([0, 1]), "got 2 actions, expected one"),
        (lambda: dmplay.compare(HEXWORLD, [[WALKER]] * 2, seat=1), "seat: got 1, expected 0 to 0"),
        (lambda: dmplay.compare(HEXWORLD, []), "got 0 agents, expected at least 2"),
        (lambda: dmplay.load_agent(HEXWORLD, 0, "human"),
         "unknown agent 'human'; expected one of optimal, nea"),
        (lambda: dmplay.load_problem(WRONG_TYPE),
         "got <class 'object'>, expected the name of a problem, or the path of a file"),
        (lambda: dmplay.load_problem(HEXWORLD_OBJECT), "got HexWorld("),
        (lambda: dmplay.load_agent(HEXWORLD, 0, WRONG_TYPE),
         "got <class 'object'>, expected the name of an agent"),
        (lambda: dmplay.check(WRONG_TYPE),
         "got <class 'object'>, expected a problem, such as dmplay.load_problem(NAME)"),
        (lambda: dmplay.check(HEXWORLD_CLASS), "expected a problem, such as HexWorld()"),
        (lambda: dmplay.run_tournament(DILEMMA, AGENT_NAMES),
         "entrants: got ['grim', 'random'], expected a dict from each name to a policy per seat"),
        (lambda: dmplay.run_tournament(DILEMMA, dict.fromkeys(AGENT_NAMES, PROBLEM_NAME)),
         "grim: got 'hexworld', expected a policy for each of agent1, agent2"),
        (lambda: dmplay.run_tournament(DILEMMA, {key: [WALKER] for key in AGENT_NAMES}),
         "grim: got 1 policy, expected a policy for each of agent1, agent2"),
        (
            lambda: dmplay.run_tournament(DILEMMA, dict.fromkeys(AGENT_NAMES, AGENT_NAMES)),
            "grim: seat 0: got 'grim', expected a policy, such as "
            "dmplay.load_agent(problem, 0, NAME)",
        ),
        (lambda: dmplay.compare(DILEMMA, WRONG_TYPE),
         "entrants: got <class 'object'>, expected a list with the policies of each entrant"),
        (lambda: dmplay.compare(DILEMMA, AGENT_NAMES), "got 'grim', expected a policy for each of"),
        (lambda: dmplay.play(WRONG_TYPE),
         "got <class 'object'>, expected a problem, such as dmplay.load_problem(NAME)"),
        (lambda: dmplay.play(DILEMMA, "grim"),
         "got 'grim', expected one agent for each of agent1, agent2"),
        (lambda: dmplay.enumerate_outcomes(WRONG_TYPE, np.zeros(1), np.zeros((1, 1))),
         "got <class 'object'>, expected a problem"),
        (lambda: dmplay.load_agent(HEXWORLD, 0, "bot"), "random, search, bot:COMMAND"),
    ],
)  # fmt: skip
def test_a_wrong_argument_is_named_in_the_error(call: Callable[[], object], message: str) -> None:
    with pytest.raises(DmplayError, match=re.escape(message)):
        call()


def test_numpy_integers_are_accepted() -> None:
    seed, first = np.int64(7), np.uint8(2)
    result = dmplay.rollout(HEXWORLD, [WALKER], episodes=3, seed=seed, first_episode=first)  # type: ignore[arg-type]
    expected = dmplay.rollout(HEXWORLD, [WALKER], episodes=3, seed=7, first_episode=2)
    assert result.returns.tolist() == expected.returns.tolist()
    assert dmplay.SeededUniforms(seed, first) == dmplay.SeededUniforms(7, 2)  # type: ignore[arg-type]


def test_a_wrong_number_of_policies_or_actions_is_refused() -> None:
    with pytest.raises(BadPolicy, match="got 1 agent, expected one for each of"):
        dmplay.play("prisoners-dilemma", [None])
    game = dmplay.play("prisoners-dilemma", [None, None])
    with pytest.raises(BadPolicy, match="got 1 action, expected one for each of agent1, agent2"):
        game.act("defect")
    with pytest.raises(UnknownName, match="unknown action 'defcet'; did you mean defect"):
        game.act("defcet", "defect")
    with pytest.raises(BadPolicy, match="got 1 action, expected none: agents play every seat"):
        dmplay.play("hexworld", ["random"]).act("e")

"""A game by hand: words and numbers go in and come out, and nothing that a seat may not know."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.errors import BadPolicy, DmplayError, EpisodeOver, UnknownName


def test_a_person_of_python_plays_with_words() -> None:
    game = dmplay.play("crying-baby", seed=7, turns=3)
    assert game.legal_actions() == ["feed", "sing", "ignore"]
    assert game._repr_html_() == game.session._repr_html_()
    assert game.last_observation() is None
    told = game.act("ignore")
    assert told == {"action": "ignore", "observation": "crying"}
    assert (game.last_observation(), game.last_percept("agent")) == ("crying", told)
    assert game.returns == {}
    game.undo()
    assert game.act("ignore") == told
    game.act("feed")
    game.act("feed")
    assert game.over
    assert game.returns == {"agent": float(game.session.returns()[0])}
    with pytest.raises(EpisodeOver):
        game.act("feed")


def test_agents_and_programs_sit_in_the_other_seats() -> None:
    game = dmplay.play("prisoners-dilemma", [None, "tit-for-tat"], seed=7)
    game.act("defect")
    assert game.act("cooperate")["actions"] == {"agent1": "cooperate", "agent2": "defect"}
    alone = dmplay.play("hexworld", ["optimal"], seed=7)
    while not alone.over:
        alone.act()
    row = dmplay.rollout(alone.session.problem, [dmplay.load_agent(alone.session.problem, 0, "optimal")],
                         episodes=1, seed=7)  # fmt: skip
    assert alone.returns["agent"] == row.returns[0, 0]


def test_numbers_are_played_as_numbers() -> None:
    game = dmplay.play("simple-regulator", seed=7)
    bounds = game.legal_actions()
    assert isinstance(bounds, dict)
    assert game.act(bounds["low"])["action"] == bounds["low"]


HEXWORLD = dmplay.load_problem("hexworld")
WALKER = dmplay.load_agent(HEXWORLD, 0, "random")
NAMED: Any = "hexworld"  # a name where there should be what it names
HALF: Any = 2.5


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        (lambda: dmplay.rollout(NAMED, [WALKER], episodes=1), "got 'hexworld', expected a problem"),
        (
            lambda: dmplay.Session(NAMED, dmplay.SeededUniforms(1)),
            "got 'hexworld', expected a problem, as of",
        ),
        (lambda: dmplay.run(NAMED, [WALKER]), "got 'hexworld', expected a problem, as of dmplay.l"),
        (lambda: dmplay.load_agent(NAMED, 0, "random"), "got 'hexworld', expected a problem"),
        (lambda: dmplay.compare(NAMED, [[WALKER]] * 2), "got 'hexworld', expected a problem"),
        (lambda: dmplay.run_tournament(NAMED, {}), "got 'hexworld', expected a problem"),
        (lambda: dmplay.rollout(HEXWORLD, [NAMED], episodes=1), "seat 0: got 'hexworld', expected"),
        (
            lambda: dmplay.Session(HEXWORLD, dmplay.SeededUniforms(1), [NAMED]),
            "seat 0: got 'hexworld', expe",
        ),
        (
            lambda: dmplay.Session(HEXWORLD, dmplay.SeededUniforms(1), [WALKER] * 2),
            "got 2 policies, exp",
        ),
        (
            lambda: dmplay.rollout(HEXWORLD, [WALKER], episodes=1, turn_limit=-1),
            "turns: got -1, expect",
        ),
        (
            lambda: dmplay.Session(HEXWORLD, dmplay.SeededUniforms(1), turn_limit=HALF),
            "turns: got 2.5, expec",
        ),
        (
            lambda: dmplay.rollout(HEXWORLD, [WALKER], episodes=1, turn_limit=NAMED),
            "turns: got 'hexwo",
        ),
        (lambda: dmplay.rollout(HEXWORLD, [WALKER], episodes=1, seed=-1), "seed: got -1, expected"),
        (
            lambda: dmplay.rollout(HEXWORLD, [WALKER], episodes=1, first_episode=-1),
            "episode: got -1, exp",
        ),
        (lambda: dmplay.play("hexworld", turns=-1), "turns: got -1, expected a whole number, 0 or"),
        (lambda: dmplay.play("hexworld", seed=NAMED), "seed: got 'hexworld', expected a whole num"),
        (lambda: dmplay.play("hexworld").last_percept(), "no turn was played that could teach"),
        (
            lambda: dmplay.play("hexworld").session.advance([0, 1]),
            "got 2 actions, expected one",
        ),
        (lambda: dmplay.compare(HEXWORLD, [[WALKER]] * 2, seat=1), "seat: got 1, expected 0 to 0"),
        (lambda: dmplay.compare(HEXWORLD, []), "got 0 agents, expected two or more"),
        (
            lambda: dmplay.load_agent(HEXWORLD, 0, "human"),
            "unknown agent 'human'; expected one of optimal, ran",
        ),
        (lambda: dmplay.load_agent(HEXWORLD, 0, "bot"), "random, search, bot:COMMAND"),
    ],
)
def test_what_python_is_given_by_mistake_is_told_by_name(
    asked: Callable[[], object], told: str
) -> None:
    with pytest.raises(DmplayError, match=re.escape(told)):
        asked()


def test_numbers_of_numpy_are_numbers() -> None:
    seed, first = np.int64(7), np.uint8(2)
    played = dmplay.rollout(HEXWORLD, [WALKER], episodes=3, seed=seed, first_episode=first)  # type: ignore[arg-type]
    same = dmplay.rollout(HEXWORLD, [WALKER], episodes=3, seed=7, first_episode=2)
    assert played.returns.tolist() == same.returns.tolist()
    assert dmplay.SeededUniforms(seed, first) == dmplay.SeededUniforms(7, 2)  # type: ignore[arg-type]


def test_seats_are_said_to_be_too_many_or_too_few() -> None:
    with pytest.raises(BadPolicy, match="got 1 agent, expected one for each of"):
        dmplay.play("prisoners-dilemma", [None])
    game = dmplay.play("prisoners-dilemma", [None, None])
    with pytest.raises(BadPolicy, match="got 1 action, expected one for each of agent1, agent2"):
        game.act("defect")
    with pytest.raises(UnknownName, match="unknown action 'defcet'; did you mean defect"):
        game.act("defcet", "defect")
    with pytest.raises(BadPolicy, match="got 1 action, agents play every seat"):
        dmplay.play("hexworld", ["random"]).act("e")

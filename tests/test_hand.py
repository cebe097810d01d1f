"""A game by hand: words and numbers go in and come out, and nothing that a seat may not know."""

import pytest

import dmplay
from dmplay.errors import BadPolicy, EpisodeOver, UnknownName


def test_a_person_of_python_plays_with_words() -> None:
    game = dmplay.play("crying-baby", seed=7, turns=3)
    assert game.legal() == ["feed", "sing", "ignore"]
    assert game._repr_html_() == game.session._repr_html_()
    assert game.seen() is None
    told = game.act("ignore")
    assert told == {"action": "ignore", "observation": "crying"}
    assert (game.seen(), game.learnt("agent")) == ("crying", told)
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
    row = dmplay.rollout(alone.session.problem, [dmplay.agent(alone.session.problem, 0, "optimal")],
                         episodes=1, seed=7)  # fmt: skip
    assert alone.returns["agent"] == row.returns[0, 0]


def test_numbers_are_played_as_numbers() -> None:
    game = dmplay.play("simple-regulator", seed=7)
    bounds = game.legal()
    assert isinstance(bounds, dict)
    assert game.act(bounds["low"])["action"] == bounds["low"]


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

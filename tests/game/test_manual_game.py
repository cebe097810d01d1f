"""Tests of ManualGame: play from Python with labels and numbers, without hidden information."""

import re
from collections.abc import Callable
from pathlib import Path
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
DILEMMA = dmplay.load_problem("prisoners-dilemma")


def make_nothing() -> Any:
    """Return None, where a problem is expected."""
    return None


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: dmplay.rollout(WRONG_TYPE, [WALKER], episodes=1),
         "got <class 'object'>, expected a problem: its name, path, class or object"),
        (lambda: dmplay.Session(PROBLEM_NAME, dmplay.SeededUniforms(1)),
         "got 'hexworld', expected a problem, such as dmplay.load_problem(NAME)"),
        (lambda: dmplay.tabulate(PROBLEM_NAME),
         "got 'hexworld', expected a problem, such as dmplay.load_problem(NAME)"),
        (lambda: dmplay.run(3, [WALKER]), "got 3, expected a problem"),  # type: ignore[arg-type]
        (lambda: dmplay.run(make_nothing, [WALKER]),
         "make_nothing: got NoneType, expected a dmplay Problem"),
        (lambda: dmplay.load_agent(WRONG_TYPE, 0, "random"),
         "got <class 'object'>, expected a problem"),
        (lambda: dmplay.compare(WRONG_TYPE, [[WALKER]] * 2),
         "got <class 'object'>, expected a problem"),
        (lambda: dmplay.tournament(WRONG_TYPE, {}), "got <class 'object'>, expected a problem"),
        (lambda: dmplay.rollout(HEXWORLD, [PROBLEM_NAME], episodes=1),
         "unknown agent 'hexworld'; expected one of human, optimal"),
        (lambda: dmplay.rollout(HEXWORLD, [None], episodes=1),  # type: ignore[list-item]
         "agent: got None, expected an agent"),
        (lambda: dmplay.rollout(HEXWORLD, [3], episodes=1),  # type: ignore[list-item]
         "agent: got 3, expected an agent: its name, class, function or object"),
        (lambda: dmplay.rollout(HEXWORLD, [WRONG_TYPE], episodes=1),
         "object: cannot construct a policy from (problem, seat)"),
        (lambda: dmplay.rollout(HEXWORLD, "random", episodes=1, turns=3, turn_limit=4),
         "turns and turn_limit: got 3 and 4, expected one of them"),
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
         "got <class 'object'>, expected a problem: its name, path, class or object"),
        (lambda: dmplay.check(WRONG_TYPE), "got <class 'object'>, expected a problem"),
        (lambda: dmplay.tournament(DILEMMA, ["grim", "random", "grim"]),
         "entrants: got grim twice, expected a dict of agents by name"),
        (lambda: dmplay.tournament(DILEMMA, WRONG_TYPE),
         "entrants: got <class 'object'>, expected a list of agents, or a dict of them by name"),
        (lambda: dmplay.tournament(DILEMMA, dict.fromkeys(["grim", "random"], PROBLEM_NAME)),
         "unknown agent 'hexworld'"),
        (lambda: dmplay.tournament(DILEMMA, {"grim": ["grim"]}),
         "grim: got 1 agent, expected one for each of agent1, agent2"),
        (lambda: dmplay.tournament(DILEMMA, {"grim": dmplay.load_agent(DILEMMA, 0, "grim")}),
         "grim: got Grim(problem=PrisonersDilemma(discount=1.0), seat=0), expected one for each"),
        (lambda: dmplay.compare(DILEMMA, WRONG_TYPE),
         "entrants: got <class 'object'>, expected a list of agents"),
        (lambda: dmplay.compare(DILEMMA, "grim"), "entrants: got 'grim', expected a list of"),
        (lambda: dmplay.play(WRONG_TYPE), "got <class 'object'>, expected a problem"),
        (lambda: dmplay.play(DILEMMA, ["grim"]),
         "got 1 agent, expected one for each of agent1, agent2"),
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


def test_a_problem_and_its_agents_have_the_same_forms_in_every_function(tmp_path: Path) -> None:
    file = tmp_path / "hex.py"
    file.write_text("from dmplay.problems.hexworld.rules import HexWorld as Hex\n"
                    "def make(): return Hex(slip=0.2)\n")  # fmt: skip
    slippery = dmplay.load_problem(f"{file}:make")
    assert slippery == dmplay.load_problem("hexworld", slip=0.2)
    forms: list[Any] = ["hexworld", HEXWORLD, type(HEXWORLD), lambda: HEXWORLD]
    agents: list[Any] = ["random", WALKER, type(WALKER), [type(WALKER)], lambda p, n: WALKER]
    expected = dmplay.rollout(HEXWORLD, [WALKER], episodes=3, seed=1)
    for problem, agent in [(form, "random") for form in forms] + [(HEXWORLD, a) for a in agents]:
        played = dmplay.rollout(problem, agent, episodes=3, seed=1)
        assert played.returns.tolist() == expected.returns.tolist()
        summary = dmplay.run(problem, agent, episodes=3, seed=1)
        assert summary.rollout.returns.tolist() == expected.returns.tolist()
    result = dmplay.compare("hexworld", agents, episodes=3, seed=1)
    assert (result.returns == expected.returns).all()


def test_an_agent_of_one_seat_is_compared_beside_the_usual_or_the_named_agents() -> None:
    both = dmplay.compare(DILEMMA, [["grim", "random"], ["always-defect", "random"]], episodes=9)
    single = dmplay.compare(DILEMMA, ["grim", "always-defect"], others="random", episodes=9)
    assert (single.returns == both.returns).all()
    usual = dmplay.compare(DILEMMA, ["grim", "always-defect"], episodes=9)
    partner = dmplay.compare(DILEMMA, [["grim", "tit-for-tat"], "always-defect"], episodes=9)
    assert (usual.returns == partner.returns).all()


def test_a_tournament_takes_a_list_of_agents_or_a_dict_of_them() -> None:
    names = ["grim", "tit-for-tat"]
    listed = dmplay.tournament("prisoners-dilemma", names, episodes=5)
    named = dmplay.run_tournament(DILEMMA, {name: [name] * 2 for name in names}, episodes=5)
    assert listed.entrants == named.entrants == tuple(names)
    assert (listed.mean_returns == named.mean_returns).all()


def test_problems_and_agents_are_listed_by_the_names_that_load_them() -> None:
    for name in dmplay.list_problems():
        problem = dmplay.load_problem(name)
        for seat, agent in enumerate(problem.agents):
            names = dmplay.list_agents(name, agent)
            assert names == dmplay.list_agents(problem, seat)
            assert "random" in names


def test_a_turn_limit_has_two_names() -> None:
    limits: list[dict[str, Any]] = [{"turns": 2}, {"turn_limit": 2}, {"turns": 2, "turn_limit": 2}]
    for options in limits:
        assert dmplay.rollout("hexworld", "random", episodes=9, **options).turn_counts.max() == 2
        session = dmplay.Session(HEXWORLD, dmplay.SeededUniforms(1), **options)
        assert session.turn_limit == session.view(0).turn_limit == 2

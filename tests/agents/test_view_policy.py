"""Tests of plain agents: what they see, how often they are asked, and games played again."""

import pickle
import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay import SeededUniforms, Session, View
from dmplay.agents.view_policy import is_plain_agent
from dmplay.errors import BadPolicy, DmplayError
from dmplay.validation.agent_trial import AgentTrial, try_agent


def draw(view: View[Any], u: float) -> float:
    """Choose a legal action at random."""
    mask = view.legal_actions_mask
    space = view.problem.actions[view.seat]
    if not space.labels:
        return float(round(space.low + u * (space.high - space.low), 3))
    legal = np.arange(len(space.labels)) if mask is None else np.flatnonzero(mask)
    return int(legal[int(u * len(legal))])


class Alternate:
    """Chooses the first action in every other of its turns."""

    def __init__(self, every: int = 2) -> None:
        self.every, self.turns = every, 0

    def act(self, view: View[Any]) -> str | float:
        self.turns += 1
        return view.action_labels[0] if self.turns % self.every else 1


class Seated:
    """Takes the problem and the seat."""

    def __init__(self, problem: dmplay.Problem, seat: int) -> None:
        self.label = problem.actions[seat].labels[-1]

    def act(self, view: View[Any]) -> str:
        return self.label


def as_text(view: View[Any]) -> list[str]:
    """Return all parts of a view but the problem as text."""
    parts = [getattr(view, field.name) for field in fields(view) if field.name != "problem"]
    return [repr(list(part) if hasattr(part, "__len__") else part) for part in parts]


@pytest.mark.parametrize("name", dmplay.list_problems())
def test_a_plain_agent_gets_the_view_of_its_seat_and_nothing_else(name: str) -> None:
    problem, views = dmplay.load_problem(name), list[tuple[int, list[str]]]()

    def look(view: View[Any], u: float) -> float:
        views.append((view.seat, as_text(view)))
        assert view.problem is problem
        return draw(view, u)

    for seat in range(len(problem.agents)):
        players = [look if index == seat else "random" for index in range(len(problem.agents))]
        policies = dmplay.load_agent(problem, seat, look, turns=5)
        others = [
            policies if index == seat else dmplay.load_agent(problem, index, "random")
            for index in range(len(problem.agents))
        ]
        game, expected = Session(problem, SeededUniforms(3, 1), others, turns=5), []
        while not game.over:
            expected += [] if game.is_inactive(seat) else [(seat, as_text(game.view(seat)))]
            game.advance()
        assert views == expected
        views.clear()
        played = dmplay.rollout(problem, players, episodes=1, first_episode=1, seed=3, turns=5)
        assert views == expected
        views.clear()
        assert played.returns[0].tolist() == game.returns().tolist()


@pytest.mark.parametrize("agent", [draw, Alternate, Seated, Alternate(1)])
@pytest.mark.parametrize("name", ["crying-baby", "predator-prey", "hexworld"])
def test_games_of_a_plain_agent_are_the_same_alone_and_in_a_batch(agent: Any, name: str) -> None:
    problem = dmplay.load_problem(name)
    played = dmplay.rollout(problem, agent, episodes=6, turns=7, seed=2)
    for episode in range(6):
        policies = [dmplay.load_agent(problem, n, agent) for n in range(len(problem.agents))]
        policies = pickle.loads(pickle.dumps(policies))
        game = Session(problem, SeededUniforms(2, episode), policies, turns=7)
        while not game.over:
            game.advance()
        assert game.returns().tolist() == played.returns[episode].tolist()


def test_an_object_chooses_again_after_an_undo_as_if_the_turns_had_not_been_played() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    policies = [None, dmplay.load_agent(problem, 1, Alternate)]
    game = Session(problem, SeededUniforms(1), policies, turns=9)
    for action in (0, 0, 0):
        game.advance([action, None])
    before = [turn.actions.tolist() for turn in game.turns]
    game.undo(2)
    for action in (1, 0, 0, 0):
        game.advance([action, None])
    assert before == [[0, 0], [0, 1], [0, 0]]
    assert [turn.actions[1] for turn in game.turns] == [0, 1, 0, 1, 0]


def test_a_plain_agent_in_a_file_has_parameters_and_verifies(tmp_path: Path) -> None:
    source = Path(__file__).read_text(encoding="utf-8")
    begin, end = source.index("class Alternate"), source.index("class Seated")
    code = source[begin:end].replace("View[Any]", "object")
    file = tmp_path / "plain.py"
    file.write_text(f"{code}\ndef first(view, action=0): return action\nshared = Alternate()\n")
    problem = dmplay.load_problem("hexworld")
    for name, action in (("first", 0), ("first:action=3", 3), ("Alternate:every=1", 1)):
        policy = dmplay.load_agent(problem, 0, f"{file}:{name}")
        assert policy.choose(policy.initial_memory(np.array([1])), None, np.zeros((1, 0))) == action
    trial = AgentTrial("hexworld", {}, f"{file}:shared", "")
    violation = try_agent(trial)
    assert violation
    assert violation.where.endswith("plain.py:7")
    for name in ("first", "Alternate", "shared"):
        game = dmplay.play(problem, f"{file}:{name}", seed=4, turns=3)
        while not game.over:
            game.act()
        path = tmp_path / f"{name}.dmt"
        game.save(path)
        assert dmplay.verify(path, trusted=True).is_ok == (name != "shared")
    with pytest.raises(BadPolicy, match="an object takes no parameters; name its class"):
        dmplay.load_agent(problem, 0, f"{file}:shared:every=3")


def test_functions_and_classes_are_plain_agents_by_their_arguments() -> None:
    assert all(map(is_plain_agent, (draw, Alternate, Alternate(), Seated, lambda v: 0)))
    policy = dmplay.load_agent("hexworld", 0, "random")
    assert not any(map(is_plain_agent, (policy, type(policy), lambda p, n: policy, "random", 3)))


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (None, "returned None, expected the name or the number of an action"),
        ("bark", "unknown action 'bark'; expected one of feed, sing, ignore"),
        (7, "got action 7, expected 0 to 2"),
    ],
)
def test_an_invalid_answer_is_one_clear_line(answer: Any, message: str) -> None:
    with pytest.raises(DmplayError, match=re.escape(message)):
        dmplay.rollout("crying-baby", lambda view: answer, episodes=2, turns=1)

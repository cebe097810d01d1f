"""Tests of the basis of action values: that of a user's agent, and its words on the screen."""

from contextlib import suppress
from pathlib import Path

import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.core.action_values import ValuesBasis
from dmplay.core.session import Session
from dmplay.core.work_budget import limit_total_work
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.registry.agents import load_hint_agent, load_roster
from dmplay.registry.builtin_names import problem_names

WORK_LIMIT = 1e8
LAMP = """
import numpy as np
from dmplay import Accuracy, ConstantPolicy, Horizon, Labels, Roster, Tables, Tabular


class Lamp(Tabular):
    actions = (Labels(("light", "wait")),)
    state_names = ("dark",)
    tables = Tables(np.ones((1, 2, 1)), np.array([[[1.0], [0.0]]]))


class Silent(ConstantPolicy):
    def action_values(self, memory):
        return np.tile([2.0, 1.0], (len(memory[0]), 1))


class Foresighted(Silent):
    def values_basis(self, question):
        return super().values_basis(question)._replace(
            accuracy=Accuracy.ESTIMATED, horizon=Horizon.AHEAD, horizon_turns=2
        )


class Mistaken(Silent):
    def values_basis(self, question):
        return "estimated values"


AGENTS = Roster(
    {"silent": Silent, "foresighted": Foresighted, "mistaken": Mistaken}, hint_provider=PROVIDER
)
"""


def make_provider(folder: Path, name: str) -> HintProvider:
    """Return the hint provider of a user's problem, whose hints come from one of its agents."""
    file = folder / f"{name}.py"
    file.write_text(LAMP.replace("PROVIDER", repr(name)))
    session = Session(dmplay.load_problem(str(file)), dmplay.SeededUniforms(7), turn_limit=5)
    return HintProvider(session, AdviceQuestion(0, 5, ("human",)))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("silent", "values: light 2.00, wait 1.00"),
        ("foresighted", "estimated values (2 turns ahead): light 2.00, wait 1.00"),
    ],
)
def test_the_values_of_a_users_agent_are_called_as_it_says(
    name: str, text: str, tmp_path: Path
) -> None:
    assert make_provider(tmp_path, name).format_values().full_values_text == text


def test_a_users_basis_of_the_wrong_kind_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadParameter, match=r"^Mistaken\.values_basis: got 'estimated values', "):
        make_provider(tmp_path, "mistaken").format_values()


@pytest.mark.parametrize("turns", [None, 3])
@pytest.mark.parametrize("name", problem_names())
def test_every_agent_has_a_basis_whose_words_are_on_the_screen(
    name: str, turns: int | None
) -> None:
    problem = dmplay.load_problem(name)
    question = AdviceQuestion(0, turns, ("human",) * len(problem.agents))
    for agent_name, agent_class in load_roster(problem).agents.items():
        if agent_class.required_package or agent_class.positional_parameter:
            continue
        with suppress(BadPolicy, BudgetExceeded), limit_total_work(WORK_LIMIT):
            assert isinstance(load_hint_agent(problem, question, agent_name).basis, ValuesBasis)
    session = Session(problem, dmplay.SeededUniforms(7), turn_limit=turns)
    provider = HintProvider(session, question)
    with limit_total_work(WORK_LIMIT):
        text = provider.format_values().full_values_text
        game = provider.describe_game()
        basis = provider.values_basis
    assert basis.turns_scope in game
    assert game.endswith(basis.players)
    name_of_values = f"{basis.accuracy.words} ({game})" if game else basis.accuracy.words
    assert not text or text.startswith(f"{name_of_values}: ")

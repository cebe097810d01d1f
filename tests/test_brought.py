"""Problems that a user brings: their agents, hints and words, by kind and size alone."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay import Interval, Labels, Tables, Tabular, catalog
from dmplay.dice import Dice
from dmplay.session import Session
from dmplay.shell.game import Game
from dmplay.shell.seats import HUMAN
from tests.test_cli import run
from tests.test_readme import TIGER

TOLD: dict[str, type[Tabular]] = {}
exec(TIGER, TOLD)  # the README's own
Tiger = TOLD["Tiger"]


@dataclass(frozen=True)
class Patient(Tiger):  # type: ignore[misc, valid-type]
    """The tiger without an end."""

    horizon = None
    discount: float = 0.95


@dataclass(frozen=True)
class Lamp(Tabular):
    """Two states that are seen: light is worth 1 a turn, the switch costs 0.5."""

    actions = (Labels(("wait", "switch")),)
    names, start_belief = ("dark", "light"), np.array([1.0, 0.0])
    discount: float = 0.5
    tables = Tables(
        np.array([[[1.0, 0.0], [0.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]]]),
        np.array([[[0.0], [-0.5]], [[1.0], [0.5]]]),
    )


@dataclass(frozen=True)
class Dial(Lamp):
    """One whose actions are real numbers."""

    actions = (Interval(-1.0, 1.0),)  # type: ignore[assignment]


def game(problem: dmplay.Problem) -> Game:
    return Game("mine", Session(problem, Dice(7, 0), [None]), [HUMAN])


@pytest.mark.parametrize(
    ("problem", "agents", "hint"),
    [
        (Tiger(), ["plan"], "plan"),
        (Patient(), ["plan", "optimal", "qmdp"], "optimal"),
        (Lamp(), ["optimal"], "optimal"),
        (Lamp(discount=1.0), [], "search"),
        (Dial(), [], "search"),
    ],
)
def test_a_problem_has_the_agents_that_its_kind_allows(
    problem: Tabular, agents: list[str], hint: str
) -> None:
    assert [*catalog.agents(problem)] == [*agents, "random", "search"]
    assert catalog.hint(problem, 0) == hint


def test_the_tiger_is_listened_to_until_a_door_is_worth_it() -> None:
    played = game(Tiger())
    assert played.adviser.hint() == (
        "hint (plan): listen. values: listen 9.44, open-left -36.25, open-right -36.25"
    )
    assert played.situation() == (
        "nothing yet. belief: left 0.500, right 0.500. actions: listen, open-left, open-right."
    )


def test_an_unending_tiger_is_worth_what_the_literature_says() -> None:
    policy = catalog.agent(Patient(), 0, "optimal")
    values = policy.values(policy.begin(np.full(1, -1)))
    assert values is not None
    assert values.max() == pytest.approx(19.3714, abs=1e-3)


def test_a_lamp_is_switched_on_and_left() -> None:
    policy = catalog.agent(Lamp(), 0, "optimal")
    values = policy.values(policy.begin(np.array([0, 1])))
    assert values is not None
    assert values.tolist() == [[0.25, 0.5], [2.0, 0.75]]


def test_a_lamp_goes_where_its_switch_says() -> None:
    played = game(Lamp())
    for action, state in (("wait", "dark"), ("switch", "light"), ("wait", "light")):
        played.choose(played.read(action))
        assert played.problem.notation(played.session.state) == state
        assert played.view().observation == played.session.state
    assert [turn.rewards.tolist() for turn in played.session.turns] == [[0.0], [-0.5], [1.0]]


def test_a_problem_without_values_is_advised_by_a_search() -> None:
    assert game(Lamp(discount=1.0)).adviser.hint().startswith("hint (search): ")


def test_each_agent_needs_actions_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "pair.py").write_text(
        TIGER.replace("    names", '    agents = ("a", "b")\n    names')
    )
    done = run(tmp_path, f"{tmp_path}/pair.py:Tiger")
    assert done.returncode == 2
    assert done.stderr.endswith(":Tiger: got 1 action sets for 2 agents, one each\n")

"""The rules of the repeated dilemma in games that somebody brings."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from dmplay import Labels, load_agent
from dmplay.chance import Array
from dmplay.core import Percept
from dmplay.finding.agents import find_hint_provider, load_roster
from dmplay.matrix_game import MatrixGame


@dataclass(frozen=True)
class Chicken(MatrixGame):
    """Who swerves pays the other; the second names his actions the other way round."""

    actions = (Labels(("dare", "swerve")), Labels(("swerve", "dare")))
    payoffs: ClassVar[Array] = np.array([[[2, 0], [-9, -9]], [[1, 1], [0, 2]]], float)


@dataclass(frozen=True)
class Named(Chicken):
    """One that says which action cooperates."""

    actions = (Labels(("cooperate", "other")), Labels(("other", "cooperate")))


def replies(game: MatrixGame, seat: int, name: str, others: str) -> str:
    """The labels of what a rule does against these labels of the other's, by first letters."""
    rule, own, other = load_agent(game, seat, name), game.actions[seat], game.actions[1 - seat]
    memory, told = rule.initial_memory(np.zeros(1, int)), ""
    for letter in f"{others}.":
        chosen = rule.choose(memory, None, np.full((1, rule.uniform_count), 0.99))
        told += own[int(chosen[0])][0]
        if letter != ".":
            did = next(n for n, label in enumerate(other) if label[0] == letter)
            joint = np.array([[int(chosen[0]), did]] if seat == 0 else [[did, int(chosen[0])]])
            memory = rule.update_memory(memory, Percept(chosen, np.zeros(1, int), joint, None))
    return told


def test_to_cooperate_is_what_pays_the_other_more_whatever_it_is_called() -> None:
    for seat in range(2):
        assert replies(Chicken(), seat, "tit-for-tat", "sddss") == "ssddss"
        assert replies(Chicken(), seat, "grim", "sdss") == "ssddd"
        assert replies(Chicken(), seat, "win-stay-lose-shift", "sdds") == "ssdss"
        assert replies(Chicken(), seat, "always-defect", "ss") == "ddd"
        assert replies(Chicken(), seat, "generous-tit-for-tat", "sd") == "ssd"
        assert replies(Named(), seat, "tit-for-tat", "oc") == "coc"


def test_hints_reply_to_what_the_play_of_the_other_suggests() -> None:
    known = [*load_roster(Chicken()).agents]
    assert known[:4] == ["nash", "frequency", "tit-for-tat", "suspicious-tit-for-tat"]
    found = find_hint_provider(Chicken(), 0)
    assert found is not None
    assert found[1].hint_basis == "best reply to what the other's play suggests"
    memory = found[1].initial_memory(np.zeros(1, int))
    for did in (1, 0, 0, 0):  # who dared once may dare again
        chosen = np.zeros(1, int)
        memory = found[1].update_memory(memory, Percept(chosen, chosen, np.array([[0, did]]), None))
    assert found[1].choose(memory, None, np.zeros((1, 0))).tolist() == [1]

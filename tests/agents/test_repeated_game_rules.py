"""Tests of the rules of the repeated dilemma in user-defined games."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from dmplay import Labels, load_agent
from dmplay.agents.base import AdviceQuestion
from dmplay.core.arrays import Array
from dmplay.core.matrix_game import MatrixGame
from dmplay.core.policy import Percept
from dmplay.registry.agents import find_hint_provider, load_roster


@dataclass(frozen=True)
class ChickenGame(MatrixGame):
    """A game of chicken; the second agent lists its actions in the reverse order."""

    actions = (Labels(("dare", "swerve")), Labels(("swerve", "dare")))
    payoffs: ClassVar[Array] = np.array([[[2, 0], [-9, -9]], [[1, 1], [0, 2]]], float)


@dataclass(frozen=True)
class NamedChickenGame(ChickenGame):
    """A game of chicken in which an action is named cooperate."""

    actions = (Labels(("cooperate", "other")), Labels(("other", "cooperate")))


def play_against(game: MatrixGame, seat: int, name: str, opponent_letters: str) -> str:
    """Return the first letters of a rule's actions against these actions of the opponent."""
    rule = load_agent(game, seat, name)
    own_actions = game.actions[seat]
    opponent_actions = game.actions[1 - seat]
    memory, letters = rule.initial_memory(np.zeros(1, int)), ""
    for letter in f"{opponent_letters}.":
        chosen = rule.choose(memory, None, np.full((1, rule.uniform_count), 0.99))
        letters += own_actions[int(chosen[0])][0]
        if letter != ".":
            opponent_action = next(
                index for index, label in enumerate(opponent_actions) if label[0] == letter
            )
            joint = np.array(
                [[int(chosen[0]), opponent_action]]
                if seat == 0
                else [[opponent_action, int(chosen[0])]]
            )
            memory = rule.update_memory(memory, Percept(chosen, np.zeros(1, int), joint, None))
    return letters


def test_the_cooperative_action_is_the_one_that_pays_the_opponent_more() -> None:
    for seat in range(2):
        assert play_against(ChickenGame(), seat, "tit-for-tat", "sddss") == "ssddss"
        assert play_against(ChickenGame(), seat, "grim", "sdss") == "ssddd"
        assert play_against(ChickenGame(), seat, "win-stay-lose-shift", "sdds") == "ssdss"
        assert play_against(ChickenGame(), seat, "always-defect", "ss") == "ddd"
        assert play_against(ChickenGame(), seat, "generous-tit-for-tat", "sd") == "ssd"
        assert play_against(NamedChickenGame(), seat, "tit-for-tat", "oc") == "coc"


def test_hints_are_best_responses_to_the_opponents_inferred_policy() -> None:
    agent_names = [*load_roster(ChickenGame()).agents]
    assert agent_names[:4] == ["nash", "frequency", "tit-for-tat", "suspicious-tit-for-tat"]
    provider = find_hint_provider(ChickenGame(), AdviceQuestion(0))
    assert provider is not None
    assert provider.describe_game(0) == "for one round, if agent2 acts as often each way as before"
    memory = provider.policy.initial_memory(np.zeros(1, int))
    for opponent_action in (1, 0, 0, 0):  # after a single dare, the opponent may dare again
        chosen = np.zeros(1, int)
        memory = provider.policy.update_memory(
            memory, Percept(chosen, chosen, np.array([[0, opponent_action]]), None)
        )
    assert provider.policy.choose(memory, None, np.zeros((1, 0))).tolist() == [1]

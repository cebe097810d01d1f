"""Tests of the sentence on how a game ended: in the problem's words, about the player."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from dmplay.game.game import Game
from tests.support.programs import run_dmplay
from tests.support.screens import make_game

OWN_WORDS = """
from dmplay import Labels, Tables, Tabular


class Coin(Tabular):
    actions, horizon = (Labels(("heads", "tails")),), 2
    state_count, state_names = 1, ("only",)
    tables = Tables([[[1.0], [1.0]]], [[[1.0], [0.0]]])
"""
OWN_VIEW = """

class VIEW:
    def describe_end(game):
        return f"{game.player} called heads {int((game.actions == 0).sum())} times in {game.turns}"
"""


def play(name: str, actions: Sequence[str], *others: str, turns: int | None = None) -> Game:
    """Play a game of a person with these actions to its end."""
    game = make_game(name, "human", *others, seed=7, turns=turns or len(actions))
    for action in actions:
        if not game.session.over:
            game.choose(game.keyboard.parse_action(game.view(), action))
    return game


@pytest.mark.parametrize(
    ("game", "expected"),
    [
        (play("hexworld", ["e"]), "you took no exit in 1 turn"),
        (play("hexworld", ["n"] * 9 + ["e"], turns=90), "you"),
        (play("bandit", ["a", "b"]), "of 2 pulls"),
        (play("cart-pole", ["left"] * 40), "the pole fell to the right, past 12 deg, after "),
        (play("cart-pole", ["left"]), "you kept the pole up for all 1 push"),
        (play("machine-replacement", ["manufacture", "replace"]), "for 1 of 2 turns"),
        (play("mountain-car", ["left"]), "you did not reach the flag in 1 turn"),
        (
            play("prisoners-dilemma", ["defect"] * 3, "always-cooperate"),
            "you defected in 3, agent2",
        ),
        (
            play("rock-paper-scissors", ["paper"] * 3, "script:rock,rock,rock"),
            "you won 3, lost 0 and drew 0 of 3 rounds",
        ),
        (
            play("travelers-dilemma", ["50"], "claim:claim=60"),
            "you claimed 50, and agent2 claimed 60",
        ),
    ],
)
def test_the_end_is_told_in_the_words_of_the_problem(game: Game, expected: str) -> None:
    assert expected in game.narrator.describe_end()


def test_an_agent_is_named_and_several_people_are_named_by_their_seats() -> None:
    agents_alone = make_game("bandit", "greedy", seed=7)
    list(agents_alone.iter_agent_turns())
    assert agents_alone.narrator.describe_end().startswith("greedy won ")
    people = make_game("rock-paper-scissors", "human", "human", seed=7, turns=1)
    people.choose(0.0)
    people.choose(1.0)
    assert people.narrator.describe_end() == "agent1 won 0, lost 1 and drew 0 of 1 round"


def test_a_file_of_a_user_says_how_its_games_end_as_a_built_in_folder_does(tmp_path: Path) -> None:
    keys = "heads\nheads\n"
    (tmp_path / "plain.py").write_text(OWN_WORDS)
    (tmp_path / "coin.py").write_text(OWN_WORDS + OWN_VIEW)
    plain = run_dmplay(tmp_path, "./plain.py", stdin=keys).stdout
    assert "over: you played all 2 turns. " in plain
    custom = run_dmplay(tmp_path, "./coin.py", stdin=keys).stdout
    assert "over: you called heads 2 times in 2 turns. " in custom
    assert run_dmplay(tmp_path, "check", "./coin.py").stdout.startswith("ok ")

"""What `help` begins with: three sentences and a worked turn, the same in every game."""

import re

import pytest

import dmplay
from dmplay.finding.names import problem_names
from dmplay.game.table import GameController
from dmplay.words.commands import run_line
from dmplay.words.lesson import lesson_lines
from tests.support.brought import Key
from tests.support.screens import game, play, seated


@pytest.mark.parametrize("name", problem_names())
def test_a_lesson_is_three_sentences_and_one_turn_that_tell_nothing_of_the_game(name: str) -> None:
    others = ["random"] * (len(dmplay.load_problem(name).agents) - 1)
    told = lesson_lines(game(name, "human", *others, seed=1))
    assert [row.endswith(".") for row in told] == [True] * 4
    assert told[0].startswith("You ")
    assert told[1].startswith("You want ")
    assert re.match("For example, one turn[: ].* It pays you -?[0-9.]+", told[3])
    played = game(name, "human", *others, seed=2)
    assert lesson_lines(played) == told
    legal = [
        label for _, label, able in played.keyboard.list_actions_with_keys(played.view()) if able
    ]
    run_line(GameController(played), legal[0] if legal else "0.5")
    assert lesson_lines(played) == told


@pytest.mark.parametrize(
    ("name", "parameters", "row", "says"),
    [
        ("hexworld", {"bump_cost": 3.0, "slip": 0.0}, 2, "a bump costs 3, and no step slips"),
        ("hexworld", {"discount": 1.0}, 2, "slip aside."),
        ("crying-baby", {"hungry_reward": -7.0}, 2, "finds it hungry costs 7, feeding 5"),
        ("cart-pole", {"theta_limit": 20.0, "force": 5.0}, 1, "within 20 degrees of upright"),
        ("2048", {"p_two": 0.9}, 2, "90% of them 2 and the others 4"),
        ("predator-prey", {"predators": 2}, 1, "pays 1, shared by the predators on it"),
        ("simple-regulator", {"noise": 0.0}, 2, "a push nothing; what comes a turn later"),
    ],
)
def test_a_lesson_has_the_numbers_of_the_game_that_is_played(
    name: str, parameters: dict[str, object], row: int, says: str
) -> None:
    assert says in lesson_lines(game(name, parameters=parameters))[row]


@pytest.mark.parametrize(
    ("name", "turn"),
    [
        ("2048", "slid left. new 2 in row 3, column 4. It pays you 4."),
        ("hexworld", "from (7,1): at (7,0). chose W, slipped, moved SW. It pays you 0."),
        ("crying-baby", "from hungry, unseen: quiet. chose feed. belief: sated 1.000, "),
        ("rock-paper-scissors", "agent1 chose scissors. agent2 chose paper. It pays you 1."),
    ],
)
def test_the_worked_turn_is_one_of_the_problem_itself(name: str, turn: str) -> None:
    assert turn in lesson_lines(game(name))[3]


def test_each_seat_has_a_lesson_of_its_own() -> None:
    prey = game("predator-prey", "flee", "human")
    assert lesson_lines(prey)[1] == "You want never to share a hex with a predator."
    assert "the other" not in lesson_lines(game("multicaregiver-crying-baby"))[3]


@pytest.mark.parametrize("size", [(80, 24), (50, 14)])
def test_help_begins_with_the_lesson_on_the_screen_and_in_lines(size: tuple[int, int]) -> None:
    played = game("hexworld")
    first = "You are @ and walk from hex to hex;"
    assert play(played, "?", size=size).last.split("\n")[1].strip().startswith(first)
    assert str(run_line(GameController(played), "help")).startswith(first)
    assert "You are" not in str(run_line(GameController(), "help"))


def test_a_problem_without_a_view_is_told_by_its_own_words() -> None:
    session = dmplay.Session(Key(), dmplay.SeededUniforms(7), turn_limit=3)
    told = lesson_lines(seated("key", session, ["human"]))
    assert told[0] == "You are agent, and you see the state."
    assert told[1].startswith("One who has taken the key may open;")
    assert told[3].startswith("For example, one turn from before: ")

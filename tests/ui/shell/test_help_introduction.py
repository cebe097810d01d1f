"""Tests of the lesson at the start of `help`: three sentences and an example turn."""

import re

import pytest

import dmplay
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.registry.builtin_names import name_to_stem, problem_names
from dmplay.ui.shell.commands import run_line
from dmplay.ui.shell.help_introduction import lesson_lines
from tests.support.screens import make_game, make_session_game, play_keys
from tests.support.user_problems import Key


@pytest.mark.parametrize("name", problem_names())
def test_a_lesson_is_three_sentences_and_an_example_turn_independent_of_the_game(name: str) -> None:
    others = ["random"] * (len(dmplay.load_problem(name).agents) - 1)
    lines = lesson_lines(make_game(name, "human", *others, seed=1))
    advice = f"see lesson in dmplay/problems/{name_to_stem(name)}/view.py"
    assert all(row.endswith(".") for row in lines), advice
    for row, beginning in zip(lines, ("You ", "You want "), strict=False):
        assert row.startswith(beginning), (
            f"expected a sentence that begins with {beginning!r}, got {row!r}; {advice}"
        )
    pattern = "For example, (one turn|(in|with|from) .*): .* The reward is -?[0-9.]+"
    assert re.match(pattern, lines[-1]), advice
    other_game = make_game(name, "human", *others, seed=2)
    assert lesson_lines(other_game) == lines, advice
    legal_actions = [
        label
        for _, label, is_legal in other_game.keyboard.list_actions_with_keys(other_game.view())
        if is_legal
    ]
    run_line(GameController(other_game), legal_actions[0] if legal_actions else "0.5")
    assert lesson_lines(other_game) == lines, advice


@pytest.mark.parametrize(
    ("name", "parameters", "row", "phrase"),
    [
        ("hexworld", {"bump_cost": 3.0, "slip": 0.0}, 2, "wall costs 3, and no step slips"),
        ("hexworld", {"discount": 1.0}, 2,
         "; there is no discount: the rewards of all turns count"),
        ("crying-baby", {"hungry_reward": -7.0}, 2, "hungry baby costs 7; feeding costs 5"),
        ("cart-pole", {"theta_limit": 20.0, "force": 5.0}, 1, "within 20 degrees of upright"),
        ("2048", {"p_two": 0.9}, 2, "90% of new tiles are 2, the others 4"),
        ("predator-prey", {"predators": 2}, 1, "you get 1, shared by the predators on it"),
        ("simple-regulator", {"noise": 0.0}, 2, "a push is free; a reward one turn later"),
    ],
)  # fmt: skip
def test_a_lesson_contains_the_parameters_of_the_game(
    name: str, parameters: dict[str, object], row: int, phrase: str
) -> None:
    assert phrase in lesson_lines(make_game(name, parameters=parameters))[row]


@pytest.mark.parametrize(
    ("name", "turn"),
    [
        ("2048", "slid left. new 2 in row 3, column 4. The reward is 4."),
        ("hexworld", "from hex (7,1): chose W, slipped, moved SW to (7,0). The reward is 0."),
        (
            "crying-baby",
            "with a baby that is hungry: chose feed, heard quiet. belief: sated 1.000, ",
        ),
        ("rock-paper-scissors", "agent1 chose scissors. agent2 chose paper. The reward is 1."),
    ],
)
def test_the_example_turn_is_a_turn_of_the_problem(name: str, turn: str) -> None:
    assert turn in lesson_lines(make_game(name))[-1]


def test_the_lesson_says_why_rewards_are_hidden() -> None:
    reason = "because they would reveal the hidden state."
    assert lesson_lines(make_game("crying-baby"))[3].endswith(reason)
    assert reason not in " ".join(
        lesson_lines(make_game("catch")) + lesson_lines(make_game("2048"))
    )
    revealed = start_new_game(GameRequest("crying-baby", seed=7, reveal=True))
    assert reason not in " ".join(lesson_lines(revealed))
    controller = GameController(revealed)
    run_line(controller, "feed")
    assert ("reward", "-15") in controller.game.view_module.panel_rows(controller.game.view())


def test_each_seat_has_its_own_lesson() -> None:
    prey_game = make_game("predator-prey", "flee", "human")
    assert lesson_lines(prey_game)[1] == "You want to avoid the hexes of predators."
    assert "the other" not in lesson_lines(make_game("multicaregiver-crying-baby"))[-1]


@pytest.mark.parametrize("size", [(80, 24), (50, 14)])
def test_help_begins_with_the_lesson_on_the_screen_and_in_lines(size: tuple[int, int]) -> None:
    hex_game = make_game("hexworld")
    first = "You walk from hex to hex;"
    assert play_keys(hex_game, "?", size=size).last.split("\n")[1].strip().startswith(first)
    assert str(run_line(GameController(hex_game), "help")).startswith(first)
    assert "You walk" not in str(run_line(GameController(), "help"))


def test_the_mark_on_the_map_is_named_on_the_screen_but_not_in_lines() -> None:
    game = make_game("predator-prey", "human", "flee")
    assert "On the map you are A." in " ".join(play_keys(game, "?").last.split())
    assert "On the map" not in str(run_line(GameController(game), "help"))


def test_the_description_of_the_other_player_speaks_to_you() -> None:
    page = " ".join(play_keys(make_game("prisoners-dilemma", "human", "grim"), "?").last.split())
    assert "agent2 is played by grim, which cooperates until either agent defects" in page
    game = make_game("prisoners-dilemma", "human", "tit-for-tat")
    assert "then repeats your last action." in " ".join(play_keys(game, "?").last.split())


def test_the_lesson_of_a_problem_without_a_view_uses_its_description() -> None:
    session = dmplay.Session(Key(), dmplay.SeededUniforms(7), turn_limit=3)
    lines = lesson_lines(make_session_game("key", session, ["human"]))
    assert lines[0] == "You are agent, and you see the state."
    assert lines[1].startswith("One who has taken the key may open;")
    assert lines[3].startswith("For example, in state before: ")

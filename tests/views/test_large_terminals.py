"""Tests of what boards add on large terminals, and of coordinates and legends on request."""

from typing import cast

import pytest
from rich.text import Text

from dmplay.core.hexgrid import list_hexes
from dmplay.core.matrix_game import MatrixGame
from dmplay.core.session import View
from dmplay.draw.bars import draw_belief_chart
from dmplay.draw.canvas import Canvas
from dmplay.draw.options import DrawOptions
from dmplay.draw.payoff_table import draw_reply_counts
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.registry.problems import load_problem
from dmplay.terminal.capabilities import Terminal
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.commands import format_help_page
from tests.support.screens import make_game, play_keys
from tests.ui.screen.frames import FrameRecorder


def draw(game: Game, columns: int, rows: int, *keys: str, ascii_only: bool = False) -> str:
    """Return the screen of a game after these keys."""
    terminal = Terminal(True, "", True, color=True, ascii=ascii_only, motion=False)
    screen, recorder = PlayScreen(GameController(game), terminal), FrameRecorder()
    recorder.columns, recorder.rows = columns, rows
    screen.paint(recorder)
    for key in keys:
        handle_key(screen, key)
    screen.paint(recorder)
    assert isinstance(recorder.frame, Text)
    return recorder.frame.plain


def test_a_belief_chart_has_a_bar_for_each_turn_and_labels_below() -> None:
    canvas = Canvas()
    rows = [("turn", ["0", "1", "2"]), ("heard", ["", "quiet", "cries"])]
    bottom = draw_belief_chart(
        canvas, 0, [0.5, 0.0, 1.0], rows, rows=4, columns=24, ascii_only=True
    )
    assert bottom == 7
    assert canvas.to_text().plain.split("\n") == [
        "  1.0             #####",
        "                  #####",
        "  0.5 #####       #####",
        "  0.0 #####       #####",
        "      ──────────────────",
        "turn      0     1     2",
        "heard       quiet cries",
    ]


def test_a_belief_chart_shows_the_last_turns_that_fit() -> None:
    canvas = Canvas()
    turns = [("turn", [*map(str, range(10))])]
    draw_belief_chart(canvas, 0, [0.1] * 10, turns, rows=2, columns=11, ascii_only=False)
    assert canvas.to_text().plain.split("\n")[-1] == "turn 7 8 9"


def test_crying_baby_shows_its_history_on_a_tall_screen_only() -> None:
    tall = draw(make_game("crying-baby"), 200, 60, "i", "s")
    assert "chose        ignore   sing" in tall
    assert "heard        crying crying" in tall or "heard        " in tall
    assert "chose        ignore" not in draw(make_game("crying-baby"), 80, 24, "i", "s")


@pytest.mark.parametrize("name", ["crying-baby", "machine-replacement", "prisoners-dilemma"])
def test_large_terminals_have_at_most_half_empty_rows(name: str) -> None:
    keys = {"crying-baby": "i", "machine-replacement": "m", "prisoners-dilemma": "c"}[name]
    players = ["human", "tit-for-tat"] if name == "prisoners-dilemma" else ["human"]
    rows = draw(make_game(name, *players), 200, 60, *keys * 3).split("\n")
    assert sum(not row.strip() for row in rows) <= 30


def test_machine_replacement_draws_a_larger_triangle_on_a_large_terminal() -> None:
    large = draw(make_game("machine-replacement"), 200, 60, "m", "m")
    assert "d defective, n nondefective, · none" in large
    assert "─" * 81 in large
    assert "─" * 24 not in draw(make_game("machine-replacement"), 80, 24, "m", "m")


def test_replies_of_the_other_agent_are_counted_after_each_joint_action() -> None:
    game = make_game("prisoners-dilemma", "human", "tit-for-tat")
    play_keys(game, "c", "d", "c")
    canvas = Canvas()
    draw_reply_counts(cast(View[MatrixGame], game.view()), canvas, 0)
    assert canvas.to_text().plain.split("\n") == [
        "agent2 chose                 cooperate     defect",
        "in all rounds                        2          1",
        "after cooperate, cooperate           1          0",
        "after defect, cooperate              0          1",
    ]


def test_the_map_shows_the_coordinates_that_the_log_names_and_c_hides_them() -> None:
    with_coordinates = draw(make_game("hexworld"), 80, 24, "l")
    assert "moved E to (8,2)" in with_coordinates
    assert "│ 6,2 │" in with_coordinates
    without = draw(make_game("hexworld"), 80, 24, "l", "C")
    assert "6,2 │" not in without
    assert "coordinates: hidden" in without
    again = draw(make_game("hexworld"), 80, 24, "l", "C", "C")
    assert "│ 6,2 │" in again
    assert "coordinates: shown, as the log names them" in again


def test_c_shows_coordinates_on_a_small_map_too() -> None:
    assert "6,2│" not in draw(make_game("hexworld"), 50, 14, "l")
    assert "│6,2│" in draw(make_game("hexworld"), 50, 14, "l", "C")


def test_every_hex_of_the_team_hunt_shows_its_coordinates() -> None:
    text = draw(make_game("collaborative-predator-prey", "human", "random"), 80, 24, "l")
    assert all(
        f"{q},{r}" in text for q, r in list_hexes(load_problem("collaborative-predator-prey"))
    )


def test_large_hexes_keep_their_content_beside_the_coordinates() -> None:
    rows = draw(make_game("collaborative-predator-prey", "human", "random"), 200, 60)
    assert "│       -1,2      │" in rows
    assert "│       @@@       │" in rows


def test_a_board_without_hexes_has_no_coordinates() -> None:
    assert "this board shows no coordinates" in draw(make_game("2048"), 80, 24, "C")


@pytest.mark.parametrize(("name", "is_listed"), [("hexworld", True), ("2048", False)])
def test_the_help_page_lists_coordinates_for_hex_maps(name: str, is_listed: bool) -> None:
    assert ("  C           coordinates" in draw(make_game(name), 120, 60, "?")) == is_listed


@pytest.mark.parametrize(
    ("size", "legend"),
    [
        ((200, 60), "left of ◆: past advisories; right of ◆: the next seconds in calm air"),
        ((80, 24), "paths: next seconds by advisory; ▒ collision"),
    ],
)
def test_the_fan_of_paths_has_a_legend(size: tuple[int, int], legend: str) -> None:
    assert legend in draw(make_game("collision-avoidance"), *size)


@pytest.mark.parametrize(
    ("name", "keys"),
    [
        ("travelers-dilemma", "2 to 100; type a number, then Enter; the arrow keys change it"),
        ("catch", "10 to 100 in steps of 10; type a number, then Enter; the arrow keys change it"),
    ],
)
def test_numbers_are_described_in_words(name: str, keys: str) -> None:
    assert f"actions: {keys}" in format_help_page(make_game(name), [])


def test_the_command_keys_does_not_list_every_number() -> None:
    frames = play_keys(make_game("travelers-dilemma", "human", "random"), ":keys enter")
    assert "2, 3, 4" not in frames.last


def test_boards_without_large_drawings_do_not_change() -> None:
    game = make_game("crying-baby")
    boards = [*game.view_module.iter_boards(game.view(), DrawOptions(200, 60))]
    assert not any("chose" in board.plain for board in boards)

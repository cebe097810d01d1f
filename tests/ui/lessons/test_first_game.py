"""Tests of the first game: the screen says what to do at each moment, until it was finished."""

from datetime import date
from pathlib import Path

import pytest

from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.core.hexgrid import format_hex
from dmplay.errors import BadParameter, UnknownName
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.problems.hexworld.rules import HexWorld
from dmplay.terminal.capabilities import Terminal as Way
from dmplay.tutor.lesson import OVER, GameTask, ScreenNote
from dmplay.tutor.lesson_file_reader import read_lesson
from dmplay.tutor.lesson_list import find_unplayed_first_game, load_first_game
from dmplay.tutor.positions import make_game_request, open_position
from dmplay.ui.gallery.gallery import Gallery
from dmplay.ui.gallery.problem_entries import list_problem_entries
from dmplay.ui.screen.frame_state import Viewport
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.commands import PlayerQuit
from tests.support.programs import run_dmplay
from tests.support.screens import EmulatedPainter, EmulatedScreen
from tests.support.terminals import ENTER, Terminal

NOTES_OF_A_USER = """\
title = "Two turns"
[position]
problem = "crying-baby"
turns = 2
[[steps]]
text = "Play two turns."
hint = "Feed."
learned = "Good."
[steps.play]
goal = "two turns"
turns_at_least = 2
[[steps.play.notes]]
text = "Listen to the baby."
[[steps.play.notes]]
when = "over"
text = "That was all."
"""


@pytest.fixture(autouse=True)
def _state_in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the progress of a test in its own folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


def open_screen(task: GameTask, folder: Path) -> PlayScreen:
    """Open the play screen of the first step of a lesson."""
    step = load_first_game().steps[0]
    game = start_new_game(make_game_request(step.position, folder, task))
    controller = GameController(game, interpret_command)
    return PlayScreen(controller, Way(True, "", True, True, False), notes=task.notes)


def read_screen(screen: PlayScreen, size: tuple[int, int]) -> str:
    """Return the text of the screen with single spaces."""
    painter = EmulatedPainter(EmulatedScreen(), *size)
    screen.paint(painter)
    return " ".join(painter.paper.text.split())


@pytest.mark.parametrize("size", [(80, 24), (50, 14), (200, 60)])
def test_the_screen_says_what_to_do_at_each_moment(size: tuple[int, int], tmp_path: Path) -> None:
    task = load_first_game().steps[0].task
    assert isinstance(task, GameTask)
    start, under_way, on_exit, over, look_back = (note.text for note in task.notes)
    screen = open_screen(task, tmp_path)
    assert start in read_screen(screen, size)
    goal = "reach exit +10 or +5; avoid exit -10; a bump costs 1; 30% of steps slip"
    assert goal in read_screen(screen, size)
    for key, note in (("n", under_way), ("n", on_exit), ("n", over), ("enter", look_back)):
        handle_key(screen, key)
        screen.review_game()
        assert note in read_screen(screen, size)
        is_under_way = note in (under_way, on_exit)
        assert (goal in read_screen(screen, size)) == (is_under_way and size != (50, 14))
        assert not any(other in read_screen(screen, size) for other in {start, over} - {note})
    for key in ("left", "enter"):  # plays on from turn 2
        handle_key(screen, key)
    assert under_way in read_screen(screen, size)


def test_q_asks_once_before_it_leaves_a_beginners_game(tmp_path: Path) -> None:
    task = load_first_game().steps[0].task
    assert isinstance(task, GameTask)
    screen = open_screen(task, tmp_path)
    for key in ("q", "n", "q"):
        handle_key(screen, key)
    assert screen.message == "this game is not over; press q again to quit"
    with pytest.raises(PlayerQuit):
        handle_key(screen, "q")


def test_what_the_first_game_says_of_its_map_is_true() -> None:
    [step] = load_first_game().steps
    assert isinstance(step.task, GameTask)
    position = open_position(step.position, Path())
    problem, (start, under_way, on_exit, over, _) = position.problem, step.task.notes
    assert isinstance(problem, HexWorld)
    exits = {format_hex(hex_): reward for hex_, reward in problem.exits.items()}
    assert {*on_exit.at} == {*exits}
    assert f"With probability {problem.slip}, a step slips" in under_way.text
    assert f"counts {problem.discount} times" in over.text
    assert "the exit +10, at the lower right of the map" in start.text
    assert (problem.format_state(position.session.state), exits["(9,0)"]) == ("(7,2)", 10)


def test_the_first_game_is_offered_until_it_was_finished(tmp_path: Path) -> None:
    left = run_dmplay(tmp_path, "learn", "first", stdin="se\nquit\n")
    assert "Your first game is not finished" in left.stdout
    assert find_unplayed_first_game() is not None
    done = run_dmplay(tmp_path, "learn", "first", stdin="se\nse\nse\n")
    assert (
        "Your first game is finished.\nnext: dmplay 2048, or the first lesson: dmplay learn 1"
        in done.stdout
    )
    assert (done.returncode, find_unplayed_first_game()) == (0, None)
    again = run_dmplay(tmp_path, "learn", "first", stdin="hint\n")
    assert "hint by optimal: se" in again.stdout


def test_the_lesson_of_a_teacher_can_have_notes(tmp_path: Path) -> None:
    path = tmp_path / "01-notes.toml"
    path.write_text(NOTES_OF_A_USER)
    [step] = read_lesson(path, 1).steps
    assert isinstance(step.task, GameTask)
    assert step.task.notes == (
        ScreenNote("Listen to the baby."), ScreenNote("That was all.", when=OVER),
    )  # fmt: skip
    path.write_text(NOTES_OF_A_USER.replace('"over"', '"ower"'))
    with pytest.raises(UnknownName, match=r"notes\[2\].when: unknown phase .* did you mean over"):
        read_lesson(path, 1)


def test_no_note_tells_a_hidden_state(tmp_path: Path) -> None:
    path = tmp_path / "01-notes.toml"
    path.write_text(NOTES_OF_A_USER.replace('when = "over"', 'at = ["hungry"]'))
    [step] = read_lesson(path, 1).steps
    assert isinstance(step.task, GameTask)
    with pytest.raises(BadParameter, match="the states are hidden"):
        make_game_request(step.position, tmp_path, step.task)


def test_keys_that_need_a_problem_say_so_beside_the_first_game() -> None:
    gallery = Gallery(list_problem_entries(), Way(True, "", True, True, False), date(2026, 11, 22))
    for key in "dag":
        gallery.handle_key(key)
        assert gallery.message == "select a problem that can be played"
    with pytest.raises(PlayerQuit):
        gallery.handle_key("enter")
    assert gallery.pending_command == ("learn", "first")
    text = "\n".join(row.plain for row in gallery.compose_rows(Viewport(80, 24)))
    assert "Your first game  3 minutes" in text
    assert "│ @ │" in text


@pytest.mark.slow
def test_the_gallery_begins_with_the_first_game_until_it_was_finished(tmp_path: Path) -> None:
    with Terminal(folder=tmp_path) as terminal:
        terminal.until("> Your first game").ready().press(ENTER, "Your goal is the exit").calm()
        terminal.press("n", "Walk on").press("n", "You stand on an exit").press("n", "is over")
        terminal.calm().press("q", "Your first game is finished.").until("Enter goes back")
        assert "right." not in terminal.text
        terminal.press(ENTER, "> 2048").until("next: 2048, Enter plays it").calm()
        assert "Your first game" not in terminal.text
        terminal.press("k", "record 8.1 in 3 turns, seed 7")
        assert terminal.press("q").ended() == 0

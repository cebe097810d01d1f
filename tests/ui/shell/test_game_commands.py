"""Tests of commands typed in a game: they apply to its problem and do not end it unasked."""

from pathlib import Path

import pytest

from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.errors import BadParameter, UnknownName
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.game.playback import Playback
from dmplay.terminal.capabilities import Terminal, TerminalOptions, choose_terminal_settings
from dmplay.ui.screen.play_operations import run_typed_line
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.commands import run_line
from tests.support.screens import make_game, play_keys


@pytest.fixture
def controller(tmp_path: Path) -> GameController:
    """The controller of a game in which a person played a turn."""
    game_controller = GameController(
        start_new_game(GameRequest("hexworld", seed=7, record_path=tmp_path / "game.dmt")),
        interpret_command,
    )
    game_controller.is_interactive = True
    run_line(game_controller, "e")
    return game_controller


@pytest.mark.parametrize("command", ["info", "agents", "solve"])
def test_commands_about_a_problem_default_to_the_problem_of_the_game(
    command: str, controller: GameController
) -> None:
    assert run_line(controller, command) == run_line(controller, f"{command} hexworld")
    assert run_line(controller, command) != run_line(controller, f"{command} prisoners-dilemma")


def test_solve_uses_the_parameters_of_the_game(controller: GameController) -> None:
    controller.is_interactive = False
    run_line(controller, "set slip 0")
    output = run_line(controller, "solve")
    assert output.startswith("hexworld slip=0: value iteration\n")
    assert output == run_line(controller, "solve hexworld --set slip=0")
    assert run_line(controller, "solve --set slip=0.5") == run_line(
        controller, "solve hexworld --set slip=0.5"
    )
    assert run_line(controller, "solve --json catch") == run_line(controller, "solve catch --json")
    with pytest.raises(UnknownName, match="'hexwrld'; did you mean hexworld"):
        run_line(controller, "solve hexwrld")
    assert controller.game.recorder
    replay = GameController(Playback(controller.game.recorder.path), interpret_command)
    assert run_line(replay, "solve") == output.replace("slip=0", "slip=0.0")


def test_save_writes_a_copy_to_a_single_file(controller: GameController, tmp_path: Path) -> None:
    with pytest.raises(BadParameter, match=r"^save: got 'a b.dmt', expected one file; put a name"):
        run_line(controller, "save a b.dmt")
    assert run_line(controller, f"save '{tmp_path}/a b.dmt'").startswith(
        f"saved {tmp_path}/a b.dmt; "
    )


@pytest.mark.parametrize("line", ["set slip 0", "agent agent optimal"])
def test_a_command_that_ends_the_game_needs_confirmation(
    line: str, controller: GameController
) -> None:
    original_game = controller.game
    name = line.partition(" ")[0]
    question = f"{name}: this ends the game after 1 turn; repeat it to confirm"
    assert run_line(controller, line) == question
    assert run_line(controller, "look").startswith("at ")
    run_line(controller, "e")
    assert run_line(controller, line).startswith(f"{name}: this ends the game after 2 turns")
    assert controller.game is original_game
    assert run_line(controller, line).startswith("new game of hexworld")
    assert controller.game is not original_game


@pytest.mark.parametrize("line", ["set nothing 7", "set slip 3", "agent agent bst"])
def test_an_invalid_command_is_refused_without_confirmation(
    line: str, controller: GameController
) -> None:
    with pytest.raises((BadParameter, UnknownName)):
        run_line(controller, line)
    assert controller.game.session.end_reason is None


def test_games_without_turns_and_scripts_need_no_confirmation(controller: GameController) -> None:
    run_line(controller, "undo")
    assert run_line(controller, "set slip 0").startswith("new game")
    run_line(controller, "e")
    controller.is_interactive = False
    assert run_line(controller, "set slip 0.1").startswith("new game")


@pytest.mark.parametrize("form", ["svg", "film", "html", "cast"])
def test_a_picture_is_written_to_a_file_not_over_the_board(
    form: str, controller: GameController, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for expected in ("wrote game.", "wrote game-2."):
        reply = run_line(controller, f"export --{form}")
        assert reply.startswith(expected)
        assert (tmp_path / reply.removeprefix("wrote ")).stat().st_size > 0
    run_line(controller, f"export --{form} -o {tmp_path / 'drawn'}")
    assert (tmp_path / "drawn").exists()
    assert run_line(controller, "export --csv").startswith("turn")


def test_turns_that_agents_play_are_logged_without_covering_the_board() -> None:
    screen = PlayScreen(
        GameController(make_game("2048", "random")), Terminal(True, "", True, True, False)
    )
    run_typed_line(screen, "auto 5")
    assert len(screen.log) == 5
    assert not screen.page_rows
    assert not screen.message


@pytest.mark.parametrize(
    ("env", "ascii_"),
    [
        ({"LC_ALL": "C"}, True),
        ({"LC_ALL": "POSIX", "LANG": "de_DE.UTF-8"}, True),
        ({"LC_ALL": "", "LC_CTYPE": "C.UTF-8", "LANG": "C"}, False),
        ({"LC_ALL": "C.UTF-8"}, False),
        ({"LC_ALL": "C", "PYTHONIOENCODING": "utf-8"}, False),
        ({}, False),
    ],
)
def test_the_c_locale_is_drawn_in_ascii(env: dict[str, str], ascii_: bool) -> None:
    with Path("/dev/null").open("w+", encoding="utf-8") as stream:
        assert choose_terminal_settings(TerminalOptions(), env, stream, stream).ascii is ascii_


@pytest.mark.parametrize(
    ("name", "title"),
    [
        ("prisoners-dilemma", " prisoners-dilemma  turn 0/10  score 0"),
        ("multicaregiver-crying-baby", " multicaregiver-crying-baby  turn 0/20"),
        ("hexworld", " hexworld  turn 0  score (discounted) 0"),
    ],
)
def test_a_title_shows_each_fact_completely_or_not_at_all(name: str, title: str) -> None:
    first = play_keys(make_game(name), size=(50, 14)).last.split("\n")[0]
    assert first.startswith(title)
    assert not first.endswith("…")

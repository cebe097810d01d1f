"""Commands of the command line in a game: they mean its problem, and do not end it unasked."""

from pathlib import Path

import pytest

from dmplay.cli.errands import interpret_command
from dmplay.errors import BadParameter, UnknownName
from dmplay.game.playback import Playback
from dmplay.game.request import GameRequest
from dmplay.game.start import start_new_game
from dmplay.game.table import GameController
from dmplay.screen.acts import run_typed_line
from dmplay.screen.screen import PlayScreen
from dmplay.terminal import Terminal, TerminalOptions, choose_terminal
from dmplay.words.commands import run_line
from tests.support.screens import game, play


@pytest.fixture
def table(tmp_path: Path) -> GameController:
    """A table at which a person played a turn."""
    made = GameController(
        start_new_game(GameRequest("hexworld", seed=7, record_path=tmp_path / "game.dmt")),
        interpret_command,
    )
    made.is_interactive = True
    run_line(made, "e")
    return made


@pytest.mark.parametrize("command", ["info", "agents", "solve"])
def test_a_question_about_a_problem_means_the_one_that_is_played(
    command: str, table: GameController
) -> None:
    assert run_line(table, command) == run_line(table, f"{command} hexworld")
    assert run_line(table, command) != run_line(table, f"{command} prisoners-dilemma")


def test_a_game_is_solved_with_the_parameters_that_it_has(table: GameController) -> None:
    table.is_interactive = False
    run_line(table, "set slip 0")
    told = run_line(table, "solve")
    assert told.startswith("hexworld slip=0: value iteration\n")
    assert told == run_line(table, "solve hexworld --set slip=0")
    assert run_line(table, "solve --set slip=0.5") == run_line(
        table, "solve hexworld --set slip=0.5"
    )
    assert run_line(table, "solve --json catch") == run_line(table, "solve catch --json")
    with pytest.raises(UnknownName, match="'hexwrld'; did you mean hexworld"):
        run_line(table, "solve hexwrld")
    assert table.game.recorder
    recording = GameController(Playback(table.game.recorder.path), interpret_command)
    assert run_line(recording, "solve") == told.replace("slip=0", "slip=0.0")


def test_a_copy_is_written_to_one_file(table: GameController, tmp_path: Path) -> None:
    with pytest.raises(BadParameter, match=r"^save: got 'a b.dmt', expected one file; quotes"):
        run_line(table, "save a b.dmt")
    assert run_line(table, f"save '{tmp_path}/a b.dmt'").startswith(f"saved {tmp_path}/a b.dmt; ")


@pytest.mark.parametrize("line", ["set slip 0", "agent agent optimal"])
def test_what_would_end_a_game_is_asked_first(line: str, table: GameController) -> None:
    played = table.game
    name = line.partition(" ")[0]
    asked = f"{name}: that ends this game of 1 turn; once more does it"
    assert run_line(table, line) == asked
    assert run_line(table, "look").startswith("at ")
    run_line(table, "e")
    assert run_line(table, line).startswith(f"{name}: that ends this game of 2 turns")
    assert table.game is played
    assert run_line(table, line).startswith("new game of hexworld")
    assert table.game is not played


@pytest.mark.parametrize("line", ["set nothing 7", "set slip 3", "agent agent bst"])
def test_what_cannot_be_is_refused_before_anything_is_asked(
    line: str, table: GameController
) -> None:
    with pytest.raises((BadParameter, UnknownName)):
        run_line(table, line)
    assert table.game.session.end_reason is None


def test_a_game_without_a_turn_and_a_script_are_not_asked(table: GameController) -> None:
    run_line(table, "undo")
    assert run_line(table, "set slip 0").startswith("new game")
    run_line(table, "e")
    table.is_interactive = False
    assert run_line(table, "set slip 0.1").startswith("new game")


@pytest.mark.parametrize("form", ["svg", "film", "html", "cast", "cast3"])
def test_a_picture_is_written_to_a_file_not_over_the_board(
    form: str, table: GameController, tmp_path: Path
) -> None:
    with pytest.raises(BadParameter, match=f"export: --{form} is for a file; -o game[.]"):
        run_line(table, f"export --{form}")
    run_line(table, f"export --{form} -o {tmp_path / 'drawn'}")
    assert (tmp_path / "drawn").exists()
    assert run_line(table, "export --csv").startswith("turn")


def test_turns_that_agents_play_are_logged_and_do_not_cover_the_board() -> None:
    shown = PlayScreen(
        GameController(game("2048", "random")), Terminal(True, "", True, True, False)
    )
    run_typed_line(shown, "auto 5")
    assert len(shown.log) == 5
    assert not shown.page_rows
    assert not shown.message


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
def test_the_bare_locale_is_drawn_in_ascii(env: dict[str, str], ascii_: bool) -> None:
    with Path("/dev/null").open("w+", encoding="utf-8") as stream:
        assert choose_terminal(TerminalOptions(), env, stream, stream).ascii is ascii_


@pytest.mark.parametrize(
    ("name", "title"),
    [
        ("prisoners-dilemma", " prisoners-dilemma  turn 0/10  score 0"),
        ("multicaregiver-crying-baby", " multicaregiver-crying-baby  turn 0/20"),
        ("hexworld", " hexworld  turn 0  score 0  you: agent"),
    ],
)
def test_a_title_tells_a_fact_whole_or_not_at_all(name: str, title: str) -> None:
    first = play(game(name), size=(50, 14)).last.split("\n")[0]
    assert first.startswith(title)
    assert not first.endswith("…")

"""Tests of the dialogs of puzzles and mistakes: scripts, JSON, and the key after a game."""

import json
from pathlib import Path

import pytest

from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.game.playback import Playback
from dmplay.terminal.capabilities import Terminal
from dmplay.tutor.mistakes import NO_MISTAKES, list_mistakes
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.commands import PlayerQuit
from tests.support.programs import run_dmplay
from tests.support.terminals import Terminal as PseudoTerminal


def test_a_wrong_answer_gets_a_reason_and_another_try(tmp_path: Path) -> None:
    result = run_dmplay(
        tmp_path, "learn", "puzzle", "prisoners-dilemma:1", stdin="defect\ncooperate\n"
    )
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.endswith(
        """\
You have 10 rounds left. All rounds count the same. What do you do?
type cooperate or defect; quit leaves.
answer> defect
not yet. defect is worth -27, 18 less than the best action:
  with probability 1 agent2 plays cooperate: reward 0, then worth -27
Try again, or type show for the solution.
answer> cooperate
right.
cooperate is worth -9:
  with probability 1 agent2 plays cooperate: reward -1, then worth -8
Each value is the mean of reward + later worth.
Rule of thumb: defect, as it pays more in each single round. Here it says defect and loses 18.
dmplay learn puzzle prisoners-dilemma gives another one.
"""
    )


def test_a_script_that_ends_without_an_answer_fails(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "learn", "puzzle", "prisoners-dilemma:1", stdin="defect\n")
    assert (result.returncode, result.stderr) == (1, "")


def test_a_wrong_word_in_a_script_is_reported_with_its_line(tmp_path: Path) -> None:
    result = run_dmplay(
        tmp_path, "learn", "puzzle", "prisoners-dilemma:1", stdin="# try\nconfess\n"
    )
    assert result.returncode == 2
    assert result.stderr == (
        "error: line 2: unknown action 'confess'; expected one of cooperate, defect\n"
    )


def test_help_look_show_and_quit_are_commands(tmp_path: Path) -> None:
    script = "help\nlook\nshow\n"
    result = run_dmplay(tmp_path, "learn", "puzzle", "prisoners-dilemma:1", stdin=script)
    assert "type an action, or: show (the solution, after one try)" in result.stdout
    assert result.stdout.count("You are agent1, a prisoner") == 2
    assert result.stderr == "error: line 3: show: expected at least one try first\n"
    result = run_dmplay(tmp_path, "learn", "puzzle", "prisoners-dilemma:1", stdin="quit\n")
    assert (result.returncode, result.stderr) == (1, "")


def test_json_hides_the_solution_unless_it_is_asked_for(tmp_path: Path) -> None:
    words = "learn", "puzzle", "prisoners-dilemma:1", "--json"
    puzzle = json.loads(run_dmplay(tmp_path, *words).stdout)
    assert puzzle["puzzle"] == "prisoners-dilemma:1"
    assert puzzle["actions"] == ["cooperate", "defect"]
    assert puzzle["text"][-1] == (
        "You have 10 rounds left. All rounds count the same. What do you do?"
    )
    assert puzzle["position"]["seats"] == {"agent2": "grim"}
    assert "solution" not in puzzle
    solution = json.loads(run_dmplay(tmp_path, *words, "--solution").stdout)["solution"]
    assert solution["right"] == ["cooperate"]
    assert solution["values"] == {"cooperate": -9.0, "defect": -27.0}
    assert solution["rule"]["action"] == "defect"


def test_solution_without_json_is_refused(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "learn", "puzzle", "--solution")
    assert result.returncode == 2
    assert result.stderr == "error: --solution: expected --json too; in a dialog, type show\n"


def test_mistakes_are_asked_one_after_the_other(tmp_path: Path) -> None:
    game = "e\ne\nw\nw\n"
    run_dmplay(tmp_path, "hexworld", "--seed", "3", "--turns", "4", "-o", "w.dmt", stdin=game)
    result = run_dmplay(tmp_path, "learn", "from", "w.dmt", stdin="e\nw\n")
    assert (result.returncode, result.stderr) == (0, "")
    assert "1 of 2. turn 3 of w.dmt." in result.stdout
    assert "2 of 2. turn 1 of w.dmt." in result.stdout
    assert result.stdout.count("You walk from hex to hex") == 1
    assert "@" not in result.stdout
    assert "2 of 2 questions answered, 2 at the first try." in result.stdout
    mistakes = json.loads(run_dmplay(tmp_path, "learn", "from", "w.dmt", "--json").stdout)
    assert [row["mistake"] for row in mistakes["mistakes"]] == [
        "turn 3 of w.dmt",
        "turn 1 of w.dmt",
    ]
    assert mistakes["mistakes"][0]["solution"]["right"] == ["e", "se"]


def test_without_saved_games_there_is_no_mistake(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "learn", "from")
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout == (
        "no mistake to learn from in the 50 newest saved games: nothing is new or due.\n"
    )


def test_a_missing_game_is_reported_in_one_line(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "learn", "from", "missing.dmt")
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1
    assert "missing.dmt" in result.stderr


def open_screen(folder: Path, keys: str) -> PlayScreen:
    """Return the screen after a game of hexworld with these keys."""
    path = folder / "walk.dmt"
    game = start_new_game(GameRequest("hexworld", seed=3, turns=4, record_path=path))
    screen = PlayScreen(GameController(game), Terminal(True, "", True, color=False, ascii=False))
    for key in keys:
        handle_key(screen, key)
    screen.post_game_review.review_game(game)
    return screen


def test_m_after_a_game_leaves_the_screen_to_learn(tmp_path: Path) -> None:
    screen = open_screen(tmp_path, "llhh")
    with pytest.raises(PlayerQuit):
        handle_key(screen, "M")
    assert screen.learns_from_game


@pytest.mark.parametrize(("claim", "is_offered"), [("97", False), ("2", True)])
def test_m_is_offered_exactly_if_it_finds_a_mistake(
    tmp_path: Path, claim: str, is_offered: bool
) -> None:
    path = tmp_path / "claims.dmt"
    request = GameRequest("travelers-dilemma", seed=7, turns=1, record_path=path)
    game = start_new_game(request)
    screen = PlayScreen(GameController(game), Terminal(True, "", True, color=False, ascii=False))
    game.choose(game.problem.parse_action(0, claim))
    screen.post_game_review.review_game(game)
    assert game.has_known_mistakes == bool(list_mistakes(path)) == is_offered
    if not is_offered:
        handle_key(screen, "M")
        assert screen.message == f"M: {NO_MISTAKES}"  # a claim of 97 lost a little
        assert not screen.learns_from_game
        printed = run_dmplay(tmp_path, "learn", "from", path.name).stdout
        assert printed == f"no mistake to learn from in {path.name}: {NO_MISTAKES}.\n"


def test_m_during_a_game_only_says_that_there_is_nothing_yet(tmp_path: Path) -> None:
    screen = open_screen(tmp_path, "l")
    handle_key(screen, "M")
    assert screen.message == "M: the game is not over"
    assert not screen.learns_from_game


def test_m_works_in_a_replay(tmp_path: Path) -> None:
    open_screen(tmp_path, "llhh").game.finish()
    controller = GameController(Playback(tmp_path / "walk.dmt"))
    screen = PlayScreen(controller, Terminal(True, "", True, color=False, ascii=False))
    with pytest.raises(PlayerQuit):
        handle_key(screen, "M")
    assert screen.learns_from_game


@pytest.mark.slow
def test_m_in_a_game_opened_from_the_shell_asks_and_goes_back_to_the_game(tmp_path: Path) -> None:
    game = "play hexworld --seed 3 --turns 4\r"
    with PseudoTerminal("shell", folder=tmp_path) as terminal:
        terminal.press(game, "t0]>").press("screen\r", "Tab hint").press("llhh", "M learn")
        terminal.press("M", "answer>")
        terminal.press("quit\r", "Enter goes back to the game>").press("\r", "M learn")
        terminal.press("q", "t4 over]>").press("quit\r", "replay:")


@pytest.mark.slow
def test_m_on_the_terminal_asks_for_a_better_action(tmp_path: Path) -> None:
    words = "hexworld", "--seed", "3", "--turns", "4"
    with PseudoTerminal(*words, folder=tmp_path) as terminal:
        terminal.ready().press("llhh", "M learn").press("M", "1 of 2. turn 3 of ")
        terminal.press("e\r", "In the game, w was chosen here. It lost 0.359 ")
        terminal.press("quit\r", "Enter goes back to the game>").press("\r", "M learn")

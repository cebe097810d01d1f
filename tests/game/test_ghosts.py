"""Tests of ghosts, shown after each turn, or after the end if something is hidden."""

from pathlib import Path

import pytest

from dmplay.errors import BadParameter
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_game, start_new_game
from dmplay.game.launch_requests import GameRequest, ResumeRequest
from dmplay.game.transcript_verification import verify
from dmplay.terminal.capabilities import Terminal
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_screen import PlayScreen
from tests.support.screens import EmulatedPainter, EmulatedScreen


def start_ghost_game(folder: Path, name: str, ghost: str = "optimal", **options: object) -> Game:
    """Start a recorded game of a person with a ghost."""
    default_request = GameRequest(name, seed=7, record_path=folder / "game.dmt", ghost_agent=ghost)
    return start_new_game(GameRequest(**{**vars(default_request), **options}))


def render_screen(
    game: Game, *keys: str, size: tuple[int, int] = (80, 24), ascii_: bool = False
) -> str:
    """Return the text of the screen after these keys."""
    screen = PlayScreen(GameController(game), Terminal(True, "", True, True, ascii_))
    for key in keys:
        handle_key(screen, key)
        screen.review_game()
    easel = EmulatedPainter(EmulatedScreen(), *size)
    screen.paint(easel)
    return easel.paper.text


def test_the_ghost_of_a_fully_observable_problem_is_on_the_board_after_each_turn(
    tmp_path: Path,
) -> None:
    game = start_ghost_game(tmp_path, "hexworld")
    assert "│  &  │" not in render_screen(game)
    text = render_screen(game, "h")
    assert text.count("│  &  │") == 1
    assert "@ you, & ghost, " in text
    assert "ghost    0\n" in text
    assert "lead     +0\n" in text
    assert "turn 1. chose W, moved W to (6,2). reward 0. score 0. ghost 0, lead +0." in text
    assert "ghost    8.1\n" in render_screen(game, "h", "h")
    assert "lead     -8.1\n" in render_screen(game)


def test_undo_moves_the_ghost_back_too(tmp_path: Path) -> None:
    game = start_ghost_game(tmp_path, "hexworld")
    text = render_screen(game, "h")
    render_screen(game, "h", "backspace")
    assert render_screen(game).split("\n")[2:12] == text.split("\n")[2:12]
    assert "│  &  │" not in render_screen(game, "backspace")


@pytest.mark.parametrize("name", ["crying-baby", "predator-prey", "prisoners-dilemma"])
def test_the_ghost_is_not_shown_before_the_end_if_something_is_hidden(
    name: str, tmp_path: Path
) -> None:
    game = start_ghost_game(tmp_path, name, "random", turns=2)
    game.choose(0)
    assert "ghost" not in render_screen(game)
    assert "ghost" not in game.narrator.describe_turn(game.snapshot())
    assert game.ghost
    assert game.ghost.session.turns == []
    game.choose(0)
    assert "random scored " in "\n".join(game.narrator.closing_lines())


def test_there_is_no_ghost_result_for_a_resumable_game(tmp_path: Path) -> None:
    game = start_ghost_game(tmp_path, "crying-baby")
    game.choose(0)
    game.finish("interrupted")
    assert "same seed" not in "\n".join(game.narrator.closing_lines())


def test_the_end_compares_with_the_ghost_and_not_with_another_agent(tmp_path: Path) -> None:
    text = render_screen(start_ghost_game(tmp_path, "hexworld", "random", turns=2), "h", "h")
    assert "same start and luck: random scored " in text
    assert "optimal scored" not in text


def test_the_transcript_with_a_ghost_differs_only_by_a_note(tmp_path: Path) -> None:
    texts = []
    for ghost in ("optimal", ""):
        game = start_ghost_game(tmp_path, "hexworld", ghost, force=True)
        for action in (3, 0, 3):
            game.choose(action)
        game.finish()
        assert verify(tmp_path / "game.dmt").is_ok
        texts.append((tmp_path / "game.dmt").read_text())
    assert texts[0] == texts[1].replace("turn: 1\n", "# ghost: optimal\nturn: 1\n")


def test_a_restarted_game_has_the_same_ghost(tmp_path: Path) -> None:
    controller = GameController(start_ghost_game(tmp_path, "hexworld"))
    controller.restart()
    assert controller.game.ghost
    assert controller.game.ghost.name == "optimal"
    new_game = start_new_game(
        GameRequest("hexworld", ghost_agent="optimal", record_path=tmp_path / "fresh.dmt")
    )
    assert "--ghost optimal" in new_game.play_again_command


@pytest.mark.parametrize(("requested", "expected"), [("", "optimal"), ("random", "random")])
def test_a_resumed_game_has_its_ghost_or_another_at_the_same_turn(
    requested: str, expected: str, tmp_path: Path
) -> None:
    game = start_ghost_game(tmp_path, "hexworld")
    game.choose(3)
    game.finish("interrupted")
    path = tmp_path / "game.dmt"
    resumed = start_game(ResumeRequest(path, ghost_agent=requested))
    assert resumed.ghost
    assert resumed.ghost.name == expected
    assert len(resumed.ghost.session.turns) == 1
    assert "│  &  │" in render_screen(resumed)
    resumed.finish()
    notes = [row for row in path.read_text().splitlines() if row.startswith("# ")]
    assert notes == [f"# ghost: {name}" for name in dict.fromkeys(("optimal", expected))]


def test_a_note_in_a_transcript_cannot_load_user_code_as_a_ghost(tmp_path: Path) -> None:
    start_ghost_game(tmp_path, "hexworld").finish("interrupted")
    path = tmp_path / "game.dmt"
    path.write_text(path.read_text().replace("ghost: optimal", "ghost: ./evil.py:X"))
    assert start_game(ResumeRequest(path)).ghost is None


def test_a_ghost_does_not_count_as_a_hint(tmp_path: Path) -> None:
    game = start_ghost_game(tmp_path, "hexworld", strict="hints")
    game.choose(3)
    assert "help" not in (tmp_path / "game.dmt").read_text()


def test_a_rejected_game_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(BadParameter, match="only agents play this game"):
        start_ghost_game(tmp_path, "hexworld", agent="optimal")
    assert not (tmp_path / "game.dmt").exists()

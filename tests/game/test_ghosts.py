"""A ghost beside a person: seen after each turn, or after the end where states are hidden."""

from pathlib import Path

import pytest

from dmplay.errors import BadParameter
from dmplay.game.checking import verify_file
from dmplay.game.game import Game
from dmplay.game.request import GameRequest, ResumeRequest
from dmplay.game.start import start_game, start_new_game
from dmplay.game.table import GameController
from dmplay.screen.press import handle_key
from dmplay.screen.screen import PlayScreen
from dmplay.terminal import Terminal
from tests.support.screens import Easel, Paper


def haunted(place: Path, name: str, ghost: str = "optimal", **wishes: object) -> Game:
    """A game of a person with a ghost beside, and a transcript."""
    asked = GameRequest(name, seed=7, record_path=place / "game.dmt", ghost_agent=ghost)
    return start_new_game(GameRequest(**{**vars(asked), **wishes}))


def shown(game: Game, *keys: str, size: tuple[int, int] = (80, 24), ascii_: bool = False) -> str:
    """The screen after these keys."""
    screen = PlayScreen(GameController(game), Terminal(True, "", True, True, ascii_))
    for key in keys:
        handle_key(screen, key)
    easel = Easel(Paper(), *size)
    screen.paint(easel)
    return easel.paper.text


def test_where_the_state_is_seen_the_ghost_stands_on_the_board_after_each_turn(
    tmp_path: Path,
) -> None:
    game = haunted(tmp_path, "hexworld")
    assert "│  &  │" not in shown(game)
    told = shown(game, "h")
    assert told.count("│  &  │") == 1
    assert "@ you, & ghost, " in told
    assert "ghost    0\n" in told
    assert "lead     +0\n" in told
    assert "turn 1. at (6,2). chose W, moved W. reward 0. score 0. ghost 0, lead +0." in told
    assert "ghost    8.1\n" in shown(game, "h", "h")
    assert "lead     -8.1\n" in shown(game)


def test_the_ghost_goes_back_with_the_person(tmp_path: Path) -> None:
    game = haunted(tmp_path, "hexworld")
    told = shown(game, "h")
    shown(game, "h", "backspace")
    assert shown(game).split("\n")[2:12] == told.split("\n")[2:12]
    assert "│  &  │" not in shown(game, "backspace")


@pytest.mark.parametrize("name", ["crying-baby", "predator-prey", "prisoners-dilemma"])
def test_where_something_is_secret_the_ghost_is_silent_up_to_the_end(
    name: str, tmp_path: Path
) -> None:
    game = haunted(tmp_path, name, "random", turns=2)
    game.choose(0)
    assert "ghost" not in shown(game)
    assert "ghost" not in game.narrator.describe_turn(game.snapshot())
    assert game.ghost
    assert game.ghost.session.turns == []
    game.choose(0)
    assert "random on the same dice: " in "\n".join(game.narrator.closing_lines())


def test_a_ghost_says_nothing_of_a_game_that_can_be_played_on(tmp_path: Path) -> None:
    game = haunted(tmp_path, "crying-baby")
    game.choose(0)
    game.finish("interrupted")
    assert "same dice" not in "\n".join(game.narrator.closing_lines())


def test_the_end_compares_with_the_ghost_and_not_with_another(tmp_path: Path) -> None:
    told = shown(haunted(tmp_path, "hexworld", "random", turns=2), "h", "h")
    assert "random on the same dice: " in told
    assert "optimal" not in told


def test_but_for_a_note_the_transcript_is_as_without_a_ghost(tmp_path: Path) -> None:
    texts = []
    for ghost in ("optimal", ""):
        game = haunted(tmp_path, "hexworld", ghost, force=True)
        for action in (3, 0, 3):
            game.choose(action)
        game.finish()
        assert verify_file(tmp_path / "game.dmt").is_ok
        texts.append((tmp_path / "game.dmt").read_text())
    assert texts[0] == texts[1].replace("turn: 1\n", "# ghost: optimal\nturn: 1\n")


def test_a_ghost_comes_along_when_the_game_begins_again(tmp_path: Path) -> None:
    table = GameController(haunted(tmp_path, "hexworld"))
    table.restart()
    assert table.game.ghost
    assert table.game.ghost.name == "optimal"
    fresh = start_new_game(
        GameRequest("hexworld", ghost_agent="optimal", record_path=tmp_path / "fresh.dmt")
    )
    assert "--ghost optimal" in fresh.play_again_command


@pytest.mark.parametrize(("wanted", "found"), [("", "optimal"), ("random", "random")])
def test_a_resumed_game_has_its_ghost_or_another_where_it_was(
    wanted: str, found: str, tmp_path: Path
) -> None:
    game = haunted(tmp_path, "hexworld")
    game.choose(3)
    game.finish("interrupted")
    path = tmp_path / "game.dmt"
    resumed = start_game(ResumeRequest(path, ghost_agent=wanted))
    assert resumed.ghost
    assert resumed.ghost.name == found
    assert len(resumed.ghost.session.turns) == 1
    assert "│  &  │" in shown(resumed)
    resumed.finish()
    notes = [row for row in path.read_text().splitlines() if row.startswith("# ")]
    assert notes == [f"# ghost: {name}" for name in dict.fromkeys(("optimal", found))]


def test_a_note_brings_nobody_else_s_code_as_a_ghost(tmp_path: Path) -> None:
    haunted(tmp_path, "hexworld").finish("interrupted")
    path = tmp_path / "game.dmt"
    path.write_text(path.read_text().replace("ghost: optimal", "ghost: ./evil.py:X"))
    assert start_game(ResumeRequest(path)).ghost is None


def test_a_ghost_is_no_help_and_so_not_forbidden(tmp_path: Path) -> None:
    game = haunted(tmp_path, "hexworld", strict="hints")
    game.choose(3)
    assert "help" not in (tmp_path / "game.dmt").read_text()


def test_a_game_that_is_refused_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(BadParameter, match="here agents play alone"):
        haunted(tmp_path, "hexworld", agent="optimal")
    assert not (tmp_path / "game.dmt").exists()

"""Tests of the viewer of algorithms inside a game, a replay and an agents' game."""

from pathlib import Path

import pytest

from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.game.playback import Playback
from dmplay.terminal.capabilities import Terminal
from dmplay.ui.screen.frame_state import Viewport
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.modes import Mode
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.watch.step_viewer import StepViewer
from tests.support.screens import make_game, play_keys

TERMINAL = Terminal(True, "", True, color=False, ascii=False)


def open_screen(name: str, *keys: str, agent: str = "human") -> PlayScreen:
    """Return the screen of a new game after these keys."""
    screen = PlayScreen(GameController(make_game(name, agent)), TERMINAL)
    for key in keys:
        handle_key(screen, key)
    return screen


def title_of(screen: PlayScreen) -> str:
    """Return the title of the viewer with single blanks."""
    assert isinstance(screen.viewer, StepViewer)
    return " ".join(screen.viewer.compose_rows(Viewport(80, 24))[0].plain.split())


def test_g_shows_the_belief_update_of_this_turn_and_q_returns_to_the_game() -> None:
    screen = open_screen("crying-baby", "f", "i", "G")
    assert title_of(screen) == "belief-update on crying-baby step 1: start of turn 2"
    for key in ("space", "space", "space"):
        handle_key(screen, key)
    assert title_of(screen) == "belief-update on crying-baby step 4: turn 2: normalize"
    handle_key(screen, "q")
    assert screen.viewer is None
    handle_key(screen, "f")
    assert len(screen.game.session.turns) == 3


def test_g_says_which_algorithm_it_chose_and_how_to_choose_another() -> None:
    screen = open_screen("crying-baby", "f", "i", "G")
    assert isinstance(screen.viewer, StepViewer)
    rows = [row.plain.strip() for row in screen.viewer.compose_rows(Viewport(80, 24))]
    assert rows[-2] == "chosen: belief-update; :watch NAME for alpha-vectors, tree-search"
    assert "This is turn 2 of your game." in " ".join(rows)


@pytest.mark.parametrize("name", ["hexworld", "crying-baby", "rock-paper-scissors"])
def test_the_first_page_of_the_help_lists_g(name: str) -> None:
    rows = play_keys(make_game(name), "?", size=(80, 24)).frames[-1].split("\n")
    assert any(row.split()[:2] == ["G", "watch"] for row in rows)


def test_an_action_key_plays_nothing_while_the_viewer_is_open() -> None:
    screen = open_screen("crying-baby", "f", "G", "f", "tab", "i")
    assert len(screen.game.session.turns) == 1
    assert screen.viewer is not None


def test_g_on_a_map_searches_from_the_present_state_and_counts_as_a_hint() -> None:
    screen = open_screen("hexworld", "l", "G", "end")
    assert title_of(screen).startswith("tree-search on hexworld step 201 of 201: simulation 50")
    assert isinstance(screen.viewer, StepViewer)
    root = screen.viewer.watched.steps[-1].pictures[0]
    assert root[0] == screen.game.problem.format_state(screen.game.session.state)
    assert screen.game.session.hint_counts["agent"] == 1


def test_a_game_that_forbids_hints_says_so() -> None:
    screen = PlayScreen(
        GameController(start_new_game(GameRequest("hexworld", seed=7, strict="hints"))), TERMINAL
    )
    handle_key(screen, "G")
    assert screen.viewer is None
    assert screen.message == "watch: this game forbids hints (--strict=hints)"


def test_the_viewer_shows_a_turn_of_a_replay(tmp_path: Path) -> None:
    path = tmp_path / "baby.dmt"
    game = start_new_game(
        GameRequest("crying-baby", seed=3, agent="random", turns=5, record_path=path)
    )
    for _ in game.iter_agent_turns():
        pass
    game.finish()
    screen = PlayScreen(GameController(Playback(path)), TERMINAL)
    for key in ("right", "right", "right", "G"):
        handle_key(screen, key)
    assert title_of(screen) == "belief-update on crying-baby step 1: start of turn 3"


def test_agents_that_play_by_themselves_wait_while_the_viewer_is_open() -> None:
    screen = open_screen("crying-baby", "P", agent="random")
    assert screen.modes.play_mode is Mode.AUTOPLAY
    handle_key(screen, "space")
    screen = open_screen("crying-baby", "space", "P", "G", agent="random")
    assert screen.modes.play_mode is Mode.WAIT_FOR_KEY
    assert screen.viewer is not None


def test_a_colon_opens_no_command_row_over_the_viewer() -> None:
    game = make_game("crying-baby")
    frames = play_keys(game, "f", "G", ":", "space", "q", "i").frames
    assert "step 2" in frames[-3]
    assert len(game.session.turns) == 2


@pytest.mark.parametrize("name", ["hexworld", "crying-baby", "2048", "prisoners-dilemma"])
def test_a_viewer_fills_the_screen_and_leaves_the_game_as_it_was(name: str) -> None:
    run = play_keys(make_game(name), "G", "space", "q", size=(80, 24))
    before, *viewed, after = run.frames[-4:]
    assert before != viewed[0]
    assert len(after.split("\n")) == len(before.split("\n"))

"""Tests of the play screen without a terminal: the effect of each key, the layout in each size."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from rich.cells import cell_len

import dmplay
from dmplay.core.arrays import Reals
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_game, start_new_game
from dmplay.game.key_bindings import KEY_SYMBOLS
from dmplay.game.launch_requests import GameRequest, ResumeRequest
from dmplay.game.playback import Playback
from dmplay.game.seats import HUMAN
from dmplay.game.transcript_verification import verify
from dmplay.registry.builtin_names import problem_names
from dmplay.terminal.capabilities import Terminal
from dmplay.ui.screen.footer import format_footer
from dmplay.ui.screen.frame import compose_frame
from dmplay.ui.screen.frame_state import FrameState, Viewport
from dmplay.ui.screen.key_handlers import handle_key as do
from dmplay.ui.screen.modes import Mode
from dmplay.ui.screen.play_operations import autoplay_turn, count_turns_per_beat, get_autoplay_rate
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.screen.text_wrapping import format_panel, wrap_lines
from dmplay.ui.shell.commands import COMMANDS, run_line
from tests.support.screens import (
    KEY_SEQUENCES,
    EmulatedPainter,
    EmulatedScreen,
    ScreenRun,
    make_game,
    make_secret_request,
    make_session_game,
    play_keys,
    press_keys,
)

HELP_ROWS = tuple(str(run_line(GameController(make_game("hexworld")), "help")).split("\n") * 3)
PROBLEMS = ("2048", "crying-baby", "hexworld", "prisoners-dilemma")
SIZES = ((80, 24), (60, 20), (20, 5), (9, 3))
OPEN_BOARD_SEED = 1  # seed of 2048 whose first board slides in every direction


@pytest.mark.parametrize("size", [(80, 24), (50, 14)])
@pytest.mark.parametrize("problem", PROBLEMS)
def test_the_terminal_shows_the_composed_frame(problem: str, size: tuple[int, int]) -> None:
    result = play_keys(make_game(problem), "L", "V", "?", size=size)
    expected = compose_frame(make_game(problem), Viewport(*size), FrameState(), [])
    assert result.frames[0].split("\n") == [row.rstrip() for row in expected.plain.split("\n")]
    assert len(result.frames) == 4
    assert "You " in result.last


# Keys


def map_keys_to_labels(game: Game) -> dict[str, str]:
    """Return the label of each key's action, digits included."""
    labels = map(str, game.problem.actions[0].labels)
    digits = {str(number): label for number, label in enumerate(labels, 1)}
    return {**game.view_module.KEYS, **digits}


def iter_keys_with_undo(game: Game, action_names: list[str]) -> Iterator[str]:
    """Yield each key of a game and undo its turn, and append the names of the actions."""
    for key in map_keys_to_labels(game):
        yield key
        (turn,) = game.session.turns
        action_names.append(game.problem.format_action(0, turn.actions[0]))
        yield "backspace"


@pytest.mark.parametrize("problem", PROBLEMS)
def test_every_key_of_a_view_plays_its_action(problem: str) -> None:
    seats = [HUMAN, "grim"] if problem == "prisoners-dilemma" else [HUMAN]
    current_game, action_names = make_game(problem, *seats, seed=OPEN_BOARD_SEED), list[str]()
    press_keys(current_game, iter_keys_with_undo(current_game, action_names))
    assert action_names == [*map_keys_to_labels(current_game).values()]


def paint_game(game: Game) -> EmulatedPainter:
    """Paint the screen of a game, and return the painter."""
    painter = EmulatedPainter(EmulatedScreen(), 80, 24)
    painter.enter_screen()
    PlayScreen(GameController(game), Terminal(True, "", True, False, False)).paint(painter)
    return painter


@pytest.mark.parametrize(
    ("problem", "glyph"), [("hexworld", "@"), ("predator-prey", "A"), ("cart-pole", "")]
)
def test_the_terminal_cursor_is_on_the_player(problem: str, glyph: str) -> None:
    screen = paint_game(make_game(problem)).paper.screen
    character = screen.display[screen.cursor.y][screen.cursor.x]
    assert (screen.cursor.hidden, character if glyph else "") == (not glyph, glyph)


def test_the_terminal_cursor_is_on_the_player_when_agents_share_a_hex() -> None:
    screen = paint_game(
        make_session_game("predator-prey", make_shared_hex_session(), [HUMAN, HUMAN])
    ).paper.screen
    column, row = screen.cursor.x, screen.cursor.y
    assert screen.display[row][column] == "*"
    assert "Ao" in screen.display[row + 1][column - 2 : column + 3]


def make_shared_hex_session() -> Session:
    """Make a predator-prey session in which both agents are on one hex."""
    session = Session(dmplay.load_problem("predator-prey"), SeededUniforms(1))
    session.initial_state = np.array([4, 4])
    return session


def test_a_panel_fact_that_is_too_long_continues_on_the_next_row() -> None:
    facts = ("last", "NE"), ("slips aside", "0.15 each"), ("who", "one two three four five")
    rows = [row.plain.rstrip() for row in format_panel(facts, 17)]
    assert rows == [
        "last NE",
        "slips aside",
        "  0.15 each",
        "who",
        "  one two three",
        "  four five",
    ]


def test_the_first_arrow_of_a_diagonal_is_explained_and_other_keys_do_not_complete_it() -> None:
    result = play_keys(make_game("hexworld"), "up", "x", "down", "right")
    assert "up: now press left or right for a diagonal step" in result.frames[1]
    assert "x: no such key" in result.frames[2]
    assert "turn 1. " in result.last
    assert "chose SE" in result.last


def test_tab_shows_a_hint_without_playing() -> None:
    current_game = make_game("hexworld")
    *_, message, row = play_keys(current_game, "tab").last.split("\n")
    assert message == " hint: press n (se), by optimal"
    assert "Tab why" in row
    assert current_game.session.turns == []


def test_reroll_is_refused_before_the_first_turn() -> None:
    assert "no turn has been played yet" in play_keys(make_game("2048"), ":", "reroll enter").last


def test_a_rerolled_turn_is_logged() -> None:
    keys = ("left", ":", "reroll enter", ":", "reroll enter", "L")
    screen_text = play_keys(make_game("2048"), *keys, size=(80, 40)).last
    rows = [row.strip() for row in screen_text.split("\n") if "slid left." in row]
    assert rows == [
        "turn 1. slid left. new 2 in row 3, column 2. reward 4. score 4.",
        "turn 1, rerolled. slid left. new 2 in row 3, column 2. reward 4. score 4.",
        "turn 1, rerolled. slid left. new 4 in row 4, column 1. reward 4. score 4.",
    ]


@pytest.mark.parametrize("key", ["backspace", "c-_"])
def test_undo_and_redo_have_keys(key: str) -> None:
    current_game = make_game("hexworld")
    result = play_keys(current_game, "h", "h", key, "c-r")
    assert "undone. turn 1." in result.frames[3]
    assert "turn 2 " in result.last
    assert "no turn was undone" in play_keys(current_game, "c-r").last
    assert "undo: no turn was played" in play_keys(make_game("hexworld"), key).last


def test_turns_played_before_an_error_are_logged() -> None:
    result = play_keys(make_game("hexworld"), "h", "backspace", ":", "redo space 2 enter")
    assert "redo: no turn was undone" in result.last
    assert result.last.count("turn 1. ") == 2  # played, then redone


@pytest.mark.parametrize("key", ["?", "f1"])
def test_help_names_every_action_and_every_key(key: str) -> None:
    result = play_keys(make_game("hexworld"), key, "space", "h")
    page = result.frames[1] + result.frames[2]
    for command in COMMANDS:
        assert command.name in page or not command.key
        assert command.key_label in page
    assert "actions: l = e,  u = ne,  y = nw,  h = w,  b = sw,  n = se" in result.frames[1]
    assert "optimal       Takes the best action" in page
    assert "the command help lists them" in page
    for shown_key in "VCW":
        assert f"   {shown_key} " in result.frames[1]
    assert "turn 1 " in result.last
    assert "actions:" not in result.last


def test_a_typed_action_closes_the_help() -> None:
    result = play_keys(make_game("hexworld"), "?", ":", "w enter")
    assert "actions: " in result.frames[1]
    assert "actions: " not in result.last
    assert "turn 1. chose W, moved W to (6,2)" in result.last


def test_help_longer_than_the_screen_is_split_into_parts() -> None:
    result = play_keys(make_game("hexworld"), "?", *["space"] * 8, "h", size=(50, 14))
    for number in range(1, 9):
        prompt = "Space shows the next page" if number < 8 else "Esc closes this page"
        assert f"page {number} of 8; {prompt}" in result.frames[number]
    parts = "".join(result.frames[1:9])
    assert all(command.name in parts for command in COMMANDS if command.key)
    assert "page" not in result.frames[9]
    assert "turn 1 " in result.last


def test_a_key_that_is_the_name_of_an_action_is_answered_with_its_key() -> None:
    screen_text = play_keys(make_game("hexworld"), "e").last
    assert "e: no such key; press l for the action e; ? lists the keys" in screen_text


def test_a_page_does_not_divide_the_description_of_a_key() -> None:
    frames = play_keys(make_game("hexworld"), "?", "space", size=(80, 24)).frames[1:]
    (look_back,) = (frame for frame in frames if "look back" in frame)
    assert "its turns (?! lost" in look_back
    assert re.search(r"X\s+worst,\s+Tab\s+why", look_back)


def test_look_shows_the_situation_without_truncation() -> None:
    screen_text = play_keys(make_game("hexworld"), "L").last
    assert "\n at (7,2). E (8,2) floor. NE wall. " in screen_text
    assert "exit +10\n   at (9,0): 2 steps.\n" in screen_text


def test_one_key_cycles_through_the_overlays() -> None:
    result = play_keys(make_game("hexworld"), "V", "V", "V", "V", size=(80, 24))
    assert "overlay: exact values" in result.frames[1]
    assert "│ 7.04│" in result.frames[1]
    assert "overlay: best actions" in result.frames[2]
    assert "  ↘  " in result.frames[2]
    assert "overlay: the number of the state in which you stand" in result.frames[3]
    assert "│  22 │" in result.frames[3]
    assert "overlay: none" in result.frames[4]


@pytest.mark.parametrize(("problem", "size"), [("crying-baby", (80, 24)), ("hexworld", (40, 20))])
def test_a_board_without_overlays_says_so(problem: str, size: tuple[int, int]) -> None:
    result = play_keys(make_game(problem), "V", size=size)
    assert "this board has no overlays" in result.last
    assert result.frames[1].replace("this board has no overlays", "").split() == (
        result.frames[0].split()
    )


def test_a_key_without_a_meaning_says_so() -> None:
    assert "z: no such key; ? lists the keys" in play_keys(make_game("crying-baby"), "z").last


def test_a_small_n_after_the_game_names_the_key_of_a_new_game() -> None:
    baby = play_keys(start_new_game(GameRequest("crying-baby", turns=1)), "f", "n").last
    assert "n: no such key; N starts a new game" in baby
    map_key = play_keys(start_new_game(GameRequest("hexworld", turns=1)), "n", "n").last
    assert "n: the game is over; N starts a new game" in map_key


def test_repainting_changes_nothing_on_the_screen() -> None:
    result = play_keys(make_game("hexworld"), "h", "c-l")
    assert result.frames[1] == result.frames[2]


@pytest.mark.parametrize(("key", "code"), [("q", 0), ("c-d", 0), ("c-c", 130)])
def test_three_keys_quit_the_screen(key: str, code: int) -> None:
    assert play_keys(make_game("hexworld"), key, "h").code == code


def test_the_command_prompt_plays_undoes_reports_errors_and_closes() -> None:
    current_game = make_game("hexworld")
    result = play_keys(
        current_game, ":", "w enter", ":", "act space e enter", ":", "undo enter", ":", "hnt enter",
        ":", "undo", "escape", "h",
    )  # fmt: skip
    assert result.frames[1].split("\n")[-2] == " :"
    assert "turn 1 " in result.frames[2]
    assert "turn 2 " in result.frames[4]
    assert "undone. turn 1." in result.frames[6]
    assert "unknown action 'hnt'; did you mean hint" in result.frames[8]
    assert " :undo" in result.frames[10]
    assert " :undo" not in result.frames[11]
    assert "turn 2 " in result.last
    assert play_keys(make_game("hexworld"), ":", "quit enter", "h").code == 0


def test_ctrl_c_in_the_command_prompt_ends_the_game() -> None:
    assert play_keys(make_game("hexworld"), ":", "un", "c-c").code == 130


def test_the_command_prompt_lists_completions() -> None:
    result = play_keys(make_game("hexworld"), ":", "play space hexw", "tab", "escape")
    assert "hexworld:straight-line" in result.frames[3]


def test_letters_typed_in_the_command_prompt_are_not_keys() -> None:
    current_game = make_game("hexworld")
    result = play_keys(current_game, ":", "hlq?:")
    assert " :hlq?:" in result.last
    assert current_game.session.turns == []


def test_keys_step_agents_but_not_a_person() -> None:
    current_game = make_game("hexworld", "optimal")
    assert "turn 2 " in play_keys(current_game, "space", "right").last
    assert "no such key" in play_keys(make_game("crying-baby"), "right").last
    assert "turn 0/20" in play_keys(make_game("crying-baby"), "space").last


def test_the_step_and_autoplay_keys_report_that_the_game_is_over() -> None:
    agent_result = play_keys(make_game("hexworld", "script:e"), "space", "space", "space", "P")
    assert ["the game is over" in frame for frame in agent_result.frames] == [False] * 3 + [
        True
    ] * 2
    result = play_keys(make_game("prisoners-dilemma", "human", "random", turns=1), "c", "P")
    assert "the game is over" in result.last


def test_turns_played_by_one_command_are_all_logged() -> None:
    screen_text = play_keys(make_game("hexworld", "optimal"), ":", "auto enter", "x").last
    turns = [row.partition(".")[0].strip() for row in screen_text.split("\n") if ". chose " in row]
    assert turns == ["turn 1", "turn 2", "turn 3"]


def test_keys_start_pause_and_change_the_speed_of_autoplay() -> None:
    result = play_keys(make_game("hexworld", "optimal"), "+", "+", "-", "P", "P")
    assert "3 turns per second" in result.frames[1]
    assert "4.5 turns per second" in result.frames[2]
    assert "3 turns per second" in result.frames[3]
    assert "paused; P continues" in result.last
    assert "there is nothing to pause" in play_keys(make_game("hexworld"), "P").last


def test_quitting_a_long_unsaved_game_needs_a_second_key() -> None:
    current_game = make_game("hexworld", parameters={"rewards": []})
    result = play_keys(current_game, *"hl" * 11, "q", "h", "q", "q", "h")
    assert "22 turns are not saved; press q again to quit" in result.frames[23]
    assert "23 turns are not saved; press q again to quit" in result.frames[25]
    assert len(result.frames) == 26


def test_a_screen_too_small_for_the_board_is_played_in_text() -> None:
    result = play_keys(make_game("hexworld"), "h", size=(20, 6))
    assert result.frames[0].split("\n")[1:4] == [
        "board needs 19x9",
        " at (7,2). E (8,2)",
        "   floor. NE wall.",
    ]
    assert result.last.split("\n")[2:4] == [" turn 1. chose W,", "   moved W to …"]


@pytest.mark.parametrize(
    ("problem", "agent", "label"),
    [
        ("predator-prey", "chase", "A is the predator, o is the prey"),
        ("prisoners-dilemma", "grim", "agent1   -1"),
        ("hexworld", "optimal", "@ agent"),
        ("collaborative-predator-prey", "sweep", "@ where predator1 may be"),
        ("collaborative-predator-prey", "sweep", "predator1 sees neither it"),
        ("simple-regulator", "optimal", "costs its square"),
        ("travelers-dilemma", "random", "agent1 ↓   agent2 →"),
    ],
)
def test_a_watched_agent_is_called_by_its_name(problem: str, agent: str, label: str) -> None:
    agent_game = start_new_game(GameRequest(problem, agent=agent, seed=7))
    screen_text = compose_frame(agent_game, Viewport(120, 30), FrameState(), []).plain
    assert label in screen_text
    assert "you" not in screen_text + agent_game.narrator.describe_situation(agent_game.snapshot())


@pytest.mark.parametrize(
    ("problem", "label"),
    [
        ("predator-prey", "A is the predator, o is the prey"),
        ("hexworld", "@ agent"),
        ("collaborative-predator-prey", "@ predator1"),
        ("simple-regulator", "costs its square"),
        ("travelers-dilemma", "agent1 ↓   agent2 →"),
    ],
)
def test_the_player_of_a_recorded_game_is_called_by_name(
    problem: str, label: str, tmp_path: Path
) -> None:
    start_new_game(GameRequest(problem, seed=7, record_path=tmp_path / "g.dmt")).finish()
    playback = Playback(tmp_path / "g.dmt")
    screen_text = compose_frame(playback, Viewport(120, 30), FrameState(), []).plain
    assert label in screen_text
    assert "you" not in screen_text + playback.narrator.describe_situation(playback.snapshot())


def test_a_replay_shows_states_and_rewards(tmp_path: Path) -> None:
    agent_game = start_new_game(
        GameRequest("crying-baby", agent="feed-when-crying", seed=5, record_path=tmp_path / "g")
    )
    list(agent_game.iter_agent_turns())
    agent_game.finish()
    playback = Playback(tmp_path / "g")
    playback.play_agent_turn()
    expected = (
        "turn 1. chose ignore, heard crying. belief: hungry 0.907, sated 0.093. "
        "reward -10. score -10."
    )
    assert playback.narrator.describe_turn(playback.snapshot()) == expected
    screen_text = compose_frame(playback, Viewport(80, 24), FrameState(), []).plain
    assert "true state: hungry" in screen_text
    assert "reward   -10" in screen_text


def test_agents_that_play_behind_the_help_page_are_logged_turn_by_turn() -> None:
    screen = PlayScreen(
        GameController(make_game("hexworld", "optimal")), Terminal(True, "", True, False, False)
    )
    do(screen, "?")
    autoplay_turn(screen)
    assert [row.partition(".")[0] for row in screen.log] == ["turn 1"]


def test_a_high_speed_plays_several_turns_between_two_frames() -> None:
    screen = PlayScreen(
        GameController(make_game("simple-regulator", "random")),
        Terminal(True, "", True, False, False),
        speed=300.0,
    )
    assert get_autoplay_rate(screen) == 30
    autoplay_turn(screen)
    assert len(screen.game.session.turns) == 10
    screen.speed = 2.0
    assert get_autoplay_rate(screen) == 2
    autoplay_turn(screen)
    assert len(screen.game.session.turns) == 11
    screen.speed = 1e6
    assert count_turns_per_beat(screen) == 200


def test_fast_play_stops_at_the_end_of_the_game() -> None:
    screen = PlayScreen(
        GameController(make_game("hexworld", "optimal")),
        Terminal(True, "", True, False, False),
        speed=6000.0,
    )
    autoplay_turn(screen)
    assert screen.game.session.over
    assert screen.message == ""


@pytest.mark.parametrize("key", ["p", "P"])
def test_p_starts_and_stops_the_agents_in_either_case(key: str) -> None:
    screen = PlayScreen(
        GameController(make_game("hexworld", "optimal")), Terminal(True, "", True, False, False)
    )
    modes = []
    for _ in range(2):
        do(screen, key)
        modes.append(screen.modes.play_mode)
    assert modes == [Mode.AUTOPLAY, Mode.WAIT_FOR_KEY]


def test_a_page_stays_open_on_a_larger_screen_that_needs_fewer_parts() -> None:
    current_game = make_game("hexworld")
    frame_state = FrameState(page_rows=HELP_ROWS, page_index=9)
    for size in ((80, 4), (80, 10), (80, 24), (200, 60)):
        rows = compose_frame(current_game, Viewport(*size), frame_state, []).plain.split("\n")
        assert len(rows) == size[1]


@pytest.mark.parametrize("rows", [1, 2, 3, 4, 5, 6])
def test_the_handover_screen_names_the_next_player_in_the_smallest_sizes(rows: int) -> None:
    frame_state = FrameState(handover_agent="caregiver2")
    screen_text = compose_frame(
        make_game("multicaregiver-crying-baby"), Viewport(60, rows), frame_state, []
    ).plain
    assert "pass the keyboard to caregiver2" in screen_text
    assert "heard" not in screen_text


def test_the_log_begins_with_the_goal_when_the_goal_has_no_row() -> None:
    for rows in (19, 24):
        first_frame, second_frame = play_keys(make_game("hexworld"), "l", size=(80, rows)).frames
        assert first_frame.count("reach exit +10 or +5") == 1
        assert second_frame.count("reach exit +10 or +5") == (rows == 24)


@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.parametrize("rows", [1, 2, 3, 4, 5])
def test_the_smallest_screens_show_the_most_urgent_row(problem: str, rows: int) -> None:
    current_game = make_game(problem)
    result = play_keys(current_game, "L", "?", "x", "V", size=(60, rows))
    assert {len(frame.split("\n")) for frame in result.frames} == {rows}
    first_frame = " ".join(result.frames[0].split())
    assert ("board needs " in first_frame and "; playing in text" in first_frame) or rows > 3
    assert current_game.narrator.describe_situation(current_game.snapshot())[:20] in " ".join(
        result.frames[1].split()
    )
    assert " You " in result.frames[2]


def test_a_terminal_of_one_row_shows_one_line_of_text() -> None:
    result = play_keys(make_game("hexworld"), "l", "e", "?", size=(40, 1))
    assert result.frames == [
        " board needs 19x9; playing in text. at …",
        " turn 1. chose E, moved E to (8,2). rew…",
        " e: no such key; press l for the action…",
        " You walk from hex to hex; you always",
    ]


def test_a_log_line_that_does_not_fit_shows_its_beginning() -> None:
    rows = play_keys(make_game("hexworld"), "l", "u", size=(30, 5)).last.split("\n")
    assert rows[2].endswith("…")
    assert rows[2].startswith(" turn 2. chose NE, bumped")


def test_a_finished_game_accepts_no_actions() -> None:
    current_game = make_game("crying-baby", turns=1)
    result = play_keys(current_game, "f", "f", "tab")
    assert "over: the baby went hungry for " in result.frames[1]
    assert len(current_game.session.turns) == 1
    assert "no hint: the game is over" in result.last


def test_hidden_input_reveals_neither_its_letters_nor_its_length_nor_its_error() -> None:
    first, second = (
        play_keys(make_game("rock-paper-scissors"), ":", word, "enter")
        for word in ("rok", "scisors")
    )
    assert first.frames == second.frames
    assert "\n :(your typing is hidden)" in first.frames[1]
    assert "not a legal action; type legal to list the legal actions, or help" in first.last
    games = make_game("travelers-dilemma"), make_game("travelers-dilemma")
    frames = [play_keys(games[0], "7").last, play_keys(games[1], "7", "5").last]
    assert frames[0] == frames[1]
    error_frames = [
        play_keys(make_game("travelers-dilemma"), *keys, "enter").last for keys in ("1", "999")
    ]
    assert error_frames[0] == error_frames[1]


def test_a_resumed_game_shows_its_last_turn(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    first_game = start_new_game(GameRequest("hexworld", seed=7, record_path=path))
    first_game.choose(3)
    first_game.finish("interrupted")
    screen_text = play_keys(start_game(ResumeRequest(path))).last
    assert " turn 1. chose W, moved W to (6,2). reward 0. score 0." in screen_text
    assert "undone" not in screen_text


@pytest.mark.parametrize("keys", ["6 0", "right right left", "4 backspace 6 0"])
def test_a_number_is_typed_or_nudged_and_played_by_enter(keys: str) -> None:
    current_game = make_game("catch")
    result = play_keys(current_game, *keys.split(), "enter", "enter")
    assert "60, caught in 39% of cases; expected reward 23   Enter plays it" in result.frames[-3]
    assert "→60←" in result.frames[-3]
    assert "threw 60 m:" in result.frames[-2]
    assert "type a number first" in result.last
    assert "type a throw (10 to 100 by 10; 6 = 60), Enter  ← → by 10 " in result.last
    assert len(current_game.session.turns) == 1


@pytest.mark.parametrize(
    ("name", "keys", "message"),
    [
        ("catch", "6", "6 = 60, caught in 39% of cases; expected reward 23   Enter plays it"),
        ("catch", "right 6", "6 = 60, caught in 39% of cases; expected reward 23   Enter plays it"),
        ("catch", "6 1", "61: expected a whole number from 10 to 100 in steps of 10"),
        ("simple-regulator", "-", "-: expected a number from -10 to 10"),
        (
            "simple-regulator",
            "- . 2",
            "-.2, aims at -0.037; costs 0.0267 now, 0.0113 next on average",
        ),
    ],
)
def test_the_effect_of_a_typed_number_is_shown_before_it_is_played(
    name: str, keys: str, message: str
) -> None:
    assert f" {message}" in play_keys(make_game(name), *keys.split()).last


@pytest.mark.parametrize(
    ("name", "keys", "text"),
    [
        ("simple-regulator", "0 , 1", "0,1"), ("simple-regulator", ", 5", ",5"),
        ("simple-regulator", "1 / 2", "1/2"), ("simple-regulator", "5 space 0", "5 0"),
        ("simple-regulator", "1 x", "1x"), ("catch", "6 ; 0", "6;0"),
        ("travelers-dilemma", "5 , 0", "5,0"),
    ],
)  # fmt: skip
def test_a_character_that_no_number_has_is_not_dropped_from_a_typed_number(
    name: str, keys: str, text: str
) -> None:
    seats = ["human", "random"] if name == "travelers-dilemma" else []
    result = play_keys(current_game := make_game(name, *seats), *keys.split(), "enter")
    assert f" {text}: expected " in result.frames[-2]
    assert f"got '{text}', expected" in result.last
    assert current_game.session.turns == []


def test_a_letter_before_a_number_is_no_part_of_it() -> None:
    assert "x: no such key" in play_keys(make_game("catch"), "x").last


@pytest.mark.parametrize("name", ["catch", "simple-regulator"])
def test_enter_plays_the_number_of_a_hint_and_a_typed_one_comes_first(name: str) -> None:
    hinted, typed = make_game(name), make_game(name)
    assert ", Enter" in play_keys(hinted, "tab", "enter").frames[1]
    play_keys(typed, "tab", "1", "enter")
    (turn,), (other_turn,) = hinted.session.turns, typed.session.turns
    assert turn.actions != other_turn.actions


def test_escape_erases_a_typed_number() -> None:
    for keys in ("W 5 0 escape 1 0 0 enter", "5 escape 1 0 0 enter"):
        game = make_game("catch")
        play_keys(game, *keys.split())
        assert [game.problem.format_action(0, turn.actions[0]) for turn in game.session.turns] == [
            "100"
        ]


def test_backspace_after_a_refused_number_erases_it_and_undoes_no_turn() -> None:
    keys = "5 0 enter 9 9 enter backspace backspace 4 0 enter"
    game = make_game("catch")
    frames = play_keys(game, *keys.split()).frames
    assert "got '99', expected" in frames[6]
    assert " 9 = 90" in frames[7]
    names = [game.problem.format_action(0, turn.actions[0]) for turn in game.session.turns]
    assert names == ["50", "40"]


def test_digits_after_a_refused_number_begin_a_new_one() -> None:
    game = make_game("catch")
    play_keys(game, "9", "9", "enter", "4", "0", "enter")
    assert len(game.session.turns) == 1


def test_a_number_that_was_typed_for_another_turn_is_forgotten() -> None:
    keys = ["1", "0", "enter", "5", "c-_", "c-_", "c-r", "1", "0"]
    assert " 10, caught in " in play_keys(make_game("catch"), *keys).last


@pytest.mark.parametrize("name", ["machine-replacement", "collision-avoidance"])
def test_a_narrow_footer_shortens_action_labels_but_shows_them_all(name: str) -> None:
    row = play_keys(make_game(name), size=(50, 14)).last.split("\n")[-1]
    assert row.endswith("? help  q quit")
    labels = make_game(name).problem.actions[0].labels
    assert all(f"={label[:3]}" in row for label in labels)


def test_a_hint_in_a_simultaneous_game_states_its_assumption() -> None:
    screen_text = play_keys(make_game("prisoners-dilemma", "human", "grim"), "c", "tab").last
    hint = "press c (cooperate), by plan-rounds (9 turns left, against grim)"
    assert f" hint: {hint}\n" in screen_text


# Whole games


def iter_game_keys(game: Game) -> Iterator[str]:
    """Yield keys that play a game to its end, with changing actions, for every player."""
    for number in count():
        if game.session.over:
            return
        if game.keyboard.is_number_entry(game.viewing_seat):
            yield from "2" if number % 2 else "37"
            yield "enter"
        else:
            legal = [
                key for key, _, legal in game.keyboard.list_actions_with_keys(game.view()) if legal
            ]
            yield legal[number * 5 // 3 % len(legal)]
        if game.has_private_views and game.choosing_seat is not None:
            yield "enter"


@pytest.mark.parametrize(
    ("line", "width", "rows"),
    [
        (
            "  W       what if        what an action may bring, before you play it",
            40,
            """\
   W       what if        what an
   action may bring, before you play it""",
        ),
        (
            "  W       what if        what an action may bring, before you play it",
            50,
            """\
   W       what if        what an action may
                          bring, before you play
                          it""",
        ),
        (
            "actions: 10,  20,  30,  40,  50,  60,  70,  80,  90,  100",
            50,
            """\
 actions: 10,  20,  30,  40,  50,  60,  70,  80,
   90,  100""",
        ),
    ],
)
def test_a_wrapped_line_continues_below_its_last_column_if_that_is_wide(
    line: str, width: int, rows: str
) -> None:
    assert [row.rstrip() for row in wrap_lines([line], Viewport(width, 14))] == rows.split("\n")


DEFAULT_CASES = [(name, "") for name in problem_names()]
ALL_HUMAN_CASES = [
    (name, HUMAN) for name in problem_names() if len(dmplay.load_problem(name).agents) > 1
]


@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize(("name", "others"), [*DEFAULT_CASES, *ALL_HUMAN_CASES])
def test_every_problem_is_played_to_its_end_by_keys_and_its_transcript_verifies(
    name: str, others: str, tmp_path: Path
) -> None:
    path = tmp_path / "game.dmt"
    current_game = start_new_game(
        GameRequest(name, seed=7, turns=4, other_agent=others, record_path=path)
    )
    result = press_keys(current_game, iter_game_keys(current_game))
    assert current_game.session.end_reason in ("terminal", "horizon", "turn limit")
    assert f"over: {current_game.narrator.describe_end()[:60]}" in result.last
    # the end reveals the hidden state
    undo = "" if current_game.problem.partially_observable else "  Bksp undo"
    learn = "  M learn" if current_game.has_known_mistakes else ""
    worst = "  X worst" if any(move.regret for move in current_game.verdict.moves) else ""
    undo = "" if worst and learn else undo  # no space for all
    keys = f" Enter look back  PgUp log{worst}{learn}  N new  R restart{undo}  ? help  q quit"
    assert keys in f"{result.last.removesuffix('  : command')}"
    current_game.finish()
    report = verify(path)
    assert report.is_ok, str(report)
    assert report.turns == len(current_game.session.turns) > 0


# Several people


def test_two_players_at_one_keyboard_do_not_move_each_other() -> None:
    current_game = make_game("predator-prey", seed=1)
    result = play_keys(current_game, "l", "l", "h", "1", "h")
    assert current_game.session.turns == []
    assert "prey chooses now; choices stay hidden" in result.last
    play_keys(current_game, "l", "d")
    actions = current_game.session.turns[0].actions
    assert [current_game.problem.format_action(seat, actions[seat]) for seat in (0, 1)] == [
        "e",
        "e",
    ]
    play_keys(current_game, "a", "h")
    actions = current_game.session.turns[1].actions
    assert [current_game.problem.format_action(seat, actions[seat]) for seat in (0, 1)] == [
        "w",
        "w",
    ]


def test_a_handover_screen_separates_players_with_different_observations() -> None:
    current_game = make_game("collaborative-predator-prey", "human", "human")
    result = play_keys(current_game, "h", "l", "L", "enter", "l", "enter", "h", "enter")
    first, hidden, *_ = result.frames
    assert "you: predator1" in first
    assert result.frames[1:4] == [hidden] * 3  # an action and a look have no effect
    assert "pass the keyboard to predator2; Enter shows the board." in hidden
    assert "│" not in hidden
    assert "saw" not in hidden
    assert "you: predator2" in result.frames[4]
    assert "pass the keyboard to predator1" in result.frames[5]
    assert "turn 1. " in result.frames[6]
    assert "you: predator1" in result.frames[6]
    assert "pass the keyboard to predator2" in result.frames[7]
    assert "turn 1. " in result.last
    assert "you: predator2" in result.last


def test_each_of_two_players_has_a_log_of_its_own_information() -> None:
    current_game = make_game("multicaregiver-crying-baby")
    result = play_keys(current_game, "f", "enter", "s", "enter", "i", "enter")
    first, second = result.frames[4], result.last
    assert "chose feed" in first
    assert "chose sing" not in first
    assert "chose sing" in second
    assert "chose feed" not in second


def test_the_handover_screen_ignores_every_other_key_but_quit() -> None:
    current_game = make_game("multicaregiver-crying-baby")
    result = play_keys(current_game, "f", ":", "V", "?", "backspace")
    assert result.frames[1:] == [result.frames[1]] * 5
    assert play_keys(make_game("multicaregiver-crying-baby"), "f", "q", "f").code == 0
    assert len(current_game.session.turns) == 0


def test_commands_after_a_choice_show_nothing_of_the_next_player() -> None:
    current_game = make_game("multicaregiver-crying-baby")
    result = play_keys(current_game, "f", "enter", "s", "enter", ":", "feed; belief", "enter")
    assert "pass the keyboard to caregiver2" in result.last
    assert "belief" not in result.last
    assert len(current_game.session.turns) == 1


def test_players_with_the_same_observations_have_no_handover_screen() -> None:
    assert "is next" not in play_keys(make_game("prisoners-dilemma"), "c").last


# Composition


@cache
def make_frame_inputs(problem: str) -> tuple[tuple[Game, FrameState, tuple[str, ...]], ...]:
    """Return the inputs of frames: a new game, one in progress, one with help, one with an overlay
    and a long message, and a finished one.
    """
    unplayed = make_game(problem, parameters={"rewards": []} if problem == "hexworld" else {})
    ongoing, finished = make_game(problem), make_game(problem)
    log = []
    for current_game in (ongoing, finished):
        for _ in range(3):
            while not current_game.choose(next(a for a in range(4) if is_legal(current_game, a))):
                pass
            log.append(current_game.narrator.describe_turn(current_game.snapshot()))
    finished.finish("quit")
    long_message = FrameState(run_line(GameController(make_game(problem)), "keys"), "values")
    return (
        (unplayed, FrameState(), ()),
        (ongoing, FrameState(), tuple(log)),
        (ongoing, FrameState(page_rows=HELP_ROWS), tuple(log)),
        (ongoing, long_message, tuple(log)),
        (finished, FrameState("a message"), tuple(log * 9)),
    )


def is_legal(game: Game, action: int) -> bool:
    mask = game.session.legal_actions_mask(game.viewing_seat)
    return mask is None or bool(mask[action])


@pytest.mark.parametrize("ascii_", [False, True])
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("problem", PROBLEMS)
def test_a_frame_has_exactly_the_rows_of_the_screen_and_none_is_too_wide(
    problem: str, size: tuple[int, int], ascii_: bool
) -> None:
    viewport = Viewport(*size, ascii_)
    for current_game, frame_state, log in make_frame_inputs(problem):
        rows = compose_frame(current_game, viewport, frame_state, list(log)).plain.split("\n")
        assert len(rows) == viewport.height
        assert max(map(cell_len, rows)) <= viewport.width
        assert not ascii_ or "".join(rows).isascii()


@pytest.mark.parametrize("problem", PROBLEMS)
def test_a_narrow_title_drops_facts_and_a_long_message_moves_to_the_log(problem: str) -> None:
    wide = compose_frame(*_make_compose_arguments(problem, 300)).plain.split("\n")
    cut = compose_frame(*_make_compose_arguments(problem, 40)).plain.split("\n")
    assert {*cut[0].split()} <= {*wide[0].split(), "you:"}, "a title tells a fact whole"
    assert not cut[-2].strip(), "the log tells it"
    assert "a message a message" in "\n".join(cut[:-2])


def test_a_path_longer_than_a_row_is_shown_completely() -> None:
    path = "/home/somebody/" + "a-folder/" * 9 + "game.dmt"
    rows = compose_frame(
        make_game("hexworld"), Viewport(50, 24), FrameState(page_rows=[f"transcript: {path}"]), []
    ).plain
    assert f"transcript:{path}" in "".join(rows.split())


def test_a_narrow_title_drops_the_seed_before_other_facts() -> None:
    wide = play_keys(make_game("prisoners-dilemma", "human", "tit-for-tat"), size=(120, 24)).last
    assert wide.startswith(
        " dmplay prisoners-dilemma    seed 7   turn 0/10   score 0   "
        "you are agent1   agent2 played by tit-for-tat\n"
    )
    narrow = play_keys(make_game("prisoners-dilemma", "human", "tit-for-tat"), size=(80, 24)).last
    assert narrow.startswith(
        " prisoners-dilemma  turn 0/10  score 0  you: agent1  agent2: tit-for-tat\n"
    )


def _make_compose_arguments(
    problem: str, width: int
) -> tuple[Game, Viewport, FrameState, list[str]]:
    return make_game(problem), Viewport(width, 24), FrameState("a message " * 9), []


@pytest.mark.parametrize("width", [50, 60, 80])
@pytest.mark.parametrize("problem", PROBLEMS)
def test_the_footer_shows_every_action_and_the_help_key(problem: str, width: int) -> None:
    current_game = make_game(problem)
    row = format_footer(current_game, Viewport(width, 24)).plain
    for key, label, legal in current_game.keyboard.list_actions_with_keys(current_game.view()):
        text = KEY_SYMBOLS.get(key, label) if key == label else f"{key}={label}"
        assert (text if legal else f"[{text}]") in row
    assert "? help" in row


@pytest.mark.extra("openspiel")
def test_labels_that_are_equal_after_truncation_leave_only_their_keys() -> None:
    current_game = make_game("openspiel:tic_tac_toe", "human", "random")
    row = format_footer(current_game, Viewport(80, 24)).plain
    assert row.startswith(" 1  2  3  4  5  6  7  8  9  Tab hint ")  # the board lists the actions


def test_control_characters_in_names_are_escaped_on_the_screen() -> None:
    hostile_game = make_session_game(
        "hex\x1b]0;x\x07", make_game("hexworld").session, ["\x9b31m\u202e"]
    )
    text = compose_frame(
        hostile_game, Viewport(200, 24), FrameState("no \x1b[2J such key"), []
    ).plain
    assert text.replace("\n", "").isprintable()
    assert r"\x1b]0;x\x07" in text


# Privacy


@dataclass(frozen=True)
class ConstantUniforms:
    """Constant uniforms: one value at the start of the game, another in every turn."""

    initial_uniform: float
    turn: float

    def generate_uniforms(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        """Return an array of `count` equal numbers."""
        return np.full((1, count), self.turn if turn else self.initial_uniform)


@pytest.mark.parametrize("size", [(80, 24), (50, 14)])
def test_the_screen_bytes_do_not_depend_on_the_hidden_state(size: tuple[int, int]) -> None:
    keys = (
        "i", "s", "tab", "L", "V", "V", "?", "x", "i", "backspace", "c-r", ":", "state", "enter",
        ":", "belief", "enter", "i",
    )  # fmt: skip
    results: list[tuple[list[int], list[int], ScreenRun, dict[str, object], str]] = []
    for uniforms in (ConstantUniforms(0.25, 0.5), ConstantUniforms(0.75, 0.95)):
        session = make_game("crying-baby", source=uniforms).session
        current_game = make_session_game(
            "crying-baby", session, [HUMAN], make_secret_request("crying-baby")
        )
        result = play_keys(current_game, *keys, size=size)
        states = [int(turn.state) for turn in current_game.session.turns]
        observations = [int(turn.observations[0]) for turn in current_game.session.turns]
        results.append(
            (
                states,
                observations,
                result,
                current_game.narrator.visible_turn_facts(current_game.snapshot()),
                current_game.narrator.describe_situation(current_game.snapshot()),
            )
        )
    sated, hungry = results
    assert sated[0] == [0] * 4
    assert hungry[0] == [1] * 4
    assert sated[1] == hungry[1]
    assert sated[2].frames == hungry[2].frames
    assert sated[2].written == hungry[2].written
    assert sated[3:] == hungry[3:]
    assert len(sated[2].frames) == len(keys) + 1


def test_every_key_of_a_view_can_be_typed() -> None:
    for problem in PROBLEMS:
        for key in make_game(problem).view_module.KEYS:
            assert all(len(word) == 1 or word in KEY_SEQUENCES for word in key.split())


def test_help_lists_the_keys_of_the_pace_only_if_something_moves_by_itself() -> None:
    assert "pause" not in play_keys(make_game("hexworld"), "?", size=(80, 40)).last
    assert "pause" in play_keys(make_game("hexworld", "random"), "?", size=(80, 40)).last


def test_help_describes_the_agent_that_plays_the_other_seat() -> None:
    current_game = make_game("rock-paper-scissors", "human", "frequency")
    text = " ".join(play_keys(current_game, "?").last.split())
    assert "agent2 is played by frequency, which plays what does best against" in text


def test_the_letters_of_the_steps_stay_on_the_map() -> None:
    current_game = make_game("hexworld", parameters={"rewards": []})
    for frame in play_keys(current_game, *"hlhlhlhl").frames:
        assert any(f"  {key}  │" in frame for key in "hlyubn")


def test_title_panel_and_log_show_a_score_in_the_same_digits() -> None:
    game = make_game("predator-prey", "human", "flee")
    text = play_keys(game, *["l", "h"] * 3, size=(120, 30)).last
    _, _, score = game.narrator.describe_turn(game.snapshot()).removesuffix(".").rpartition(" ")
    assert len(score) == len("-4.686")
    assert f"score (discounted) {score} " in text
    assert f"score A  {score}" in text


def test_the_panel_describes_the_rule_of_a_built_in_agent_and_of_a_file(tmp_path: Path) -> None:
    file = tmp_path / "echo.py"
    file.write_text(
        "from dmplay import ReactivePolicy\n"
        "class Echo(ReactivePolicy):\n"
        '    """Copies the opponent\'s first action."""\n'
        "    def choose(self, memory, uniforms):\n"
        "        return 0.0, memory\n",
        encoding="utf-8",
    )
    for player, rule in (
        ("tit-for-tat", "cooperates first, then repeats your last action"),
        (f"{file}:Echo", "copies your first action"),
    ):
        game = make_game("prisoners-dilemma", "human", player)
        screen_text = compose_frame(game, Viewport(120, 30), FrameState(), []).plain
        assert rule in screen_text


def test_the_panel_says_why_a_reward_is_hidden() -> None:
    baby_screen, catch_screen = (
        compose_frame(make_game(name), Viewport(80, 24), FrameState(), []).plain
        for name in ("crying-baby", "catch")
    )
    assert "it would tell" in baby_screen
    assert "it would tell" not in catch_screen

"""Tests of whole games by real keys in a real terminal: turns, undo, commands, help and hints."""

import json
import shlex
import time
from pathlib import Path

import pytest

from dmplay.terminal.background import BACKGROUND_QUERY
from tests.support.games import assert_verified, read_values
from tests.support.programs import run_dmplay
from tests.support.terminals import (
    BACKSPACE,
    CTRL_D,
    CTRL_L,
    CTRL_R,
    DMPLAY_COMMAND,
    DOWN,
    ENTER,
    ESCAPE,
    LEFT,
    RIGHT,
    TAB,
    UP,
    Terminal,
)

pytestmark = pytest.mark.slow
REPLY = "\x1b]11;rgb:ffff/ffff/ffff\x1b\\"


def test_the_keys_and_the_words_of_hexworld_write_the_same_transcript(tmp_path: Path) -> None:
    commands = "w\nnw\nne\ne\nse\nsw\nquit\n"
    result = run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "piped.dmt", stdin=commands)
    assert result.returncode == 0
    with Terminal("hexworld", "--seed", "7", "-o", "keys.dmt", folder=tmp_path) as terminal:
        terminal.ready()
        for turn, key in enumerate("hyulnb", 1):
            terminal.press(key, f"turn {turn} ")
        assert terminal.press("q").ended() == 0
        assert "transcript: keys.dmt" in terminal.text
        assert terminal.left_clean()
    assert (tmp_path / "keys.dmt").read_bytes() == (tmp_path / "piped.dmt").read_bytes()
    assert_verified(tmp_path / "keys.dmt")


def test_a_whole_game_of_2048_is_played_with_the_arrows(tmp_path: Path) -> None:
    with Terminal("2048", "--seed", "7", "-o", "game.dmt", folder=tmp_path) as terminal:
        terminal.ready()
        for _ in range(60):
            if "nothing moves" in terminal.text:
                break
            terminal.press((LEFT + DOWN) * 10 + RIGHT + DOWN + UP + DOWN).calm(0.05)
        terminal.until("nothing moves")
        assert terminal.press("q").ended() == 0
    end = json.loads(read_values(assert_verified(tmp_path / "game.dmt"), "end")[0])
    assert end["reason"] == "terminal"
    assert end["turns"] > 50


def test_a_slide_that_moves_nothing_is_reported_and_is_not_a_turn(tmp_path: Path) -> None:
    with Terminal("2048", "--seed", "7", "-o", "game.dmt", folder=tmp_path) as terminal:
        terminal.ready()
        for arrow in (DOWN, LEFT, DOWN, LEFT) * 20:
            terminal.press(arrow).calm(0.05)
            if "moves no tile" in terminal.text:
                break
        terminal.until("moves no tile")
        assert terminal.press("q").ended() == 0
    assert_verified(tmp_path / "game.dmt")


def test_crying_baby_is_played_by_letters_and_shows_its_state_at_the_end(tmp_path: Path) -> None:
    arguments = ("crying-baby", "--seed", "7", "--turns", "3", "-o", "game.dmt")
    with Terminal(*arguments, folder=tmp_path) as terminal:
        terminal.ready().press("f", "turn 1/3").press("s", "turn 2/3")
        assert "true state" not in terminal.text
        assert "return" not in terminal.text
        terminal.press("i", "over: the baby went hungry for ")
        terminal.press("\r", "true state: sated").until("turn 3: chose ignore, the best action.")
        assert terminal.press("q").ended() == 0
    actions = [
        json.loads(line)["agent"]
        for line in read_values(assert_verified(tmp_path / "game.dmt"), "actions")
    ]
    assert actions == ["feed", "sing", "ignore"]


def test_the_first_choice_of_two_players_can_be_undone(tmp_path: Path) -> None:
    arguments = ("prisoners-dilemma", "--vs", "human", "--seed", "7", "-o", "game.dmt")
    with Terminal(*arguments, folder=tmp_path) as terminal:
        terminal.ready().press("d", "agent2 chooses").press(BACKSPACE, "your choice is undone")
        terminal.press("c", "agent2 chooses").press("c", "turn 1/10").press("q")
        assert terminal.ended() == 0
    assert read_values(tmp_path / "game.dmt", "actions") == [
        '{"agent1": "cooperate", "agent2": "cooperate"}'
    ]
    assert read_values(tmp_path / "game.dmt", "undo") == []


def test_grim_never_forgives(tmp_path: Path) -> None:
    arguments = ("prisoners-dilemma", "--vs", "grim", "--seed", "7", "-o", "game.dmt")
    with Terminal(*arguments, folder=tmp_path) as terminal:
        terminal.ready()
        for turn, key in enumerate("cdcccccccc", 1):
            terminal.press(key, f"turn {turn}/10")
        terminal.until("over: both cooperated in 1 of 10 rounds").press("q")
        assert terminal.ended() == 0
    joint_actions = map(json.loads, read_values(assert_verified(tmp_path / "game.dmt"), "actions"))
    assert (
        "".join(action_by_agent["agent2"][0] for action_by_agent in joint_actions) == "ccdddddddd"
    )


def test_an_agent_is_watched_step_by_step(tmp_path: Path) -> None:
    arguments = ("hexworld", "--agent", "optimal", "--seed", "7", "-o", "game.dmt")
    with Terminal(*arguments, folder=tmp_path) as terminal:
        terminal.ready().press(" ", "turn 1 ").press(RIGHT, "turn 2 ").press("q")
        assert terminal.ended() == 0
    assert_verified(tmp_path / "game.dmt")


def test_a_replay_is_stepped_forward_and_back(tmp_path: Path) -> None:
    result = run_dmplay(
        tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="w\nw\nundo\nnw\n"
    )
    assert result.returncode == 0
    with Terminal("replay", "g.dmt", folder=tmp_path) as terminal:
        terminal.ready().press(" ", "turn 1 ").press(" ", "turn 2 ").press(" ", "turn 1 ")
        terminal.press(BACKSPACE, "turn 2 ").press("q")
        assert terminal.ended() == 0


def test_autoplay_of_a_replay_stops_at_an_error_in_the_transcript(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="w\nw\nw\n")
    text = (tmp_path / "g.dmt").read_text()
    (tmp_path / "bad.dmt").write_text(text.replace("turn: 3", "turn: 4"))
    for name, message in (("g.dmt", "quit after 3 turns"), ("bad.dmt", "got turn 4, expected 3")):
        with Terminal("replay", name, "--speed", "50", folder=tmp_path) as terminal:
            terminal.ready().press("A", message).press("q")
            assert terminal.ended() == 0


def test_a_speed_of_zero_or_less_is_refused(tmp_path: Path) -> None:
    for speed in ("0", "-1"):
        result = run_dmplay(tmp_path, "hexworld", "--agent", "optimal", "--speed", speed)
        assert result.returncode == 2
        assert "--speed" in result.stderr


# Undo


def test_undo_redo_and_reroll_are_recorded_and_the_transcript_verifies(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", "-o", "game.dmt", folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").press("h", "turn 2 ")
        terminal.press(BACKSPACE, "undone. turn 1.").press(CTRL_R, "turn 2 ")
        terminal.press(":").press("reroll", ":reroll").press(ENTER).calm()
        terminal.press(":").press("undo 2", ":undo 2").press(ENTER, "undone. turn 0.")
        terminal.press("l", "turn 1 ").press("q")
        assert terminal.ended() == 0
    path = assert_verified(tmp_path / "game.dmt")
    lines = path.read_text().splitlines()
    blocks = [line for line in lines if line.startswith(("turn", "undo", "reroll"))]
    assert blocks == [
        "turn: 0", "turn: 1", "turn: 2", "undo: 1", "turn: 2", "reroll: 1", "turn: 2", "undo: 2",
        "turn: 1",
    ]  # fmt: skip
    uniforms = read_values(path, "draws")
    assert uniforms[2] == uniforms[3] != uniforms[4]


def test_a_strict_game_refuses_undo(tmp_path: Path) -> None:
    arguments = ("hexworld", "--seed", "7", "--strict", "-o", "game.dmt")
    with Terminal(*arguments, folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").press(BACKSPACE, "undo: this game is strict")
        terminal.press("q")
        assert terminal.ended() == 0


# The command prompt, help and hints


def test_the_command_prompt_runs_commands_and_escape_closes_it(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").press(":").press("undo", ":undo")
        terminal.press(ESCAPE, lambda: ":undo" not in terminal.text).calm()
        terminal.until("turn 1 ")
        terminal.press("h", "turn 2 ").press(":").press("undo", ":undo")
        terminal.press(ENTER, "undone. turn 1.")
        terminal.press(":").press("nonsense", ":nonsense").press(ENTER, "unknown action 'nonsense'")
        terminal.press(":").press("quit", ":quit").press(ENTER)
        assert terminal.ended() == 0


def test_help_opens_over_the_board_and_any_key_closes_it(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().press("?", "page 1 of 3").press("  ", "The key : opens a line")
        terminal.press("x", lambda: "commands, typed" not in terminal.text).until("turn 0 ")
        assert terminal.press(CTRL_D).ended() == 0


def test_a_hint_names_the_best_action_and_all_values(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().press(TAB, "hint: press n (se), by optimal").until("n=se best  b=sw  l=e")
        terminal.press("V", "overlay: exact values").press(CTRL_L).until("│ 7.04│")
        assert terminal.press("q").ended() == 0


def test_a_reply_in_pieces_is_no_key_on_the_screen_and_changes_the_theme(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", "-o", "game.dmt", folder=tmp_path) as terminal:
        terminal.until(lambda: BACKGROUND_QUERY in terminal.printed)
        for piece in ("\x1b", "]11;rgb:ffff/ff", "ff/ffff\x1b", "\\"):
            terminal.press(piece)
            time.sleep(0.05)
        terminal.ready().press("q").ended()
    assert "actions:" not in (tmp_path / "game.dmt").read_text()


@pytest.mark.parametrize("pieces", [(REPLY,), (REPLY[:1], REPLY[1:]), (REPLY[:9], REPLY[9:])])
def test_a_reply_after_the_end_of_the_game_is_not_typed_into_the_shell(
    pieces: tuple[str, ...], tmp_path: Path
) -> None:
    script = f"{shlex.join(DMPLAY_COMMAND)} hexworld --seed 7; sleep 1; echo done"
    with Terminal(folder=tmp_path, command=("sh", "-c", script)) as terminal:
        terminal.until(lambda: BACKGROUND_QUERY in terminal.printed)
        asked_at = time.monotonic()
        terminal.ready().press("q", lambda: "\x1b[?1049l" in terminal.printed)
        for piece in pieces:
            while time.monotonic() < asked_at + 0.7 / len(pieces):
                terminal.read()
            terminal.press(piece)
            asked_at = time.monotonic()
        terminal.until("done").ended()
        assert "11;rgb" not in terminal.text

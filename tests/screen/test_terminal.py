"""Whole games by real keys in a real terminal; what signals, sizes and full disks do to them."""

import json
import os
import pty
import re
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

import pytest

from dmplay.game.checking import check
from tests.support.games import values
from tests.support.programs import run
from tests.support.terminals import (
    BACKSPACE,
    CTRL_C,
    CTRL_D,
    CTRL_L,
    CTRL_R,
    CTRL_Z,
    DMPLAY,
    DOWN,
    ENTER,
    ESCAPE,
    LEFT,
    RIGHT,
    TAB,
    UP,
    Terminal,
    clean_environment,
    colours,
)

pytestmark = pytest.mark.slow

PROBLEMS = ("2048", "crying-baby", "hexworld", "prisoners-dilemma")
DRAWN = re.compile("[\u2500-\u28ff]")
NOTHING: Mapping[str, str] = {}
SIZE_LIMIT = 700  # bytes that a small disk holds


def fresh(
    *words: str,
    folder: Path,
    typed: str = "",
    disk: int | None = None,
    env: Mapping[str, str] = NOTHING,
) -> subprocess.CompletedProcess[str]:
    """The program from its very start: in another language, or where a disk is small."""

    def small() -> None:
        if disk is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (disk, disk))

    return subprocess.run(
        [*DMPLAY, *words],
        input=typed,
        capture_output=True,
        text=True,
        env=clean_environment(folder, **env),
        cwd=folder,
        timeout=60,
        check=False,
        preexec_fn=small,
    )


def shell(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """A line of bash in which `dmplay` is the program."""
    quoted = f'dmplay() {{ "{sys.executable}" -m dmplay "$@"; }}; {line}'
    return subprocess.run(
        ["bash", "-c", quoted],
        capture_output=True,
        text=True,
        env=clean_environment(folder),
        cwd=folder,
        timeout=60,
        check=False,
    )


def verified(path: Path) -> Path:
    report = check(path)
    assert report.ok, str(report)
    return path


# Games by keys


def test_hexworld_by_its_six_letters_is_the_game_of_the_same_words(tmp_path: Path) -> None:
    typed = "w\nnw\nne\ne\nse\nsw\nquit\n"
    piped = run(tmp_path, "hexworld", "--seed", "7", "-o", "piped.dmt", stdin=typed)
    assert piped.returncode == 0
    with Terminal("hexworld", "--seed", "7", "-o", "keys.dmt", folder=tmp_path) as terminal:
        terminal.ready()
        for turn, key in enumerate("hyulnb", 1):
            terminal.press(key, f"turn {turn} ")
        assert terminal.press("q").ended() == 0
        assert "transcript: keys.dmt" in terminal.text
        assert terminal.left_clean()
    assert (tmp_path / "keys.dmt").read_bytes() == (tmp_path / "piped.dmt").read_bytes()
    verified(tmp_path / "keys.dmt")


def test_a_whole_game_of_2048_is_played_with_the_arrows(tmp_path: Path) -> None:
    with Terminal("2048", "--seed", "7", "-o", "game.dmt", folder=tmp_path) as terminal:
        terminal.ready()
        for _ in range(60):
            if "terminal after" in terminal.text:
                break
            terminal.press((LEFT + DOWN) * 10 + RIGHT + DOWN + UP + DOWN).calm(0.05)
        terminal.until("over: terminal after")
        assert terminal.press("q").ended() == 0
    end = json.loads(values(verified(tmp_path / "game.dmt"), "end")[0])
    assert end["reason"] == "terminal"
    assert end["turns"] > 50


def test_a_slide_that_moves_nothing_says_so_and_is_no_turn(tmp_path: Path) -> None:
    with Terminal("2048", "--seed", "7", "-o", "game.dmt", folder=tmp_path) as terminal:
        terminal.ready()
        for arrow in (DOWN, LEFT, DOWN, LEFT) * 20:
            terminal.press(arrow).calm(0.05)
            if "changes nothing" in terminal.text:
                break
        terminal.until("changes nothing")
        assert terminal.press("q").ended() == 0
    verified(tmp_path / "game.dmt")


def test_a_crying_baby_is_cared_for_by_letters_and_its_state_shown_at_the_end(
    tmp_path: Path,
) -> None:
    words = ("crying-baby", "--seed", "7", "--turns", "3", "-o", "game.dmt")
    with Terminal(*words, folder=tmp_path) as terminal:
        terminal.ready().press("f", "turn 1/3").press("s", "turn 2/3")
        assert "state" not in terminal.text
        assert "return" not in terminal.text
        terminal.press("i", "turn 3. action ignore. state").until("turn limit after 3 turns")
        assert terminal.press("q").ended() == 0
    told = [json.loads(one)["agent"] for one in values(verified(tmp_path / "game.dmt"), "actions")]
    assert told == ["feed", "sing", "ignore"]


def test_two_people_choose_and_the_first_choice_stays_hidden_until_both_are_in(
    tmp_path: Path,
) -> None:
    seen = []
    for first in "cd":
        words = ("prisoners-dilemma", "--vs", "human", "--seed", "7", "-o", f"{first}.dmt")
        with Terminal(*words, folder=tmp_path) as terminal:
            terminal.ready().press(first, "agent2 chooses").calm()
            seen.append(terminal.text)
            told = {"c": "agent1 chose cooperate", "d": "agent1 chose defect"}[first]
            terminal.press("d", f"turn 1. {told}. agent2 chose defect.")
            assert terminal.press("q").ended() == 0
        verified(tmp_path / f"{first}.dmt")
    assert seen[0] == seen[1]


def test_a_first_choice_of_two_can_be_taken_back(tmp_path: Path) -> None:
    words = ("prisoners-dilemma", "--vs", "human", "--seed", "7", "-o", "game.dmt")
    with Terminal(*words, folder=tmp_path) as terminal:
        terminal.ready().press("d", "agent2 chooses").press(BACKSPACE, "your choice is taken back")
        terminal.press("c", "agent2 chooses").press("c", "turn 1/10").press("q")
        assert terminal.ended() == 0
    assert values(tmp_path / "game.dmt", "actions") == [
        '{"agent1": "cooperate", "agent2": "cooperate"}'
    ]
    assert values(tmp_path / "game.dmt", "undo") == []


def test_grim_never_forgives(tmp_path: Path) -> None:
    words = ("prisoners-dilemma", "--vs", "grim", "--seed", "7", "-o", "game.dmt")
    with Terminal(*words, folder=tmp_path) as terminal:
        terminal.ready()
        for turn, key in enumerate("cdcccccccc", 1):
            terminal.press(key, f"turn {turn}/10")
        terminal.until("horizon after 10 turns").press("q")
        assert terminal.ended() == 0
    told = map(json.loads, values(verified(tmp_path / "game.dmt"), "actions"))
    assert "".join(one["agent2"][0] for one in told) == "ccdddddddd"


def test_an_agent_is_watched_step_by_step(tmp_path: Path) -> None:
    words = ("hexworld", "--agent", "optimal", "--seed", "7", "-o", "game.dmt")
    with Terminal(*words, folder=tmp_path) as terminal:
        terminal.ready().press(" ", "turn 1 ").press(RIGHT, "turn 2 ").press("q")
        assert terminal.ended() == 0
    verified(tmp_path / "game.dmt")


def test_a_recording_is_stepped_through_forth_and_back(tmp_path: Path) -> None:
    piped = run(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="w\nw\nundo\nnw\n")
    assert piped.returncode == 0
    with Terminal("replay", "g.dmt", folder=tmp_path) as terminal:
        terminal.ready().press(" ", "turn 1 ").press(" ", "turn 2 ").press(" ", "turn 1 ")
        terminal.press(BACKSPACE, "turn 2 ").press("q")
        assert terminal.ended() == 0


def test_autoplay_goes_on_by_itself_and_stops_at_a_fault_of_the_recording(tmp_path: Path) -> None:
    run(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="w\nw\nw\n")
    text = (tmp_path / "g.dmt").read_text()
    (tmp_path / "bad.dmt").write_text(text.replace("turn: 3", "turn: 4"))
    for name, seen in (("g.dmt", "quit after 3 turns"), ("bad.dmt", "got turn 4, expected 3")):
        with Terminal("replay", name, "--speed", "50", folder=tmp_path) as terminal:
            terminal.ready().press("A", seen).press("q")
            assert terminal.ended() == 0


def test_a_speed_of_nothing_is_refused(tmp_path: Path) -> None:
    for speed in ("0", "-1"):
        done = run(tmp_path, "hexworld", "--agent", "optimal", "--speed", speed)
        assert done.returncode == 2
        assert "--speed" in done.stderr


# Taking back


def test_undo_redo_and_reroll_stand_in_the_transcript_which_verifies(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", "-o", "game.dmt", folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").press("h", "turn 2 ")
        terminal.press(BACKSPACE, "undone. turn 1.").press(CTRL_R, "turn 2 ")
        terminal.press(":").press("reroll", ":reroll").press(ENTER).calm()
        terminal.press(":").press("undo 2", ":undo 2").press(ENTER, "undone. turn 0.")
        terminal.press("l", "turn 1 ").press("q")
        assert terminal.ended() == 0
    path = verified(tmp_path / "game.dmt")
    lines = path.read_text().splitlines()
    blocks = [line for line in lines if line.startswith(("turn", "undo", "reroll"))]
    assert blocks == [
        "turn: 0", "turn: 1", "turn: 2", "undo: 1", "turn: 2", "reroll: 1", "turn: 2", "undo: 2",
        "turn: 1",
    ]  # fmt: skip
    draws = values(path, "draws")
    assert draws[2] == draws[3] != draws[4]


def test_a_strict_game_takes_nothing_back(tmp_path: Path) -> None:
    words = ("hexworld", "--seed", "7", "--strict", "-o", "game.dmt")
    with Terminal(*words, folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").press(BACKSPACE, "undo: this game is strict")
        terminal.press("q")
        assert terminal.ended() == 0


# The command row, help and hints


def test_the_command_row_takes_words_and_escape_closes_it(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").press(":").press("undo", ":undo")
        terminal.press(ESCAPE, lambda: ":undo" not in terminal.text).calm()
        assert "turn 1 " in terminal.text
        terminal.press("h", "turn 2 ").press(":").press("undo", ":undo")
        terminal.press(ENTER, "undone. turn 1.")
        terminal.press(":").press("nonsense", ":nonsense").press(ENTER, "unknown action 'nonsense'")
        terminal.press(":").press("quit", ":quit").press(ENTER)
        assert terminal.ended() == 0


def test_help_opens_over_the_board_and_any_key_closes_it(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().press("?", "commands, typed after ':'")
        terminal.press("x", lambda: "commands, typed" not in terminal.text)
        assert "turn 0 " in terminal.text
        assert terminal.press(CTRL_D).ended() == 0


def test_a_hint_names_the_best_action_and_all_values(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().press(TAB, "hint (optimal): se. values: e 6.27, ne 5.47")
        terminal.press("V", "overlay: values").press(CTRL_L).until("│ 7.04│")
        assert terminal.press("q").ended() == 0


# Signals


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)]
)
def test_a_signal_ends_the_game_with_its_code_and_a_whole_transcript(
    number: int, code: int, tmp_path: Path
) -> None:
    with Terminal("hexworld", "--seed", "7", "-o", "game.dmt", folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").signal(number)
        assert terminal.ended() == code
        assert terminal.left_clean()
        assert "Traceback" not in terminal.printed
    end = json.loads(values(verified(tmp_path / "game.dmt"), "end")[0])
    assert (end["reason"], end["turns"]) == ("interrupted", 1)


def test_ctrl_c_ends_the_game_as_its_signal_does(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", "-o", "game.dmt", folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").press(CTRL_C)
        assert terminal.ended() == 130
        assert terminal.left_clean()
    verified(tmp_path / "game.dmt")


@pytest.mark.parametrize("wait", [0, 15, 30, 60, 90, 120, 150, 250])
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)]
)
def test_a_signal_before_the_first_key_leaves_the_terminal_as_it_was(
    number: int, code: int, wait: int, tmp_path: Path
) -> None:
    # Before the interpreter is up, which tells so here, a signal is its own affair.
    up = "print('up', flush=True); import runpy; runpy.run_module('dmplay', None, '__main__')"
    command = (sys.executable, "-c", up)
    with Terminal("hexworld", "--seed", "7", folder=tmp_path, command=command) as terminal:
        terminal.until(lambda: b"up" in terminal.raw)
        time.sleep(wait / 1000)
        terminal.signal(number)
        assert terminal.ended() == code
        assert terminal.left_clean()
        assert '/dmplay/__main__.py"' not in terminal.printed  # nothing of ours is traced back


@pytest.mark.parametrize("outside", [False, True])
def test_a_stopped_game_gives_the_terminal_back_and_fg_goes_on(
    outside: bool, tmp_path: Path
) -> None:
    bash = ("bash", "--norc", "--noprofile", "-i")
    with Terminal(command=bash, folder=tmp_path, env={"PS1": "ready> "}) as terminal:
        terminal.until("ready>").press("stty -a > before\r").calm()
        terminal.press(f"{sys.executable} -m dmplay hexworld --seed 7 -o game.dmt\r").ready()
        terminal.press("h", "turn 1 ")
        if outside:
            os.kill(os.tcgetpgrp(terminal.child.child_fd), signal.SIGTSTP)
        else:
            terminal.press(CTRL_Z)
        terminal.until("Stopped").calm()
        assert terminal.raw.rfind(b"\x1b[?1049l") > terminal.raw.rfind(b"\x1b[?1049h")
        assert terminal.raw.rfind(b"\x1b[?25h") > terminal.raw.rfind(b"\x1b[?25l")
        terminal.press("stty -a > after\r").calm().press("fg\r", "turn 1 ").calm()
        terminal.press("h", "turn 2 ").press("q", "transcript: game.dmt").calm()
        terminal.press("echo code=$?\r", "code=0").press("exit\r")
        assert terminal.ended() == 0
    assert (tmp_path / "before").read_text() == (tmp_path / "after").read_text()
    verified(tmp_path / "game.dmt")


def test_two_who_hear_different_things_take_turns_before_a_plain_terminal(tmp_path: Path) -> None:
    words = ("multicaregiver-crying-baby", "--vs", "human", "--seed", "3", "--plain")
    with Terminal(*words, folder=tmp_path) as terminal:
        terminal.until("caregiver1 action>").press(f"feed; belief{ENTER}")
        terminal.until("caregiver2 is next: nobody else should look now. Enter goes on.")
        assert "feed" not in terminal.text
        assert terminal.text.count("belief") == 1  # as the game began
        terminal.press(ENTER).until("caregiver2 action>").press(f"sing{ENTER}")
        terminal.until("caregiver1 is next").press(ENTER)
        terminal.until("turn 1. quiet. chose feed.").press(f"{CTRL_D}")
        assert terminal.ended() == 0


def test_two_who_hear_different_things_have_a_curtain_in_the_shell(tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path) as terminal:
        play = "play multicaregiver-crying-baby --vs human --seed 3"
        terminal.ready().press(f"{play}{ENTER}", "t0 caregiver1]>").calm()
        terminal.press(f"feed; belief{ENTER}", "caregiver2 is next: nobody else should look now.")
        assert "heard" not in terminal.text  # the board of the one before is wiped
        terminal.press(ENTER, "t0 caregiver2]>").calm().press(f"sing{ENTER}", "caregiver1 is next")
        assert "chose" not in terminal.calm().text
        terminal.press(ENTER, "turn 1. quiet. chose feed.").until("t1 caregiver1]>").calm()
        terminal.press(f"undo{ENTER}", "undone. turn 0.").until("t0 caregiver1]>").calm()
        terminal.press(f"feed{ENTER}", "caregiver2 is next").press(CTRL_C, "Ctrl-C once more")
        assert terminal.press(CTRL_C).ended() == 130
        assert terminal.left_clean()


def test_who_leaves_the_screen_for_the_shell_is_shown_nothing_of_the_next(tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path) as terminal:
        play = "play multicaregiver-crying-baby --vs human --seed 3"
        terminal.ready().press(f"{play}{ENTER}", "t0 caregiver1]>").calm()
        terminal.press(f"screen{ENTER}", "you: caregiver1").calm().press("i", "caregiver2 is next")
        terminal.press(ENTER, "you: caregiver2").press("f", "caregiver1 is next").calm()
        terminal.press("q", "caregiver1 is next: nobody else should look now. Enter goes on.")
        assert "heard" not in terminal.calm().text
        terminal.press(ENTER, "t1 caregiver1]>").press(CTRL_D)
        assert terminal.ended() == 0


def test_a_script_of_two_who_hear_different_things_waits_for_nobody(tmp_path: Path) -> None:
    lines = "play multicaregiver-crying-baby --vs human --seed 3\nfeed; sing\nfeed\n"
    given = [word for line in lines.split("\n") if line for word in ("-e", line)]
    with Terminal(*given, folder=tmp_path) as terminal:
        assert terminal.ended() == 0
        assert "is next: nobody" not in terminal.printed
    piped = run(tmp_path, "shell", stdin=lines)
    assert "caregiver1 chose" not in piped.stderr
    assert piped.returncode == 0


def test_keys_typed_before_the_toolkit_is_there_are_played_and_never_echoed(
    tmp_path: Path,
) -> None:
    with Terminal("hexworld", "--seed", "7", "-o", "game.dmt", folder=tmp_path) as terminal:
        terminal.until("q quit")
        terminal.press("hh", "turn 2 ").calm()
        assert "hh" not in terminal.text
        assert terminal.press("q").ended() == 0
    verified(tmp_path / "game.dmt")


def test_a_killed_game_of_keys_keeps_every_turn_and_goes_on_with_the_same_dice(
    tmp_path: Path,
) -> None:
    keys = "hyulnbhh"
    for name, pieces in (("whole", [keys]), ("killed", [keys[:4], keys[4:]])):
        turn = 0
        for number, piece in enumerate(pieces):
            words = ("resume",) if number else ("hexworld", "--seed", "7", "-o")
            with Terminal(*words, f"{name}.dmt", folder=tmp_path) as terminal:
                terminal.ready()
                for turn, key in enumerate(piece, turn + 1):  # noqa: B020 - goes on counting
                    terminal.press(key, f"turn {turn} ")
                if piece is not pieces[-1]:
                    terminal.signal(signal.SIGKILL)
                    assert terminal.ended() == 137
                    assert values(tmp_path / "killed.dmt", "turn")[-1] == "4"
                else:
                    assert terminal.press("q").ended() == 0
    assert (tmp_path / "killed.dmt").read_bytes() == (tmp_path / "whole.dmt").read_bytes()
    verified(tmp_path / "killed.dmt")


def test_resume_alone_takes_the_game_that_was_killed(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").signal(signal.SIGKILL)
        assert terminal.ended() == 137
    with Terminal("resume", folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 2 ").press("q")
        assert terminal.ended() == 0


# Sizes and colours


def test_the_screen_follows_every_size(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ")
        for columns, rows in ((50, 14), (200, 60), (20, 5), (80, 24)):
            terminal.resize(columns, rows).calm()
            assert "hexworld" in terminal.screen.display[0]
            assert terminal.screen.display[-1].strip()
        terminal.press("h", "turn 2 ")
        assert terminal.press("q").ended() == 0
        assert "Traceback" not in terminal.printed


def test_the_board_above_the_command_row_follows_every_size(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().press(":").press("hin", ":hin")
        terminal.resize(50, 14).until("│ ✗ │").until(":hin").resize(80, 24).until("│ -10 │")
        terminal.press("t" + ENTER, "hint (optimal): se")


@pytest.mark.parametrize("how", [("--width", "50"), ("COLUMNS", "50")])
def test_a_narrower_screen_than_there_is_can_be_asked_for(
    how: tuple[str, str], tmp_path: Path
) -> None:
    name, columns = how
    words, env = ([name, columns], {}) if name.startswith("-") else ([], {name: columns})
    with Terminal("hexworld", "--seed", "7", *words, folder=tmp_path, env=env) as terminal:
        terminal.ready().press("l", "turn 1 ").press("L", "goal +10 at (9,0): 2 steps.")
        assert max(map(len, terminal.text.split("\n"))) <= 50
        terminal.press("q")
        assert terminal.ended() == 0


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_a_command_is_typed_on_the_smallest_screens(rows: int, tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", folder=tmp_path, size=(40, rows)) as terminal:
        terminal.ready().press(":ac", " :ac").press(f"t w{ENTER}", "turn 1. at (6,2)")
        terminal.press("q")
        assert terminal.ended() == 0


def test_a_screen_is_never_wider_than_the_terminal(tmp_path: Path) -> None:
    words = ("hexworld", "--seed", "7", "--width", "200")
    with Terminal(*words, folder=tmp_path, size=(50, 14)) as terminal:
        terminal.ready().press("l", "turn 1 ").press("q")
        assert terminal.ended() == 0


def test_without_motion_agents_go_on_by_steps_only(tmp_path: Path) -> None:
    words = ("hexworld", "--agent", "optimal", "--seed", "7", "--no-motion")
    with Terminal(*words, folder=tmp_path) as terminal:
        terminal.ready().press("P", "nothing moves by itself").press(" ", "turn 1 ")
        terminal.press("A", "nothing moves by itself").press(":auto\r", "left by the exit +10")
        terminal.press(" ", "over: terminal after 3 turns").press("q")
        assert terminal.ended() == 0


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("hexworld --no-input", "--no-input: agent would be asked; let agents play every seat"),
        ("prisoners-dilemma --agent grim --vs human --no-input", "--no-input: agent2 would be"),
        ("shell --no-input", "--no-input: nobody is asked; give commands by -e or in a pipe"),
        ("resume g.dmt --no-input", "--no-input: agent would be asked"),
        ("branch g.dmt --at 1 -o b.dmt --no-input", "--no-input: agent would be asked"),
    ],
)
def test_who_must_not_be_asked_is_not(words: str, told: str, tmp_path: Path) -> None:
    run(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="w\nw\n")
    before = (tmp_path / "g.dmt").read_bytes()
    with Terminal(*words.split(), folder=tmp_path) as terminal:
        assert terminal.ended() == 2
        assert terminal.printed.startswith("error: ")
        assert told in terminal.printed
    assert (tmp_path / "g.dmt").read_bytes() == before
    assert [*tmp_path.glob("b.dmt")] == []


def test_without_input_agents_play_in_lines_and_pipes_are_read(tmp_path: Path) -> None:
    words = ("hexworld", "--agent", "optimal", "--seed", "7", "--no-input")
    with Terminal(*words, folder=tmp_path) as terminal:
        assert terminal.ended() == 0
        assert "over: terminal after" in terminal.printed
        assert "\x1b" not in terminal.printed
    piped = run(tmp_path, "hexworld", "--seed", "7", "--no-input", stdin="w\nquit\n")
    assert piped.returncode == 0
    assert "over: quit after 1 turn." in piped.stdout


def test_real_time_moves(tmp_path: Path) -> None:
    refused = run(tmp_path, "cart-pole", "--rate", "--no-motion")
    assert refused.returncode == 2
    assert refused.stderr == "error: --rate: real time moves by itself; leave out --no-motion\n"


@pytest.mark.parametrize("problem", PROBLEMS)
def test_no_color_gives_no_colour_codes(problem: str, tmp_path: Path) -> None:
    for env, coloured in (({"NO_COLOR": "1"}, False), ({"NO_COLOR": ""}, True)):
        with Terminal(problem, "--seed", "7", folder=tmp_path, env=env) as terminal:
            terminal.ready().press("V").press("1").press("2").press("?").calm()
            assert terminal.press("x").press("q").ended() == 0
            if not coloured:
                assert colours(terminal.printed) == set()
            elif problem in ("crying-baby", "hexworld"):  # tables and small tiles need none
                assert colours(terminal.printed)


@pytest.mark.parametrize("problem", PROBLEMS)
def test_a_dumb_terminal_gets_no_escape_at_all(problem: str, tmp_path: Path) -> None:
    words = (problem, "--seed", "7", "--turns", "2")
    with Terminal(*words, folder=tmp_path, env={"TERM": "dumb"}) as terminal:
        terminal.until("action>").press("nonsense\r", "unknown action 'nonsense'")
        terminal.press("look\r").press("legal\r").press("1\r").press("2\r").press("3\r")
        terminal.press("quit\r")
        assert terminal.ended() == 0
        assert "\x1b" not in terminal.printed
        assert not DRAWN.search(terminal.printed)


def test_two_people_at_a_dumb_terminal_do_not_see_each_other_type(tmp_path: Path) -> None:
    words = ("prisoners-dilemma", "--vs", "human", "--plain", "--turns", "1")
    with Terminal(*words, folder=tmp_path) as terminal:
        terminal.until("agent1 action>").calm().press("defect\r", "agent2 action>").calm()
        assert "> defect" not in terminal.text
        terminal.press("cooperate\r", "agent1 chose defect. agent2 chose cooperate.")
        assert terminal.ended() == 0
        assert terminal.left_clean()


def test_a_recording_with_turns_taken_back_is_told_in_lines(tmp_path: Path) -> None:
    typed = "w\nundo\ne\nreroll\n"
    run(tmp_path, "hexworld", "--seed", "7", "-o", "game.dmt", stdin=typed)
    done = run(tmp_path, "replay", "game.dmt")
    assert done.returncode == 0
    told = [line.partition(".")[0] for line in done.stdout.splitlines()]
    assert told[1:-1] == ["turn 1", "undone", "turn 1", "turn 1, under other dice"]
    assert run(tmp_path, "replay", "game.dmt", "--json").returncode == 0


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_a_signal_while_a_secret_is_typed_brings_the_echo_back(
    number: int, code: int, tmp_path: Path
) -> None:
    words = ("prisoners-dilemma", "--vs", "human", "--plain")
    with Terminal(*words, folder=tmp_path) as terminal:
        terminal.until("agent1 action>").calm().signal(number)
        assert terminal.ended() == code
        assert terminal.left_clean()


# Pipes, disks and encodings


@pytest.mark.parametrize("problem", PROBLEMS)
def test_no_input_is_a_game_that_nobody_plays(problem: str, tmp_path: Path) -> None:
    done = shell(f"dmplay {problem} --seed 7 < /dev/null", tmp_path)
    assert done.returncode == 0
    assert "over: quit after 0 turns" in done.stdout


@pytest.mark.parametrize(
    "line",
    [
        "2048 --agent corner --seed 7",
        "hexworld --agent random --seed 7 --set 'rewards=[]' --turns 5000 --json",
        "list",
        "info hexworld",
        "--help",
        "--version",
    ],
)
def test_a_reader_that_leaves_early_is_no_news(line: str, tmp_path: Path) -> None:
    done = shell(f"dmplay {line} | head -1", tmp_path)
    assert (done.stderr, len(done.stdout.splitlines())) == ("", 1)
    gone = shell(f"dmplay {line} | true", tmp_path)
    assert (gone.stderr, gone.stdout) == ("", "")


@pytest.mark.parametrize("line", ["hexworld --agent optimal --seed 7", "list", "--help"])
@pytest.mark.parametrize("closed", [">&-", "<&-", "2>&-", "<&- >&- 2>&-"])
def test_a_closed_stream_raises_nothing(line: str, closed: str, tmp_path: Path) -> None:
    done = shell(f"dmplay {line} {closed}", tmp_path)
    assert "Traceback" not in done.stderr
    assert done.returncode in (0, 1)


def test_a_closed_input_is_a_game_that_nobody_plays(tmp_path: Path) -> None:
    done = shell("dmplay hexworld --seed 7 <&-", tmp_path)
    assert done.returncode == 0
    assert "over: quit after 0 turns" in done.stdout


@pytest.mark.parametrize("line", ["hexworld --agent optimal --seed 7", "list", "--help"])
def test_an_output_that_is_full_is_one_line_and_code_1(line: str, tmp_path: Path) -> None:
    done = shell(f"dmplay {line} > /dev/full", tmp_path)
    assert done.returncode == 1
    assert [row for row in done.stderr.splitlines() if "No space left" in row] == (
        done.stderr.splitlines()[:1]
    )
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr


@pytest.mark.parametrize("line", ["hexworld", "hexworld --plain", "shell"])
def test_a_terminal_that_is_gone_ends_the_game_with_129_and_leaves_no_log(
    line: str, tmp_path: Path
) -> None:
    ours, its = pty.openpty()
    env = clean_environment(tmp_path, TMPDIR=str(tmp_path))
    words = [*DMPLAY, *line.split()]
    with subprocess.Popen(words, stdin=its, stdout=its, stderr=its, env=env) as game:
        os.close(its)
        os.read(ours, 1)  # it has begun
        os.close(ours)
        assert game.wait(30) == 129
    assert not list(tmp_path.glob("*.log"))


def test_an_unknown_word_in_a_pipe_ends_with_2_and_names_its_line(tmp_path: Path) -> None:
    typed = "# first a comment\n\nw\nleft; wset\nw\n"
    done = run(tmp_path, "hexworld", "--seed", "7", "-o", "game.dmt", stdin=typed)
    assert done.returncode == 2
    assert "error: line 4: unknown action 'wset'; did you mean" in done.stderr
    end = json.loads(values(verified(tmp_path / "game.dmt"), "end")[0])
    assert (end["reason"], end["turns"]) == ("illegal", 2)


def test_an_illegal_action_in_a_pipe_ends_with_2_and_names_its_line(tmp_path: Path) -> None:
    done = run(tmp_path, "2048", "--seed", "7", stdin="down\n" * 50)
    assert done.returncode == 2
    assert re.search(r"error: line \d+: turn \d+, agent: down changes nothing in ", done.stderr)


ASCII = {"PYTHONIOENCODING": "ascii", "LANG": "C", "LC_ALL": "C"}


def told_in_ascii(*words: str, folder: Path) -> None:
    """Runs the program where only ASCII is read and written."""
    typed = "look\nhint\nbelief\nkeys\nlegal\nhelp\n1\nundo\nquit\n"
    done = fresh(*words, typed=typed, folder=folder, env=ASCII)
    assert "Traceback" not in done.stderr, words
    assert done.returncode == (0 if words[-1].isascii() else 2), done.stderr
    assert done.stdout.isascii()
    assert done.stderr.isascii()


@pytest.mark.parametrize("line", ["list", "--help", "crying-bäby", "verify nö.dmt"])
def test_an_ascii_stream_never_raises(line: str, tmp_path: Path) -> None:
    told_in_ascii(*line.split(), folder=tmp_path)


@pytest.mark.parametrize("problem", PROBLEMS)
def test_a_game_on_an_ascii_stream_never_raises(problem: str, tmp_path: Path) -> None:
    for words in (
        (problem, "--seed", "7", "-o", "game.dmt", "--frames", "--reveal"), ("info", problem),
        ("replay", "game.dmt"), ("replay", "game.dmt", "--json"), ("verify", "game.dmt"),
    ):  # fmt: skip
        told_in_ascii(*words, folder=tmp_path)
    with Terminal(problem, "--seed", "7", folder=tmp_path, env=ASCII) as terminal:
        terminal.ready().press("1").press("V").press(TAB).press("?").calm()
        assert terminal.press("x").press("q").ended() == 0
        assert terminal.printed.isascii()


def test_names_that_an_ascii_stream_lacks_are_shown_as_escapes(tmp_path: Path) -> None:
    run(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="w\n")
    text = (tmp_path / "g.dmt").read_text().replace('"human"', '"gr\u00fcn\\u001b[31m"')
    (tmp_path / "gr\u00fcn.dmt").write_text(text, encoding="utf-8")
    ascii_ = {"PYTHONIOENCODING": "ascii"}
    done = fresh("replay", "gr\u00fcn.dmt", folder=tmp_path, env=ascii_)
    assert done.stdout.splitlines()[0] == r"hexworld, seed 7. gr\xfcn\x1b[31m."
    done = fresh("replay", "gr\u00fcn.dmt", "--json", folder=tmp_path, env=ascii_)
    assert json.loads(done.stdout.splitlines()[0])["seats"] == {"agent": "gr\u00fcn\x1b[31m"}
    assert fresh("verify", "gr\u00fcn.dmt", folder=tmp_path, env=ascii_).returncode == 3


@pytest.mark.parametrize("problem", PROBLEMS)
def test_plain_output_draws_nothing(problem: str, tmp_path: Path) -> None:
    typed = "look\nhint\nbelief\nkeys\nlegal\nstate\nhelp\n1\nundo\n2\nreroll\nquit\n"
    done = run(tmp_path, problem, "--seed", "7", "--plain", "--reveal", stdin=typed)
    assert done.returncode == 0, done.stderr
    assert not DRAWN.search(done.stdout)
    assert "\x1b" not in done.stdout
    assert "\r" not in done.stdout


def test_a_full_disk_is_told_once_and_the_game_goes_on(tmp_path: Path) -> None:
    typed = "w\n" * 5 + "quit\n"
    done = run(tmp_path, "hexworld", "--seed", "7", "-o", "/dev/full", stdin=typed)
    assert done.returncode == 1
    assert "over: quit after 5 turns" in done.stdout
    assert done.stderr == "error: cannot write /dev/full: No space left on device\n"


def test_a_disk_that_fills_holds_whole_turns_that_verify_and_resume(tmp_path: Path) -> None:
    typed = "w\n" * 9 + "quit\n"
    words = ("hexworld", "--seed", "7", "-o")
    done = fresh(*words, "small.dmt", typed=typed, folder=tmp_path, disk=SIZE_LIMIT)
    assert done.returncode == 1
    assert re.fullmatch(r"error: cannot write small\.dmt: [\w ]+\n", done.stderr)
    assert check(tmp_path / "small.dmt").unfinished
    turns = int(values(tmp_path / "small.dmt", "turn")[-1])
    assert 1 < turns < 9
    again = run(tmp_path, "resume", "small.dmt", stdin="w\n" * (9 - turns) + "quit\n")
    assert again.returncode == 0
    run(tmp_path, *words, "whole.dmt", stdin=typed)
    assert (tmp_path / "small.dmt").read_bytes() == (tmp_path / "whole.dmt").read_bytes()


def test_the_screen_tells_of_a_full_disk_and_plays_on(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", "-o", "/dev/full", folder=tmp_path) as terminal:
        terminal.ready().press("h", "cannot write /dev/full").press("h", "turn 2 ").press("q")
        assert terminal.ended() == 1
        assert "error: cannot write /dev/full: No space left on device" in terminal.text


def test_a_state_folder_that_cannot_be_written_is_one_warning(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file where the folder should be")
    done = run(tmp_path, "hexworld", "--seed", "7", stdin="w\nquit\n")
    assert done.returncode == 0
    assert done.stderr.startswith("warning: this game is not kept: ")
    assert len(done.stderr.splitlines()) == 1

"""Terminals of every size, without motion, without colours, and dumb ones."""

import random
import re
import signal
from pathlib import Path

import pytest

from tests.support.programs import run
from tests.support.terminals import (
    ENTER,
    PLAYED,
    TAB,
    Terminal,
    colours,
)

pytestmark = pytest.mark.slow
DRAWN = re.compile("[\u2500-\u28ff]")


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


@pytest.mark.parametrize("typing", [False, True])
def test_five_hundred_sizes_in_a_row_leave_the_screen_as_the_last_one_is(
    typing: bool, tmp_path: Path
) -> None:
    dice = random.Random(500)
    with Terminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready()
        if typing:
            terminal.press(":").press("hint", ":hint")
        for _ in range(500):
            terminal.resize(dice.randint(1, 200), dice.randint(1, 60)).read(0)
        terminal.resize(80, 24)
        if typing:
            terminal.until(lambda: ":hint" in terminal.text)
        terminal.calm()
        if typing:
            terminal.press(ENTER, "hint (optimal)").calm()
        before = terminal.text
        with Terminal("hexworld", "--seed", "7", folder=tmp_path) as other:
            other.ready()
            if typing:
                other.press(TAB, "hint (optimal)")
            assert other.calm().text == before
            assert other.press("q").ended() == 0
        assert terminal.press("q").ended() == 0
        assert terminal.left_clean()


def test_what_is_typed_is_shown_whole_again_where_there_is_room(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().press(":").press("hint", ":hint")
        terminal.resize(3, 10).until(lambda: "hint" not in terminal.text and "t" in terminal.text)
        terminal.calm().resize(80, 24).until(" :hint")


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


@pytest.mark.parametrize("problem", PLAYED)
def test_no_color_gives_no_colour_codes(problem: str, tmp_path: Path) -> None:
    drawn = problem in ("crying-baby", "hexworld")  # tables and small tiles need no colours
    for wish in ("1", "") if drawn else ("1",):
        env = {"NO_COLOR": wish}
        with Terminal(problem, "--seed", "7", folder=tmp_path, env=env) as terminal:
            terminal.ready().press("V").press("1").press("2").press("?").calm()
            assert terminal.press("x").press("q").ended() == 0
            assert bool(colours(terminal.printed)) == (not wish)


@pytest.mark.parametrize("problem", PLAYED)
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

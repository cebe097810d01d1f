"""Terminals of every size, without motion, without colours, and dumb ones."""

import random
import re
import signal
from pathlib import Path

import pytest

from tests.support.programs import run_dmplay
from tests.support.terminals import ENTER, TAB, TERMINAL_TEST_PROBLEMS, Terminal, list_colour_codes

pytestmark = pytest.mark.slow
GRAPHIC_CHARACTERS = re.compile("[\u2500-\u28ff]")


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
def test_500_resizes_leave_the_screen_of_the_last_size(typing: bool, tmp_path: Path) -> None:
    rng = random.Random(500)
    with Terminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready()
        if typing:
            terminal.press(":").press("hint", ":hint")
        for _ in range(500):
            terminal.resize(rng.randint(1, 200), rng.randint(1, 60)).read(0)
        terminal.resize(80, 24)
        if typing:
            terminal.until(lambda: ":hint" in terminal.text)
        terminal.calm()
        if typing:
            terminal.press(ENTER, ", by optimal").calm()
        before = terminal.text
        with Terminal("hexworld", "--seed", "7", folder=tmp_path) as other:
            other.ready()
            if typing:
                other.press(TAB, ", by optimal")
            assert other.calm().text == before
            assert other.press("q").ended() == 0
        assert terminal.press("q").ended() == 0
        assert terminal.left_clean()


def test_typed_text_is_shown_completely_again_after_widening(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().press(":").press("hint", ":hint")
        terminal.resize(3, 10).until(lambda: "hint" not in terminal.text and "t" in terminal.text)
        terminal.calm().resize(80, 24).until(" :hint")


def test_the_board_above_the_command_prompt_follows_every_size(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().press(":").press("hin", ":hin")
        terminal.resize(50, 14).until("│-10│").until(":hin").resize(80, 24).until("│ -10 │")
        terminal.press("t" + ENTER, "hint: press n (se), by optimal")


def test_the_screen_has_the_size_of_its_terminal_whatever_the_variables_say(tmp_path: Path) -> None:
    env = {"COLUMNS": "50", "LINES": "10"}
    with Terminal("hexworld", "--seed", "7", folder=tmp_path, env=env) as terminal:
        terminal.ready().press("L", "at (9,0): 2 steps.")
        terminal.until(lambda: "q quit" in terminal.text.split("\n")[23])
        terminal.until(lambda: max(map(len, terminal.text.split("\n"))) > 50)
        terminal.resize(120, 30).until(lambda: "q quit" in terminal.text.split("\n")[29])
        terminal.until(lambda: max(map(len, terminal.text.split("\n"))) > 80)


def test_an_option_limits_the_width_of_the_screen(tmp_path: Path) -> None:
    arguments = ("hexworld", "--seed", "7", "--width", "50")
    with Terminal(*arguments, folder=tmp_path) as terminal:
        terminal.ready().press("l", "turn 1 ").press("L", "exit +10 at (9,0): 2 steps.").calm()
        assert max(map(len, terminal.text.split("\n"))) <= 50
        terminal.press("q")
        assert terminal.ended() == 0


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_a_command_is_typed_on_the_smallest_screens(rows: int, tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", folder=tmp_path, size=(40, rows)) as terminal:
        terminal.ready().press(":ac", " :ac").press(f"t w{ENTER}", "turn 1. chose W, moved W")
        terminal.press("q")
        assert terminal.ended() == 0


def test_a_screen_is_never_wider_than_the_terminal(tmp_path: Path) -> None:
    arguments = ("hexworld", "--seed", "7", "--width", "200")
    with Terminal(*arguments, folder=tmp_path, size=(50, 14)) as terminal:
        terminal.ready().press("l", "turn 1 ").press("q")
        assert terminal.ended() == 0


def test_without_motion_agents_play_only_when_stepped(tmp_path: Path) -> None:
    arguments = ("hexworld", "--agent", "optimal", "--seed", "7", "--no-motion")
    with Terminal(*arguments, folder=tmp_path) as terminal:
        terminal.ready().press("P", "motion is off").press(" ", "turn 1 ")
        terminal.press("A", "motion is off").press(":auto\r", "took exit +10")
        terminal.press(" ", "over: optimal reached the exit with +10 in 3 turns").press("q")
        assert terminal.ended() == 0


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("hexworld --no-input", "--no-input: a person plays agent; give an agent to every seat"),
        ("prisoners-dilemma --agent grim --vs human --no-input",
         "--no-input: a person plays agent2"),
        ("shell --no-input",
         "--no-input: no prompts are allowed; give commands with -e or through a pipe"),
        ("resume g.dmt --no-input", "--no-input: a person plays agent"),
        ("branch g.dmt --at 1 -o b.dmt --no-input", "--no-input: a person plays agent"),
    ],
)  # fmt: skip
def test_no_input_refuses_games_that_need_a_person(
    command: str, message: str, tmp_path: Path
) -> None:
    run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="w\nw\n")
    before = (tmp_path / "g.dmt").read_bytes()
    with Terminal(*command.split(), folder=tmp_path) as terminal:
        assert terminal.ended() == 2
        assert terminal.printed.startswith("error: ")
        assert message in terminal.printed
    assert (tmp_path / "g.dmt").read_bytes() == before
    assert [*tmp_path.glob("b.dmt")] == []


def test_no_input_allows_agents_and_pipes(tmp_path: Path) -> None:
    arguments = ("hexworld", "--agent", "optimal", "--seed", "7", "--no-input")
    with Terminal(*arguments, folder=tmp_path) as terminal:
        assert terminal.ended() == 0
        assert "over: optimal reached the exit with +10" in terminal.printed
        assert "\x1b" not in terminal.printed
    result = run_dmplay(tmp_path, "hexworld", "--seed", "7", "--no-input", stdin="w\nquit\n")
    assert result.returncode == 0
    assert "over: quit after 1 turn." in result.stdout


def test_real_time_conflicts_with_no_motion(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "cart-pole", "--rate", "--no-motion")
    assert result.returncode == 2
    assert result.stderr == "error: --rate: real time needs motion; leave out --no-motion\n"


@pytest.mark.parametrize("problem", TERMINAL_TEST_PROBLEMS)
def test_no_color_gives_no_colour_codes(problem: str, tmp_path: Path) -> None:
    uses_color = problem in ("crying-baby", "hexworld")  # tables and small tiles need no colours
    for value in ("1", "") if uses_color else ("1",):
        env = {"NO_COLOR": value}
        with Terminal(problem, "--seed", "7", folder=tmp_path, env=env) as terminal:
            terminal.ready().press("V").press("1").press("2").press("?").calm()
            assert terminal.press("x").press("q").ended() == 0
            assert bool(list_colour_codes(terminal.printed)) == (not value)


@pytest.mark.parametrize("problem", TERMINAL_TEST_PROBLEMS)
def test_a_dumb_terminal_gets_no_escape_at_all(problem: str, tmp_path: Path) -> None:
    arguments = (problem, "--seed", "7", "--turns", "2")
    with Terminal(*arguments, folder=tmp_path, env={"TERM": "dumb"}) as terminal:
        terminal.until("action>").press("nonsense\r", "unknown action 'nonsense'")
        terminal.press("look\r").press("legal\r").press("1\r").press("2\r").press("3\r")
        terminal.press("quit\r")
        assert terminal.ended() == 0
        assert "\x1b" not in terminal.printed
        assert not GRAPHIC_CHARACTERS.search(terminal.printed)


def test_two_people_at_a_dumb_terminal_do_not_see_each_other_type(tmp_path: Path) -> None:
    arguments = ("prisoners-dilemma", "--vs", "human", "--plain", "--turns", "1")
    with Terminal(*arguments, folder=tmp_path) as terminal:
        terminal.until("agent1 action>").calm().press("defect\r", "agent2 action>").calm()
        assert "> defect" not in terminal.text
        terminal.press("cooperate\r", "agent1 chose defect. agent2 chose cooperate.")
        assert terminal.ended() == 0
        assert terminal.left_clean()


def test_a_replay_of_undone_turns_prints_lines(tmp_path: Path) -> None:
    commands = "w\nundo\ne\nreroll\n"
    run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "game.dmt", stdin=commands)
    result = run_dmplay(tmp_path, "replay", "game.dmt")
    assert result.returncode == 0
    turns = [line.partition(".")[0] for line in result.stdout.splitlines()]
    assert turns[1:-1] == ["turn 1", "undone", "turn 1", "turn 1, rerolled"]
    assert run_dmplay(tmp_path, "replay", "game.dmt", "--json").returncode == 0


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_a_signal_during_hidden_input_restores_the_echo(
    number: int, code: int, tmp_path: Path
) -> None:
    arguments = ("prisoners-dilemma", "--vs", "human", "--plain")
    with Terminal(*arguments, folder=tmp_path) as terminal:
        terminal.until("agent1 action>").calm().signal(number)
        assert terminal.ended() == code
        assert terminal.left_clean()

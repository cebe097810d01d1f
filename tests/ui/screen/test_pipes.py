"""Tests of the program in pipes, on full disks and with ASCII streams."""

import json
import re
from pathlib import Path

import pytest

from tests.support.games import assert_verified, read_values, record_game, replace_in_file
from tests.support.programs import run_dmplay, run_fresh_interpreter, run_shell_line
from tests.support.terminals import TAB, TERMINAL_TEST_PROBLEMS, Terminal

pytestmark = pytest.mark.slow
GRAPHIC_CHARACTERS = re.compile("[\u2500-\u28ff]")
SIZE_LIMIT = 700  # bytes that the small disk can hold


@pytest.mark.parametrize("problem", TERMINAL_TEST_PROBLEMS)
def test_empty_input_quits_the_game_after_0_turns(problem: str, tmp_path: Path) -> None:
    result = run_shell_line(f"dmplay {problem} --seed 7 < /dev/null", tmp_path)
    assert result.returncode == 0
    assert "over: quit after 0 turns" in result.stdout


@pytest.mark.parametrize(
    "line",
    [
        "2048 --agent corner --seed 7",
        "hexworld --agent random --seed 7 --set 'rewards=[]' --turns 5000 --json",
        "list",
        "info hexworld",
        "--help",
        "--version",
        "hexworld --agent random --seed 7 --quiet -o -",
    ],
)
def test_a_reader_that_closes_the_pipe_early_causes_no_error(line: str, tmp_path: Path) -> None:
    result = run_shell_line(f"dmplay {line} | head -1", tmp_path)
    assert (result.stderr, len(result.stdout.splitlines())) == ("", 1)
    unread_result = run_shell_line(f"dmplay {line} | true", tmp_path)
    assert (unread_result.stderr, unread_result.stdout) == ("", "")


@pytest.mark.parametrize("line", ["--help", "list", "hexworld --agent random --quiet -o -"])
def test_without_a_reader_the_exit_code_is_that_of_sigpipe(line: str, tmp_path: Path) -> None:
    result = run_shell_line(
        f"dmplay {line} | (exec <&-; sleep 2); echo ${{PIPESTATUS[0]}}", tmp_path
    )
    assert (result.stdout, result.stderr) == ("141\n", "")


@pytest.mark.parametrize("line", ["hexworld --agent optimal --seed 7", "list", "--help"])
@pytest.mark.parametrize("closed", [">&-", "<&-", "2>&-", "<&- >&- 2>&-"])
def test_a_closed_stream_causes_no_traceback(line: str, closed: str, tmp_path: Path) -> None:
    result = run_shell_line(f"dmplay {line} {closed}", tmp_path)
    assert "Traceback" not in result.stderr
    assert result.returncode in (0, 1)


@pytest.mark.parametrize("unreadable", ["<&-", "0>/dev/null"])  # the second as by nohup
def test_unreadable_input_quits_the_game_after_0_turns(unreadable: str, tmp_path: Path) -> None:
    result = run_shell_line(f"dmplay hexworld --seed 7 {unreadable}", tmp_path)
    assert result.returncode == 0
    assert "over: quit after 0 turns" in result.stdout


@pytest.mark.parametrize("line", ["hexworld --agent optimal --seed 7", "list", "--help"])
def test_a_full_output_device_prints_one_line_and_exits_with_1(line: str, tmp_path: Path) -> None:
    result = run_shell_line(f"dmplay {line} > /dev/full", tmp_path)
    assert result.returncode == 1
    assert [row for row in result.stderr.splitlines() if "No space left" in row] == (
        result.stderr.splitlines()[:1]
    )
    assert "Traceback" not in result.stderr
    assert "Exception ignored" not in result.stderr


def test_an_unknown_word_in_a_pipe_exits_with_2_and_names_its_line(tmp_path: Path) -> None:
    commands = "# first a comment\n\nw\nleft; wset\nw\n"
    result = run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "game.dmt", stdin=commands)
    assert result.returncode == 2
    assert "error: line 4: unknown action 'wset'; did you mean" in result.stderr
    end = json.loads(read_values(assert_verified(tmp_path / "game.dmt"), "end")[0])
    assert (end["reason"], end["turns"]) == ("illegal", 2)


def test_an_illegal_action_in_a_pipe_exits_with_2_and_names_its_line(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "2048", "--seed", "7", stdin="down\n" * 50)
    assert result.returncode == 2
    assert re.search(r"error: line \d+: turn \d+, agent: down moves no tile", result.stderr)


ASCII_ENVIRONMENT = {"PYTHONIOENCODING": "ascii", "LANG": "C", "LC_ALL": "C"}


def run_with_ascii_streams(*arguments: str, folder: Path) -> None:
    """Run the program with ASCII standard streams, and check its output."""
    commands = "look\nhint\nbelief\nkeys\nlegal\nhelp\n1\nundo\nquit\n"
    result = run_fresh_interpreter(*arguments, typed=commands, folder=folder, env=ASCII_ENVIRONMENT)
    assert "Traceback" not in result.stderr, arguments
    assert result.returncode == (0 if arguments[-1].isascii() else 2), result.stderr
    assert result.stdout.isascii()
    assert result.stderr.isascii()


@pytest.mark.parametrize("line", ["list", "--help", "crying-bäby", "verify nö.dmt"])
def test_an_ascii_stream_never_raises(line: str, tmp_path: Path) -> None:
    run_with_ascii_streams(*line.split(), folder=tmp_path)


@pytest.mark.parametrize("problem", TERMINAL_TEST_PROBLEMS)
def test_a_game_on_an_ascii_stream_never_raises(problem: str, tmp_path: Path) -> None:
    for arguments in (
        (problem, "--seed", "7", "-o", "game.dmt", "--frames", "--reveal"), ("info", problem),
        ("replay", "game.dmt"), ("replay", "game.dmt", "--json"), ("verify", "game.dmt"),
    ):  # fmt: skip
        run_with_ascii_streams(*arguments, folder=tmp_path)
    with Terminal(problem, "--seed", "7", folder=tmp_path, env=ASCII_ENVIRONMENT) as terminal:
        terminal.ready().press("1").press("V").press(TAB).press("?").calm()
        assert terminal.press("x").press("q").ended() == 0
        assert terminal.printed.isascii()


def test_names_outside_ascii_are_escaped_on_an_ascii_stream(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="w\n")
    text = (tmp_path / "g.dmt").read_text().replace('"human"', '"gr\u00fcn\\u001b[31m"')
    (tmp_path / "gr\u00fcn.dmt").write_text(text, encoding="utf-8")
    environment = {"PYTHONIOENCODING": "ascii"}
    result = run_fresh_interpreter("replay", "gr\u00fcn.dmt", folder=tmp_path, env=environment)
    assert result.stdout.splitlines()[0] == r"hexworld, seed 7. gr\xfcn\x1b[31m."
    result = run_fresh_interpreter(
        "replay", "gr\u00fcn.dmt", "--json", folder=tmp_path, env=environment
    )
    assert json.loads(result.stdout.splitlines()[0])["seats"] == {"agent": "gr\u00fcn\x1b[31m"}
    assert (
        run_fresh_interpreter(
            "verify", "gr\u00fcn.dmt", folder=tmp_path, env=environment
        ).returncode
        == 3
    )


HOSTILE_NAME = '"\\u001b]0;pwned\\u0007"'  # sets the title of the terminal window


@pytest.mark.parametrize("arguments", [[], ["hexworld", "--plain"]])
def test_escape_sequences_in_a_file_do_not_reach_a_plain_terminal(
    arguments: list[str], tmp_path: Path
) -> None:
    record_game(tmp_path / "g.dmt", "hexworld", "random", turns=1)
    replace_in_file(tmp_path / "g.dmt", '"agent": "random"', f'{HOSTILE_NAME}: "random"')
    with Terminal(*arguments, folder=tmp_path, env={"TERM": "dumb"}) as terminal:
        terminal.until(">").press("load g.dmt\n", r"error: g.dmt:3: seats: got \x1b]0;pwned\x07")
        assert "\x1b" not in terminal.printed


def test_escape_sequences_in_a_file_do_not_reach_a_diff(tmp_path: Path) -> None:
    record_game(tmp_path / "g.dmt", "hexworld", "random", turns=1, record_frames=True)
    text = (tmp_path / "g.dmt").read_text().replace("\n| ", "\n| \x1b]0;pwned\x07", 1)
    (tmp_path / "g.dmt").write_text(text)
    output = run_dmplay(tmp_path, "verify", "g.dmt", "--update").stdout
    assert r"-| \x1b]0;pwned\x07" in output
    assert "\x1b" not in output


@pytest.mark.parametrize("problem", TERMINAL_TEST_PROBLEMS)
def test_plain_output_has_no_graphic_characters(problem: str, tmp_path: Path) -> None:
    commands = "look\nhint\nbelief\nkeys\nlegal\nstate\nhelp\n1\nundo\n2\nreroll\nquit\n"
    result = run_dmplay(tmp_path, problem, "--seed", "7", "--plain", "--reveal", stdin=commands)
    assert result.returncode == 0, result.stderr
    assert not GRAPHIC_CHARACTERS.search(result.stdout)
    assert "\x1b" not in result.stdout
    assert "\r" not in result.stdout

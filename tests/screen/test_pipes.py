"""The program at the ends of pipes, on full disks, and where only ASCII is read."""

import json
import re
from pathlib import Path

import pytest

from tests.support.games import altered, recorded, values, verified
from tests.support.programs import fresh, run, shell
from tests.support.terminals import (
    PLAYED,
    TAB,
    Terminal,
)

pytestmark = pytest.mark.slow
DRAWN = re.compile("[\u2500-\u28ff]")
SIZE_LIMIT = 700  # bytes that a small disk holds


@pytest.mark.parametrize("problem", PLAYED)
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
        "hexworld --agent random --seed 7 --quiet -o -",
    ],
)
def test_a_reader_that_leaves_early_is_no_news(line: str, tmp_path: Path) -> None:
    done = shell(f"dmplay {line} | head -1", tmp_path)
    assert (done.stderr, len(done.stdout.splitlines())) == ("", 1)
    gone = shell(f"dmplay {line} | true", tmp_path)
    assert (gone.stderr, gone.stdout) == ("", "")


@pytest.mark.parametrize("line", ["--help", "list", "hexworld --agent random --quiet -o -"])
def test_without_a_reader_the_code_is_that_of_the_signal(line: str, tmp_path: Path) -> None:
    done = shell(f"dmplay {line} | (exec <&-; sleep 2); echo ${{PIPESTATUS[0]}}", tmp_path)
    assert (done.stdout, done.stderr) == ("141\n", "")


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
    assert re.search(r"error: line \d+: turn \d+, agent: down is not legal now", done.stderr)


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


@pytest.mark.parametrize("problem", PLAYED)
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


HOSTILE = '"\\u001b]0;pwned\\u0007"'  # names the terminal's window


@pytest.mark.parametrize("words", [[], ["hexworld", "--plain"]])
def test_no_escape_of_a_file_reaches_a_terminal_in_words(words: list[str], tmp_path: Path) -> None:
    recorded(tmp_path / "g.dmt", "hexworld", "random", turns=1)
    altered(tmp_path / "g.dmt", '"agent": "random"', f'{HOSTILE}: "random"')
    with Terminal(*words, folder=tmp_path, env={"TERM": "dumb"}) as terminal:
        terminal.until(">").press("load g.dmt\n", r"error: g.dmt:3: seats: got \x1b]0;pwned\x07")
        assert "\x1b" not in terminal.printed


def test_no_escape_of_a_file_reaches_a_diff(tmp_path: Path) -> None:
    recorded(tmp_path / "g.dmt", "hexworld", "random", turns=1, record_frames=True)
    text = (tmp_path / "g.dmt").read_text().replace("\n| ", "\n| \x1b]0;pwned\x07", 1)
    (tmp_path / "g.dmt").write_text(text)
    told = run(tmp_path, "verify", "g.dmt", "--update").stdout
    assert r"-| \x1b]0;pwned\x07" in told
    assert "\x1b" not in told


@pytest.mark.parametrize("problem", PLAYED)
def test_plain_output_draws_nothing(problem: str, tmp_path: Path) -> None:
    typed = "look\nhint\nbelief\nkeys\nlegal\nstate\nhelp\n1\nundo\n2\nreroll\nquit\n"
    done = run(tmp_path, problem, "--seed", "7", "--plain", "--reveal", stdin=typed)
    assert done.returncode == 0, done.stderr
    assert not DRAWN.search(done.stdout)
    assert "\x1b" not in done.stdout
    assert "\r" not in done.stdout

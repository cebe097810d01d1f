"""Tests of the output streams: nothing is lost in silence, and user code writes elsewhere."""

import json
import os
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from tests.support.document_examples import NOISE_NAMES, NOISY_PROBLEM
from tests.support.programs import NO_VARIABLES
from tests.support.terminals import DMPLAY_COMMAND, clean_environment

pytestmark = pytest.mark.skipif(os.name != "posix", reason="descriptors of POSIX")
TIMEOUT_SECONDS = 60.0
LONG_GAME = ("crying-baby", "--agent", "random", "--turns", "1500", "--seed", "1")


def run_in_pipe(
    words: Sequence[str],
    folder: Path,
    *,
    pause_seconds: float = 0,
    errors: int = subprocess.PIPE,
    variables: Mapping[str, str] = NO_VARIABLES,
) -> tuple[int, bytes]:
    """Run dmplay with a pipe as its output; return its exit code and the output.

    With a pause before the output is read, the pipe does not block.
    """
    reader, writer = os.pipe()
    os.set_blocking(writer, not pause_seconds)
    with subprocess.Popen(
        [*DMPLAY_COMMAND, *words], stdin=subprocess.DEVNULL, stdout=writer, stderr=errors,
        cwd=folder, env=clean_environment(folder, **variables),
    ) as program:  # fmt: skip
        if pause_seconds:
            threading.Event().wait(pause_seconds)
            os.set_blocking(writer, False)  # as another process with the same pipe may do
        os.close(writer)
        with open(reader, "rb") as file:
            output = file.read()
        return program.wait(TIMEOUT_SECONDS), output


@pytest.mark.slow
def test_a_pipe_that_does_not_block_loses_no_output(tmp_path: Path) -> None:
    code, _ = run_in_pipe([*LONG_GAME, "-q", "-o", "game.dmt"], tmp_path)
    assert code == 0
    commands = (
        (*LONG_GAME,), (*LONG_GAME, "--json"), (*LONG_GAME, "-q", "-o", "-"),
        ("replay", "game.dmt"), ("export", "game.dmt", "--html"), ("export", "game.dmt", "--csv"),
    )  # fmt: skip
    for words in commands:
        complete = run_in_pipe(words, tmp_path)
        assert complete[0] == 0
        assert len(complete[1]) > 65_536, words  # more than a pipe holds
        variables = {"PYTHONUNBUFFERED": "1"} if "--html" in words else {}
        output = run_in_pipe(words, tmp_path, pause_seconds=1.2, variables=variables)
        assert output == complete, words


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (("bogus",), 2),
        (("verify", "nothing.dmt"), 2),
        (("run", "hexworld", "--agent", "bogus"), 2),
        (("--bogus",), 2),
        (("hexworld", "--agent", "random", "--seed", "1"), 0),
        (("list",), 0),
        (("run", "hexworld", "--episodes", "3"), 0),
    ],
)
def test_errors_that_cannot_be_written_do_not_change_the_exit_code(
    words: Sequence[str], code: int, tmp_path: Path
) -> None:
    closed_reader, closed_pipe = os.pipe()
    os.close(closed_reader)
    for errors in (os.open("/dev/full", os.O_WRONLY), closed_pipe):
        assert run_in_pipe(words, tmp_path, errors=errors)[0] == code
        os.close(errors)


@pytest.mark.parametrize(
    ("redirection", "reason"),
    [(">/dev/full", "No space left on device"), (">&-", "standard output is closed")],
)
def test_output_that_cannot_be_written_is_never_a_success(
    redirection: str, reason: str, tmp_path: Path
) -> None:
    for words in (("list",), ("--version",), ("hexworld", "--agent", "random"), ("--help",)):
        for variables in ({}, {"PYTHONUNBUFFERED": "1"}):
            program = run_redirected(words, redirection, tmp_path, variables)
            assert program.returncode == 1, words
            assert program.stderr.endswith(f"error: {reason}\n")
    assert run_redirected(["list"], f"{redirection} 2>&-", tmp_path).returncode == 1
    for line, code in (("bogus", 2), ("hexworld --agent random -q", 0)):
        assert run_redirected(line.split(), redirection, tmp_path).returncode == code
    output_file = ("hexworld", "--agent", "random", "-q", "-o", "-")
    program = run_redirected(output_file, redirection, tmp_path)
    assert program.returncode != 0
    assert program.stderr.startswith("error: cannot write /dev/stdout: ")


def test_a_closed_input_is_empty_and_closed_errors_are_dropped(tmp_path: Path) -> None:
    for line, code in (("list", 0), ("hexworld --seed 1", 0), ("bogus", 2)):
        complete = run_redirected(line.split(), "</dev/null", tmp_path)
        assert complete.returncode == code
        program = run_redirected(line.split(), "<&- 2>&-", tmp_path)
        assert (program.returncode, program.stdout) == (code, complete.stdout)
        assert program.stderr == ""


def run_redirected(
    words: Sequence[str],
    redirection: str,
    folder: Path,
    variables: Mapping[str, str] = NO_VARIABLES,
) -> subprocess.CompletedProcess[str]:
    """Run dmplay in a Unix shell that redirects its standard streams."""
    return subprocess.run(
        ["sh", "-c", f'"$@" {redirection}', "sh", *DMPLAY_COMMAND, *words], capture_output=True,
        stdin=subprocess.DEVNULL, text=True, cwd=folder,
        env=clean_environment(folder, **variables), check=False,
    )  # fmt: skip


def test_user_code_that_writes_to_descriptor_1_leaves_the_output_alone(tmp_path: Path) -> None:
    (tmp_path / "noisy.py").write_text(NOISY_PROBLEM)
    commands = (
        ("solve", "./noisy.py:Noisy", "--json"),
        ("run", "./noisy.py:Noisy", "--episodes", "2", "--turns", "2", "--json"),
        ("info", "./noisy.py:Noisy", "--json"),
        ("./noisy.py:Noisy", "--agent", "random", "--turns", "2", "--json"),
        ("./noisy.py:Noisy", "--agent", "random", "--turns", "2", "-q", "-o", "noisy.dmt"),
        ("./noisy.py:Noisy", "--agent", "random", "--turns", "2", "-q", "-o", "-"),
        ("review", "noisy.dmt", "--trust", "--json"),
        ("export", "noisy.dmt", "--trust", "--csv"),
        ("replay", "noisy.dmt", "--trust", "--json"),
    )
    for words in commands:
        program = subprocess.run(
            [*DMPLAY_COMMAND, *words], stdin=subprocess.DEVNULL, capture_output=True, text=True,
            cwd=tmp_path, env=clean_environment(tmp_path), check=False,
        )  # fmt: skip
        assert program.returncode == 0, program.stderr
        assert "noise" not in program.stdout, words
        for source in NOISE_NAMES:
            assert f"noise of {source}" in program.stderr
        if words[0] == "run":
            assert "noise of a turn" in program.stderr
        if words[-1] == "--json":
            for line in program.stdout.splitlines():
                json.loads(line)


def test_an_interactive_python_session_follows_without_an_error(tmp_path: Path) -> None:
    for words, error in ((["list"], ""), (["bogus"], "error: unknown problem")):
        program = subprocess.run(
            [sys.executable, "-i", "-m", "dmplay", *words], input="print(6 * 7)\n1 / 0\n",
            capture_output=True, text=True, cwd=tmp_path, env=clean_environment(tmp_path),
            check=False,
        )  # fmt: skip
        assert program.stdout.endswith("42\n")
        assert error in program.stderr
        assert "SystemExit" not in program.stderr
        assert "ZeroDivisionError: division by zero" in program.stderr

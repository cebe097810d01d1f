"""Run the code blocks of a document, in order, in an empty folder.

A `console` block holds commands, each after `$ `, and their output, where `...` matches any text.
A block with a name (`toml dmplay.toml`) is written to that file. Python blocks with `>>>` are run
as doctests. The dmplay commands of a pipe run in this process, which saves most of the time.
"""

import doctest
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple

import pytest

from dmplay.cli import config_files, main
from dmplay.guide.topics import read_topic
from tests.support.terminals import clean_environment

PROJECT_ROOT = Path(__file__).parent.parent.parent
CODE_BLOCK_PATTERN = re.compile(r"^```(\w+) ?(\S*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
DOCTEST_OPTIONS = doctest.ELLIPSIS
# disable the plugins that these runs do not use
PYTEST_OPTIONS = "-p no:cacheprovider -p no:hypothesispytest -p no:xdist"
OUTPUT_CHECKER = doctest.OutputChecker()
EXIT_CODE_COMMAND = "echo $?"  # follows a command whose exit code is not 0


class Block(NamedTuple):
    """A block of code."""

    language: str
    name: str  # file name, or '' for a block that is not a file
    code: str

    @property
    def runs(self) -> bool:
        """True if the block is a named file, a console session or a doctest."""
        return bool(self.name) or self.language == "console" or ">>> " in self.code


def parse_blocks(document: str) -> list[Block]:
    """Parse the code blocks of a document."""
    return [Block(*fields) for fields in CODE_BLOCK_PATTERN.findall(document)]


def extract_file(document: str, name: str) -> str:
    """Return the code of the block with this file name."""
    (code,) = (block.code for block in parse_blocks(document) if block.name == name)
    return code


README_TEXT = (PROJECT_ROOT / "README.md").read_text(encoding="utf-8")
TIGER_SOURCE = extract_file(read_topic("problems"), "tiger.py")


# what user code may do with the standard streams, while it is loaded and while it plays
NOISE_SOURCE = """import ctypes, os, subprocess, sys
def make_noise():
    os.write(1, b"noise of os.write\\n")
    subprocess.run([sys.executable, "-c", "print('noise of a child')"], check=True)
    ctypes.CDLL(None).puts(b"noise of a library")
    ctypes.CDLL(None).printf(b"noise without a line end")
    with open("/dev/stdout", "w") as file:
        file.write("noise of the device\\n")
def read_input():
    yield subprocess.run(["cat"], stdout=subprocess.PIPE).stdout
    yield os.read(0, 1000)
    yield ctypes.CDLL(None).getchar() + 1
    yield sys.stdin.read()
    with open("/dev/stdin") as file:
        yield file.read()
    try:
        yield input()
    except EOFError:
        yield ""
make_noise()
assert not any(read_input())
"""
NOISE_NAMES = ("os.write", "a child", "a library", "print", "the device", "the first stream")
NOISY_PROBLEM = f"""{NOISE_SOURCE}
print("noise of print")
print("noise of the first stream", file=sys.__stdout__, flush=True)
{TIGER_SOURCE}
class Noisy(Tiger):
    def resolve_events(self, s, a, events):
        make_noise()
        assert not any(read_input())
        print("noise of a turn")
        return super().resolve_events(s, a, events)
"""


class DocumentRunner:
    """A runner that executes the code blocks of a document in an empty folder."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder = folder
        self.monkeypatch = monkeypatch
        self.code = 0  # exit code of the last command
        self._globals: dict[str, object] = {}
        commands = folder / "bin"
        commands.mkdir()
        for name, module in (("dmplay", "dmplay"), ("pytest", "pytest"), ("python", "")):
            command = f'exec "{sys.executable}" {f"-m {module}" if module else ""} "$@"'
            (commands / name).write_text(f"#!/bin/sh\n{command}\n")
            (commands / name).chmod(0o755)
        plain = clean_environment(
            folder, PYTEST_ADDOPTS=PYTEST_OPTIONS, COLUMNS="80", PYTHONDONTWRITEBYTECODE="1"
        )
        for name in os.environ:
            monkeypatch.delenv(name)
        for name, value in (plain | {"PATH": f"{commands}:{plain['PATH']}"}).items():
            monkeypatch.setenv(name, value)
        # files change within one second, the resolution of the bytecode cache
        monkeypatch.setattr(sys, "dont_write_bytecode", True)
        monkeypatch.chdir(folder)
        monkeypatch.syspath_prepend(folder)  # as in an interactive Python

    def follow(self, document: str) -> None:
        """Run all blocks; fail if an output differs from the document."""
        for block in parse_blocks(document):
            if block.name:
                Path(block.name).parent.mkdir(parents=True, exist_ok=True)
                Path(block.name).write_text(block.code)
            elif block.language == "console":
                self._session(block.code)
            elif block.runs:
                self._examples(block.code)

    def _session(self, code: str) -> None:
        steps = re.split(r"^\$ ", code, flags=re.MULTILINE)[1:]
        for step, next_step in zip(steps, [*steps[1:], ""], strict=True):
            command, _, expected = step.partition("\n")
            printed, errors = self.run(command)
            if not any(
                OUTPUT_CHECKER.check_output(expected, text, DOCTEST_OPTIONS)
                for text in (printed, errors)
            ):
                example = doctest.Example(command, expected)
                text = OUTPUT_CHECKER.output_difference(example, errors, DOCTEST_OPTIONS)
                pytest.fail(f"$ {command}\n{text}")
            assert not self.code or next_step.startswith(EXIT_CODE_COMMAND), (
                f"{command} ends with {self.code}"
            )

    def _examples(self, code: str) -> None:
        test = doctest.DocTestParser().get_doctest(code, self._globals, "examples", None, 0)
        self._globals = test.globs
        output = io.StringIO()
        if doctest.DocTestRunner().run(test, out=output.write, clear_globs=False).failed:
            pytest.fail(output.getvalue())

    def run(self, command: str) -> tuple[str, str]:
        """Run a command; return its standard output, and the same followed by its error output."""
        printed = errors = ""
        for stage in command.split(" | "):
            words = shlex.split(stage)
            if words[:2] == ["pip", "install"]:
                self._install()
            elif words[0] == "cc" and shutil.which("cc") is None:
                pytest.skip("there is no C compiler here: what stands before it was tried")
            elif words[0] == "dmplay" and words[-2:-1] == [">"]:
                output, errors = self._dmplay(words[:-2], printed)
                Path(words[-1]).write_text(output, encoding="utf-8")
                printed = ""
            elif words[0] == "dmplay" and ">" not in words:
                printed, errors = self._dmplay(words, printed)
            else:
                printed, errors = self._shell(stage, printed)
        return printed, printed + errors

    def _dmplay(self, words: list[str], stdin_text: str) -> tuple[str, str]:
        printed, errors = _Utf8Stream(), _Utf8Stream()
        with (
            redirect_stdout(printed),
            redirect_stderr(errors),
            self.monkeypatch.context() as context,
        ):
            context.setattr(
                sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin_text.encode()), "utf-8")
            )
            context.setattr(sys, "argv", words)
            # Each command starts as a new process would.
            config_files.load_config_files.cache_clear()
            self.code = main.run_command_line()
            config_files.load_config_files.cache_clear()
        return printed.getvalue(), errors.getvalue()

    def _shell(self, command: str, stdin_text: str) -> tuple[str, str]:
        process = subprocess.run(
            ["sh", "-c", f"(exit {self.code})\n{command}"],
            input=stdin_text, capture_output=True, text=True, check=False,
        )  # fmt: skip
        self.code = process.returncode
        return process.stdout, process.stderr

    def _install(self) -> None:
        """Write the project's entry points into this folder, as `pip install` does."""
        project = tomllib.loads(Path("pyproject.toml").read_text())["project"]
        metadata_folder = self.folder / f"{project['name']}-{project['version']}.dist-info"
        metadata_folder.mkdir()
        rows = [
            row
            for group, points in project["entry-points"].items()
            for row in (f"[{group}]", *(f"{name} = {target}" for name, target in points.items()))
        ]
        (metadata_folder / "entry_points.txt").write_text("\n".join(rows))
        self.monkeypatch.syspath_prepend(self.folder)


class _Utf8Stream(io.StringIO):
    """A text stream with UTF-8 as its encoding."""

    encoding = "utf-8"

"""Documents that are done as they say: their blocks of code, in order, in an empty folder.

A `console` block holds commands, each after `$ `, and what they print, where `...` stands for
anything; a block with a name (`toml dmplay.toml`) is a file, which is written; Python with `>>>` is
run. Of a pipe, the commands of dmplay run in this process, which spares most of the time.
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

from dmplay.cli import config, entry
from dmplay.finding.topics import read_topic
from tests.support.terminals import clean_environment

ROOT = Path(__file__).parent.parent.parent
FENCE = re.compile(r"^```(\w+) ?(\S*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
OPTIONS = doctest.ELLIPSIS
LEAN = "-p no:cacheprovider -p no:hypothesispytest -p no:xdist"  # of pytest, what is needed
CHECKER = doctest.OutputChecker()
ASKS = "echo $?"  # after a command that ends with another code than 0


class Block(NamedTuple):
    """A block of code."""

    language: str
    name: str  # of the file that it is, or ''
    code: str

    @property
    def runs(self) -> bool:
        """Whether it says what to do."""
        return bool(self.name) or self.language == "console" or ">>> " in self.code


def blocks(document: str) -> list[Block]:
    """The blocks of a document."""
    return [Block(*found) for found in FENCE.findall(document)]


def file(document: str, name: str) -> str:
    """A file that a document writes."""
    (code,) = (block.code for block in blocks(document) if block.name == name)
    return code


README = (ROOT / "README.md").read_text(encoding="utf-8")
TIGER = file(read_topic("problems"), "tiger.py")


class Reader:
    """Somebody who does what a document says, in an empty folder."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder = folder
        self.monkeypatch = monkeypatch
        self.code = 0  # of the last command
        self._globals: dict[str, object] = {}
        commands = folder / "bin"
        commands.mkdir()
        for name, module in (("dmplay", "dmplay"), ("pytest", "pytest"), ("python", "")):
            start = f'exec "{sys.executable}" {f"-m {module}" if module else ""} "$@"'
            (commands / name).write_text(f"#!/bin/sh\n{start}\n")
            (commands / name).chmod(0o755)
        plain = clean_environment(
            folder, PYTEST_ADDOPTS=LEAN, COLUMNS="80", PYTHONDONTWRITEBYTECODE="1"
        )
        for name in os.environ:
            monkeypatch.delenv(name)
        for name, value in (plain | {"PATH": f"{commands}:{plain['PATH']}"}).items():
            monkeypatch.setenv(name, value)
        monkeypatch.setattr(sys, "dont_write_bytecode", True)  # files change within a second
        monkeypatch.chdir(folder)

    def follow(self, document: str) -> None:
        """Does all of it; fails where something else comes out."""
        for block in blocks(document):
            if block.name:
                Path(block.name).parent.mkdir(parents=True, exist_ok=True)
                Path(block.name).write_text(block.code)
            elif block.language == "console":
                self._session(block.code)
            elif block.runs:
                self._examples(block.code)

    def _session(self, code: str) -> None:
        steps = re.split(r"^\$ ", code, flags=re.MULTILINE)[1:]
        for step, after in zip(steps, [*steps[1:], ""], strict=True):
            command, _, shown = step.partition("\n")
            printed, errors = self.run(command)
            if not any(CHECKER.check_output(shown, told, OPTIONS) for told in (printed, errors)):
                wanted = doctest.Example(command, shown)
                told = CHECKER.output_difference(wanted, errors, OPTIONS)
                pytest.fail(f"$ {command}\n{told}")
            assert not self.code or after.startswith(ASKS), f"{command} ends with {self.code}"

    def _examples(self, code: str) -> None:
        test = doctest.DocTestParser().get_doctest(code, self._globals, "examples", None, 0)
        self._globals = test.globs
        told = io.StringIO()
        if doctest.DocTestRunner().run(test, out=told.write, clear_globs=False).failed:
            pytest.fail(told.getvalue())

    def run(self, command: str) -> tuple[str, str]:
        """What a command prints, and the same with what it says of errors and files."""
        printed = errors = ""
        for stage in command.split(" | "):
            words = shlex.split(stage)
            if words[:2] == ["pip", "install"]:
                self._install()
            elif words[0] == "cc" and shutil.which("cc") is None:
                pytest.skip("there is no C compiler here: what stands before it was tried")
            elif words[0] == "dmplay" and words[-2:-1] == [">"]:
                told, errors = self._dmplay(words[:-2], printed)
                Path(words[-1]).write_text(told, encoding="utf-8")
                printed = ""
            elif words[0] == "dmplay" and ">" not in words:
                printed, errors = self._dmplay(words, printed)
            else:
                printed, errors = self._shell(stage, printed)
        return printed, printed + errors

    def _dmplay(self, words: list[str], typed: str) -> tuple[str, str]:
        printed, errors = _Paper(), _Paper()
        with redirect_stdout(printed), redirect_stderr(errors), self.monkeypatch.context() as here:
            here.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(typed.encode()), "utf-8"))
            here.setattr(sys, "argv", words)
            config.load_config_files.cache_clear()  # each command is a process of its own
            self.code = entry.run_command_line()
            config.load_config_files.cache_clear()
        return printed.getvalue(), errors.getvalue()

    def _shell(self, command: str, typed: str) -> tuple[str, str]:
        done = subprocess.run(
            ["sh", "-c", f"(exit {self.code})\n{command}"],
            input=typed, capture_output=True, text=True, check=False,
        )  # fmt: skip
        self.code = done.returncode
        return done.stdout, done.stderr

    def _install(self) -> None:
        """Has Python find the entry points of the project in this folder, as pip does."""
        project = tomllib.loads(Path("pyproject.toml").read_text())["project"]
        facts = self.folder / f"{project['name']}-{project['version']}.dist-info"
        facts.mkdir()
        rows = [
            row
            for group, points in project["entry-points"].items()
            for row in (f"[{group}]", *(f"{name} = {place}" for name, place in points.items()))
        ]
        (facts / "entry_points.txt").write_text("\n".join(rows))
        self.monkeypatch.syspath_prepend(self.folder)


class _Paper(io.StringIO):
    """A stream that takes all characters."""

    encoding = "utf-8"

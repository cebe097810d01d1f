"""Every example that a help text shows is run."""

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from dmplay.cli.app import root_command
from dmplay.files import writing
from dmplay.finding.topics import read_topic
from tests.support.blocks import file
from tests.support.hidden import cheese
from tests.support.programs import run
from tests.support.terminals import clean_environment

GROUP: Any = root_command()
SCRIPT = "play hexworld --seed 7\ne\nquit\n"
MOVES = "f\ns\ni\n" * 3  # of a crying baby


def commands(group: Any, name: str = "dmplay") -> Iterator[tuple[str, Any]]:
    """The program and every command of it, by the words that call it."""
    yield name, group
    for word, command in getattr(group, "commands", {}).items():
        yield from commands(command, f"{name} {word}")


EVERY = dict(commands(GROUP))


def examples(command: Any) -> list[str]:
    """The lines of a help text that call the program; two blanks end one."""
    lines = re.findall(r"^ +(?=[A-Z_]*=?\w* ?(?:dmplay|printf))(.*)$", command.help, re.MULTILINE)
    return [re.split(r"  +", line.strip())[0] for line in lines]


def test_an_example_is_found_with_its_variables_and_without_its_comment() -> None:
    assert examples(GROUP)[:2] == ["dmplay hexworld", "dmplay 2048 --seed 7 -o game.dmt"]
    assert "DMPLAY_COLOR=never dmplay config show --json" in examples(EVERY["dmplay config show"])
    assert examples(EVERY["dmplay play"])[-1] == r"printf 'e\nne\nquit\n' | dmplay play hexworld"


@pytest.mark.parametrize("name", EVERY)
def test_every_command_has_an_example_of_its_own(name: str) -> None:
    last = name.rpartition(" ")[2]
    assert any(last in line for line in examples(EVERY[name]))


@pytest.mark.slow
@pytest.mark.parametrize(
    "line", dict.fromkeys(line for c in EVERY.values() for line in examples(c))
)
def test_an_example_does_what_it_says(line: str, tmp_path: Path) -> None:
    (tmp_path / "dmplay").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m dmplay "$@"\n')
    (tmp_path / "dmplay").chmod(0o755)
    (tmp_path / "game.dm").write_text(SCRIPT)
    for name in ("tiger.py", "shop.py"):
        (tmp_path / name).write_text(file(read_topic("problems"), name))
    rooms = writing.iter_problem_lines(cheese(), ".pomdp", "Rooms that look alike.")
    (tmp_path / "hallway.pomdp").write_text("".join(rooms))
    (tmp_path / "tigers.dpomdp").write_text(file(read_topic("planning"), "tigers.dpomdp"))
    run(tmp_path, "crying-baby", "--seed", "7", stdin=MOVES)
    (tmp_path / "transcripts").mkdir()
    run(tmp_path, "hexworld", "--agent", "optimal", "--seed", "7", "-o", "transcripts/a.dmt")
    if "-o game.dmt" not in line:
        run(tmp_path, "crying-baby", "--seed", "7", "-o", "game.dmt", stdin=MOVES)
    done = subprocess.run(
        ["bash", "-c", line], input=SCRIPT if line == "dmplay" else "", capture_output=True,
        text=True, cwd=tmp_path, env=clean_environment(tmp_path, PATH=f"{tmp_path}:/usr/bin:/bin"),
        check=False, timeout=120,
    )  # fmt: skip
    assert (done.returncode, "error:" in done.stderr) == (0, False), done.stderr
    written = re.findall(r"-o (\S+)", line)
    assert all((tmp_path / name).stat().st_size for name in written)
    assert done.stdout or written or line == "dmplay mcp"  # which nobody asks anything

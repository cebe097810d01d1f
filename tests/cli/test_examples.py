"""Tests that run every example in the help texts."""

import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.core import TyperGroup

from dmplay.cli.app import root_command
from dmplay.formats import writer
from dmplay.guide.topics import read_topic
from tests.support.document_examples import extract_file
from tests.support.literature_pomdps import make_cheese_maze
from tests.support.programs import run_dmplay
from tests.support.terminals import clean_environment

GROUP: Any = root_command()
SHELL_CHARACTERS = {*"|<>&;$*?~"}
COMMAND_SCRIPT = "play hexworld --seed 7\ne\nquit\n"
BABY_ACTIONS = "f\ns\ni\n" * 3  # for crying baby


def iter_commands(group: Any, name: str = "dmplay") -> Iterator[tuple[str, Any]]:
    """Yield the program and each of its commands, by the words that call it."""
    yield name, group
    context = typer.Context(group)
    for word in group.list_commands(context) if isinstance(group, TyperGroup) else ():
        yield from iter_commands(group.get_command(context, word), f"{name} {word}")


COMMANDS = dict(iter_commands(GROUP))


def find_examples(command: Any) -> list[str]:
    """Return the lines of a help text that call the program; two blanks end an example."""
    lines = re.findall(r"^ +(?=[A-Z_]*=?\w* ?(?:dmplay|printf))(.*)$", command.help, re.MULTILINE)
    return [re.split(r"  +", line.strip())[0] for line in lines]


def test_an_example_includes_its_variables_but_not_its_comment() -> None:
    assert find_examples(GROUP)[1:3] == ["dmplay hexworld", "dmplay 2048 --seed 7 -o game.dmt"]
    assert "DMPLAY_COLOR=never dmplay config show --json" in find_examples(
        COMMANDS["dmplay config show"]
    )
    assert (
        find_examples(COMMANDS["dmplay play"])[-1]
        == r"printf 'ignore\nfeed\nquit\n' | dmplay play crying-baby"
    )


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_an_example(name: str) -> None:
    last = name.rpartition(" ")[2]
    assert any(last in line for line in find_examples(COMMANDS[name]))


def list_needed_extras(line: str) -> list[str]:
    """Return the extras that an example needs."""
    needs = {"mcp": "dmplay mcp" in line, "plot": "dmplay plot" in line and " -o " in line}
    return [name for name, is_needed in needs.items() if is_needed]


EXAMPLES = dict.fromkeys(line for c in COMMANDS.values() for line in find_examples(c))


@pytest.fixture(scope="module")
def folder_of_examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files that examples name."""
    folder = tmp_path_factory.mktemp("examples")
    (folder / "commands.txt").write_text(COMMAND_SCRIPT)
    for topic, name in (("problems", "tiger.py"), ("problems", "shop.py"), ("agents", "calm.py")):
        (folder / name).write_text(extract_file(read_topic(topic), name))
    (folder / "week3").mkdir()
    for name in ("01-cries.toml", "02-more-cries.toml"):
        lesson = extract_file(read_topic("lessons"), "01-cries.toml")
        (folder / "week3" / name).write_text(lesson)
    problem_lines = writer.iter_problem_lines(
        make_cheese_maze(), ".pomdp", "Rooms that look alike."
    )
    (folder / "hallway.pomdp").write_text("".join(problem_lines))
    (folder / "tigers.dpomdp").write_text(extract_file(read_topic("planning"), "tigers.dpomdp"))
    run_dmplay(folder, "crying-baby", "--seed", "7", stdin=BABY_ACTIONS)
    (folder / "transcripts").mkdir()
    run_dmplay(folder, "hexworld", "--agent", "optimal", "--seed", "7", "-o", "transcripts/a.dmt")
    run_dmplay(folder, "crying-baby", "--seed", "7", "-o", "game.dmt", stdin=BABY_ACTIONS)
    walks = run_dmplay(folder, "run", "hexworld", "--episodes", "10", "--json")
    (folder / "walks.json").write_text(walks.stdout)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    "line",
    [
        pytest.param(line, marks=[pytest.mark.extra(name) for name in list_needed_extras(line)])
        for line in EXAMPLES
    ],
)
def test_an_example_runs_without_an_error(
    line: str, folder_of_examples: Path, tmp_path: Path
) -> None:
    shutil.copytree(folder_of_examples, tmp_path, dirs_exist_ok=True)
    (tmp_path / "dmplay").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m dmplay "$@"\n')
    (tmp_path / "dmplay").chmod(0o755)
    if "-o game.dmt" in line:
        (tmp_path / "game.dmt").unlink()
    typed, path = COMMAND_SCRIPT if line == "dmplay" else "", f"{tmp_path}:/usr/bin:/bin"
    if line.startswith("dmplay") and not SHELL_CHARACTERS & {*line}:  # starts quicker
        result = run_dmplay(tmp_path, *shlex.split(line)[1:], stdin=typed, PATH=path)
    else:
        result = subprocess.run(
            ["bash", "-c", line], input=typed, capture_output=True, text=True, cwd=tmp_path,
            env=clean_environment(tmp_path, PATH=path), check=False, timeout=120,
        )  # fmt: skip
    assert (result.returncode, "error:" in result.stderr) == (0, False), result.stderr
    output_names = re.findall(r"-o (\S+)", line)
    assert all((tmp_path / name).stat().st_size for name in output_names)
    assert result.stdout or output_names or line == "dmplay mcp"  # `dmplay mcp` receives no request

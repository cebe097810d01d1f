"""Tests that every command says in its JSON and its pictures how they were made."""

import json
from pathlib import Path

import pytest

from tests.privacy.command_arguments import PROGRAM_ARGUMENTS
from tests.support.programs import run_dmplay

PLACES = {"problem": "crying-baby", "file": "game.dmt", "trust": "", "replayed": ""}
# They print JSON Lines, an object for each event, or read such a file.
LEFT_OUT = {"play", "resume", "replay", "branch", "shell", "rerun"}
PICTURES = (".json", ".svg", ".png")


def list_commands() -> list[str]:
    """Return the command lines of all commands that write one JSON object, or a picture."""
    lines = [
        f"{name} {arguments.format(**PLACES)}"
        for name, examples in PROGRAM_ARGUMENTS.items()
        for arguments in examples
        if name not in LEFT_OUT
    ]
    written = [line for line in lines if "--json" in line.split() or line.endswith(PICTURES)]
    return [
        *[line for line in written if "learn lesson" not in line and "tree-search" not in line],
        "learn --json",
        "watch --json",
        "watch belief-update crying-baby --svg -o steps.svg",
        "watch belief-update crying-baby --film -o steps-film.svg",
        "export game.dmt --film -o film.svg",
        "solve crying-baby --turns 2 --json",
        "tournament rock-paper-scissors nash random --episodes 3 --json",
        "compare crying-baby random random --episodes 3 --turns 2 --json",
    ]


def record_game(folder: Path) -> None:
    run_dmplay(
        folder, "crying-baby", "--turns", "2", "--seed", "7", "-o", "game.dmt", stdin="feed\nfeed\n"
    )


def has_provenance(text: str) -> bool:
    if text.startswith("<"):
        return '<metadata id="provenance">' in text
    return "command" in json.loads(text)["provenance"]


def test_every_json_and_svg_of_a_command_has_provenance(tmp_path: Path) -> None:
    record_game(tmp_path)
    for line in list_commands():
        files = {*tmp_path.iterdir()}
        completed = run_dmplay(tmp_path, *line.split())
        new = {*tmp_path.iterdir()} - files
        texts = [path.read_text() for path in new if path.suffix in PICTURES]
        texts += [completed.stdout] if completed.stdout.startswith(("{", "<svg")) else []
        assert texts, f"{line} wrote no JSON and no picture: {completed.stderr}"
        assert all(map(has_provenance, texts)), line


@pytest.mark.extra("plot")
@pytest.mark.parametrize("picture", ["belief.svg", "belief.png"])
def test_every_plot_has_provenance(tmp_path: Path, picture: str) -> None:
    record_game(tmp_path)
    run_dmplay(tmp_path, "plot", "belief", "game.dmt", "-o", picture)
    assert b"provenance" in (tmp_path / picture).read_bytes()

"""What is typed at another terminal while a game is played, or after it was killed."""

import io
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from dmplay.cli import entry
from dmplay.cli.app import root_command
from dmplay.cli.errands import interpret_command
from dmplay.game.table import GameController
from tests.privacy.arguments import OUTSIDE, TYPED
from tests.privacy.fronts import FILE, Told, alike, both, printed
from tests.privacy.pairs import BROUGHT, LOOKED_AT, Pair, Side

GROUP: Any = root_command()
PROGRAM: dict[str, Any] = {
    name: command
    for word, one in GROUP.commands.items()
    for name, command in (
        [(f"{word} {inner}", each) for inner, each in one.commands.items()]
        if hasattr(one, "commands")
        else [(word, one)]
    )
}
ENDS = ("over: ", '{"event": "end"')  # after which all is told


def told(line: str, monkeypatch: pytest.MonkeyPatch) -> Told:
    """What a command prints, up to the end of a game that it plays."""
    monkeypatch.setattr("sys.argv", ["dmplay", *shlex.split(line)])
    monkeypatch.setattr("sys.stdin", io.StringIO(TYPED))
    with printed() as paper:
        print(f"exit code {entry.run_command_line()}")
    came = paper.taken()
    ends = [came.find(end) for end in ENDS if end in came]
    return Told(line, came[: min(ends, default=None)])


def completed(twins: Pair, side: Side, monkeypatch: pytest.MonkeyPatch) -> list[Told]:
    """What a shell is told can follow each command, while a game is played that is kept."""
    left(twins, side, None)
    lines = [*(f"dmplay {name} " for name in PROGRAM), f"dmplay play {twins.name} --seed "]
    with monkeypatch.context() as world:
        world.setenv(entry.COMPLETION_VARIABLE, "complete_zsh")
        return [_completed(line, world) for line in lines]


def _completed(line: str, world: pytest.MonkeyPatch) -> Told:
    world.setenv("_TYPER_COMPLETE_ARGS", line)
    with printed() as paper:
        print(f"exit code {entry.run_command_line()}")
    return Told(line, paper.taken())


def left(twins: Pair, side: Side, record: Path | None = FILE) -> GameController:
    """A game before its last turn, in the file, or in the folder of games that are kept."""
    game = twins.begun(side, record)
    for joint in side.actions[:LOOKED_AT]:
        game.choose(joint[twins.seat_index])
    return GameController(game, interpret_command)


def asked(twins: Pair, command: str) -> Iterator[str]:
    """What is typed at another terminal."""
    agents = twins.problem.agents
    replayed = " ".join(f"--seat {agent}=replay:{FILE}" for agent in agents)
    trusts = any(param.name == "trust" for param in PROGRAM[command].params)
    for rest in OUTSIDE[command]:
        words = rest.format(problem=twins.name, file=FILE, replayed=replayed)
        yield f"{command} {words}{' --trust' * (trusts and twins.name == BROUGHT)}"


def outside(twins: Pair, monkeypatch: pytest.MonkeyPatch, command: str, *, killed: bool) -> None:
    """Nothing that is typed elsewhere tells the games apart, in play or left."""

    def play(side: Side) -> list[Told]:
        heard: list[Told] = []
        table, begun = left(twins, side), b""
        for line in asked(twins, command):
            if FILE.read_bytes() != begun:
                table.end_game()
                FILE.unlink()
                table = left(twins, side)
                begun = FILE.read_bytes()
                if killed:
                    assert table.game.recorder
                    table.game.recorder.close()
            heard.append(told(line, monkeypatch))
            for path in {*Path().glob("*.*")} - {FILE}:
                path.unlink()
        table.end_game()
        return heard

    alike(*both(twins, Path.cwd(), play))

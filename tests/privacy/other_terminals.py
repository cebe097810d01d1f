"""Commands typed in another terminal while a game is played or after it was killed."""

import io
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from dmplay.cli import main
from dmplay.cli.commands import COMMANDS, build_command
from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.game.game_series import GameController
from tests.privacy.command_arguments import PROGRAM_ARGUMENTS, STDIN_TEXT
from tests.privacy.front_ends import (
    TRANSCRIPT_PATH,
    Response,
    assert_indistinguishable,
    capture_output,
    play_both,
)
from tests.privacy.indistinguishable_pairs import SHARED_TURNS, USER_PROBLEM, Pair, Side

PROGRAM_COMMANDS: dict[str, Any] = {
    name: command
    for word, subgroup in zip(COMMANDS, map(build_command, COMMANDS), strict=True)
    for name, command in (
        [(f"{word} {inner}", subcommand) for inner, subcommand in subgroup.commands.items()]
        if hasattr(subgroup, "commands")
        else [(word, subgroup)]
    )
}
END_MARKERS = ("\nturn 0. ", "over: ", '{"event": "end"')  # the end reveals everything


def run_line(line: str, monkeypatch: pytest.MonkeyPatch) -> Response:
    """Run a command and return what it prints before the end of a game that it plays."""
    monkeypatch.setattr("sys.argv", ["dmplay", *shlex.split(line)])
    monkeypatch.setattr("sys.stdin", io.StringIO(STDIN_TEXT))
    with capture_output() as output:
        print(f"exit code {main.run_command_line()}")
    text = output.taken()
    positions = [text.find(end) for end in END_MARKERS if end in text]
    return Response(line, text[: min(positions, default=None)])


def list_completions(twins: Pair, side: Side, monkeypatch: pytest.MonkeyPatch) -> list[Response]:
    """Return the shell's completions of each command while a saved game is being played."""
    start_unfinished_game(twins, side, None)
    lines = [*(f"dmplay {name} " for name in PROGRAM_COMMANDS), f"dmplay play {twins.name} --seed "]
    with monkeypatch.context() as context:
        return [_complete_line(line, context) for line in lines]


def _complete_line(line: str, monkeypatch: pytest.MonkeyPatch) -> Response:
    monkeypatch.setenv("_DMPLAY_COMPLETE", "complete_zsh")
    monkeypatch.setenv("_TYPER_COMPLETE_ARGS", line)
    monkeypatch.setenv("_TYPER_COMPLETE_FISH_ACTION", "")
    with capture_output() as output:
        print(f"exit code {main.run_command_line()}")
    return Response(line, output.taken())


def start_unfinished_game(
    twins: Pair, side: Side, record: Path | None = TRANSCRIPT_PATH
) -> GameController:
    """Start a game and stop before its last turn, in this file or in the folder of saved games."""
    game = twins.begun(side, record)
    for turn, joint in enumerate(side.actions[:SHARED_TURNS]):
        if len(game.session.turns) == turn:  # not played already, because the seat waited
            game.choose(joint[twins.seat_index])
    return GameController(game, interpret_command)


def iter_lines(twins: Pair, command: str) -> Iterator[str]:
    """Yield the lines to type in another terminal."""
    agents = twins.problem.agents
    replayed = " ".join(f"--seat {agent}=replay:{TRANSCRIPT_PATH}" for agent in agents)
    has_trust_option = any(param.name == "trust" for param in PROGRAM_COMMANDS[command].params)
    for template in PROGRAM_ARGUMENTS[command]:
        arguments = template.format(problem=twins.name, file=TRANSCRIPT_PATH, replayed=replayed)
        yield (
            f"{command} {arguments}{' --trust' * (has_trust_option and twins.name == USER_PROBLEM)}"
        )


def assert_no_leak_outside(
    twins: Pair, monkeypatch: pytest.MonkeyPatch, command: str, *, killed: bool
) -> None:
    """Assert that no command in another terminal distinguishes the games, running or killed."""

    def play(side: Side) -> list[Response]:
        responses: list[Response] = []
        table, first_content = start_unfinished_game(twins, side), b""
        for line in iter_lines(twins, command):
            if TRANSCRIPT_PATH.read_bytes() != first_content:
                table.end_game()
                TRANSCRIPT_PATH.unlink()
                table = start_unfinished_game(twins, side)
                first_content = TRANSCRIPT_PATH.read_bytes()
                if killed:
                    assert table.game.recorder
                    table.game.recorder.close()
            responses.append(run_line(line, monkeypatch))
            for path in {*Path().glob("*.*")} - {TRANSCRIPT_PATH, *Path().glob("*.efg")}:
                path.unlink()
        table.end_game()
        return responses

    assert_indistinguishable(*play_both(twins, Path.cwd(), play))

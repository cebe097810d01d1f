"""Tests of the MCP server: typed answers in process, and invalid input to a subprocess."""

import asyncio
import json
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from select import select
from typing import Any

import pytest

from dmplay.game.command_line_results import McpServerConfig
from dmplay.servers.mcp.language_model_games import MAX_GAMES, ModelGames
from tests.support.document_examples import NOISE_NAMES, NOISY_PROBLEM, TIGER_SOURCE
from tests.support.games import assert_verified, read_values
from tests.support.terminals import DMPLAY_COMMAND, clean_environment

pytestmark = [pytest.mark.slow, pytest.mark.extra("mcp")]
TIMEOUT_SECONDS = 60.0  # seconds to wait for an answer or the end of a process
UNREAD_REQUEST_COUNT = 100  # number of requests whose answers do not fit in a pipe
LONG_LINE_CHARS = 3_000_000  # number of characters of an invalid line
INITIALIZE_PARAMS = {
    "protocolVersion": "2025-06-18",
    "capabilities": {},
    "clientInfo": {"name": "tests", "version": "1"},
}
PRINTING_PROBLEM_SOURCE = f"""from pathlib import Path
{TIGER_SOURCE}
class Loud(Tiger):
    def resolve_events(self, s, a, events):
        print("loud")
        1 / (not Path("bad").exists())
        return super().resolve_events(s, a, events)
"""
INVALID_REQUEST = '{"jsonrpc": "2.0", "id": %s, "method": "ping"}'
INVALID_LINES = {  # invalid lines, and the number of errors that each line causes
    "{": 1, "[]": 1, '"x"': 1, '{"jsonrpc": "2.0"}': 1, "\udcff": 1, "": 1, "[" * 10_000: 1,
    "x" * LONG_LINE_CHARS: 4,
    **{INVALID_REQUEST % number: 1 for number in ("null", "1.5", "1.0", "true", "[1]", "{}")},
}  # fmt: skip


class ServerClient:
    """A client that talks to the server process line by line."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.folder = folder
        folder.mkdir(exist_ok=True)
        self.program = subprocess.Popen(
            [*DMPLAY_COMMAND, "mcp", "--seed", "5", "-o", str(folder / "games"), *options],
            bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            env=clean_environment(folder), cwd=folder,
        )  # fmt: skip
        self._number = 0
        self.ask("initialize", **INITIALIZE_PARAMS)
        self.say('{"jsonrpc": "2.0", "method": "notifications/initialized"}')

    def say(self, line: str) -> None:
        assert self.program.stdin
        remaining = f"{line}\n".encode(errors="surrogateescape")
        while remaining:
            remaining = remaining[self.program.stdin.write(remaining) or 0 :]

    def heard(self) -> dict[str, object]:
        assert self.program.stdout
        assert select([self.program.stdout], [], [], TIMEOUT_SECONDS)[0]
        message: dict[str, object] = json.loads(self.program.stdout.readline())
        return message

    def request(self, method: str, **params: object) -> None:
        self._number += 1
        message = {"jsonrpc": "2.0", "id": self._number, "method": method, "params": params}
        self.say(json.dumps(message))

    def ask(self, method: str, **params: object) -> dict[str, object]:
        self.request(method, **params)
        return self.heard()

    def call(self, tool: str, **arguments: object) -> dict[str, object]:
        """Call a tool and return its result."""
        result = self.ask("tools/call", name=tool, arguments=arguments)["result"]
        assert isinstance(result, dict)
        return result

    def fault(self, tool: str, **arguments: object) -> str:
        """Call a tool that fails and return its error message of one line."""
        result = self.call(tool, **arguments)
        assert result["isError"] is True
        assert isinstance(result["content"], list)
        (part,) = result["content"]
        assert "\n" not in part["text"]
        return str(part["text"])

    def ended(self) -> tuple[int, str]:
        """Wait for the process to end; return its exit code and its error output."""
        assert self.program.stderr
        assert self.program.stdout
        code = self.program.wait(TIMEOUT_SECONDS)
        errors = self.program.stderr.read().decode()
        self.program.stderr.close()
        self.program.stdout.close()
        return code, errors

    def gone(self) -> tuple[int, str]:
        """Close the input of the process and wait for it to end."""
        assert self.program.stdin
        self.program.stdin.close()
        return self.ended()

    def transcript_paths(self) -> list[Path]:
        return [assert_verified(path) for path in (self.folder / "games").glob("*.dmt")]


@contextmanager
def open_client(folder: Path, *options: str) -> Iterator[ServerClient]:
    new_client = ServerClient(folder, *options)
    try:
        yield new_client
    finally:
        new_client.program.kill()
        for stream in (
            new_client.program.stdin,
            new_client.program.stdout,
            new_client.program.stderr,
        ):
            if stream:
                stream.close()
        new_client.program.wait()


def test_every_tool_returns_typed_content_and_disabled_tools_do_not_exist(tmp_path: Path) -> None:
    from mcp import Client as Inside  # slow to import

    from dmplay.servers.mcp.server import make_server

    async def play() -> None:
        games = ModelGames(McpServerConfig(allow_hints=True, transcript_folder=tmp_path))
        async with Inside(make_server(games)) as session:
            tools = (await session.list_tools()).tools
            names = [tool.name for tool in tools]
            assert all(tool.description and tool.output_schema for tool in tools)
            for tool in tools:
                for argument in tool.input_schema["properties"].values():
                    assert argument["description"]
                    assert isinstance(argument["type"], str)
            read_only = [
                tool.name for tool in tools if getattr(tool.annotations, "read_only_hint", False)
            ]
            assert read_only == ["dmplay_list", "dmplay_info", "dmplay_look"]
            arguments_by_tool: dict[str, dict[str, Any]] = {
                "list": {},
                "info": {"problem": "catch"},
                "new": {"problem": "catch"},
                "look": {"game": "g1"},
                "act": {"game": "g1", "action": 50.0},
                "hint": {"game": "g1"},
                "over": {"game": "g1"},
            }
            assert names == [f"dmplay_{name}" for name in arguments_by_tool]
            for name, arguments in arguments_by_tool.items():
                result = await session.call_tool(f"dmplay_{name}", arguments)
                assert not result.is_error
                assert result.structured_content
            assert (await session.call_tool("dmplay_undo", {"game": "g1"})).is_error

    asyncio.run(play())
    assert_verified(next(tmp_path.glob("*.dmt")))


def test_invalid_calls_return_one_line_errors_and_the_game_continues(tmp_path: Path) -> None:
    with open_client(tmp_path) as session:
        assert not session.call("dmplay_new", problem="2048")["isError"]
        assert session.fault("dmplay_act", game="g7", action="left").startswith("unknown game 'g7'")
        assert "down moves no tile" in session.fault("dmplay_act", game="g1", action="down")
        assert (
            session.fault("dmplay_act", game="g1", action="left", turn=3)
            == "turn: got 3, expected 1"
        )
        for name in ("/etc/passwd", "2048; touch x", "$(touch x)", "./evil.py:X", "bot:touch x"):
            assert session.fault("dmplay_new", problem=name).startswith("unknown problem ")
        assert session.fault("dmplay_new", problem="2048", path="x").startswith(
            "dmplay_new: unknown argument"
        )
        type_errors = session.fault("dmplay_act", game=["g1"], action=None)
        assert type_errors.startswith(
            "game: Input should be a valid string; action: Input should be"
        )
        assert session.fault("dmplay_act") == "game: Field required; action: Field required"
        for forbidden in ("dmplay_hint", "dmplay_undo", "act", "nothing"):
            assert session.fault(forbidden, game="g1") == f"Unknown tool: {forbidden}"
        for line, error_count in INVALID_LINES.items():
            session.say(line)
            for _ in range(error_count):
                error = session.heard()["error"]
                assert isinstance(error, dict)
                assert error["message"].endswith("as the id of a request")
        for _ in range(MAX_GAMES - 1):
            session.call("dmplay_new", problem="catch")
        for _ in range(300):
            message = session.fault("dmplay_new", problem="catch")
            assert message == f"{MAX_GAMES} games are running; end one of them with dmplay_over"
        assert not session.call("dmplay_act", game="g1", action="left")["isError"]
        session.call("dmplay_over", game="g1")
        assert session.fault("dmplay_act", game="g1", action="left") == "the game is over (quit)"
        assert session.gone() == (0, "")
        reasons = [
            json.loads(read_values(path, "end")[0])["reason"] for path in session.transcript_paths()
        ]
        assert sorted(reasons) == ["interrupted"] * (MAX_GAMES - 1) + ["quit"]
        assert not (tmp_path / "x").exists()


def test_a_lost_client_leaves_no_process_and_a_complete_transcript(tmp_path: Path) -> None:
    for name, code in {"deaf": 143, "interrupted": 130, "gone": 0}.items():
        with open_client(tmp_path / name, "hexworld") as session:
            session.call("dmplay_new", problem="hexworld")
            session.call("dmplay_act", game="g1", action="e")
            if name == "gone":
                assert session.program.stdout
                session.program.stdout.close()
                session.request("tools/list")
                assert session.program.wait(TIMEOUT_SECONDS) == code
            else:
                for _ in range(UNREAD_REQUEST_COUNT * (name == "deaf")):  # it reads no answer
                    session.request("tools/list")
                signal_number = signal.SIGTERM if name == "deaf" else signal.SIGINT
                session.program.send_signal(signal_number)
                assert session.ended() == (code, "")
            (path,) = session.transcript_paths()
            assert '"reason": "interrupted"' in read_values(path, "end")[0]


def test_output_and_errors_of_a_problem_are_not_sent_to_the_client(tmp_path: Path) -> None:
    (tmp_path / "loud.py").write_text(PRINTING_PROBLEM_SOURCE)
    with open_client(tmp_path, "./loud.py:Loud") as session:
        assert not session.call("dmplay_new", problem="loud:Loud")["isError"]
        (tmp_path / "bad").touch()
        message = session.fault("dmplay_act", game="g1", action="listen")
        assert message == "unexpected ZeroDivisionError; dmplay mcp printed its location to stderr"
        code, errors = session.gone()
        assert code == 0
        assert "loud" in errors
        assert "loud.py:24: ZeroDivisionError" in errors
        assert "Traceback" not in errors


def test_a_problem_that_uses_the_standard_streams_does_not_reach_the_client(tmp_path: Path) -> None:
    (tmp_path / "noisy.py").write_text(NOISY_PROBLEM)
    with open_client(tmp_path, "./noisy.py:Noisy") as session:
        assert session.call("dmplay_list")["structuredContent"]
        assert not session.call("dmplay_new", problem="noisy:Noisy")["isError"]
        assert not session.call("dmplay_act", game="g1", action="listen")["isError"]
        code, errors = session.gone()
        assert code == 0
        for source in NOISE_NAMES:
            assert f"noise of {source}" in errors


def test_an_output_that_cannot_be_written_is_one_error(tmp_path: Path) -> None:
    message = {"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": INITIALIZE_PARAMS}
    for redirection in (">&-", ">/dev/full"):
        program = subprocess.run(
            ["sh", "-c", f'(echo "$0"; sleep 2) | "$@" {redirection}', json.dumps(message),
             *DMPLAY_COMMAND, "mcp"], capture_output=True, text=True, check=False,
            env=clean_environment(tmp_path), cwd=tmp_path,
        )  # fmt: skip
        assert program.returncode == 1
        [line] = program.stderr.splitlines()
        assert line in ("error: standard output is closed", "error: No space left on device")


@pytest.mark.extra("axelrod")
def test_other_requests_are_answered_while_a_library_of_agents_is_loaded(tmp_path: Path) -> None:
    with open_client(tmp_path) as session:
        arguments = {"problem": "prisoners-dilemma", "others": "axelrod:Alternator"}
        session.request("tools/call", name="dmplay_new", arguments=arguments)
        assert "result" in session.ask("ping")
        assert '"game": "g1"' in json.dumps(session.call("dmplay_new", problem="catch"))
        assert '"game": "g2"' in json.dumps(session.heard())

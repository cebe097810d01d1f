"""The tools over the wire: typed answers in process, and no abuse of them that leaves anything."""

import asyncio
import json
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from dmplay.game.errand import McpServerConfig
from dmplay.mcp.games import MAX_GAMES, ModelGames
from tests.support.blocks import TIGER
from tests.support.games import values, verified
from tests.support.terminals import DMPLAY, clean_environment

pytestmark = pytest.mark.slow
PATIENCE = 60.0  # seconds until a program that does not end is a failure
DEAF = 100  # answers, which are more than a pipe holds
LONG = 3_000_000  # characters of a line that is none
HELLO = {
    "protocolVersion": "2025-06-18",
    "capabilities": {},
    "clientInfo": {"name": "tests", "version": "1"},
}
LOUD = f"""from pathlib import Path
{TIGER}
class Loud(Tiger):
    def resolve_events(self, s, a, events):
        print("loud")
        1 / (not Path("bad").exists())
        return super().move(s, a, events)
"""
BAD = {  # lines, and as how many they are told
    "{": 1, "[]": 1, '"x"': 1, '{"jsonrpc": "2.0"}': 1, "\udcff": 1, "": 1, "[" * 10_000: 1,
    "x" * LONG: 4,
}  # fmt: skip


class Client:
    """A client of the program, line by line."""

    def __init__(self, folder: Path, *words: str) -> None:
        self.folder = folder
        folder.mkdir(exist_ok=True)
        self.program = subprocess.Popen(
            [*DMPLAY, "mcp", "--seed", "5", "-o", str(folder / "games"), *words],
            bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            env=clean_environment(folder), cwd=folder,
        )  # fmt: skip
        self._number = 0
        self.ask("initialize", **HELLO)
        self.say('{"jsonrpc": "2.0", "method": "notifications/initialized"}')

    def say(self, line: str) -> None:
        assert self.program.stdin
        left = f"{line}\n".encode(errors="surrogateescape")
        while left:
            left = left[self.program.stdin.write(left) or 0 :]

    def heard(self) -> dict[str, object]:
        assert self.program.stdout
        said: dict[str, object] = json.loads(self.program.stdout.readline())
        return said

    def request(self, method: str, **params: object) -> None:
        self._number += 1
        asked = {"jsonrpc": "2.0", "id": self._number, "method": method, "params": params}
        self.say(json.dumps(asked))

    def ask(self, method: str, **params: object) -> dict[str, object]:
        self.request(method, **params)
        return self.heard()

    def call(self, tool: str, **arguments: object) -> dict[str, object]:
        """What a tool answers."""
        result = self.ask("tools/call", name=tool, arguments=arguments)["result"]
        assert isinstance(result, dict)
        return result

    def fault(self, tool: str, **arguments: object) -> str:
        """The one line in which a tool says what is wrong."""
        result = self.call(tool, **arguments)
        assert result["isError"] is True
        assert isinstance(result["content"], list)
        (part,) = result["content"]
        assert "\n" not in part["text"]
        return str(part["text"])

    def ended(self) -> tuple[int, str]:
        """Its exit code and what it says of errors; nothing of it is left."""
        assert self.program.stderr
        assert self.program.stdout
        code = self.program.wait(PATIENCE)
        told = self.program.stderr.read().decode()
        self.program.stderr.close()
        self.program.stdout.close()
        return code, told

    def gone(self) -> tuple[int, str]:
        """The same once nobody speaks to it any more."""
        assert self.program.stdin
        self.program.stdin.close()
        return self.ended()

    def kept(self) -> list[Path]:
        return [verified(path) for path in (self.folder / "games").glob("*.dmt")]


@contextmanager
def client(folder: Path, *words: str) -> Iterator[Client]:
    made = Client(folder, *words)
    try:
        yield made
    finally:
        made.program.kill()
        for stream in (made.program.stdin, made.program.stdout, made.program.stderr):
            if stream:
                stream.close()
        made.program.wait()


def test_every_tool_answers_with_typed_content_and_only_what_is_allowed_is_a_tool(
    tmp_path: Path,
) -> None:
    from mcp import Client as Inside  # which takes long to load

    from dmplay.mcp.server import make_server

    async def play() -> None:
        games = ModelGames(McpServerConfig(allow_hints=True, transcript_folder=tmp_path))
        async with Inside(make_server(games)) as inside:
            tools = (await inside.list_tools()).tools
            names = [tool.name for tool in tools]
            assert names == ["list", "info", "new", "look", "act", "hint", "over"]
            assert all(tool.description and tool.output_schema for tool in tools)
            asked: dict[str, dict[str, Any]] = {
                "list": {},
                "info": {"problem": "catch"},
                "new": {"problem": "catch"},
                "look": {"game": "g1"},
                "act": {"game": "g1", "action": 50},
                "hint": {"game": "g1"},
                "over": {"game": "g1"},
            }
            for name, arguments in asked.items():
                told = await inside.call_tool(name, arguments)
                assert not told.is_error
                assert told.structured_content
            assert (await inside.call_tool("undo", {"game": "g1"})).is_error

    asyncio.run(play())
    verified(next(tmp_path.glob("*.dmt")))


def test_abuses_end_in_one_line_each_and_the_game_goes_on(tmp_path: Path) -> None:
    with client(tmp_path) as abuser:
        assert not abuser.call("new", problem="2048")["isError"]
        assert abuser.fault("act", game="g7", action="left").startswith("unknown game 'g7'")
        assert "down is not legal now" in abuser.fault("act", game="g1", action="down")
        assert abuser.fault("act", game="g1", action="left", turn=3) == "turn: got 3, expected 1"
        for name in ("/etc/passwd", "2048; touch x", "$(touch x)", "./evil.py:X", "bot:touch x"):
            assert abuser.fault("new", problem=name).startswith("unknown problem ")
        assert abuser.fault("new", problem="2048", path="x").startswith("new: unknown argument")
        wrong = abuser.fault("act", game=["g1"], action=None)
        assert wrong.startswith("game: Input should be a valid string; action: Input should be")
        assert abuser.fault("act") == "game: Field required; action: Field required"
        for forbidden in ("hint", "undo", "nothing"):
            assert abuser.fault(forbidden, game="g1") == f"Unknown tool: {forbidden}"
        for line, told_as in BAD.items():
            abuser.say(line)
            for _ in range(told_as):
                error = abuser.heard()["error"]
                assert isinstance(error, dict)
                assert error["message"].endswith("expected a message of JSON-RPC 2.0")
        for _ in range(MAX_GAMES - 1):
            abuser.call("new", problem="catch")
        for _ in range(300):
            told = abuser.fault("new", problem="catch")
            assert told == f"new: {MAX_GAMES} games are played; end one of them by over"
        assert not abuser.call("act", game="g1", action="left")["isError"]
        abuser.call("over", game="g1")
        assert abuser.fault("act", game="g1", action="left") == "the game is over (quit)"
        assert abuser.gone() == (0, "")
        reasons = [json.loads(values(path, "end")[0])["reason"] for path in abuser.kept()]
        assert sorted(reasons) == ["interrupted"] * (MAX_GAMES - 1) + ["quit"]
        assert not (tmp_path / "x").exists()


def test_a_client_that_is_deaf_gone_or_interrupted_leaves_no_process_and_a_whole_transcript(
    tmp_path: Path,
) -> None:
    for name, code in {"deaf": 143, "interrupted": 130, "gone": 0}.items():
        with client(tmp_path / name, "hexworld") as left:
            left.call("new", problem="hexworld")
            left.call("act", game="g1", action="e")
            if name == "gone":
                assert left.program.stdout
                left.program.stdout.close()
                left.request("tools/list")
                assert left.program.wait(PATIENCE) == code
            else:
                for _ in range(DEAF * (name == "deaf")):  # it reads no answer
                    left.request("tools/list")
                number = signal.SIGTERM if name == "deaf" else signal.SIGINT
                left.program.send_signal(number)
                assert left.ended() == (code, "")
            (path,) = left.kept()
            assert '"reason": "interrupted"' in values(path, "end")[0]


def test_what_a_problem_prints_or_does_wrong_is_no_answer(tmp_path: Path) -> None:
    (tmp_path / "loud.py").write_text(LOUD)
    with client(tmp_path, "./loud.py:Loud") as host:
        assert not host.call("new", problem="loud:Loud")["isError"]
        (tmp_path / "bad").touch()
        told = host.fault("act", game="g1", action="listen")
        assert told == "unexpected ZeroDivisionError; whoever runs dmplay can read where"
        code, errors = host.gone()
        assert code == 0
        assert "loud" in errors
        assert "loud.py:24: ZeroDivisionError" in errors
        assert "Traceback" not in errors

"""A server of the Model Context Protocol: what a language model can ask for, as tools."""

import sys
from collections.abc import Callable, Sequence
from typing import Any, cast

from mcp.server import MCPServer
from mcp.server.mcpserver import Context
from mcp.server.mcpserver.exceptions import ToolError
from mcp.server.stdio import stdio_server
from pydantic import ValidationError

from dmplay import __version__
from dmplay.bots.protocol import Facts
from dmplay.describe import one_line
from dmplay.errors import DmplayError, UnknownName
from dmplay.front import faults
from dmplay.mcp.games import Games, Situation
from dmplay.mcp.wire import Wire
from dmplay.places import blamed
from dmplay.signals import leaving
from dmplay.terminal import clean

HOW = """\
Play decision problems. list names them, info tells the rules of one, new begins a game and gives
its id; look tells where it stands, act plays a turn, over ends it. Act on what you are told: what
is hidden comes out at the end."""
LONGEST = 1000  # characters of what is wrong
ALONE = "dmplay mcp: a client speaks here, not a person; dmplay guide mcp tells how"


class Server(MCPServer[None]):
    """Tells what is wrong with a call in one line."""

    async def call_tool(
        self, name: str, arguments: dict[str, Any], context: Context[None, Any] | None = None
    ) -> Any:
        """The answer to a call, or ToolError."""
        for tool in await self.list_tools():
            known = tool.input_schema["properties"]
            unknown = [one for one in arguments if tool.name == name and one not in known]
            if unknown:
                raise ToolError(_line(UnknownName("argument", unknown[0], known, where=name)))
        try:
            return await super().call_tool(name, arguments, context)
        except ToolError as error:
            raise ToolError(_line(error.__cause__ or error)) from None

    async def run_stdio_async(self) -> None:
        """Serves a client at the standard streams, until it is gone or a signal comes."""
        wire, low = Wire(), self._lowlevel_server
        try:
            async with stdio_server(cast(Any, wire), cast(Any, wire)) as (come, go):
                await low.run(come, go, low.create_initialization_options())
        finally:
            wire.close()


def _line(error: BaseException) -> str:
    """What is wrong, in one line, as it may be told to whoever is not trusted with places."""
    if isinstance(error, ValidationError):
        each = [f"{one['loc'][0]}: {one['msg']}" for one in error.errors()]
        return one_line("; ".join(each))
    if isinstance(error, DmplayError | ToolError):
        return one_line(clean(str(error)))[:LONGEST]
    print(f"error: {clean(blamed(error) or repr(error))}", file=sys.stderr)
    return f"unexpected {type(error).__name__}; whoever runs dmplay can read where"


def server(games: Games) -> MCPServer[None]:
    """The tools by which a model plays these games: hint and undo only where they are allowed."""
    made = Server("dmplay", version=__version__, instructions=HOW, log_level="CRITICAL")
    terms = games.terms
    allowed = {"hint": terms.hints, "undo": terms.undo}
    for tool in _tools(games):
        name = tool.__name__.rstrip("_")
        if allowed.get(name, True):
            made.add_tool(tool, name=name)
    return made


def _tools(games: Games) -> Sequence[Callable[..., object]]:
    """What each tool is called, takes and does, as a model reads it."""

    async def list_() -> list[dict[str, str]]:
        """The problems that can be played."""
        return games.problems()

    async def info(problem: str) -> Facts:
        """The rules of a problem: what it is about, its seats, actions, observations, parameters
        and the agents that can sit in the other seats.
        """
        return games.info(problem)

    async def new(problem: str, seat: str = "", others: str = "") -> Situation:
        """Begins a game; you sit in the first seat unless you name another, and an agent, the usual
        one unless you name it, in all others.
        """
        return games.new(problem, seat, others)

    async def look(game: str, history: bool = False) -> Situation:
        """Where a game stands; with the history, all its turns again."""
        return games.look(game, history=history)

    async def act(game: str, action: str | int | float, turn: int = 0) -> Situation:
        """Plays a turn by one of the legal actions. Name the turn to play, and it is played only
        once.
        """
        return games.act(game, str(action), turn)

    async def hint(game: str) -> Facts:
        """What a good player would do now. The record says that you asked."""
        return games.hint(game)

    async def undo(game: str, turns: int = 1) -> Situation:
        """Takes back your last turns; the same actions then meet the same luck."""
        return games.undo(game, turns)

    async def over(game: str) -> Facts:
        """Ends a game; how it ended, what it paid, and turn by turn what was hidden."""
        return games.over(game)

    return list_, info, new, look, act, hint, undo, over


def serve(games: Games) -> int:
    """Serves a client at the standard streams until it is gone; the exit code."""
    if sys.stdin.isatty():
        print(ALONE, file=sys.stderr)
    try:
        with leaving():
            server(games).run()
    except* ConnectionError:
        pass  # the client is gone
    finally:
        games.close()
    return faults(games.unwritten)

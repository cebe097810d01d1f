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
from dmplay.bots.protocol import JsonObject
from dmplay.describe import escape_newlines
from dmplay.errors import DmplayError, UnknownName
from dmplay.front import report_write_errors
from dmplay.mcp.games import GameStatus, ModelGames
from dmplay.mcp.wire import StdioStreams
from dmplay.places import describe_error_location
from dmplay.signals import exit_on_signals
from dmplay.terminal import escape_unprintable

INSTRUCTIONS = """\
Play decision problems. list names them, info tells the rules of one, new begins a game and gives
its id; look tells where it stands, act plays a turn, over ends it. Act on what you are told: what
is hidden comes out at the end."""
MAX_ERROR_CHARACTERS = 1000  # characters of what is wrong
TERMINAL_NOTICE = "dmplay mcp: a client speaks here, not a person; dmplay guide mcp tells how"


class McpServer(MCPServer[None]):
    """Tells what is wrong with a call in one line."""

    async def call_tool(
        self, name: str, arguments: dict[str, Any], context: Context[None, Any] | None = None
    ) -> Any:
        """The answer to a call, or ToolError."""
        for tool in await self.list_tools():
            known = tool.input_schema["properties"]
            unknown = [one for one in arguments if tool.name == name and one not in known]
            if unknown:
                raise ToolError(
                    _format_error(UnknownName("argument", unknown[0], known, error_prefix=name))
                )
        try:
            return await super().call_tool(name, arguments, context)
        except ToolError as error:
            raise ToolError(_format_error(error.__cause__ or error)) from None

    async def run_stdio_async(self) -> None:
        """Serves a client at the standard streams, until it is gone or a signal comes."""
        wire, low = StdioStreams(), self._lowlevel_server
        try:
            async with stdio_server(cast(Any, wire), cast(Any, wire)) as (come, go):
                await low.run(come, go, low.create_initialization_options())
        finally:
            wire.close()


def _format_error(error: BaseException) -> str:
    """What is wrong, in one line, as it may be told to whoever is not trusted with places."""
    if isinstance(error, ValidationError):
        each = [f"{one['loc'][0]}: {one['msg']}" for one in error.errors()]
        return escape_newlines("; ".join(each))
    if isinstance(error, DmplayError | ToolError):
        return escape_newlines(escape_unprintable(str(error)))[:MAX_ERROR_CHARACTERS]
    print(
        f"error: {escape_unprintable(describe_error_location(error) or repr(error))}",
        file=sys.stderr,
    )
    return f"unexpected {type(error).__name__}; whoever runs dmplay can read where"


def make_server(games: ModelGames) -> MCPServer[None]:
    """The tools by which a model plays these games: hint and undo only where they are allowed."""
    made = McpServer("dmplay", version=__version__, instructions=INSTRUCTIONS, log_level="CRITICAL")
    terms = games.config
    allowed = {"hint": terms.allow_hints, "undo": terms.allow_undo}
    for tool in _make_tools(games):
        name = tool.__name__.rstrip("_")
        if allowed.get(name, True):
            made.add_tool(tool, name=name)
    return made


def _make_tools(games: ModelGames) -> Sequence[Callable[..., object]]:
    """What each tool is called, takes and does, as a model reads it."""

    async def list_() -> list[dict[str, str]]:
        """The problems that can be played."""
        return games.list_problems()

    async def info(problem: str) -> JsonObject:
        """The rules of a problem: what it is about, its seats, actions, observations, parameters
        and the agents that can sit in the other seats.
        """
        return games.problem_info(problem)

    async def new(problem: str, seat: str = "", others: str = "") -> GameStatus:
        """Begins a game; you sit in the first seat unless you name another, and an agent, the usual
        one unless you name it, in all others.
        """
        return games.start_game(problem, seat, others)

    async def look(game: str, history: bool = False) -> GameStatus:
        """Where a game stands; with the history, all its turns again."""
        return games.game_status(game, history=history)

    async def act(game: str, action: str | int | float, turn: int = 0) -> GameStatus:
        """Plays a turn by one of the legal actions. Name the turn to play, and it is played only
        once.
        """
        return games.play_action(game, str(action), turn)

    async def hint(game: str) -> JsonObject:
        """What a good player would do now. The record says that you asked."""
        return games.get_hint(game)

    async def undo(game: str, turns: int = 1) -> GameStatus:
        """Takes back your last turns; the same actions then meet the same luck."""
        return games.undo_turns(game, turns)

    async def over(game: str) -> JsonObject:
        """Ends a game; how it ended, what it paid, and turn by turn what was hidden."""
        return games.end_game(game)

    return list_, info, new, look, act, hint, undo, over


def serve(games: ModelGames) -> int:
    """Serves a client at the standard streams until it is gone; the exit code."""
    if sys.stdin.isatty():
        print(TERMINAL_NOTICE, file=sys.stderr)
    try:
        with exit_on_signals():
            make_server(games).run()
    except* ConnectionError:
        pass  # the client is gone
    finally:
        games.end_all_games()
    return report_write_errors(games.failed_recorders)

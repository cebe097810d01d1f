"""A server of the Model Context Protocol, which offers games to a language model as tools."""

import os
import sys
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from typing import Annotated, Any

from anyio import to_thread
from mcp.server import MCPServer
from mcp.server.mcpserver import Context
from mcp.server.mcpserver.exceptions import ToolError
from mcp.server.stdio import stdio_server
from mcp.types import ToolAnnotations
from pydantic import BeforeValidator, Field, ValidationError

from dmplay import __version__
from dmplay.core.text import escape_newlines, escape_unprintable
from dmplay.core.user_code_locations import describe_error_location
from dmplay.errors import DmplayError, UnknownName
from dmplay.external.bots.protocol import JsonObject
from dmplay.servers.mcp.language_model_games import GameStatus, ModelGames
from dmplay.servers.mcp.stdio_streams import StdioStreams
from dmplay.terminal.signals import exit_on_signals
from dmplay.ui.game_launcher import report_removed_saves, report_write_errors

TOOL_PREFIX = "dmplay_"  # so that the tools of other servers have other names
INSTRUCTIONS = """\
Play decision problems. dmplay_list returns the problems, and dmplay_info the rules of one.
dmplay_new starts a game and returns its id. dmplay_look returns the status of the game, dmplay_act
plays a turn, and dmplay_over ends the game. Base your actions on the status. Only dmplay_over
returns hidden information."""
MAX_ERROR_CHARACTERS = 1000
TERMINAL_NOTICE = "dmplay mcp: waiting for an MCP client on standard input; see dmplay guide mcp"


class McpServer(MCPServer[None]):
    """A server that reports each failed call in one line."""

    input_fd, output_fd = 0, 1  # descriptors of the messages from and to the client

    async def call_tool(
        self, name: str, arguments: dict[str, Any], context: Context[None, Any] | None = None
    ) -> Any:
        """Return the result of a call; raise ToolError with a message of one line."""
        for tool in await self.list_tools():
            properties = tool.input_schema["properties"]
            unknown = next((word for word in arguments if word not in properties), None)
            if tool.name == name and unknown is not None:
                error = UnknownName("argument", unknown, properties, error_prefix=name)
                raise ToolError(_format_error(error))
        try:
            return await super().call_tool(name, arguments, context)
        except ToolError as failure:
            raise ToolError(_format_error(failure.__cause__ or failure)) from None

    async def run_stdio_async(self) -> None:
        """Serve a client on the standard streams until it disconnects or a signal arrives."""
        streams: Any = StdioStreams(self.input_fd, self.output_fd)
        low_level = self._lowlevel_server
        try:
            async with stdio_server(streams, streams) as (incoming, outgoing):
                await low_level.run(incoming, outgoing, low_level.create_initialization_options())
        finally:
            os.set_blocking(self.output_fd, True)  # The client may have the same pipe.


def _format_error(error: BaseException) -> str:
    """Return an error's message in one line, without locations of files.

    The location of an unexpected error is printed to stderr only: the client is not trusted with
    it.
    """
    if isinstance(error, ValidationError):
        messages = [f"{detail['loc'][0]}: {detail['msg']}" for detail in error.errors()]
        return escape_newlines("; ".join(messages))
    if isinstance(error, DmplayError | ToolError):
        return escape_newlines(escape_unprintable(str(error)))[:MAX_ERROR_CHARACTERS]
    location = escape_unprintable(describe_error_location(error) or repr(error))
    print(f"error: {location}", file=sys.stderr)
    return f"unexpected {type(error).__name__}; dmplay mcp printed its location to stderr"


def make_server(games: ModelGames) -> McpServer:
    """Return a server with the tools of the games; hint and undo only if they are allowed."""
    game_server = McpServer(
        "dmplay", version=__version__, instructions=INSTRUCTIONS, log_level="CRITICAL"
    )
    config = games.config
    is_allowed = {"hint": config.allow_hints, "undo": config.allow_undo}
    for tool in _make_tools(games):
        name = tool.__name__.rstrip("_")
        if is_allowed.get(name, True):
            annotations = ToolAnnotations(
                read_only_hint=name in ("list", "info", "look"),
                destructive_hint=name in ("undo", "over"),
                idempotent_hint=name in ("list", "info", "look", "over"),
                open_world_hint=False,
            )
            game_server.add_tool(tool, name=TOOL_PREFIX + name, annotations=annotations)
    return game_server


def _format_number(value: object) -> object:
    """Return a number as text, without a decimal point if it is whole; return others unchanged."""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    return str(value) if isinstance(value, int | float) else value


ProblemId = Annotated[str, Field(description="id of a problem, from dmplay_list")]
GameId = Annotated[str, Field(description="id of a game, from dmplay_new")]
SeatName = Annotated[
    str, Field(description="your seat, from dmplay_info; empty for the first seat")
]
OtherAgent = Annotated[
    str,
    Field(description="agent in all other seats, from dmplay_info; empty for the default agents"),
]
WithHistory = Annotated[bool, Field(description="whether to return all turns again")]
Action = Annotated[
    str,
    BeforeValidator(_format_number),  # Models send a number as it is.
    Field(description="one of the legal actions: a name, or a number as text"),
]
TurnNumber = Annotated[
    int, Field(description="number of the turn, so that it is played once; 0 for the next turn")
]
NOTHING_STATED: dict[str, float] = {}
StatedBelief = Annotated[
    dict[str, float],
    Field(
        description="optional, if states are hidden: the probability of each state before your "
        "action, as you believe; states that are left out have probability 0"
    ),
]
TurnCount = Annotated[int, Field(description="number of your turns to take back")]


def _make_tools(games: ModelGames) -> Sequence[Callable[..., object]]:
    """Return the tools; a model reads their names, parameters and docstrings."""

    async def list_() -> list[dict[str, str]]:
        """List the problems that can be played."""
        return games.list_problems()

    async def info(problem: ProblemId) -> JsonObject:
        """Return the rules of a problem: its description, seats, actions, observations, parameters
        and the agents that can play the other seats.
        """
        return games.problem_info(problem)

    async def new(problem: ProblemId, seat: SeatName = "", others: OtherAgent = "") -> GameStatus:
        """Start a game. You play the first seat unless you name another. Agents play the other
        seats: the default ones unless you name one.
        """
        package = games.find_required_package(problem, others)
        if package:  # A large library takes seconds, in which the server answers other requests.
            with suppress(ImportError):  # `start_game` reports it.
                await to_thread.run_sync(import_module, package, abandon_on_cancel=True)
        return games.start_game(problem, seat, others)

    async def look(game: GameId, history: WithHistory = False) -> GameStatus:
        """Return the current situation of a game; with `history`, also all turns played."""
        return games.game_status(game, history=history)

    async def act(
        game: GameId, action: Action, turn: TurnNumber = 0, belief: StatedBelief = NOTHING_STATED
    ) -> GameStatus:
        """Play a turn with one of the legal actions. If you give the number of the turn, it is
        played at most once. The transcript records the belief that you state.
        """
        return games.play_action(game, action, turn, belief or None)

    async def hint(game: GameId) -> JsonObject:
        """Return the action that a good player would choose. The transcript records each hint."""
        return games.get_hint(game)

    async def undo(game: GameId, turns: TurnCount = 1) -> GameStatus:
        """Take back your last turns. The same actions then lead to the same random events."""
        return games.undo_turns(game, turns)

    async def over(game: GameId) -> JsonObject:
        """End a game. Return its result, its rewards and the hidden information of every turn."""
        return games.end_game(game)

    return list_, info, new, look, act, hint, undo, over


def serve(games: ModelGames, input_fd: int, output_fd: int) -> int:
    """Serve a client on two descriptors until it disconnects, and return the exit code."""
    if os.isatty(input_fd):
        print(TERMINAL_NOTICE, file=sys.stderr)
    # A signal may end the server after a coroutine is made and before it is awaited.
    warnings.filterwarnings("ignore", "coroutine .* was never awaited", RuntimeWarning)
    try:
        with exit_on_signals():
            server = make_server(games)
            server.input_fd, server.output_fd = input_fd, output_fd
            server.run()
    except ExceptionGroup as group:
        error: Exception = group
        while isinstance(error, ExceptionGroup):
            error = error.exceptions[0]
        if not isinstance(error, ConnectionError):  # A client that is gone is no error.
            raise error from None
    finally:
        games.end_all_games()
        report_removed_saves(games.save_removal)
    return report_write_errors(games.failed_recorders)

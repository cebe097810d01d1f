"""CLI commands that serve games on the standard streams: as a bot, or over MCP."""

import sys
from contextlib import redirect_stdout

from dmplay.core.policy import Policy
from dmplay.core.problem import Problem, find_seat
from dmplay.external.bots.protocol import JsonObject
from dmplay.external.optional_libraries import import_library
from dmplay.game.command_line_results import McpServerConfig
from dmplay.registry import agents, problems
from dmplay.servers.bot_server import BotServer, SeatFactory, serve_lines
from dmplay.terminal.output_streams import divert_stdin, divert_stdout


def serve_bot(agent: str, problem_name: str) -> int:
    """Serve an agent as a bot for a problem on the standard streams, and return the exit code."""
    divert_stdout()
    lines, output = divert_stdin(), sys.stdout
    with redirect_stdout(sys.stderr):
        problems.resolve_problem(problem_name, {})  # raises an error if it does not exist
        serve_lines(BotServer(agent, make_seat_factory(agent, problem_name)), lines, output)
    return 0


def serve_mcp(config: McpServerConfig) -> int:
    """Serve games to a language model over MCP on standard streams; return the exit code."""
    from dmplay.servers.mcp.language_model_games import ModelGames

    import_library("mcp.server.mcpserver", "mcp", "mcp")
    from dmplay.servers.mcp.server import serve

    divert_stdout()
    lines, output = divert_stdin(), sys.stdout
    with redirect_stdout(sys.stderr):  # Output of a problem must not mix with the messages.
        return serve(ModelGames(config), lines.fileno(), output.fileno())


def make_seat_factory(agent: str, problem_name: str) -> SeatFactory:
    """Return a function that creates the problem, seat and policy that a hello message names.

    If the hello message has a turn limit, the agent is the one that suits that many turns.
    """

    def create_seat(hello: JsonObject) -> tuple[Problem, int, Policy]:
        """Load the problem with its parameters and create the agent in its seat."""
        problem = problems.load_problem(problem_name, **hello["parameters"])
        seat_index, turn_limit = find_seat(problem, hello["seat"]), hello["turns"]
        if turn_limit is None:
            name = agent
        else:
            name = agents.set_horizon_in_name(problem, seat_index, agent, turn_limit)
        return problem, seat_index, agents.load_agent(problem, seat_index, name)

    return create_seat

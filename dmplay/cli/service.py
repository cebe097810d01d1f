"""Games with another program at the standard streams: it keeps one, or a model plays in ours."""

import sys
from contextlib import redirect_stdout

from dmplay.bots.protocol import JsonObject
from dmplay.bots.speaker import BotServer, SeatFactory, serve_lines
from dmplay.core import Policy, Problem
from dmplay.finding import agents, problems
from dmplay.game.errand import McpServerConfig
from dmplay.guests.extras import import_library


def serve_bot(agent: str, problem_name: str) -> int:
    """Plays a problem of this name between the standard streams; the exit code."""
    problems.resolve_problem(problem_name, {})  # refuses what there is not
    serve_lines(BotServer(agent, make_seat_factory(agent, problem_name)), sys.stdin, sys.stdout)
    return 0


def serve_mcp(config: McpServerConfig) -> int:
    """Has a language model play, on these terms, between the standard streams; the exit code."""
    from dmplay.mcp.games import ModelGames

    with redirect_stdout(sys.stderr):  # what a problem prints is no answer
        games = ModelGames(config)
    import_library("mcp.server.mcpserver", "mcp", "mcp")
    from dmplay.mcp.server import serve

    return serve(games)


def make_seat_factory(agent: str, problem_name: str) -> SeatFactory:
    """An agent of this name, in the seat and under the parameters that hello says."""

    def create_seat(hello: JsonObject) -> tuple[Problem, int, Policy]:
        problem = problems.load_problem(problem_name, **hello["parameters"])
        place, turns = problem.seat_index(hello["seat"]), hello["turns"]
        who = agent if turns is None else agents.plan_for_turn_limit(problem, place, agent, turns)
        return problem, place, agents.load_agent(problem, place, who)

    return create_seat

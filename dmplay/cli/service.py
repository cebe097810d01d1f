"""Games with another program at the standard streams: it keeps one, or a model plays in ours."""

import sys
from contextlib import redirect_stdout

from dmplay.bots.protocol import Facts
from dmplay.bots.speaker import Seat, Speaker, speak
from dmplay.core import Policy, Problem
from dmplay.finding import agents, problems
from dmplay.game.errand import Hosting
from dmplay.guests.extras import library


def speaks(agent: str, name: str) -> int:
    """Plays a problem of this name between the standard streams; the exit code."""
    problems.resolve(name, {})  # refuses what there is not
    speak(Speaker(agent, sits(agent, name)), sys.stdin, sys.stdout)
    return 0


def host(terms: Hosting) -> int:
    """Has a language model play, on these terms, between the standard streams; the exit code."""
    from dmplay.mcp.games import Games

    with redirect_stdout(sys.stderr):  # what a problem prints is no answer
        games = Games(terms)
    library("mcp.server.mcpserver", "mcp", "mcp")
    from dmplay.mcp.server import serve

    return serve(games)


def sits(agent: str, name: str) -> Seat:
    """An agent of this name, in the seat and under the parameters that hello says."""

    def seat(hello: Facts) -> tuple[Problem, int, Policy]:
        problem = problems.load(name, **hello["parameters"])
        place, turns = problem.seat(hello["seat"]), hello["turns"]
        who = agent if turns is None else agents.for_turns(problem, place, agent, turns)
        return problem, place, agents.agent(problem, place, who)

    return seat

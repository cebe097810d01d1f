"""An agent of dmplay that plays a game which another program keeps."""

import sys

from dmplay.bots.protocol import Facts
from dmplay.bots.speaker import Seat, Speaker, speak
from dmplay.core import Policy, Problem
from dmplay.finding import agents, problems


def serve(agent: str, name: str) -> int:
    """Plays a problem of this name between the standard streams; the exit code."""
    problems.resolve(name, {})  # refuses what there is not
    speak(Speaker(agent, sits(agent, name)), sys.stdin, sys.stdout)
    return 0


def sits(agent: str, name: str) -> Seat:
    """An agent of this name, in the seat and under the parameters that hello says."""

    def seat(hello: Facts) -> tuple[Problem, int, Policy]:
        problem = problems.load(name, **hello["parameters"])
        place, turns = problem.seat(hello["seat"]), hello["turns"]
        who = agent if turns is None else agents.for_turns(problem, place, agent, turns)
        return problem, place, agents.agent(problem, place, who)

    return seat

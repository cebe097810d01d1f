"""The built-in agents of a problem in the seats that they fit."""

from functools import cache

import dmplay
from dmplay.core import Memory, Percept, Policy, Problem
from dmplay.errors import BadParameter, BadPolicy, UnknownName
from dmplay.finding import agents
from dmplay.finding.agents import plan_for_turn_limit
from dmplay.policies.script import Script
from tests.support.cases import random_play, small

BRIEF = {"search": "search:simulations=3,depth=2"}  # agents that take their time, for the laws
SMALL = "joint-plan:nodes=2"  # where a team would make a large plan
AHEAD = 4  # turns for which those plan who plan a whole game
FOREIGN = {"axelrod"}  # a package that takes long to load: it has tests of its own


def brief(problem: Problem, seat: int, agent: str) -> str:
    """The name of an agent that does not take its time."""
    planned = agents.load_roster(problem, seat).simulation_agent == "joint-plan"
    if agent in BRIEF:
        return BRIEF[agent] + f",others={SMALL},rollout={SMALL}" * planned
    return (
        SMALL
        if planned and agent == "joint-plan"
        else plan_for_turn_limit(problem, seat, agent, AHEAD)
    )


def made(problem: Problem, seat: int, agent: str) -> Policy | None:
    """The agent of this name, or None where it refuses the seat."""
    try:
        return dmplay.load_agent(problem, seat, brief(problem, seat, agent))
    except (BadPolicy, BadParameter, UnknownName):
        return None


@cache
def seated(name: str) -> list[tuple[int, list[Policy]]]:
    """Each built-in agent in each seat that it fits, random play in the others."""
    problem = small(name)
    found: list[tuple[int, list[Policy]]] = []
    for agent in agents.load_roster(problem).agents:
        if agent in FOREIGN:
            continue
        before = len(found)
        for seat in range(len(problem.agents)):
            policy = made(problem, seat, agent)
            if policy is not None:
                others = random_play(problem)
                others[seat] = policy
                found.append((seat, others))
        assert len(found) > before, f"{agent} fits no seat"
    return found


class Rescaling(Script):
    """Means no harm."""

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        observation = percept.observation
        observation /= 2.4
        return super().update_memory(memory, percept)

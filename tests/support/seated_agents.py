"""The built-in agents of a problem in the seats that they fit."""

from functools import cache

import dmplay
from dmplay.agents.script import Script
from dmplay.core.policy import Memory, Percept, Policy
from dmplay.core.problem import Problem
from dmplay.errors import BadParameter, BadPolicy, UnknownName
from dmplay.registry import agents
from dmplay.registry.agents import set_horizon_in_name
from tests.support.problem_cases import load_small_problem, make_random_policies

# faster settings of slow agents, for the tests of invariants
FAST_AGENTS = {"search": "search:simulations=3,depth=2", "plan": "plan:horizon=3"}
SMALL_JOINT_PLAN = "joint-plan:nodes=2"  # a smaller plan than the default
PLANNING_TURNS = 4  # turns of the game for agents that plan a whole game
EXTERNAL_AGENTS = {"axelrod"}  # packages that take long to load and have separate tests


def format_fast_agent(problem: Problem, seat: int, agent: str) -> str:
    """Return the name of an agent with settings that make it fast."""
    is_planned = agents.load_roster(problem, seat).simulation_agent == "joint-plan"
    if agent in FAST_AGENTS:
        return FAST_AGENTS[agent] + f",others={SMALL_JOINT_PLAN},rollout={SMALL_JOINT_PLAN}" * (
            is_planned and agent == "search"
        )
    if is_planned and agent == "joint-plan":
        return SMALL_JOINT_PLAN
    return set_horizon_in_name(problem, seat, agent, PLANNING_TURNS)


def make_agent(problem: Problem, seat: int, agent: str) -> Policy | None:
    """Make the agent of this name, or return None if it does not fit the seat."""
    try:
        return dmplay.load_agent(problem, seat, format_fast_agent(problem, seat, agent))
    except (BadPolicy, BadParameter, UnknownName):
        return None


@cache
def seat_agents(name: str) -> list[tuple[int, list[Policy]]]:
    """Return each built-in agent in each seat that it fits, with random agents in the others."""
    problem = load_small_problem(name)
    seatings: list[tuple[int, list[Policy]]] = []
    for agent in agents.load_roster(problem).agents:
        if agent in EXTERNAL_AGENTS:
            continue
        previous_count = len(seatings)
        for seat in range(len(problem.agents)):
            policy = make_agent(problem, seat, agent)
            if policy is not None:
                policies = make_random_policies(problem)
                policies[seat] = policy
                seatings.append((seat, policies))
        assert len(seatings) > previous_count, f"{agent} fits no seat"
    return seatings


class ObservationMutatingScript(Script):
    """A script that divides its observation in place, which it must not do."""

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        observation = percept.observation
        observation /= 2.4
        return super().update_memory(memory, percept)

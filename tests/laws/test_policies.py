"""Agents choose what is legal, alone as in a batch, and say what they do."""

from typing import NamedTuple

import numpy as np
import pytest

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Interval, Memory, Outcome, Percept, Policy, Problem
from dmplay.finding import agents
from tests.support.cases import SOME, draws, every_problem, frozen, load, same, small
from tests.support.pools import parts
from tests.support.seats import seated

pytestmark = pytest.mark.usefixtures("coarse")


@every_problem
def test_an_agent_says_what_it_does_and_what_its_parameters_mean(name: str) -> None:
    for agent, make in agents.roster(load(name)).agents.items():
        assert (make.__doc__ or "").strip(), agent
        assert all(agents.meanings(make).values()), agent


class Asked(NamedTuple):
    """One choice of a policy over a batch, and what it rested on."""

    memory: Memory
    legal: Bools | None
    u: Reals
    chosen: Array
    values: Reals | None


def asked(policy: Policy, memory: Memory, legal: Bools | None, u: Reals) -> Asked:
    return Asked(memory, legal, u, policy.choose(memory, legal, u), policy.values(memory))


def course(problem: Problem, seat: int, policies: list[Policy], rows: int) -> list[Asked]:
    """What a seat's policy is asked in the first turns of a batch of games."""
    s = problem.start(draws(problem.draws.start, 0, rows))
    memories = [policy.begin(problem.first_sight(s)) for policy in policies]
    found = []
    for turn in range(1, SOME):
        going = ~problem.terminal(s)
        s = frozen(s[going])[0]
        memories = [frozen(*(part[going] for part in memory)) for memory in memories]
        if not len(s):
            break
        legal = problem.legal(s)
        asks = []
        for i, (policy, memory) in enumerate(zip(policies, memories, strict=True)):
            u = frozen(draws(policy.draws, turn, len(s), 1 + i))[0]
            asks.append(asked(policy, memory, None if legal is None else legal[:, i], u))
        found.append(asks[seat])
        a = np.stack([ask.chosen for ask in asks], axis=1)
        outcome = problem.step(s, a, draws(problem.draws.step, turn, len(s)))
        learnt = percepts(problem, a, outcome)
        memories = [
            policy.update(memory, percept)
            for policy, memory, percept in zip(policies, memories, learnt, strict=True)
        ]
        one = slice(0, 1)
        alone = policies[seat].update(parts(asks[seat].memory, one), row_of(learnt[seat], one))
        assert same(alone, parts(memories[seat], one))
        s = outcome.state
    return found


def row_of(percept: Percept, rows: slice) -> Percept:
    action, observation, actions, reward = percept
    return Percept(
        action[rows],
        observation[rows],
        None if actions is None else actions[rows],
        None if reward is None else reward[rows],
    )


def percepts(problem: Problem, a: Array, outcome: Outcome) -> list[Percept]:
    return [problem.percept(seat, a, outcome) for seat in range(len(problem.agents))]


@every_problem
def test_policies_choose_legal_actions_the_same_alone_as_in_a_batch(name: str) -> None:
    problem = small(name)
    for seat, policies in seated(name):
        policy, known = policies[seat], problem.actions[seat]
        for ask in course(problem, seat, policies, 23):
            rows = len(ask.u)
            assert isinstance(ask.memory, tuple)
            assert all(len(part) == rows for part in ask.memory)
            assert ask.chosen.shape == (rows,)
            if isinstance(known, Interval):
                assert ((ask.chosen >= known.low) & (ask.chosen <= known.high)).all()
            else:
                assert ask.chosen.dtype.kind in "iu"
                assert ((ask.chosen >= 0) & (ask.chosen < len(known))).all()
                assert ask.values is None or ask.values.shape == (rows, len(known))
            if ask.legal is not None:
                assert ask.legal[np.arange(rows), ask.chosen].all()
            for some in (slice(0, 1), slice(rows - 1, rows), slice(rows // 3, rows // 2 + 1)):
                alone = asked(
                    policy,
                    parts(ask.memory, some),
                    None if ask.legal is None else ask.legal[some],
                    ask.u[some],
                )
                assert same(alone.chosen, ask.chosen[some])
                assert same(alone.values, None if ask.values is None else ask.values[some])

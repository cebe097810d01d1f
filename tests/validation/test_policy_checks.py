"""Agents choose legal actions, the same alone as in a batch, and describe themselves."""

import pickle
from dataclasses import dataclass

import numpy as np
import pytest

import dmplay
from dmplay.agents.random_agent import Random
from dmplay.core.arrays import Array
from dmplay.core.policy import Memory
from dmplay.evaluation.many_games import rollout
from dmplay.registry import agents
from dmplay.validation.policy_checks import find_agent_violation
from tests.support.problem_cases import every_problem, load_problem, load_small_problem
from tests.support.seated_agents import seat_agents
from tests.support.turn_based_games import Peek

ROW_COUNT = 11  # more than the eight rows of a vector
pytestmark = pytest.mark.usefixtures("coarse")


@every_problem
def test_an_agent_documents_itself_and_its_parameters(name: str) -> None:
    for agent, make in agents.load_roster(load_problem(name)).agents.items():
        assert (make.__doc__ or "").strip(), agent
        assert all(agents.parameter_meanings(make).values()), agent


@every_problem
def test_policies_choose_legal_actions_the_same_alone_as_in_a_batch(name: str) -> None:
    problem = load_small_problem(name)
    for seat, policies in seat_agents(name):
        assert not find_agent_violation(problem, seat, policies, ROW_COUNT)


@dataclass(frozen=True)
class NullObservationPolicy(Random):
    """A policy that expects the null observation at the start."""

    def initial_memory(self, observation: Array) -> Memory:
        assert (observation == -1).all()
        return super().initial_memory(observation)


def test_check_takes_problems_and_agents_in_all_forms() -> None:
    def cooperate(view: dmplay.View[dmplay.Problem]) -> str:
        return "cooperate"

    class PassedTurns:
        turns = 0

        def act(self, view: dmplay.View[dmplay.Problem]) -> int:
            PassedTurns.turns += 1
            return PassedTurns.turns % 2

    problem = load_problem("prisoners-dilemma")
    for form in "prisoners-dilemma", problem, type(problem), lambda: problem:
        assert dmplay.check(form) == []
        for agent in cooperate, agents.load_agent(problem, 1, "grim"):
            assert dmplay.check(form, agent, seat="agent2") == []
    (fault,) = dmplay.check(problem, PassedTurns)
    assert "expected the same choice" in fault.what


def test_an_agent_gets_its_own_initial_observation() -> None:
    peek = Peek()
    policies = [Random(peek, 0), NullObservationPolicy(peek, 1)]
    assert not find_agent_violation(peek, 1, policies, ROW_COUNT)


@every_problem
def test_agents_can_be_pickled_after_they_have_chosen(name: str) -> None:
    for seat, policies in seat_agents(name):
        before = rollout(load_small_problem(name), policies, episodes=2, turn_limit=1)
        unpickled = pickle.loads(pickle.dumps(policies))
        repeated = rollout(load_small_problem(name), unpickled, episodes=2, turn_limit=1)
        assert np.array_equal(repeated.returns, before.returns), type(policies[seat])

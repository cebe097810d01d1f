"""Agents choose what is legal, alone as in a batch, and say what they do."""

import pickle
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest

from dmplay.chance import Array
from dmplay.core import Memory
from dmplay.finding import agents
from dmplay.laws.choices import check_policy_choices
from dmplay.policies.general import Random
from dmplay.rollouts import rollout
from tests.support.cases import every_problem, load, small
from tests.support.pools import broken
from tests.support.seats import seated
from tests.support.turns import Peek

ROWS = 11  # beyond the eight of a vector
pytestmark = pytest.mark.usefixtures("coarse")


@every_problem
def test_an_agent_says_what_it_does_and_what_its_parameters_mean(name: str) -> None:
    for agent, make in agents.load_roster(load(name)).agents.items():
        assert (make.__doc__ or "").strip(), agent
        assert all(agents.parameter_meanings(make).values()), agent


@every_problem
def test_policies_choose_legal_actions_the_same_alone_as_in_a_batch(name: str) -> None:
    problem = small(name)
    for seat, policies in seated(name):
        law = partial(check_policy_choices, problem, seat, policies, ROWS)
        assert not broken(problem, law), type(policies[seat])


@dataclass(frozen=True)
class Groping(Random):
    """One who is shown nothing at first."""

    def initial_memory(self, observation: Array) -> Memory:
        assert (observation == -1).all()
        return super().initial_memory(observation)


def test_an_agent_is_shown_its_own_first_sight() -> None:
    peek = Peek()
    agents = [Random(peek, 0), Groping(peek, 1)]
    assert not broken(peek, partial(check_policy_choices, peek, 1, agents, ROWS))


@every_problem
def test_agents_that_have_chosen_can_be_sent_to_a_worker(name: str) -> None:
    for seat, policies in seated(name):
        before = rollout(small(name), policies, episodes=2, turn_limit=1)
        sent = pickle.loads(pickle.dumps(policies))
        again = rollout(small(name), sent, episodes=2, turn_limit=1)
        assert np.array_equal(again.returns, before.returns), type(policies[seat])

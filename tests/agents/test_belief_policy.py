"""Tests of belief updates by sparse transitions and beside a partner."""

from dataclasses import dataclass

import numpy as np
import pytest

import dmplay
from dmplay.agents.belief_policy import SparseTransition
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.chance import weighted_sum
from dmplay.core.policy import Memory
from dmplay.errors import BadPolicy
from dmplay.problems.multicaregiver_crying_baby.same_observation_planning import PartnerBeliefFilter

# by turn, `[2, S, S']`
EXPECTED_TRANSITIONS = np.array([[[0.5, 0.0], [0.0, 0.0]], [[0.2, 0.3], [0.0, 0.7]]])
UNEXPECTED_TRANSITIONS = np.array([[[0.5, 0.1], [0.0, 0.3]], [[0.2, 0.3], [0.1, 0.7]]])


def sample_beliefs(rows: int) -> Reals:
    weights = np.random.default_rng(3).random((rows, 2))
    weights[0] = 0.0, 1.0
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def test_a_sparse_transition_has_only_nonzeros_and_equals_the_dense_product() -> None:
    for dense in EXPECTED_TRANSITIONS:
        transition = SparseTransition.from_dense(dense)
        assert len(transition.source) == np.count_nonzero(dense)
        for rows in (1, 2, 3, 40):  # few rows and many rows
            assert (
                transition.propagate(sample_beliefs(rows))
                == weighted_sum(sample_beliefs(rows), dense)
            ).all()


def test_a_batched_belief_update_equals_single_updates() -> None:
    belief_filter = PartnerBeliefFilter.from_arrays(EXPECTED_TRANSITIONS, UNEXPECTED_TRANSITIONS)
    b = sample_beliefs(40)
    for turns in (np.arange(40) % 2, np.zeros(40, np.int64)):
        batched = belief_filter.update_beliefs(b, [turns])
        single = [
            belief_filter.update_beliefs(b[row : row + 1], [turns[row : row + 1]])
            for row in range(40)
        ]
        assert (batched == np.concatenate(single)).all()


def test_a_turn_that_the_expected_partner_rules_out_uses_the_other_transitions() -> None:
    after = PartnerBeliefFilter.from_arrays(
        EXPECTED_TRANSITIONS, UNEXPECTED_TRANSITIONS
    ).update_beliefs(sample_beliefs(2), [np.zeros(2, np.int64)])
    assert after.tolist() == [[0.0, 1.0], [1.0, 0.0]]


@dataclass(frozen=True)
class Likeliest(dmplay.BeliefPolicy):
    """Takes the action with the number of the likeliest state."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        return np.asarray(memory[0].argmax(axis=1))


def choose_by_view(view: dmplay.View[dmplay.Problem]) -> int:
    assert view.belief is not None
    return int(view.belief.argmax())


@pytest.mark.parametrize(
    "problem", ["crying-baby", "machine-replacement", "multicaregiver-crying-baby"]
)
def test_a_belief_policy_acts_on_the_belief_that_its_view_shows(problem: str) -> None:
    first = dmplay.load_problem(problem).agents[1:] and ["random"]
    played = [
        dmplay.rollout(problem, [agent, *first], episodes=30, seed=7, turns=9)
        for agent in (Likeliest, choose_by_view)
    ]
    assert (played[0].returns == played[1].returns).all()


def test_a_belief_policy_refuses_a_problem_whose_agents_see_the_state() -> None:
    with pytest.raises(BadPolicy, match="Likeliest: the agents of HexWorld see the state"):
        dmplay.rollout("hexworld", Likeliest, episodes=1)

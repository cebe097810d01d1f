"""Invariants that hold in every turn that random play reaches, in every problem."""

from dmplay.laws import play
from tests.support.cases import every_problem
from tests.support.pools import assert_invariant_holds

INVARIANT_CHECKS = {
    "a step is the move of the sampled events": play.check_sampling,
    "outcomes have the shapes and ranges that the problem states": play.check_shapes,
    "probabilities sum to one": play.check_probabilities,
    "the tables are what the outcomes amount to": play.check_tabulation,
    "a belief is carried as the listed outcomes say": play.check_belief_update,
    "the least and the greatest draw give outcomes that can happen": play.check_extreme_uniforms,
}


@every_problem
def test_every_turn_satisfies_every_invariant(name: str) -> None:
    for description, invariant in INVARIANT_CHECKS.items():
        assert_invariant_holds(name, invariant, description)

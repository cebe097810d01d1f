"""Invariants that hold in every turn that random play reaches, in every problem."""

from dmplay.validation import invariants
from tests.support.problem_cases import every_problem
from tests.support.sampled_turns import assert_invariant_holds

INVARIANT_CHECKS = {
    "a step is the move of the sampled events": invariants.check_sampling,
    "outcomes have the shapes and ranges that the problem states": invariants.check_shapes,
    "probabilities sum to one": invariants.check_probabilities,
    "the tables are what the outcomes amount to": invariants.check_tabulation,
    "a belief is carried as the listed outcomes say": invariants.check_belief_update,
    "the least and the greatest draw give outcomes that can happen": (
        invariants.check_extreme_uniforms
    ),
}


@every_problem
def test_every_turn_satisfies_every_invariant(name: str) -> None:
    for description, invariant in INVARIANT_CHECKS.items():
        assert_invariant_holds(name, invariant, description)

"""Turns that random play reaches, of each kind in which an invariant must hold."""

from collections.abc import Callable
from functools import cache

from dmplay.core.problem import Problem
from dmplay.core.violation import CheckResults, Violation
from dmplay.simulation.random_play import WALK_LENGTH, SampledTurns, sample_random_turns
from dmplay.validation import invariants
from tests.support.problem_cases import ROW_COUNT, load_problem, make_readonly, sample_actions


@cache
def make_turn_pool(name: str) -> SampledTurns:
    """Return turns in which row r is the r-th game after r % WALK_LENGTH turns, with any actions.

    The actions may be illegal.
    """
    problem = load_problem(name)
    return sample_random_turns(problem, ROW_COUNT)._replace(
        a=make_readonly(sample_actions(problem, None, WALK_LENGTH))[0]
    )


def list_violations(problem: Problem, invariant: Callable[[], CheckResults]) -> list[Violation]:
    """List the violations of an invariant."""
    return [*invariants.find_violations(type(problem), invariant)]


def assert_invariant_holds(
    name: str, invariant: Callable[[Problem, SampledTurns], CheckResults], message: str = ""
) -> None:
    """Assert that a built-in problem satisfies an invariant in the turns of its pool."""
    problem = load_problem(name)
    assert not list_violations(problem, lambda: invariant(problem, make_turn_pool(name))), message

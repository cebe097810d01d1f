"""Turns that random play comes to, of every kind that a law is to hold in."""

from collections.abc import Callable
from functools import cache

from dmplay.core import Problem
from dmplay.laws import play
from dmplay.laws.breach import CheckResults, Violation
from dmplay.laws.samples import WALK_LENGTH, SampledTurns, sample_turns
from tests.support.cases import ROWS, anything, frozen, load


@cache
def pool(name: str) -> SampledTurns:
    """Row r is what the r-th game is at after r % WALK turns; any action, legal or not."""
    problem = load(name)
    return sample_turns(problem, ROWS)._replace(a=frozen(anything(problem, None, WALK_LENGTH))[0])


def broken(problem: Problem, law: Callable[[], CheckResults]) -> list[Violation]:
    """What does not hold of a law."""
    return [*play.find_violations(type(problem), law)]


def keeps(name: str, law: Callable[[Problem, SampledTurns], CheckResults], said: str = "") -> None:
    """A built-in problem keeps a law in the turns of its pool."""
    problem = load(name)
    assert not broken(problem, lambda: law(problem, pool(name))), said

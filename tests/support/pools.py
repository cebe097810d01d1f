"""Turns that random play comes to, of every kind that a law is to hold in."""

from collections.abc import Callable
from functools import cache

from dmplay.core import Problem
from dmplay.laws import play
from dmplay.laws.breach import Breach, Facts
from dmplay.laws.samples import WALK, Turns, turns
from tests.support.cases import ROWS, anything, frozen, load


@cache
def pool(name: str) -> Turns:
    """Row r is what the r-th game is at after r % WALK turns; any action, legal or not."""
    problem = load(name)
    return turns(problem, ROWS)._replace(a=frozen(anything(problem, None, WALK))[0])


def broken(problem: Problem, law: Callable[[], Facts]) -> list[Breach]:
    """What does not hold of a law."""
    return [*play.held(type(problem), law)]


def keeps(name: str, law: Callable[[Problem, Turns], Facts], said: str = "") -> None:
    """A built-in problem keeps a law in the turns of its pool."""
    problem = load(name)
    assert not broken(problem, lambda: law(problem, pool(name))), said

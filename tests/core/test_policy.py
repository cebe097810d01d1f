"""Tests of the interface of policies: what an object needs to be one, and what it may read."""

from typing import Any

import pytest

import dmplay
from dmplay.core.policy import requires_fields
from dmplay.errors import BadPolicy, UnknownName


def test_a_field_that_percepts_do_not_have_is_refused() -> None:
    with pytest.raises(UnknownName, match="did you mean reward"):
        requires_fields("action", "rewards")


class Half:
    """Part of a policy."""

    uniform_count = 0

    def __init__(self, problem: object, seat: int) -> None:
        pass

    def initial_memory(self, observation: object) -> tuple[object]:
        return (observation,)


class Abstract(dmplay.ReactivePolicy):
    """A policy that inherits `choose` from the interface alone."""


@pytest.mark.parametrize(
    ("kind", "missing"), [(Half, "update_memory, choose"), (Abstract, "choose")]
)
def test_an_error_names_what_an_object_lacks_to_be_a_policy(kind: Any, missing: str) -> None:
    problem = dmplay.load_problem("hexworld")
    for agent in kind, kind(problem, 0):
        with pytest.raises(BadPolicy, match=f": not a policy, because it lacks {missing}$"):
            dmplay.run(problem, agent)


def test_a_session_names_what_its_policy_lacks() -> None:
    policy: Any = Abstract
    problem = dmplay.load_problem("hexworld")
    with pytest.raises(BadPolicy, match=r"^seat 0, Abstract: .* lacks choose$"):
        dmplay.Session(problem, dmplay.SeededUniforms(7), [policy(problem, 0)])

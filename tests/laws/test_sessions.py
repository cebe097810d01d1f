"""One game: what it refuses, what it takes back, and that it is a row of many."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from dmplay.core import Interval
from dmplay.dice import SeededUniforms
from dmplay.errors import IllegalAction
from dmplay.rollouts import rollout
from dmplay.session import Session
from tests.support.cases import (
    SEED,
    SOME,
    every_problem,
    load,
    random_play,
    same,
    small,
)
from tests.support.seats import seated

pytestmark = pytest.mark.usefixtures("coarse")


def outside(actions: Interval | Sequence[str]) -> tuple[float, ...]:
    if isinstance(actions, Interval):
        return (actions.low - 1e-6, actions.high + 1e-6, math.nan, math.inf)
    return (-1, len(actions), 0.5, math.nan)


@every_problem
def test_an_illegal_action_is_refused_and_changes_nothing(name: str) -> None:
    problem = load(name)
    agents = random_play(problem)
    session, other = (
        Session(problem, SeededUniforms(SEED), agents, turn_limit=99) for _ in range(2)
    )
    for _ in range(SOME):
        if session.over:
            break
        before = [session.view(seat) for seat in range(len(agents))]
        for seat in range(len(agents)):
            legal = session.legal_actions_mask(seat)
            closed = () if legal is None else tuple(map(float, np.flatnonzero(~legal)))
            for bad in (*outside(problem.actions[seat]), *closed):
                joint: list[float | None] = [None] * len(agents)
                joint[seat] = bad
                with pytest.raises(IllegalAction, match=f"turn {len(session.turns) + 1}"):
                    session.advance(joint)
        assert same([session.view(seat) for seat in range(len(agents))], before)
        assert same(session.advance(), other.advance())


@every_problem
def test_undo_then_the_same_actions_give_the_same_turns(name: str) -> None:
    problem = small(name)
    for _, policies in seated(name):
        session = Session(problem, SeededUniforms(SEED, 3), policies, turn_limit=SOME)
        views = []
        while not session.over:
            views.append([session.view(seat) for seat in range(len(policies))])
            session.advance()
        played, returns = list(session.turns), session.returns()
        assert played
        for back in {1, len(played)}:
            taken = session.undo(back)
            assert same(taken, played[-back:])
            now = [session.view(seat) for seat in range(len(policies))]
            assert same(now, views[len(played) - back])
            assert same(session.choose_policy_actions(), list(map(float, taken[0].actions)))
            for turn in taken:
                assert same(session.advance(list(turn.actions)), turn)
        assert same(session.returns(), returns)


@every_problem
def test_a_session_is_a_row_of_the_rollout(name: str) -> None:
    problem = small(name)
    for _, policies in seated(name):
        many = rollout(problem, policies, episodes=3, turn_limit=SOME, seed=SEED, first_episode=2)
        session = Session(problem, SeededUniforms(SEED, 4), policies, turn_limit=SOME)
        while not session.over:
            session.advance()
        assert same(session.state, np.asarray(many.final_states[2]))
        assert same(session.returns(), many.returns[2])
        assert same(session.total_rewards(), many.total_rewards[2])
        assert len(session.turns) == many.turn_counts[2]
        assert (session.end_reason == "terminal") == many.terminated[2]

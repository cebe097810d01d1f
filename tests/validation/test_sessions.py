"""Tests of sessions: illegal actions, undo, and equality with a row of a rollout."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from dmplay.core.session import Session
from dmplay.core.spaces import Interval
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import IllegalAction
from dmplay.evaluation.many_games import rollout
from tests.support.problem_cases import (
    SEED,
    SHORT_GAME_TURNS,
    every_problem,
    is_identical,
    load_problem,
    load_small_problem,
    make_random_policies,
)
from tests.support.seated_agents import seat_agents

pytestmark = pytest.mark.usefixtures("coarse")


def list_illegal_actions(actions: Interval | Sequence[str]) -> tuple[float, ...]:
    if isinstance(actions, Interval):
        return (actions.low - 1e-6, actions.high + 1e-6, math.nan, math.inf)
    return (-1, len(actions), 0.5, math.nan)


@every_problem
def test_an_illegal_action_is_refused_and_changes_nothing(name: str) -> None:
    problem = load_problem(name)
    agents = make_random_policies(problem)
    session, other = (
        Session(problem, SeededUniforms(SEED), agents, turn_limit=99) for _ in range(2)
    )
    for _ in range(SHORT_GAME_TURNS):
        if session.over:
            break
        before = [session.view(seat) for seat in range(len(agents))]
        for seat in range(len(agents)):
            legal = session.legal_actions_mask(seat)
            closed = () if legal is None else tuple(map(float, np.flatnonzero(~legal)))
            for illegal in (*list_illegal_actions(problem.actions[seat]), *closed):
                joint: list[float | None] = [None] * len(agents)
                joint[seat] = illegal
                with pytest.raises(IllegalAction, match=f"turn {len(session.turns) + 1}"):
                    session.advance(joint)
        assert is_identical([session.view(seat) for seat in range(len(agents))], before)
        assert is_identical(session.advance(), other.advance())


@every_problem
def test_undo_then_the_same_actions_give_the_same_turns(name: str) -> None:
    problem = load_small_problem(name)
    for _, policies in seat_agents(name):
        session = Session(problem, SeededUniforms(SEED, 3), policies, turn_limit=SHORT_GAME_TURNS)
        views = []
        while not session.over:
            views.append([session.view(seat) for seat in range(len(policies))])
            session.advance()
        turns, returns = list(session.turns), session.returns()
        assert turns
        for count in {1, len(turns)}:
            undone = session.undo(count)
            assert is_identical(undone, turns[-count:])
            views_after_undo = [session.view(seat) for seat in range(len(policies))]
            assert is_identical(views_after_undo, views[len(turns) - count])
            assert is_identical(
                session.choose_policy_actions(), list(map(float, undone[0].actions))
            )
            for turn in undone:
                assert is_identical(session.advance(list(turn.actions)), turn)
        assert is_identical(session.returns(), returns)


@every_problem
def test_a_session_is_a_row_of_the_rollout(name: str) -> None:
    problem = load_small_problem(name)
    for _, policies in seat_agents(name):
        result = rollout(
            problem, policies, episodes=3, turn_limit=SHORT_GAME_TURNS, seed=SEED, first_episode=2
        )
        session = Session(problem, SeededUniforms(SEED, 4), policies, turn_limit=SHORT_GAME_TURNS)
        while not session.over:
            session.advance()
        assert is_identical(session.state, np.asarray(result.final_states[2]))
        assert is_identical(session.returns(), result.returns[2])
        assert is_identical(session.total_rewards(), result.total_rewards[2])
        assert len(session.turns) == result.turn_counts[2]
        assert (session.end_reason == "terminal") == result.terminated[2]

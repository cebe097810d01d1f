"""What `help` begins with: what one is, wants and pays, and one turn as it may go."""

import numpy as np

from dmplay.core import ContinuousStates, Interval, Problem
from dmplay.dice import SeededUniforms
from dmplay.game.game import Game
from dmplay.session import Session
from dmplay.views.style import Lesson, load_view_module

UNTYPABLE_SEED = 2**63 + 1228  # a seed that nobody can type: what it draws tells of no game


def lesson_lines(game: Game) -> list[str]:
    """Three sentences and one worked turn, of the seat that is asked."""
    problem, view = game.problem, game.view()
    told = game.view_module.lesson(view)
    later = f"; what comes a turn later counts {problem.discount:g} as much (gamma)"
    cost = told.costs + later * (problem.discount < 1.0)
    return [
        f"{told.role}.",
        f"{told.objective}.",
        f"{cost}.",
        describe_example_turn(problem, view.seat, told),
    ]


def describe_example_turn(problem: Problem, seat: int, lesson: Lesson) -> str:
    """A first turn in a game of its own, with all that is hidden in it."""
    session = Session(problem, SeededUniforms(UNTYPABLE_SEED), turn_limit=1)
    wanted = (
        {seat: problem.parse_action(seat, lesson.example_action)} if lesson.example_action else {}
    )
    actions = [
        _choose_legal_action(session, each, wanted.get(each)) for each in range(len(problem.agents))
    ]
    before = session.state
    reward = float(session.advance(actions).rewards[seat])
    short = problem.state_count != 1 and not isinstance(problem.state_count, ContinuousStates)
    unseen = ", unseen" * problem.partially_observable
    start = f" from {problem.format_state(before)}{unseen}:" if short else ""
    what = load_view_module(problem).describe_turn(session.view(seat))
    return f"For example, one turn{start or ':'} {what} It pays you {reward:.4g}."


def _choose_legal_action(session: Session, seat: int, preferred: float | None) -> float:
    """The action that is wanted, if it is legal; else one from the middle of those that are."""
    actions, legal = session.problem.actions[seat], session.legal_actions_mask(seat)
    if isinstance(actions, Interval):
        return (actions.low + actions.high) / 2 if preferred is None else preferred
    able = np.arange(len(actions)) if legal is None else np.flatnonzero(legal)
    return preferred if preferred in able and preferred is not None else float(able[len(able) // 2])

"""What `help` begins with: what one is, wants and pays, and one turn as it may go."""

import numpy as np

from dmplay.core import Continuous, Interval, Problem
from dmplay.dice import Dice
from dmplay.game.game import Game
from dmplay.session import Session
from dmplay.views.style import Lesson, style_of

UNTYPED = 2**63 + 1228  # a seed that nobody can type: what it draws tells of no game


def lesson(game: Game) -> list[str]:
    """Three sentences and one worked turn, of the seat that is asked."""
    problem, view = game.problem, game.view()
    told = game.style.lesson(view)
    later = f"; what comes a turn later counts {problem.discount:g} as much (gamma)"
    cost = told.cost + later * (problem.discount < 1.0)
    return [f"{told.you}.", f"{told.want}.", f"{cost}.", worked(problem, view.seat, told)]


def worked(problem: Problem, seat: int, told: Lesson) -> str:
    """A first turn in a game of its own, with all that is hidden in it."""
    session = Session(problem, Dice(UNTYPED), limit=1)
    wanted = {seat: problem.action(seat, told.action)} if told.action else {}
    actions = [_able(session, each, wanted.get(each)) for each in range(len(problem.agents))]
    before = session.state
    reward = float(session.advance(actions).rewards[seat])
    short = problem.states != 1 and not isinstance(problem.states, Continuous)
    unseen = ", unseen" * problem.hidden
    start = f" from {problem.notation(before)}{unseen}:" if short else ""
    what = style_of(problem).told(session.view(seat))
    return f"For example, one turn{start or ':'} {what} It pays you {reward:.4g}."


def _able(session: Session, seat: int, wanted: float | None) -> float:
    """The action that is wanted, if it is legal; else one from the middle of those that are."""
    actions, legal = session.problem.actions[seat], session.legal(seat)
    if isinstance(actions, Interval):
        return (actions.low + actions.high) / 2 if wanted is None else wanted
    able = np.arange(len(actions)) if legal is None else np.flatnonzero(legal)
    return wanted if wanted in able and wanted is not None else float(able[len(able) // 2])

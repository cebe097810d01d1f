"""A problem in somebody else's loop: its seats as spaces, who sits in the others, its drawing."""

from typing import Any

import numpy as np
from gymnasium import spaces

from dmplay.chance import Array, Bools
from dmplay.core import Interval, Labels, Numbers, Policy, Problem, Texts
from dmplay.errors import BadParameter, IllegalAction
from dmplay.finding import agents, problems
from dmplay.session import Session

Space = spaces.Space[Any]
Info = dict[str, Any]
WIDTH, HEIGHT = 80, 24  # of a drawing


class Seat:
    """A seat as a learner has it: what it may do and see, as spaces and the values in them."""

    def __init__(self, problem: Problem, seat: int) -> None:
        self.problem, self.seat = problem, seat
        self._known = problem.actions[seat]
        self._every = np.ones(problem.action_counts[seat], np.int8)
        self.actions, self.observations = self._doable(), self._visible()

    def _doable(self) -> Space:
        known = self._known
        if isinstance(known, Interval):
            return spaces.Box(known.low, known.high, (1,), np.float64)
        return spaces.Discrete(len(known))

    def _visible(self) -> Space:
        problem = self.problem
        if problem.hidden:
            return self._observed(problem.observations[self.seat])
        if problem.states == 1:
            return _whole([many + 1 for many in problem.action_counts])
        state = problem.start(np.zeros((1, problem.draws.start)))[0]
        if state.dtype.kind == "f":
            return spaces.Box(-np.inf, np.inf, state.shape, np.float64)
        if isinstance(problem.states, int):
            return _whole(problem.enumerated().max(axis=0) + 1)
        least, most = np.iinfo(state.dtype).min // 2, np.iinfo(state.dtype).max // 2
        return spaces.Box(least, most, state.shape, state.dtype.type)

    def _observed(self, known: Labels | Numbers | Texts) -> Space:
        """The space of what is observed of a hidden state: a label more for nothing yet."""
        if isinstance(known, Labels):
            return spaces.Discrete(len(known) + 1)
        if isinstance(known, Numbers):
            return spaces.Box(-np.inf, np.inf, known.shape, np.float64)
        raise BadParameter("what is observed is text, of which there is no space")

    def act(self, told: Array) -> Array:
        """The actions `[B]` that values of the space are, the nearest of numbers out of bounds.

        Raises IllegalAction for what is no action, and says which.
        """
        if isinstance(self._known, Interval):
            numbers = told.reshape(len(told), -1).astype(float)
            if numbers.shape[1] != 1:
                raise IllegalAction(f"step: got {numbers.shape[1]} numbers, expected one")
            return self._known.nearest(numbers[:, 0])
        if told.dtype.kind not in "iu" or told.ndim != 1:
            for one in told.tolist():
                self._known.check(one, "step")
        elif told.min() < 0 or told.max() >= len(self._known):
            self._known.check(told[(told < 0) | (told >= len(self._known))][0], "step")
        return told.astype(np.int64)

    def seen(self, observation: Array, joint: Array | None) -> Array:
        """The values of the space `[B, ...]` for what was observed, after these joint actions."""
        if self.problem.hidden:
            known = self.problem.observations[self.seat]
            if isinstance(known, Labels):
                return np.where(observation < 0, len(known), observation)
            return np.nan_to_num(observation)
        if self.problem.states == 1:
            shape = len(observation), len(self.problem.agents)
            return np.zeros(shape, np.int64) if joint is None else joint.astype(np.int64) + 1
        return observation.copy()

    def info(self, legal: Bools | None) -> Info:
        """What marks legal actions `[A]`, where there are any to choose from."""
        if not len(self._every):
            return {}
        return {"action_mask": self._every.copy() if legal is None else legal.astype(np.int8)}


def _whole(many: Any) -> Space:
    """The space of an index, or of several."""
    return spaces.MultiDiscrete(many) if np.ndim(many) else spaces.Discrete(int(many))


def found(problem: str | Problem, parameters: Info) -> Problem:
    """A problem, or the one of this name with these parameters."""
    if isinstance(problem, str):
        return problems.load(problem, **parameters)
    return problems.configured(problem, parameters)


def seated(problem: Problem, seat: int, others: str) -> list[Policy | None]:
    """The agents of this name in all other seats; '' for those that usually sit there."""
    who = [others or agents.roster(problem, i).partner for i in range(len(problem.agents))]
    every = enumerate(who)
    return [None if i == seat else agents.agent(problem, i, name) for i, name in every]


def drawn(session: Session, seat: int) -> str:
    """The board as a seat sees it, in plain text."""
    from dmplay.views.style import Look, fit, style_of

    look = Look(width=WIDTH, height=HEIGHT)
    return fit(style_of(session.problem), session.view(seat), look).plain

"""A problem in somebody else's loop: its seats as spaces, who sits in the others, its drawing."""

from typing import Any

import numpy as np
from gymnasium import spaces

from dmplay.chance import Array, Bools
from dmplay.core import Interval, Labels, Policy, Problem, RealVector, TextLine
from dmplay.errors import BadParameter, IllegalAction
from dmplay.finding import agents, problems
from dmplay.session import Session

Space = spaces.Space[Any]
Info = dict[str, Any]
RENDER_COLUMNS, RENDER_ROWS = 80, 24  # of a drawing


class SeatSpaces:
    """A seat as a learner has it: what it may do and see, as spaces and the values in them."""

    def __init__(self, problem: Problem, seat: int) -> None:
        self.problem, self.seat = problem, seat
        self._action_set = problem.actions[seat]
        self._full_action_mask = np.ones(problem.action_counts[seat], np.int8)
        self.action_space, self.observation_space = (
            self._make_action_space(),
            self._make_observation_space(),
        )

    def _make_action_space(self) -> Space:
        known = self._action_set
        if isinstance(known, Interval):
            return spaces.Box(known.low, known.high, (1,), np.float64)
        return spaces.Discrete(len(known))

    def _make_observation_space(self) -> Space:
        problem = self.problem
        if problem.partially_observable:
            return self._make_hidden_space(problem.observations[self.seat])
        if problem.state_count == 1:
            return _make_discrete_space([many + 1 for many in problem.action_counts])
        state = problem.sample_initial_states(np.zeros((1, problem.uniform_counts.start)))[0]
        if state.dtype.kind == "f":
            return spaces.Box(-np.inf, np.inf, state.shape, np.float64)
        if isinstance(problem.state_count, int):
            return _make_discrete_space(problem.enumerate_states().max(axis=0) + 1)
        least, most = np.iinfo(state.dtype).min // 2, np.iinfo(state.dtype).max // 2
        return spaces.Box(least, most, state.shape, state.dtype.type)

    def _make_hidden_space(self, observations: Labels | RealVector | TextLine) -> Space:
        """The space of what is observed of a hidden state: a label more for nothing yet."""
        if isinstance(observations, Labels):
            return spaces.Discrete(len(observations) + 1)
        if isinstance(observations, RealVector):
            return spaces.Box(-np.inf, np.inf, observations.shape, np.float64)
        raise BadParameter("what is observed is text, of which there is no space")

    def decode_actions(self, values: Array) -> Array:
        """The actions `[B]` that values of the space are, the nearest of numbers out of bounds.

        Raises IllegalAction for what is no action, and says which.
        """
        if isinstance(self._action_set, Interval):
            numbers = values.reshape(len(values), -1).astype(float)
            if numbers.shape[1] != 1:
                raise IllegalAction(f"step: got {numbers.shape[1]} numbers, expected one")
            return self._action_set.clip_actions(numbers[:, 0])
        if values.dtype.kind not in "iu" or values.ndim != 1:
            for one in values.tolist():
                self._action_set.validate_action(one, "step")
        elif values.min() < 0 or values.max() >= len(self._action_set):
            self._action_set.validate_action(
                values[(values < 0) | (values >= len(self._action_set))][0], "step"
            )
        return values.astype(np.int64)

    def encode_observations(self, observation: Array, joint: Array | None) -> Array:
        """The values of the space `[B, ...]` for what was observed, after these joint actions."""
        if self.problem.partially_observable:
            known = self.problem.observations[self.seat]
            if isinstance(known, Labels):
                return np.where(observation < 0, len(known), observation)
            return np.nan_to_num(observation)
        if self.problem.state_count == 1:
            shape = len(observation), len(self.problem.agents)
            return np.zeros(shape, np.int64) if joint is None else joint.astype(np.int64) + 1
        return observation.copy()

    def make_info(self, legal: Bools | None) -> Info:
        """What marks legal actions `[A]`, where there are any to choose from."""
        if not len(self._full_action_mask):
            return {}
        return {
            "action_mask": self._full_action_mask.copy() if legal is None else legal.astype(np.int8)
        }


def _make_discrete_space(sizes: Any) -> Space:
    """The space of an index, or of several."""
    return spaces.MultiDiscrete(sizes) if np.ndim(sizes) else spaces.Discrete(int(sizes))


def resolve_problem(problem: str | Problem, parameters: Info) -> Problem:
    """A problem, or the one of this name with these parameters."""
    if isinstance(problem, str):
        return problems.load_problem(problem, **parameters)
    return problems.with_parameters(problem, parameters)


def load_other_policies(problem: Problem, seat: int, others: str) -> list[Policy | None]:
    """The agents of this name in all other seats; '' for those that usually sit there."""
    who = [
        others or agents.load_roster(problem, i).default_partner for i in range(len(problem.agents))
    ]
    every = enumerate(who)
    return [None if i == seat else agents.load_agent(problem, i, name) for i, name in every]


def render_board(session: Session, seat: int) -> str:
    """The board as a seat sees it, in plain text."""
    from dmplay.views.style import DrawOptions, fit_board, load_view_module

    look = DrawOptions(width=RENDER_COLUMNS, height=RENDER_ROWS)
    return fit_board(load_view_module(session.problem), session.view(seat), look).plain

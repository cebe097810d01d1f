"""A seat of a problem for reinforcement-learning libraries.

Contains its spaces, its observations, and the limits of its episodes.
"""

from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces

from dmplay.core.arrays import Array, Bools, Ints, is_within
from dmplay.core.policy import GameFollower, Memory, Percept, required_fields, requires_fields
from dmplay.core.problem import MAX_REWARD, Problem, check_problem
from dmplay.core.session import DEFAULT_TURN_LIMIT, Session
from dmplay.core.spaces import Interval
from dmplay.errors import BadParameter, IllegalAction, UnknownName
from dmplay.simulation.observed_parts import (
    Space,
    make_action_space,
    make_part,
    read_observed_names,
)

Info = dict[str, Any]
ILLEGAL_ACTION_RULES = ("noop", "penalty", "end")


class IllegalActionRule(NamedTuple):
    """The consequence of a step with an illegal action; the game itself never changes."""

    reward: float  # of the seat that acted illegally
    ends_episode: bool

    @classmethod
    def from_option(cls, illegal: object, illegal_reward: object) -> "IllegalActionRule":
        """Return the rule of this name: noop (reward 0), penalty, or end of the episode."""
        if not isinstance(illegal, str):
            rules = ", ".join(ILLEGAL_ACTION_RULES)
            raise BadParameter(f"illegal: got {illegal!r}, expected one of {rules}")
        if illegal not in ILLEGAL_ACTION_RULES:
            raise UnknownName("rule for illegal actions", illegal, ILLEGAL_ACTION_RULES)
        if (
            isinstance(illegal_reward, bool)
            or not isinstance(illegal_reward, int | float | np.integer | np.floating)
            or not -MAX_REWARD <= illegal_reward <= MAX_REWARD  # not for NaN either
        ):
            raise BadParameter(f"illegal_reward: got {illegal_reward!r}, expected a finite number")
        return cls(0.0 if illegal == "noop" else float(illegal_reward), illegal == "end")


class TurnLimit(NamedTuple):
    """The steps after which an episode ends, and whether it ends by a rule of the problem."""

    steps: int
    is_rule: bool

    @classmethod
    def from_option(cls, problem: Problem, turns: int | None) -> "TurnLimit":
        """Return the limit of an environment: `turns`, else the problem's horizon, else 10,000.

        The last is the limit of all games without people. Raise BadParameter for an invalid limit.
        """
        check_problem(problem, turns)
        if turns is not None:
            return cls(turns, is_rule=False)
        return cls(problem.horizon or DEFAULT_TURN_LIMIT, problem.is_finite_horizon)

    def is_terminated(self, session: Session) -> bool:
        """Return whether a game is over by the rules: in a terminal state, or at the horizon."""
        return session.end_reason == "terminal" or (
            self.is_rule and session.end_reason == "horizon"
        )


class SeatSpaces:
    """The action and observation spaces of a seat, with conversions to and from their values.

    `observe` names the parts of the observation, and `beliefs` computes beliefs of the seat, if
    there are any. Several parts are a dictionary by name.
    """

    def __init__(
        self,
        problem: Problem,
        seat: int,
        limit: TurnLimit,
        observe: str | Sequence[str] = "observation",
        beliefs: GameFollower | None = None,
    ) -> None:
        self.problem, self.seat = problem, seat
        self._action_set = problem.actions[seat]
        self._action_count = problem.action_counts[seat]  # 0 for real numbers
        self.action_space = make_action_space(self._action_set)
        self._parts = {
            name: make_part(name, problem, seat, limit.steps, beliefs)
            for name in sorted(read_observed_names(observe))  # as spaces.Dict orders them
        }
        ends = accumulate((part.memory_size for part in self._parts.values()), initial=0)
        self._memory_slices = [slice(*pair) for pair in pairwise(ends)]
        part_spaces = {name: part.space for name, part in self._parts.items()}
        self.observation_space: Space = spaces.Dict(part_spaces)
        if len(part_spaces) == 1:
            (self.observation_space,) = part_spaces.values()

    def decode_action(self, value: object) -> Any:
        """Return the action for one value of the action space."""
        return self.decode_actions(convert_to_action_array(value)[None])[0]

    def decode_actions(self, values: Array) -> Array:
        """Return the actions `[B]` for values of the action space; numbers are clipped.

        Raises IllegalAction with the first value that is not an action.
        """
        if isinstance(self._action_set, Interval):
            numbers = values.reshape(len(values), -1)
            if numbers.shape[1] != 1:
                raise IllegalAction(f"step: got {numbers.shape[1]} numbers, expected 1")
            numbers = numbers.astype(float) if numbers.dtype.kind in "iufb" else values
            if numbers.dtype.kind != "f" or np.isnan(numbers).any():
                expected = self._action_set.describe_actions()
                raise IllegalAction(f"step: got {values.tolist()}, expected {expected}")
            return self._action_set.clip_actions(numbers[:, 0])
        is_index_array = values.dtype.kind in "iu" and values.ndim == 1
        if not is_index_array or not is_within(values, 0, len(self._action_set) - 1):
            for value in values.tolist():
                self._action_set.validate_action(value, "step")
        return values.astype(np.int64, copy=False)

    def initial_memory(self, observation: Array) -> Memory:
        """Return the memories of all parts before the first turn; () if they need none."""
        memory: Memory = ()
        for part in self._parts.values():
            memory += part.initial_memory(observation)
        return memory

    @requires_fields("action", "observation", "actions")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the memories of all parts after a turn."""
        updated: Memory = ()
        for part, ends in zip(self._parts.values(), self._memory_slices, strict=True):
            updated += part.update_memory(memory[ends], percept)
        return updated

    def encode_memory(self, memory: Memory, state: Array, turns_left: Ints) -> Any:
        """Return the current observations `[B, ...]`, as new arrays of values of the space."""
        pairs = zip(self._parts.values(), self._memory_slices, strict=True)
        values = [part.encode(memory[ends], state, turns_left) for part, ends in pairs]
        return values[0] if len(values) == 1 else dict(zip(self._parts, values, strict=True))

    def make_info(self, legal: Bools | None, turns_left: int | Ints) -> Info:
        """Return the info of a game or, with `turns_left` `[B]`, of several.

        It has the turns left and, unless actions are real numbers, the mask `[A]` or `[B, A]` of
        the legal actions.
        """
        info: Info = {"turns_left": turns_left}
        if self._action_count:
            mask = np.empty((*np.shape(turns_left), self._action_count), np.int8)
            mask[...] = 1 if legal is None else legal
            info["action_mask"] = mask
        return info

    def action_masks(self, info: Info) -> Bools:
        """Return the legal actions of an info as booleans `[A]`, or `[B, A]` for several games.

        Raises BadParameter if the actions are real numbers.
        """
        if "action_mask" not in info:
            raise BadParameter("action_masks: got real-valued actions, which have no mask")
        return np.asarray(info["action_mask"], bool)


class SeatObserver:
    """The observations of one seat of a session, encoded as values of its observation space."""

    def __init__(self, seat_spaces: SeatSpaces, session: Session) -> None:
        self._seat_spaces, self._session = seat_spaces, session
        self._follow_from_start()

    def _follow_from_start(self) -> None:
        """Return to the memory before the first turn."""
        first = self._session.observation_after(self._seat_spaces.seat, 0)
        self._memory, self._turn_count = self._seat_spaces.initial_memory(first[None]), 0

    def observe(self, turns_left: int) -> Any:
        """Return the current observation with this number of turns left, as new arrays."""
        session, spaces = self._session, self._seat_spaces
        if self._turn_count > len(session.turns):  # turns were taken back
            self._follow_from_start()
        while self._memory and self._turn_count < len(session.turns):
            self._turn_count += 1
            fields = required_fields(spaces)
            percept = session.build_percept(spaces.seat, self._turn_count, fields)
            self._memory = spaces.update_memory(self._memory, percept)
        batch = spaces.encode_memory(self._memory, session.state[None], np.array([turns_left]))
        return select_row(batch, 0)


def select_row(observations: Any, row: int) -> Any:
    """Return the observation of one row, also of a dictionary of observations."""
    if isinstance(observations, dict):
        return {name: part[row] for name, part in observations.items()}
    return observations[row]


def convert_to_action_array(values: object) -> Array:
    """Return actions as an array; raise IllegalAction if they make none."""
    try:
        return np.asarray(values)
    except (TypeError, ValueError):
        raise IllegalAction(f"step: got {values!r}, expected an action for each game") from None

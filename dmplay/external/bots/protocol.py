"""The line protocol of a game with a program in one of its seats: one JSON object per line.

The game sends `hello`, `turn`, `act`, `over` and `quit`; the program answers `hello` and `act`.
Both ignore messages of unknown types.
"""

import json
from typing import Any

import numpy as np

from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Percept
from dmplay.core.problem import Problem
from dmplay.core.spaces import Labels, RealVector
from dmplay.errors import BadParameter, UnknownName
from dmplay.transcript.line_parser import JSON_DECODER

PROTOCOL_VERSION = 1
MANY_GAMES_OFFER = "games"  # requested by a program that plays many games at once
MAX_LINE_CHARACTERS = 65_536  # maximum characters of a line that a program sends

JsonObject = dict[str, Any]


def encode_message(kind: str, facts: JsonObject) -> str:
    """Return a message as a line of JSON."""
    return json.dumps({"type": kind, **facts}, default=str) + "\n"


def decode_message(text: str) -> JsonObject:
    """Return the message in a line; raise ValueError if it is not a valid one."""
    try:
        decoded = JSON_DECODER.decode(text)
    except json.JSONDecodeError as error:
        raise ValueError(f"{error.msg}, at column {error.colno}") from None
    except RecursionError:
        raise ValueError("nested too deeply") from None
    if not isinstance(decoded, dict) or not isinstance(decoded.get("type"), str):
        raise ValueError('expected a JSON object with a "type"')
    return decoded


def describe_choices(
    problem: Problem, seat: int, legal: Bools | None = None, action_labels: Labels | None = None
) -> object:
    """Return a seat's legal actions by name, or the bounds of a numeric action.

    `action_labels` are the actions' names in the current state, if they differ from the usual ones.
    """
    space = problem.actions[seat]
    if isinstance(space, Labels):
        names = enumerate(action_labels or space)
        return [name for index, name in names if legal is None or legal[index]]
    return {"low": space.low, "high": space.high}


def encode_observation(problem: Problem, seat: int, observation: Array) -> object:
    """Return an observation as a JSON value at full precision; None for the null observation."""
    if problem.partially_observable:
        space = problem.observations[seat]
        null_observation, is_float = space.null_observation(1)[0], observation.dtype.kind == "f"
        if np.array_equal(observation, null_observation, equal_nan=is_float):
            return None
        if isinstance(space, Labels):
            return space[int(observation)]
        return space.to_json_value(observation)
    return (
        observation.tolist() if observation.dtype.kind == "f" else problem.format_state(observation)
    )


def decode_observation(problem: Problem, seat: int, value: Any, *, initial: bool = False) -> Array:
    """Return the observation `[1, ...]` that `encode_observation` has encoded.

    Only an `initial` observation may be null. Raise BadParameter, or UnknownName, for a value that
    is not an observation of this seat.
    """
    if not problem.partially_observable:
        state = problem.sample_initial_states(np.zeros((1, problem.uniform_counts.start)))[0]
        if state.dtype.kind == "f":
            return _decode_numbers("observation", value, state.shape)[None]
        try:
            return np.asarray(problem.parse_state(value))[None]
        except (ValueError, LookupError, TypeError, AttributeError):
            example = json.dumps(problem.format_state(state))
            expected = f"a state as text, such as {example}"
            raise make_value_error("observation", value, expected) from None
    space = problem.observations[seat]
    if value is None and initial:
        return space.null_observation(1)
    if isinstance(space, RealVector):
        return _decode_numbers("observation", value, space.shape)[None]
    if not isinstance(value, str) or not value:
        expected = f"one of {', '.join(space)}" if isinstance(space, Labels) else "text"
        raise make_value_error("observation", value, expected)
    if not isinstance(space, Labels):
        return np.array([value])
    if value not in space:
        raise UnknownName("observation", value, space)
    return np.array([space.index(value)])


def _decode_numbers(key: str, value: Any, shape: tuple[int, ...]) -> Reals:
    """Return finite numbers of this shape; raise BadParameter for any other value of a key."""
    try:
        numbers = np.array(value)
    except ValueError:  # lists of different lengths
        numbers = np.array("")
    if numbers.dtype.kind not in "iuf" or numbers.shape != shape:
        expected = f"numbers of shape {[*shape]}" if shape else "a number"
        raise make_value_error(key, value, expected)
    return numbers.astype(float)


def make_value_error(key: str, value: object, expected: str) -> BadParameter:
    """Return the error for the value of a key of a message, which is shown as JSON."""
    return BadParameter(f"{key} {json.dumps(value)}, expected {expected}")


def encode_percept(problem: Problem, seat: int, percept: Percept, row: int) -> JsonObject:
    """Return one row of a seat's percept as JSON facts."""
    own_action = problem.actions[seat].to_json_value(percept.action[row])
    facts: JsonObject = {
        "action": own_action,
        "observation": encode_observation(problem, seat, percept.observation[row]),
    }
    if percept.actions is not None:
        joint_action = zip(problem.agents, problem.actions, percept.actions[row], strict=True)
        facts["actions"] = {
            agent: space.to_json_value(action) for agent, space, action in joint_action
        }
    if percept.reward is not None:
        facts["reward"] = float(percept.reward[row])
    return facts


def decode_percept(problem: Problem, seat: int, facts: JsonObject) -> Percept:
    """Return the percept, of one row, that `encode_percept` has encoded.

    Raise KeyError for a missing fact, and BadParameter or UnknownName for an invalid one.
    """
    joint, reward = facts.get("actions"), facts.get("reward")
    actions = None
    if joint is not None:
        if not isinstance(joint, dict) or not {*problem.agents} <= {*joint}:
            raise make_value_error(
                "actions", joint, f"an action for each of {', '.join(problem.agents)}"
            )
        joint_action = [
            _decode_action(problem, i, joint[agent]) for i, agent in enumerate(problem.agents)
        ]
        actions = np.array([joint_action])
    own_actions = np.array([_decode_action(problem, seat, facts["action"])])
    return Percept(
        own_actions if actions is None else actions[:, seat],
        decode_observation(problem, seat, facts["observation"]),
        actions,
        None if reward is None else _decode_numbers("reward", reward, ())[None],
    )


def _decode_action(problem: Problem, seat: int, value: object) -> float:
    """Return the action in a message; raise BadParameter or UnknownName if there is none."""
    action_set = problem.actions[seat]
    if isinstance(value, bool) or not isinstance(value, action_set.json_types):
        description = action_set.describe_actions()
        is_named = isinstance(action_set, Labels)
        raise make_value_error("action", value, "one of " * is_named + description)
    return problem.parse_action(seat, str(value))

"""The line protocol of a game with a program in one of its seats: one JSON object per line.

The game sends `hello`, `turn`, `act`, `over` and `quit`; the program answers `hello` and `act`.
Both ignore messages of unknown types.
"""

import json
from typing import Any

import numpy as np

from dmplay.chance import Array, Bools
from dmplay.core import Labels, Percept, Problem
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
    except RecursionError:
        raise ValueError("nested too deeply") from None
    if not isinstance(decoded, dict) or not isinstance(decoded.get("type"), str):
        raise ValueError('no object with a "type"')
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
        if _are_observations_equal(observation, space.null_observation(1)[0]):
            return None
        return (
            space[int(observation)]
            if isinstance(space, Labels)
            else space.to_json_value(observation)
        )
    return (
        observation.tolist() if observation.dtype.kind == "f" else problem.format_state(observation)
    )


def _are_observations_equal(first: Array, second: Array) -> bool:
    """Return whether two observations are equal, with NaN equal to NaN."""
    is_float = first.dtype.kind == "f"
    return np.array_equal(first, second, equal_nan=is_float)


def decode_observation(problem: Problem, seat: int, value: Any) -> Array:
    """Return the observation `[1, ...]` that `encode_observation` has encoded."""
    if problem.partially_observable:
        space = problem.observations[seat]
        if value is None:
            return space.null_observation(1)
        return np.array([space.index(value) if isinstance(space, Labels) else value])
    return np.asarray(problem.parse_state(value) if isinstance(value, str) else value)[None]


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
    """Return the percept, of one row, that `encode_percept` has encoded."""
    joint, reward = facts.get("actions"), facts.get("reward")
    actions = None
    if joint is not None:
        joint_action = [
            problem.parse_action(i, str(joint[agent])) for i, agent in enumerate(problem.agents)
        ]
        actions = np.array([joint_action])
    own_actions = np.array([problem.parse_action(seat, str(facts["action"]))])
    return Percept(
        own_actions if actions is None else actions[:, seat],
        decode_observation(problem, seat, facts["observation"]),
        actions,
        None if reward is None else np.array([float(reward)]),
    )

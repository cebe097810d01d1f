"""The line protocol of a game with a program in one of its seats: a JSON object on each line.

The game says `hello`, `turn`, `act`, `over` and `quit`; the program answers `hello` and `act`.
Either ignores a type that it does not know.
"""

import json
from typing import Any

import numpy as np

from dmplay.chance import Array, Bools
from dmplay.core import Labels, Percept, Problem
from dmplay.transcript.keyed import JSON_DECODER

PROTOCOL_VERSION = 1
MANY_GAMES_OFFER = "games"  # what a program wants that plays many games at once
MAX_LINE_CHARACTERS = 65_536  # characters of a line that a program says

JsonObject = dict[str, Any]


def encode_message(kind: str, facts: JsonObject) -> str:
    """A message, as it is sent."""
    return json.dumps({"type": kind, **facts}, default=str) + "\n"


def decode_message(text: str) -> JsonObject:
    """What a line says; raises ValueError where it is no message."""
    try:
        said = JSON_DECODER.decode(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None
    if not isinstance(said, dict) or not isinstance(said.get("type"), str):
        raise ValueError('no object with a "type"')
    return said


def describe_choices(
    problem: Problem, seat: int, legal: Bools | None = None, action_labels: Labels | None = None
) -> object:
    """What a seat may do: the names of actions, as they are called, or the bounds of a number."""
    known = problem.actions[seat]
    if isinstance(known, Labels):
        names = enumerate(action_labels or known)
        return [name for place, name in names if legal is None or legal[place]]
    return {"low": known.low, "high": known.high}


def encode_observation(problem: Problem, seat: int, observation: Array) -> object:
    """What a seat observes, to the last digit; None for nothing yet."""
    if problem.partially_observable:
        known = problem.observations[seat]
        if _are_observations_equal(observation, known.null_observation(1)[0]):
            return None
        return (
            known[int(observation)]
            if isinstance(known, Labels)
            else known.to_json_value(observation)
        )
    return (
        observation.tolist() if observation.dtype.kind == "f" else problem.format_state(observation)
    )


def _are_observations_equal(first: Array, second: Array) -> bool:
    """Whether two observations are equal, nothing seen of a number too."""
    numbers = first.dtype.kind == "f"
    return np.array_equal(first, second, equal_nan=numbers)


def decode_observation(problem: Problem, seat: int, value: Any) -> Array:
    """The observation `[1, ...]` that `sight` tells."""
    if problem.partially_observable:
        known = problem.observations[seat]
        if value is None:
            return known.null_observation(1)
        return np.array([known.index(value) if isinstance(known, Labels) else value])
    return np.asarray(problem.parse_state(value) if isinstance(value, str) else value)[None]


def encode_percept(problem: Problem, seat: int, percept: Percept, row: int) -> JsonObject:
    """What a turn taught a seat of one of the games that a percept is of."""
    own = problem.actions[seat].to_json_value(percept.action[row])
    facts: JsonObject = {
        "action": own,
        "observation": encode_observation(problem, seat, percept.observation[row]),
    }
    if percept.actions is not None:
        every = zip(problem.agents, problem.actions, percept.actions[row], strict=True)
        facts["actions"] = {agent: known.to_json_value(action) for agent, known, action in every}
    if percept.reward is not None:
        facts["reward"] = float(percept.reward[row])
    return facts


def decode_percept(problem: Problem, seat: int, facts: JsonObject) -> Percept:
    """The percept, of one game, that `learnt` tells."""
    joint, reward = facts.get("actions"), facts.get("reward")
    actions = None
    if joint is not None:
        done = [
            problem.parse_action(i, str(joint[agent])) for i, agent in enumerate(problem.agents)
        ]
        actions = np.array([done])
    own = np.array([problem.parse_action(seat, str(facts["action"]))])
    return Percept(
        own if actions is None else actions[:, seat],
        decode_observation(problem, seat, facts["observation"]),
        actions,
        None if reward is None else np.array([float(reward)]),
    )

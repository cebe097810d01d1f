"""The line protocol of a game with a program in one of its seats: a JSON object on each line.

The game says `hello`, `turn`, `act`, `over` and `quit`; the program answers `hello` and `act`.
Either ignores a type that it does not know.
"""

import json
from typing import Any

import numpy as np

from dmplay.chance import Array, Bools
from dmplay.core import Labels, Percept, Problem
from dmplay.transcript.keyed import JSON

VERSION = 1
GAMES = "games"  # what a program wants that plays many games at once
LONGEST = 65_536  # characters of a line that a program says

Facts = dict[str, Any]


def line(kind: str, facts: Facts) -> str:
    """A message, as it is sent."""
    return json.dumps({"type": kind, **facts}, default=str) + "\n"


def message(text: str) -> Facts:
    """What a line says; raises ValueError where it is no message."""
    try:
        said = JSON.decode(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None
    if not isinstance(said, dict) or not isinstance(said.get("type"), str):
        raise ValueError('no object with a "type"')
    return said


def choices(
    problem: Problem, seat: int, legal: Bools | None = None, called: Labels | None = None
) -> object:
    """What a seat may do: the names of actions, as they are called, or the bounds of a number."""
    known = problem.actions[seat]
    if isinstance(known, Labels):
        names = enumerate(called or known)
        return [name for place, name in names if legal is None or legal[place]]
    return {"low": known.low, "high": known.high}


def sight(problem: Problem, seat: int, observation: Array) -> object:
    """What a seat observes, to the last digit; None for nothing yet."""
    if problem.hidden:
        known = problem.observations[seat]
        if _same(observation, known.unseen(1)[0]):
            return None
        return known[int(observation)] if isinstance(known, Labels) else known.fact(observation)
    return observation.tolist() if observation.dtype.kind == "f" else problem.notation(observation)


def _same(one: Array, other: Array) -> bool:
    """Whether two observations are equal, nothing seen of a number too."""
    numbers = one.dtype.kind == "f"
    return np.array_equal(one, other, equal_nan=numbers)


def seen(problem: Problem, seat: int, told: Any) -> Array:
    """The observation `[1, ...]` that `sight` tells."""
    if problem.hidden:
        known = problem.observations[seat]
        if told is None:
            return known.unseen(1)
        return np.array([known.index(told) if isinstance(known, Labels) else told])
    return np.asarray(problem.parse(told) if isinstance(told, str) else told)[None]


def learnt(problem: Problem, seat: int, percept: Percept, row: int) -> Facts:
    """What a turn taught a seat of one of the games that a percept is of."""
    own = problem.actions[seat].fact(percept.action[row])
    facts: Facts = {"action": own, "observation": sight(problem, seat, percept.observation[row])}
    if percept.actions is not None:
        every = zip(problem.agents, problem.actions, percept.actions[row], strict=True)
        facts["actions"] = {agent: known.fact(action) for agent, known, action in every}
    if percept.reward is not None:
        facts["reward"] = float(percept.reward[row])
    return facts


def percept(problem: Problem, seat: int, facts: Facts) -> Percept:
    """The percept, of one game, that `learnt` tells."""
    joint, reward = facts.get("actions"), facts.get("reward")
    actions = None
    if joint is not None:
        done = [problem.action(i, str(joint[agent])) for i, agent in enumerate(problem.agents)]
        actions = np.array([done])
    own = np.array([problem.action(seat, str(facts["action"]))])
    return Percept(
        own if actions is None else actions[:, seat],
        seen(problem, seat, facts["observation"]),
        actions,
        None if reward is None else np.array([float(reward)]),
    )

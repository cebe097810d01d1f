"""What a block of a transcript says that was done and drawn, whether or not it can be."""

import json

import numpy as np

from dmplay.chance import Reals
from dmplay.core import Problem
from dmplay.errors import DmplayError
from dmplay.transcript.reading import Block, Transcript


def read_uniforms(transcript: Transcript, block: Block, count: int) -> Reals:
    """The draws `[count]` of a block."""
    values = block.get("draws", [])
    if not isinstance(values, list) or not all(
        type(u) in (int, float) and 0.0 <= u < 1.0 for u in values
    ):
        line = block.line_of_key("draws")
        raise transcript.error_at(line, "draws: expected numbers from 0 to below 1")
    if len(values) != count:
        line = block.line_of_key("draws")
        raise transcript.error_at(line, f"draws: got {len(values)}, expected {count}")
    return np.array(values, float)


def read_actions(transcript: Transcript, block: Block, problem: Problem) -> list[float]:
    """The action of each agent in a turn."""
    told = block.get("actions")
    if not isinstance(told, dict) or list(told) != list(problem.agents):
        expected = f"expected one for each of {', '.join(problem.agents)}"
        raise transcript.error_at(block.line_of_key("actions"), f"actions: {expected}")
    actions = []
    for seat, (agent, value) in enumerate(told.items()):
        if type(value) not in problem.actions[seat].json_types:
            what = f"actions: {agent}: got {json.dumps(value)}"
            raise transcript.error_at(block.line_of_key("actions"), what)
        try:
            actions.append(problem.parse_action(seat, str(value)))
        except DmplayError as error:
            what = f"actions: {agent}: {error}"
            raise transcript.error_at(block.line_of_key("actions"), what) from None
    return actions


def read_hint_counts(transcript: Transcript, block: Block, problem: Problem) -> dict[str, int]:
    """How often each seat was helped at one time."""
    told = block["help"]
    if not isinstance(told, dict) or not told or not {*told} <= {*problem.agents}:
        raise transcript.error_at(block.line, f"help: expected some of {', '.join(problem.agents)}")
    if not all(type(many) is int and many > 0 for many in told.values()):
        raise transcript.error_at(block.line, "help: expected whole numbers, as 1")
    return told


def read_count(transcript: Transcript, block: Block, key: str) -> int:
    """How many turns an undo takes back, or the number of a reroll."""
    value = block[key]
    if type(value) is not int or value < 1:
        raise transcript.error_at(block.line, f"{key}: expected a whole number, as 1")
    return value

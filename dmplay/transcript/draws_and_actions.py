"""The inputs of a transcript block: their form is checked, but not whether they are legal."""

import json

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem
from dmplay.errors import DmplayError
from dmplay.transcript.reader import Block, Transcript


def read_uniforms(transcript: Transcript, block: Block, count: int) -> Reals:
    """Return the uniforms `[count]` of a block; raise BadTranscript if they are malformed."""
    values = block.get_value("draws", [])
    if not isinstance(values, list) or not all(
        [type(u) in (int, float) and 0.0 <= u < 1.0 for u in values]
    ):
        line = block.line_of_key("draws")
        raise transcript.error_at(line, "draws: expected numbers from 0 (included) to 1 (excluded)")
    if len(values) != count:
        line = block.line_of_key("draws")
        raise transcript.error_at(line, f"draws: got {len(values)} numbers, expected {count}")
    return np.array(values, float)


def read_actions(transcript: Transcript, block: Block, problem: Problem) -> list[float]:
    """Return each agent's action in a turn; raise BadTranscript if one is missing or unknown."""
    values_by_agent = block.get_value("actions")
    if not isinstance(values_by_agent, dict) or list(values_by_agent) != list(problem.agents):
        expected = f"expected one for each of {', '.join(problem.agents)}"
        raise transcript.error_at(block.line_of_key("actions"), f"actions: {expected}")
    actions = []
    for seat, (agent, value) in enumerate(values_by_agent.items()):
        if type(value) not in problem.actions[seat].json_types:
            expected = "a text" if str in problem.actions[seat].json_types else "a number"
            explanation = f"actions: {agent}: got {json.dumps(value)}, expected {expected}"
            raise transcript.error_at(block.line_of_key("actions"), explanation)
        try:
            actions.append(problem.parse_action(seat, str(value)))
        except DmplayError as error:
            explanation = f"actions: {agent}: {error}"
            raise transcript.error_at(block.line_of_key("actions"), explanation) from None
    return actions


def read_hint_counts(transcript: Transcript, block: Block, problem: Problem) -> dict[str, int]:
    """Return the number of hints for each seat in a block of kind `help`.

    Raises BadTranscript if it is malformed.
    """
    hint_counts = block["help"]
    if (
        not isinstance(hint_counts, dict)
        or not hint_counts
        or not {*hint_counts} <= {*problem.agents}
    ):
        names = ", ".join(problem.agents)
        raise transcript.error_at(block.line, f"help: expected counts for one or more of {names}")
    if not all(type(count) is int and count > 0 for count in hint_counts.values()):
        raise transcript.error_at(block.line, "help: expected whole numbers of 1 or more")
    return hint_counts


def read_count(transcript: Transcript, block: Block, key: str) -> int:
    """Return the number of turns of an undo, or the number of a reroll.

    Raises BadTranscript if it is not a positive whole number.
    """
    value = block[key]
    if type(value) is not int or value < 1:
        raise transcript.error_at(block.line, f"{key}: expected a whole number of 1 or more")
    return value

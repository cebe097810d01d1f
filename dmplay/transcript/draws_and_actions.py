"""The inputs of a transcript block: their form is checked, but not whether they are legal."""

import json
import math
from collections.abc import Mapping

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.belief import normalize_belief
from dmplay.core.problem import Problem
from dmplay.core.session import NO_STATED_BELIEFS, belief_size
from dmplay.errors import BadParameter, DmplayError
from dmplay.transcript.reader import Block, Transcript

STATED_SUM_TOLERANCE = 1e-9  # their sum is rounded to ten digits, as each probability is


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


def read_stated_beliefs(
    transcript: Transcript, block: Block, problem: Problem
) -> Mapping[int, Reals]:
    """Return the belief `[S]` that each seat stated in a turn, by seat; {} if none did.

    Raise BadTranscript unless each is a list with the probability of every state.
    """
    if "stated" not in block.keys:
        return NO_STATED_BELIEFS
    line, values_by_agent = block.line_of_key("stated"), block["stated"]
    stated = values_by_agent if isinstance(values_by_agent, dict) else {}
    if not stated or [*stated] != [agent for agent in problem.agents if agent in stated]:
        expected = f"expected beliefs of one or more of {', '.join(problem.agents)}"
        raise transcript.error_at(line, f"stated: {expected}")
    size = belief_size(problem)
    if math.isinf(size):
        raise transcript.error_at(line, "stated: this problem has no belief over hidden states")
    beliefs = {}
    for agent, values in stated.items():
        is_list = isinstance(values, list) and len(values) == size
        if not is_list or not all(type(p) in (int, float) for p in values):
            expected = f"expected {size:.0f} numbers, one for each state"
            raise transcript.error_at(line, f"stated: {agent}: {expected}")
        try:
            normalize_belief(np.array(values, float), STATED_SUM_TOLERANCE)
        except BadParameter as error:
            raise transcript.error_at(line, f"stated: {agent}: {error}") from None
        beliefs[problem.agents.index(agent)] = np.array(values, float)
    return beliefs


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

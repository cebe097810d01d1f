"""Policies as files: an action or a row of Q for each state, or alpha vectors of other solvers.

A text file has a line for each state, in the order in which `dmplay solve` lists them: an action,
or Q of all actions. A JSON file has a list of these, or an object with the names of the states.
Alpha vectors are those of SARSOP (`.policy`) and pomdp-solve (`.alpha`).
"""

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.agents.belief_policy import BeliefPolicy
from dmplay.agents.learned_policy import LearnedPolicy
from dmplay.algorithms.features import StateFeatures
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.chance import weighted_sum
from dmplay.core.policy import Memory
from dmplay.core.problem import Problem, check_listing_size
from dmplay.core.safe_files import read_bytes
from dmplay.errors import BadPolicy, DmplayError

SARSOP_VECTOR = re.compile(r'<Vector\s+action="(\d+)"[^>]*>([^<]*)</Vector>')


@dataclass(frozen=True)
class AlphaVectorPolicy(BeliefPolicy):
    """Takes the action of the alpha vector that is greatest at its belief."""

    vectors: Reals  # [N, S]
    vector_actions: Ints  # [N]

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the action of the best vector whose action is legal."""
        values = weighted_sum(memory[0], self.vectors.T)
        if legal is not None:
            values = np.where(legal[:, self.vector_actions], values, -np.inf)
        return np.asarray(self.vector_actions[values.argmax(axis=1)])


def read_policy_file(path: Path, problem: Problem) -> SeatPolicy:
    """Return the policy in a file; raise BadPolicy in one line if it does not fit the problem."""
    try:
        text = read_bytes(path).decode()
        if len(problem.agents) > 1 or not problem.action_counts[0]:
            raise ValueError("expected a problem of one agent with a list of actions")
        if not isinstance(problem.state_count, int):
            raise ValueError("expected a problem whose states can be listed")
        check_listing_size(problem, problem.state_count * problem.action_counts[0])
        if problem.partially_observable:
            return _parse_alpha_vectors(text, problem)
        rows = _list_rows(text, problem)
        if len(rows) != problem.state_count:
            raise ValueError(f"got {len(rows)} states, expected {problem.state_count}")
        weights = np.array([_parse_row(row, problem) for row in rows])
    except OSError as error:
        raise BadPolicy(f"{path}: {error.strerror}") from None
    except (ValueError, LookupError, RecursionError, DmplayError) as error:
        raise BadPolicy(f"{path}: {error}") from None
    return LearnedPolicy(problem, 0, StateFeatures(problem, problem.state_count), weights)


def _list_rows(text: str, problem: Problem) -> Sequence[object]:
    """Return the action or the row of each state, in index order."""
    if text.lstrip()[:1] not in {"[", "{"}:
        lines = (line.partition("#")[0].strip() for line in text.splitlines())
        return [line for line in lines if line]
    rows = json.loads(text)
    if isinstance(rows, list):
        return rows
    names = [problem.format_state(s) for s in problem.enumerate_states()]
    missing = [
        name
        for name, is_over in zip(names, problem.terminal(problem.enumerate_states()), strict=True)
        if name not in rows and not is_over
    ]
    if missing or not rows.keys() <= {*names}:
        name = missing[0] if missing else next(iter(rows.keys() - {*names}))
        raise ValueError(f"state {name}: {'is missing' if missing else 'is unknown'}")
    return [rows.get(name, 0) for name in names]


def _parse_row(row: object, problem: Problem) -> Reals:
    """Return the weights `[A]` of a state: its Q, or 1 for its action."""
    count = problem.action_counts[0]
    if isinstance(row, str):
        words = row.replace(",", " ").split()
        if len(words) == 1:
            return np.asarray(np.eye(count)[int(problem.parse_action(0, words[0]))])
        row = [float(word) for word in words]
    if isinstance(row, int) and 0 <= row < count:
        return np.asarray(np.eye(count)[row])
    if not isinstance(row, list) or len(row) != count:
        raise ValueError(f"got {str(row)[:40]}, expected an action, or {count} numbers")
    q = np.array([float(number) for number in row])
    if np.isnan(q).any():
        raise ValueError("got nan in a row of Q")
    return q


def _parse_alpha_vectors(text: str, problem: Problem) -> AlphaVectorPolicy:
    """Return the policy of alpha vectors as SARSOP or pomdp-solve writes them."""
    pairs = SARSOP_VECTOR.findall(text)
    if not pairs:  # pomdp-solve: the number of an action, a line with its vector, an empty line
        lines = [line for line in text.splitlines() if line.strip()]
        pairs = [*zip(lines[::2], lines[1::2], strict=True)]
    if not pairs:
        raise ValueError("expected alpha vectors of SARSOP or pomdp-solve")
    actions = np.array([int(action) for action, _ in pairs])
    vectors = [[float(word) for word in numbers.split()] for _, numbers in pairs]
    lengths = {len(vector) for vector in vectors}
    if lengths != {problem.state_count}:
        got = ", ".join(map(str, sorted(lengths)[:3]))
        raise ValueError(f"got vectors of length {got}, expected {problem.state_count} states")
    if actions.max() >= problem.action_counts[0] or actions.min() < 0:
        raise ValueError(
            f"got action {actions.max()}, expected 0 to {problem.action_counts[0] - 1}"
        )
    return AlphaVectorPolicy(problem, 0, np.array(vectors), actions)

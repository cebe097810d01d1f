"""Write problems as `.pomdp` and `.mdp` (Cassandra), `.dpomdp` (MADP) and `.nfg` (Gambit)."""

import re
from collections.abc import Iterator, Sequence
from itertools import product
from math import prod
from typing import NamedTuple

import numpy as np

from dmplay.core import belief
from dmplay.core.problem import ContinuousStates, Problem
from dmplay.core.spaces import Labels
from dmplay.core.sparse_matrix import SparseMatrix
from dmplay.core.tabular import SparseTables, Tabular, tabulate
from dmplay.core.work_budget import Budget
from dmplay.errors import BadParameter
from dmplay.formats.cassandra_syntax import KEYWORDS, VALUE_KEYWORDS
from dmplay.formats.file_problems import make_unique_labels

RESERVED_WORDS = {*KEYWORDS, *VALUE_KEYWORDS}
BYTES_PER_LINE = 200  # memory of one line while it is written
FILE_SUFFIXES = (".pomdp", ".mdp", ".dpomdp", ".nfg")


def iter_problem_lines(problem: Problem, suffix: str, description: str) -> Iterator[str]:
    """Return the lines of a file with this suffix that contains a problem and its description.

    Raises BadParameter if the format cannot represent the problem.
    """
    if not isinstance(problem.state_count, int) or not all(problem.action_counts):
        reason = _explain_unlistable(problem)
        raise BadParameter(f"a file lists all states and actions, but {reason}")
    if suffix == ".nfg":
        return _iter_nfg_lines(problem, description)
    team = suffix == ".dpomdp"
    agents = len(problem.agents)
    one_state = problem.state_count == 1 and not problem.partially_observable
    if agents > 1 and not team:
        remedy = f"write a {'.nfg' if one_state else '.dpomdp, if all agents get the same reward'}"
        raise BadParameter(f"{suffix} is for one agent, but this problem has {agents}; {remedy}")
    if suffix == ".mdp" and problem.partially_observable:
        raise BadParameter(
            ".mdp is for problems without hidden states, but this problem has them; write a .pomdp"
        )
    return _iter_markov_lines(problem, description, team=team)


def _explain_unlistable(problem: Problem) -> str:
    """Return the reason why the states or the actions of a problem cannot be listed."""
    if not all(problem.action_counts):
        return "an action of this problem is a real number"
    if isinstance(problem.state_count, ContinuousStates):
        return "the states of this problem are real numbers"
    return "dmplay creates the states of this problem only during play"


class _StatementStyle(NamedTuple):
    """The names and punctuation in the statements of a format."""

    value_separator: str  # between the last name and the number
    any_observation: str  # selects all observations
    actions: Sequence[str]
    states: Sequence[str]
    observations: Sequence[str]

    def format_statement(self, kind: str, *fields: object) -> str:
        """Return one `T:`, `O:` or `R:` line from the selected names and, last, the number."""
        *names, number = fields
        value = repr(float(number) + 0.0)  # type: ignore[arg-type]
        return f"{kind}: {' : '.join(map(str, names))}{self.value_separator} {value}\n"


def _iter_markov_lines(problem: Problem, description: str, *, team: bool) -> Iterator[str]:
    """Yield the lines of a file in Cassandra's format, or in MADP's for a team.

    Raises BadParameter if the agents' rewards differ.
    """
    tables = _build_sparse_tables(problem)
    rewards, names = tables.rewards, [problem.format_state(s) for s in problem.enumerate_states()]
    if (rewards != rewards[:, :1]).any():
        suggestion = "no file format holds such a problem with several states"
        if len(names) == 1:
            suggestion = "write a .nfg"
        raise BadParameter(
            f"the rewards of the agents differ, but a .dpomdp has one reward for all; {suggestion}"
        )
    states = make_valid_names(names, "state")
    actions = [
        make_valid_names(make_unique_labels(space.labels, "action"), "action")
        for space in problem.actions
    ]
    spaces = (
        space for space in problem.observations if isinstance(space, Labels)
    )  # all are Labels
    observations = [make_valid_names(space, "observation") for space in spaces]
    if team and not problem.partially_observable:
        observations = [states] * len(problem.agents)
        tables = tables._replace(observation=_build_identity_observation_table(problem, tables))
    line_count = len(tables.transition.columns) * (2 + len(observations)) + len(rewards)
    budget = Budget("writing the file", "try a smaller problem")
    budget.check_memory(float(BYTES_PER_LINE) * line_count)
    for line in description.strip().splitlines():
        yield f"# {line.strip()}".rstrip() + "\n"
    if team:
        yield f"agents: {len(problem.agents)}\n"
    yield f"discount: {float(problem.discount)!r}\nvalues: reward\n"
    yield f"states: {_format_names(states)}\n"
    if team:
        yield _format_start_line(problem, states, "\n")
        yield "actions:\n" + "".join(f"{' '.join(labels)}\n" for labels in actions)
        yield "observations:\n" + "".join(f"{_format_names(labels)}\n" for labels in observations)
    else:
        yield f"actions: {' '.join(actions[0])}\n"
        yield f"observations: {_format_names(observations[0])}\n" if observations else ""
        yield _format_start_line(problem, states, " ")
    joint_actions, joint_observations = _join_names(actions), _join_names(observations)
    punctuation = (" :", " ".join("*" * len(observations))) if team else ("", "*")
    style = _StatementStyle(*punctuation, joint_actions, states, joint_observations)
    yield from _iter_probability_lines("T", style, tables.transition, len(states))
    if tables.observation:
        yield from _iter_probability_lines("O", style, tables.observation, len(states))
    yield from _iter_reward_lines(style, tables)


def _build_sparse_tables(problem: Problem) -> SparseTables:
    """Return the transitions, observations and rewards of a finite problem as sparse tables."""
    has_all_actions = type(problem).legal_actions_mask is Problem.legal_actions_mask
    if isinstance(problem, Tabular) and has_all_actions:
        return problem.sparse_tables
    return tabulate(problem).sparse_tables


def _build_identity_observation_table(problem: Problem, tables: SparseTables) -> SparseMatrix:
    """Return the observation table of a problem in which every agent observes the state."""
    assert isinstance(problem.state_count, int)
    state_count, agent_count = problem.state_count, len(problem.agents)
    state_indices = [np.arange(state_count)] * agent_count
    joint_observations = np.ravel_multi_index(state_indices, (state_count,) * agent_count)
    action_count = prod(problem.action_counts)
    columns = np.tile(joint_observations, action_count)
    return SparseMatrix(np.arange(len(columns) + 1), columns, np.ones(len(columns)))


def _iter_probability_lines(
    kind: str, style: _StatementStyle, matrix: SparseMatrix, state_count: int
) -> Iterator[str]:
    """Yield the line of each entry of T or O that is not 0."""
    columns = style.states if kind == "T" else style.observations
    for row, column, value in zip(matrix.row_indices, matrix.columns, matrix.values, strict=True):
        if kind == "T":
            s, a = divmod(int(row), len(style.actions))
        else:
            a, s = divmod(int(row), state_count)
        names = style.actions[a], style.states[s], columns[column]
        yield style.format_statement(kind, *names, value)


def _iter_reward_lines(style: _StatementStyle, tables: SparseTables) -> Iterator[str]:
    """Yield the line of each reward that is not 0, with the fields that it depends on."""
    transitions, rewards = tables.transition, tables.rewards[:, 0]
    action_count = len(style.actions)
    by_state_and_action = len(rewards) == len(transitions.row_starts) - 1
    observation_count = 1 if by_state_and_action else len(rewards) // len(transitions.columns)
    rows = np.arange(len(rewards)) if by_state_and_action else transitions.row_indices
    for index in np.flatnonzero(rewards):
        s, a = divmod(int(rows[index // observation_count]), action_count)
        next_state, observation = "*", style.any_observation
        if not by_state_and_action:
            next_state = style.states[int(transitions.columns[index // observation_count])]
        if observation_count > 1:
            observation = style.observations[int(index % observation_count)]
        names = style.actions[a], style.states[s], next_state, observation
        yield style.format_statement("R", *names, rewards[index])


def _format_start_line(problem: Problem, states: Sequence[str], separator: str) -> str:
    """Return the `start:` line: one state, `uniform`, or the probability of each state."""
    p = belief.initial_belief(problem)
    if (p == p[0]).all() and len(p) > 1:
        return f"start:{separator}uniform\n"
    if p.max() == 1 and not states[int(p.argmax())].isdecimal():
        return f"start: {states[int(p.argmax())]}\n"
    return f"start:{separator}{' '.join(repr(float(probability)) for probability in p)}\n"


def _format_names(names: Sequence[str]) -> str:
    """Return the names in one string, or their count if they are the numbers from 0 on."""
    numbers = [*map(str, range(len(names)))]
    return str(len(names)) if list(names) == numbers else " ".join(names)


def _join_names(names_by_agent: Sequence[Sequence[str]]) -> list[str]:
    """Return the names of joint actions or observations, in row-major order."""
    return [" ".join(names) for names in product(*names_by_agent)]


def make_valid_names(names: Sequence[str], kind: str) -> list[str]:
    """Return distinct names that the formats allow, made from any names.

    A valid name is a letter, then letters, digits, `-` and `_`, and is not reserved. Names that are
    the numbers from 0 on stay as they are.
    """
    if list(names) == [*map(str, range(len(names)))]:
        return list(names)
    valid_names: list[str] = []
    used_names: set[str] = set()
    for name in names:
        base_name = re.sub(r"[^A-Za-z0-9_-]+", "-", name.strip("()[]{} ")) or kind
        if not base_name[0].isalpha() or base_name in RESERVED_WORDS:
            prefix = f"{kind}-" if base_name in RESERVED_WORDS else kind[0]
            base_name = f"{prefix}{base_name}"
        label, number = base_name, 2
        while label in used_names:
            label, number = f"{base_name}-{number}", number + 1
        valid_names.append(label)
        used_names.add(label)
    return valid_names


def _iter_nfg_lines(problem: Problem, description: str) -> Iterator[str]:
    """Yield the lines of an `.nfg` file; raise BadParameter if the problem has several states."""
    if problem.state_count != 1 or problem.partially_observable:
        reason = "this problem has several or hidden states"
        raise BadParameter(f".nfg is for games with one visible state, but {reason}")
    title, _, comment = description.strip().partition("\n\n")
    player_names = " ".join(map(_quote, make_unique_labels(problem.agents, "player")))
    yield f"NFG 1 R {_quote(title)} {{ {player_names} }}\n\n{{\n"
    for space in problem.actions:
        names = " ".join(map(_quote, make_unique_labels(space.labels, "strategy")))
        yield f"{{ {names} }}\n"
    yield "}\n"
    yield f"{_quote(comment)}\n\n"
    counts, player_count = problem.action_counts, len(problem.agents)
    table = tabulate(problem).rewards[0].reshape(*counts, player_count)
    # The first player's strategy varies fastest.
    for row in np.moveaxis(table, -1, 0).T.reshape(-1, player_count):
        yield f"{' '.join(repr(float(payoff) + 0.0) for payoff in row)}\n"


def _quote(text: str) -> str:
    """Return a text in quotation marks, with backslashes and quotation marks escaped."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'

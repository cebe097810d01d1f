"""Writing `.pomdp` and `.mdp` as Cassandra has them, `.dpomdp` as MADP, `.nfg` as Gambit."""

import re
from collections.abc import Iterator, Sequence
from itertools import product
from math import prod
from typing import NamedTuple

import numpy as np

from dmplay import belief
from dmplay.budget import Budget
from dmplay.core import Labels, Problem
from dmplay.errors import BadParameter
from dmplay.files.names import make_unique_labels
from dmplay.files.preamble import DECLARATION_KEYS, START_LIST_KEYS
from dmplay.files.statements import VALUE_KEYWORDS
from dmplay.rows import SparseMatrix
from dmplay.tabular import SparseTables, Tabular, tabulate

RESERVED_WORDS = {
    *DECLARATION_KEYS,
    *START_LIST_KEYS,
    *VALUE_KEYWORDS,
    *(word for words in VALUE_KEYWORDS.values() for word in words),
}
BYTES_PER_LINE = 200  # bytes of a line, while it is written
FILE_SUFFIXES = (".pomdp", ".mdp", ".dpomdp", ".nfg")


def iter_problem_lines(problem: Problem, suffix: str, description: str) -> Iterator[str]:
    """The lines of a file of this kind that holds a problem, and what is said of it.

    Raises BadParameter where such a file cannot.
    """
    if not isinstance(problem.state_count, int) or not all(problem.action_counts):
        raise BadParameter("a file lists states and actions, and this problem's are not finite")
    if suffix == ".nfg":
        return _iter_nfg_lines(problem, description)
    team = suffix == ".dpomdp"
    agents, one_state = (
        len(problem.agents),
        problem.state_count == 1 and not problem.partially_observable,
    )
    if agents > 1 and not team:
        fit = ".nfg" if one_state else ".dpomdp, if all are paid alike"
        raise BadParameter(f"{suffix} is for one agent, and here are {agents}: write a {fit}")
    if suffix == ".mdp" and problem.partially_observable:
        raise BadParameter(".mdp is for states that are seen, and here they are not: a .pomdp")
    return _iter_markov_lines(problem, description, team=team)


class _StatementStyle(NamedTuple):
    """How the lines of a format look."""

    value_separator: str  # between the last name and its number
    any_observation: str  # for all observations
    actions: Sequence[str]
    states: Sequence[str]
    observations: Sequence[str]

    def format_statement(self, kind: str, *fields: object) -> str:
        """One line `T:`, `O:` or `R:`."""
        *names, number = fields
        value = repr(float(number) + 0.0)  # type: ignore[arg-type]
        return f"{kind}: {' : '.join(map(str, names))}{self.value_separator} {value}\n"


def _iter_markov_lines(problem: Problem, description: str, *, team: bool) -> Iterator[str]:
    """The lines of a file of Cassandra's format, or of MADP's."""
    tables = _build_sparse_tables(problem)
    rewards, names = tables.rewards, [problem.format_state(s) for s in problem.enumerate_states()]
    if (rewards != rewards[:, :1]).any():
        fit = "write a .nfg" if len(names) == 1 else "a file of several states holds no such game"
        raise BadParameter(f"its agents are paid differently, and a .dpomdp pays all alike: {fit}")
    states = make_valid_names(names, "state")
    actions = [
        make_valid_names(make_unique_labels(known.labels, "action"), "action")
        for known in problem.actions
    ]
    seen = [make_valid_names(known, "observation") for known in _list_observation_labels(problem)]
    if team and not problem.partially_observable:
        seen = [states] * len(problem.agents)
        tables = tables._replace(observation=_identity_observations(problem, tables))
    numbers = len(tables.transition.columns) * (2 + len(seen)) + len(rewards)
    Budget("writing it", "try a smaller problem").check_memory(float(BYTES_PER_LINE) * numbers)
    yield from _iter_comment_lines(description)
    if team:
        yield f"agents: {len(problem.agents)}\n"
    yield f"discount: {float(problem.discount)!r}\nvalues: reward\n"
    yield f"states: {_format_names(states)}\n"
    if team:
        yield _format_start_line(problem, states, "\n")
        yield "actions:\n" + "".join(f"{' '.join(one)}\n" for one in actions)
        yield "observations:\n" + "".join(f"{_format_names(one)}\n" for one in seen)
    else:
        yield f"actions: {' '.join(actions[0])}\n"
        yield f"observations: {_format_names(seen[0])}\n" if seen else ""
        yield _format_start_line(problem, states, " ")
    every = " ".join("*" * len(seen)) if team else "*"
    line = _StatementStyle(
        " :" if team else "", every, _join_names(actions), states, _join_names(seen)
    )
    yield from _iter_probability_lines("T", line, tables.transition, len(states))
    if tables.observation:
        yield from _iter_probability_lines("O", line, tables.observation, len(states))
    yield from _iter_reward_lines(line, tables)


def _list_observation_labels(problem: Problem) -> list[Labels]:
    """What each agent observes; tables are of nothing else."""
    return [known for known in problem.observations if isinstance(known, Labels)]


def _build_sparse_tables(problem: Problem) -> SparseTables:
    """What can happen in a finite problem."""
    if (
        isinstance(problem, Tabular)
        and type(problem).legal_actions_mask is Problem.legal_actions_mask
    ):
        return problem.sparse_tables
    return tabulate(problem).sparse_tables


def _identity_observations(problem: Problem, tables: SparseTables) -> SparseMatrix:
    """What each agent sees where all see the state, as an observation of its own."""
    assert isinstance(problem.state_count, int)
    many, agents = problem.state_count, len(problem.agents)
    each = [np.arange(many)] * agents
    seen = np.ravel_multi_index(each, (many,) * agents)
    rows = prod(problem.action_counts) * many
    return SparseMatrix(np.arange(rows + 1), np.tile(seen, rows // many), np.ones(rows))


def _iter_probability_lines(
    kind: str, style: _StatementStyle, matrix: SparseMatrix, state_count: int
) -> Iterator[str]:
    """The numbers of T or of O that are not 0."""
    columns = style.states if kind == "T" else style.observations
    for row, column, value in zip(matrix.row_indices, matrix.columns, matrix.values, strict=True):
        if kind == "T":
            s, a = divmod(int(row), len(style.actions))
        else:
            a, s = divmod(int(row), state_count)
        yield style.format_statement(
            kind, style.actions[a], style.states[s], columns[column], value
        )


def _iter_reward_lines(style: _StatementStyle, tables: SparseTables) -> Iterator[str]:
    """The rewards that are not 0, by what they depend on."""
    flow, paid = tables.transition, tables.rewards[:, 0]
    many = len(style.actions)
    narrow = len(paid) == len(flow.row_starts) - 1
    each = 1 if narrow else len(paid) // len(flow.columns)
    row = np.arange(len(paid)) if narrow else flow.row_indices
    for place in np.flatnonzero(paid):
        s, a = divmod(int(row[place // each]), many)
        after = "*" if narrow else style.states[int(flow.columns[place // each])]
        seen = style.any_observation if each == 1 else style.observations[int(place % each)]
        yield style.format_statement(
            "R", style.actions[a], style.states[s], after, seen, paid[place]
        )


def _format_start_line(problem: Problem, states: Sequence[str], separator: str) -> str:
    """The line of the first state: one, any, or how likely each."""
    p = belief.initial_belief(problem)
    if (p == p[0]).all() and len(p) > 1:
        return f"start:{separator}uniform\n"
    if p.max() == 1 and not states[int(p.argmax())].isdecimal():
        return f"start: {states[int(p.argmax())]}\n"
    return f"start:{separator}{' '.join(repr(float(one)) for one in p)}\n"


def _iter_comment_lines(description: str) -> Iterator[str]:
    """What is said of a problem."""
    for line in description.strip().splitlines():
        yield f"# {line.strip()}".rstrip() + "\n"


def _format_names(names: Sequence[str]) -> str:
    """Names, or how many, where they are no more than numbers."""
    numbers = [*map(str, range(len(names)))]
    return str(len(names)) if list(names) == numbers else " ".join(names)


def _join_names(names_by_agent: Sequence[Sequence[str]]) -> list[str]:
    """The names of joint ones, row-major."""
    return [" ".join(one) for one in product(*names_by_agent)]


def make_valid_names(names: Sequence[str], kind: str) -> list[str]:
    """Names as the formats have them: a letter, then letters, digits, `-` and `_`; or numbers."""
    if list(names) == [*map(str, range(len(names)))]:
        return list(names)
    found: list[str] = []
    known: set[str] = set()
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9_-]+", "-", name.strip("()[]{} ")) or kind
        if not plain[0].isalpha() or plain in RESERVED_WORDS:
            plain = f"{kind[0]}{plain}" if plain not in RESERVED_WORDS else f"{kind}-{plain}"
        label, number = plain, 2
        while label in known:
            label, number = f"{plain}-{number}", number + 1
        found.append(label)
        known.add(label)
    return found


def _iter_nfg_lines(problem: Problem, description: str) -> Iterator[str]:
    """The lines of a game of one state."""
    if problem.state_count != 1 or problem.partially_observable:
        raise BadParameter("a .nfg is a game of one state that all see, and this is none")
    title, _, comment = description.strip().partition("\n\n")
    agents = " ".join(map(_quote, make_unique_labels(problem.agents, "player")))
    yield f"NFG 1 R {_quote(title)} {{ {agents} }}\n\n{{\n"
    for known in problem.actions:
        names = " ".join(map(_quote, make_unique_labels(known.labels, "strategy")))
        yield f"{{ {names} }}\n"
    yield "}\n"
    yield f"{_quote(comment)}\n\n"
    counts, agents_ = problem.action_counts, len(problem.agents)
    table = tabulate(problem).rewards[0].reshape(*counts, agents_)
    for row in np.moveaxis(table, -1, 0).T.reshape(-1, agents_):  # the first player's fastest
        yield f"{' '.join(repr(float(one) + 0.0) for one in row)}\n"


def _quote(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'

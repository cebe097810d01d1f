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
from dmplay.files.names import plainly
from dmplay.files.preamble import KEYS, LISTS
from dmplay.files.statements import WORDS
from dmplay.rows import Rows
from dmplay.tabular import Sparse, Tabular, tabulate

TAKEN = {*KEYS, *LISTS, *WORDS, *(word for words in WORDS.values() for word in words)}
LINE = 200  # bytes of a line, while it is written
SUFFIXES = (".pomdp", ".mdp", ".dpomdp", ".nfg")


def written(problem: Problem, suffix: str, about: str) -> Iterator[str]:
    """The lines of a file of this kind that holds a problem, and what is said of it.

    Raises BadParameter where such a file cannot.
    """
    if not isinstance(problem.states, int) or not all(problem.action_counts):
        raise BadParameter("a file lists states and actions, and this problem's are not finite")
    if suffix == ".nfg":
        return _normal_form(problem, about)
    team = suffix == ".dpomdp"
    agents, one_state = len(problem.agents), problem.states == 1 and not problem.hidden
    if agents > 1 and not team:
        fit = ".nfg" if one_state else ".dpomdp, if all are paid alike"
        raise BadParameter(f"{suffix} is for one agent, and here are {agents}: write a {fit}")
    if suffix == ".mdp" and problem.hidden:
        raise BadParameter(".mdp is for states that are seen, and here they are not: a .pomdp")
    return _markov(problem, about, team=team)


class _Line(NamedTuple):
    """How the lines of a format look."""

    comma: str  # between the last name and its number
    every: str  # for all observations
    actions: Sequence[str]
    states: Sequence[str]
    observations: Sequence[str]

    def said(self, kind: str, *told: object) -> str:
        """One line `T:`, `O:` or `R:`."""
        *names, number = told
        value = repr(float(number) + 0.0)  # type: ignore[arg-type]
        return f"{kind}: {' : '.join(map(str, names))}{self.comma} {value}\n"


def _markov(problem: Problem, about: str, *, team: bool) -> Iterator[str]:
    """The lines of a file of Cassandra's format, or of MADP's."""
    tables = _tables(problem)
    rewards, names = tables.rewards, [problem.notation(s) for s in problem.enumerated()]
    if (rewards != rewards[:, :1]).any():
        fit = "write a .nfg" if len(names) == 1 else "a file of several states holds no such game"
        raise BadParameter(f"its agents are paid differently, and a .dpomdp pays all alike: {fit}")
    states = allowed(names, "state")
    actions = [allowed(plainly(known.labels, "action"), "action") for known in problem.actions]
    seen = [allowed(known, "observation") for known in _labels(problem)]
    if team and not problem.hidden:
        seen = [states] * len(problem.agents)
        tables = tables._replace(observation=_sight(problem, tables))
    numbers = len(tables.transition.columns) * (2 + len(seen)) + len(rewards)
    Budget("writing it", "try a smaller problem").hold(float(LINE) * numbers)
    yield from _comment(about)
    if team:
        yield f"agents: {len(problem.agents)}\n"
    yield f"discount: {float(problem.discount)!r}\nvalues: reward\n"
    yield f"states: {_many(states)}\n"
    if team:
        yield _start(problem, states, "\n")
        yield "actions:\n" + "".join(f"{' '.join(one)}\n" for one in actions)
        yield "observations:\n" + "".join(f"{_many(one)}\n" for one in seen)
    else:
        yield f"actions: {' '.join(actions[0])}\n"
        yield f"observations: {_many(seen[0])}\n" if seen else ""
        yield _start(problem, states, " ")
    every = " ".join("*" * len(seen)) if team else "*"
    line = _Line(" :" if team else "", every, _joint(actions), states, _joint(seen))
    yield from _rows("T", line, tables.transition, len(states))
    if tables.observation:
        yield from _rows("O", line, tables.observation, len(states))
    yield from _rewards(line, tables)


def _labels(problem: Problem) -> list[Labels]:
    """What each agent observes; tables are of nothing else."""
    return [known for known in problem.observations if isinstance(known, Labels)]


def _tables(problem: Problem) -> Sparse:
    """What can happen in a finite problem."""
    if isinstance(problem, Tabular) and type(problem).legal is Problem.legal:
        return problem.support
    return tabulate(problem).sparse


def _sight(problem: Problem, tables: Sparse) -> Rows:
    """What each agent sees where all see the state, as an observation of its own."""
    assert isinstance(problem.states, int)
    many, agents = problem.states, len(problem.agents)
    each = [np.arange(many)] * agents
    seen = np.ravel_multi_index(each, (many,) * agents)
    rows = prod(problem.action_counts) * many
    return Rows(np.arange(rows + 1), np.tile(seen, rows // many), np.ones(rows))


def _rows(kind: str, line: _Line, rows: Rows, states: int) -> Iterator[str]:
    """The numbers of T or of O that are not 0."""
    columns = line.states if kind == "T" else line.observations
    for row, column, value in zip(rows.row, rows.columns, rows.values, strict=True):
        if kind == "T":
            s, a = divmod(int(row), len(line.actions))
        else:
            a, s = divmod(int(row), states)
        yield line.said(kind, line.actions[a], line.states[s], columns[column], value)


def _rewards(line: _Line, tables: Sparse) -> Iterator[str]:
    """The rewards that are not 0, by what they depend on."""
    flow, paid = tables.transition, tables.rewards[:, 0]
    many = len(line.actions)
    narrow = len(paid) == len(flow.starts) - 1
    each = 1 if narrow else len(paid) // len(flow.columns)
    row = np.arange(len(paid)) if narrow else flow.row
    for place in np.flatnonzero(paid):
        s, a = divmod(int(row[place // each]), many)
        after = "*" if narrow else line.states[int(flow.columns[place // each])]
        seen = line.every if each == 1 else line.observations[int(place % each)]
        yield line.said("R", line.actions[a], line.states[s], after, seen, paid[place])


def _start(problem: Problem, states: Sequence[str], blank: str) -> str:
    """The line of the first state: one, any, or how likely each."""
    p = belief.prior(problem)
    if (p == p[0]).all() and len(p) > 1:
        return f"start:{blank}uniform\n"
    if p.max() == 1 and not states[int(p.argmax())].isdecimal():
        return f"start: {states[int(p.argmax())]}\n"
    return f"start:{blank}{' '.join(repr(float(one)) for one in p)}\n"


def _comment(about: str) -> Iterator[str]:
    """What is said of a problem."""
    for line in about.strip().splitlines():
        yield f"# {line.strip()}".rstrip() + "\n"


def _many(names: Sequence[str]) -> str:
    """Names, or how many, where they are no more than numbers."""
    numbers = [*map(str, range(len(names)))]
    return str(len(names)) if list(names) == numbers else " ".join(names)


def _joint(each: Sequence[Sequence[str]]) -> list[str]:
    """The names of joint ones, row-major."""
    return [" ".join(one) for one in product(*each)]


def allowed(names: Sequence[str], what: str) -> list[str]:
    """Names as the formats have them: a letter, then letters, digits, `-` and `_`; or numbers."""
    if list(names) == [*map(str, range(len(names)))]:
        return list(names)
    found: list[str] = []
    known: set[str] = set()
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9_-]+", "-", name.strip("()[]{} ")) or what
        if not plain[0].isalpha() or plain in TAKEN:
            plain = f"{what[0]}{plain}" if plain not in TAKEN else f"{what}-{plain}"
        label, number = plain, 2
        while label in known:
            label, number = f"{plain}-{number}", number + 1
        found.append(label)
        known.add(label)
    return found


def _normal_form(problem: Problem, about: str) -> Iterator[str]:
    """The lines of a game of one state."""
    if problem.states != 1 or problem.hidden:
        raise BadParameter("a .nfg is a game of one state that all see, and this is none")
    title, _, comment = about.strip().partition("\n\n")
    agents = " ".join(map(_quoted, plainly(problem.agents, "player")))
    yield f"NFG 1 R {_quoted(title)} {{ {agents} }}\n\n{{\n"
    for known in problem.actions:
        names = " ".join(map(_quoted, plainly(known.labels, "strategy")))
        yield f"{{ {names} }}\n"
    yield "}\n"
    yield f"{_quoted(comment)}\n\n"
    counts, agents_ = problem.action_counts, len(problem.agents)
    table = tabulate(problem).rewards[0].reshape(*counts, agents_)
    for row in np.moveaxis(table, -1, 0).T.reshape(-1, agents_):  # the first player's fastest
        yield f"{' '.join(repr(float(one) + 0.0) for one in row)}\n"


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'

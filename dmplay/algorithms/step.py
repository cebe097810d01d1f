"""The steps of an algorithm that is watched, and the data that is drawn of each step."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.problem import Problem
from dmplay.core.session import Session


class StateValues(NamedTuple):
    """A value and an action for each of S states, for a map, a heat map or a table."""

    states: Array  # [S, ...]
    values: Reals  # [S]
    actions: Ints | None = None  # [S], the greedy action; -1 for none
    changed: Bools | None = None  # [S], whether this step changed the value or the action
    focus: int | None = None  # index of the state whose formula is shown


class Curve(NamedTuple):
    """One number for each step so far, such as the residual."""

    label: str
    numbers: Sequence[float]


class TreeNode(NamedTuple):
    """A node of a search tree: a state, the action that leads to it, and its statistics."""

    label: str  # the action or the outcome that leads here; the state for the root
    visits: int  # N(s, a) of an action; N(s), the sum over its actions, of a state
    value: float | None = None  # Q(s, a), the mean return of an action that was tried
    score: float | None = None  # UCB score at its parent; None if it was not tried
    is_on_path: bool = False  # whether the current simulation passes through it
    children: tuple["TreeNode", ...] = ()


class BeliefTable(NamedTuple):
    """A belief update as columns over S states, such as prior, likelihood and posterior."""

    state_labels: Sequence[str]
    columns: Sequence[tuple[str, Reals]]  # (name, [S])


class AlphaVectorSet(NamedTuple):
    """Alpha vectors over the beliefs of a problem with S states."""

    state_labels: Sequence[str]
    vectors: Reals  # [K, S]
    action_labels: Sequence[str]  # K names
    dominated: Bools  # [K], whether another vector is better at each belief
    belief: Reals | None = None  # [S], to be marked


class StrategyMixes(NamedTuple):
    """The mixed strategy of each agent, and its expected payoff."""

    agents: Sequence[str]
    action_labels: Sequence[Sequence[str]]
    mixes: Sequence[Reals]  # one [A] for each agent
    best_responses: Sequence[int] = ()  # one action for each agent


Picture = StateValues | Curve | TreeNode | BeliefTable | AlphaVectorSet | StrategyMixes


@dataclass(frozen=True)
class Step:
    """One step of an algorithm: a title, what it did, the formula with its numbers, pictures."""

    title: str  # for example "sweep 3" or "backup"
    sentences: tuple[str, ...]  # what this step did
    formula: str = ""  # for example "V(5,2) = 0 + 0.9 (0.70 x 6.1 + 0.30 x 4.0) = 4.8"
    pictures: tuple[Picture, ...] = ()  # the most important first


@dataclass(frozen=True)
class WatchRequest:
    """The problem and the seat to watch, and the game whose position or turns are used."""

    problem: Problem
    seat: int = 0
    session: Session | None = None  # None for the start of a game
    iterations: int | None = None  # sweeps, simulations or rounds; None for the usual number
    seed: int = 0  # of algorithms that use random numbers


class Algorithm(NamedTuple):
    """An algorithm that can be watched. Each module of this folder offers one as `ALGORITHM`."""

    name: str  # for example "value-iteration"
    description: str  # one line for people who do not know it
    source: str  # section and equation or algorithm of the book
    explain_misfit: Callable[[Problem], str]  # why it does not fit a problem; '' if it fits
    iterate_steps: Callable[[WatchRequest], Iterator[Step]]
    shows_actions: bool = True  # whether it shows good actions, which counts as a hint in a game

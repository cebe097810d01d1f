"""What agents earn where nothing is solved."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from dmplay.blocks import Workers
from dmplay.budget import between
from dmplay.chance import Ints, Reals
from dmplay.core import Policy, Problem
from dmplay.describe import brief, counted, several
from dmplay.errors import BadParameter
from dmplay.finding.agents import agent, usual
from dmplay.guests.history import Guest
from dmplay.policies.search import Search
from dmplay.rollouts import rollout
from dmplay.solutions.solution import Row, Solution

GAMES, SEED = 1000, 1
FEW = 10  # games of those who search in what another library plays, which is done turn by turn
TURNS = 20  # of a game that has no end of its own, and is played or planned
AT_A_TIME = 100
DONE = {"turns": "played or planned to a last turn", "work": "brought between two bounds"}


class Played(NamedTuple):
    """The returns of some games, and how long each was."""

    returns: Reals  # [E, n]
    turns: Ints  # [E]


@dataclass
class Wish:
    """How much is to be simulated, by how many; what is None is as each solution has it."""

    episodes: int | None = None
    turns: int | None = None
    workers: Workers | None = None
    work: float | None = None  # times the usual, between bounds
    met: set[str] = field(default_factory=set)  # what of these was heard

    def check(self, told: str) -> None:
        """Refuses a number of games, turns or workers where nothing heard it, and work likewise."""
        for name in ("episodes", "turns", "workers", "work"):
            if getattr(self, name) not in (None, "auto") and name not in self.met:
                done = DONE.get(name, "simulated")
                raise BadParameter(f"--{name}: nothing is {done} here; the method is {told}")


_wish: ContextVar[Wish | None] = ContextVar("wish", default=None)


@contextmanager
def wished(wish: Wish) -> Iterator[None]:
    """Has what is simulated meanwhile be simulated so."""
    before = _wish.set(wish)
    try:
        yield
    finally:
        _wish.reset(before)


def games(
    problem: Problem, policies: Sequence[Policy], *, episodes: int, turns: int | None
) -> Played:
    """Games of one seed, some at a time where one process plays them all."""
    wish = _wish.get() or Wish()
    wish.met |= {"episodes", "turns", "workers"}
    episodes, turns, workers = wish.episodes or episodes, wish.turns or turns, wish.workers or 1
    at_a_time = AT_A_TIME if workers == 1 else episodes
    parts = []
    for first in range(0, episodes, at_a_time):
        many = min(at_a_time, episodes - first)
        with between(first / episodes, (first + many) / episodes):
            played = rollout(
                problem, policies, episodes=many, seed=SEED, first=first, turns=turns,
                workers=workers,
            )  # fmt: skip
        parts.append(Played(played.returns, played.turns))
    returns, lengths = zip(*parts, strict=True)
    return Played(np.concatenate(returns), np.concatenate(lengths))


def planning(usual: int | None) -> int | None:
    """The turns of a game that is planned whole: as many as wished, or the usual ones; None
    for a game without end.
    """
    wish = _wish.get() or Wish()
    wish.met.add("turns")
    return wish.turns or usual


def working() -> float:
    """How much is done to bring a value between bounds, in times of the usual."""
    wish = _wish.get() or Wish()
    wish.met.add("work")
    return wish.work or 1.0


def mean(sample: Reals) -> dict[str, object]:
    """A mean with its standard error."""
    error = sample.std(ddof=1) / np.sqrt(len(sample))
    return {"mean return": float(sample.mean()), "standard error": float(error)}


def simulation(problem: Problem, agents: Sequence[str] = ()) -> Solution:
    """What these agents earn, or the usual ones."""
    names = agents or [usual(problem, seat) for seat in range(len(problem.agents))]
    policies = [agent(problem, seat, name) for seat, name in enumerate(names)]
    searching = any(isinstance(one, Search) for one in policies)
    slow = searching and isinstance(problem, Guest)
    ends = problem.states == math.inf and searching == slow  # as far as is known
    turns = problem.horizon or (None if ends else TURNS)
    played = games(problem, policies, episodes=FEW if slow else GAMES, turns=turns)
    rows: list[Row] = [
        {"seat": player, "agent": name} | mean(played.returns[:, seat])
        for seat, (player, name) in enumerate(zip(problem.agents, names, strict=True))
    ]
    many, long = counted(len(played.turns), "game"), several(brief(played.turns.mean()), "turn")
    told = f"{many} of seed {SEED}, {long} each"
    return Solution("simulation of its agents: no exact solution is known here", told, rows)

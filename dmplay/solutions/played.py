"""What agents earn where nothing is solved."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from dmplay.blocks import WorkerCount
from dmplay.budget import scale_progress
from dmplay.chance import Ints, Reals
from dmplay.core import Policy, Problem
from dmplay.describe import append_noun, format_count, format_score
from dmplay.errors import BadParameter
from dmplay.finding.agents import default_agent, load_agent
from dmplay.guests.history import ExternalProblem
from dmplay.policies.search import TreeSearch
from dmplay.rollouts import rollout
from dmplay.solutions.solution import Row, Solution

DEFAULT_EPISODES, SIMULATION_SEED = 1000, 1
EXTERNAL_SEARCH_EPISODES = (
    10  # games of those who search in what another library plays, which is done turn by turn
)
DEFAULT_TURNS = 20  # of a game that has no end of its own, and is played or planned
EPISODES_PER_BATCH = 100
OPTION_USES = {"turns": "played or planned to a last turn", "work": "brought between two bounds"}


class SimulatedReturns(NamedTuple):
    """The returns of some games, and how long each was."""

    returns: Reals  # [E, n]
    turns: Ints  # [E]


@dataclass
class SimulationOptions:
    """How much is to be simulated, by how many; what is None is as each solution has it."""

    episodes: int | None = None
    turns: int | None = None
    workers: WorkerCount | None = None
    work: float | None = None  # times the usual, between bounds
    used_options: set[str] = field(default_factory=set)  # what of these was heard

    def check_options_used(self, method_name: str) -> None:
        """Refuses a number of games, turns or workers where nothing heard it, and work likewise."""
        for name in ("episodes", "turns", "workers", "work"):
            if getattr(self, name) not in (None, "auto") and name not in self.used_options:
                done = OPTION_USES.get(name, "simulated")
                raise BadParameter(f"--{name}: nothing is {done} here; the method is {method_name}")


_options: ContextVar[SimulationOptions | None] = ContextVar("wish", default=None)


@contextmanager
def use_simulation_options(options: SimulationOptions) -> Iterator[None]:
    """Has what is simulated meanwhile be simulated so."""
    before = _options.set(options)
    try:
        yield
    finally:
        _options.reset(before)


def simulate_games(
    problem: Problem, policies: Sequence[Policy], *, episodes: int, turns: int | None
) -> SimulatedReturns:
    """Games of one seed, some at a time where one process plays them all."""
    wish = _options.get() or SimulationOptions()
    wish.used_options |= {"episodes", "turns", "workers"}
    episodes, turns, workers = wish.episodes or episodes, wish.turns or turns, wish.workers or 1
    at_a_time = EPISODES_PER_BATCH if workers == 1 else episodes
    parts = []
    for first in range(0, episodes, at_a_time):
        many = min(at_a_time, episodes - first)
        with scale_progress(first / episodes, (first + many) / episodes):
            played = rollout(
                problem, policies, episodes=many, seed=SIMULATION_SEED, first_episode=first, turn_limit=turns,
                workers=workers,
            )  # fmt: skip
        parts.append(SimulatedReturns(played.returns, played.turn_counts))
    returns, lengths = zip(*parts, strict=True)
    return SimulatedReturns(np.concatenate(returns), np.concatenate(lengths))


def resolve_horizon(default_turns: int | None) -> int | None:
    """The turns of a game that is planned whole: as many as wished, or the usual ones; None
    for a game without end.
    """
    wish = _options.get() or SimulationOptions()
    wish.used_options.add("turns")
    return wish.turns or default_turns


def resolve_work() -> float:
    """How much is done to bring a value between bounds, in times of the usual."""
    wish = _options.get() or SimulationOptions()
    wish.used_options.add("work")
    return wish.work or 1.0


def mean_with_error(sample: Reals) -> dict[str, object]:
    """A mean with its standard error."""
    error = sample.std(ddof=1) / np.sqrt(len(sample))
    return {"mean return": float(sample.mean()), "standard error": float(error)}


def solve_by_simulation(problem: Problem, agents: Sequence[str] = ()) -> Solution:
    """What these agents earn, or the usual ones."""
    names = agents or [default_agent(problem, seat) for seat in range(len(problem.agents))]
    policies = [load_agent(problem, seat, name) for seat, name in enumerate(names)]
    searching = any(isinstance(one, TreeSearch) for one in policies)
    slow = searching and isinstance(problem, ExternalProblem)
    ends = problem.state_count == math.inf and searching == slow  # as far as is known
    turns = problem.horizon or (None if ends else DEFAULT_TURNS)
    played = simulate_games(
        problem,
        policies,
        episodes=EXTERNAL_SEARCH_EPISODES if slow else DEFAULT_EPISODES,
        turns=turns,
    )
    rows: list[Row] = [
        {"seat": player, "agent": name} | mean_with_error(played.returns[:, seat])
        for seat, (player, name) in enumerate(zip(problem.agents, names, strict=True))
    ]
    many, long = (
        format_count(len(played.turns), "game"),
        append_noun(format_score(played.turns.mean()), "turn"),
    )
    told = f"{many} of seed {SIMULATION_SEED}, {long} each"
    return Solution("simulation of its agents: no exact solution is known here", told, rows)

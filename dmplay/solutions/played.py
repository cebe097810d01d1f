"""What agents earn where nothing is solved."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dmplay.budget import between
from dmplay.chance import Ints, Reals
from dmplay.core import Policy, Problem
from dmplay.finding.agents import adviser, agent, roster
from dmplay.rollouts import rollout
from dmplay.solutions.solution import Row, Solution

GAMES, SEED = 1000, 1
TURNS = 20  # of a game that may go on in the same few states for ever
AT_A_TIME = 100


class Played(NamedTuple):
    """The returns of some games, and how long each was."""

    returns: Reals  # [E, n]
    turns: Ints  # [E]


def games(
    problem: Problem, policies: Sequence[Policy], *, episodes: int, turns: int | None
) -> Played:
    """Games of one seed, some at a time."""
    parts = []
    for first in range(0, episodes, AT_A_TIME):
        many = min(AT_A_TIME, episodes - first)
        with between(first / episodes, (first + many) / episodes):
            played = rollout(
                problem, policies, episodes=many, seed=SEED, first=first, turns=turns
            )  # fmt: skip
        parts.append(Played(played.returns, played.turns))
    returns, lengths = zip(*parts, strict=True)
    return Played(np.concatenate(returns), np.concatenate(lengths))


def mean(sample: Reals) -> dict[str, object]:
    """A mean with its standard error."""
    error = sample.std(ddof=1) / np.sqrt(len(sample))
    return {"mean return": float(sample.mean()), "standard error": float(error)}


def _usual(problem: Problem, seat: int) -> str:
    """Who plays a seat unless somebody is named: whoever advises there, if anybody does."""
    known = roster(problem, seat)
    advises = known.quick or (known.adviser if adviser(problem, seat) else None)
    return advises or known.partner


def simulation(problem: Problem, agents: Sequence[str] = ()) -> Solution:
    """What these agents earn, or the usual ones."""
    names = agents or [_usual(problem, seat) for seat in range(len(problem.agents))]
    policies = [agent(problem, seat, name) for seat, name in enumerate(names)]
    turns = problem.horizon or (None if problem.states == math.inf else TURNS)
    played = games(problem, policies, episodes=GAMES, turns=turns)
    rows: list[Row] = [
        {"seat": player, "agent": name} | mean(played.returns[:, seat])
        for seat, (player, name) in enumerate(zip(problem.agents, names, strict=True))
    ]
    told = f"{GAMES} games of seed {SEED}, {played.turns.mean():.4g} turns each"
    return Solution("simulation of its agents: no exact solution is known here", told, rows)

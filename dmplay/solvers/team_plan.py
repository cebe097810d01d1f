"""The best joint plan of a team, or the best that is found, beside what no team exceeds."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dmplay.budget import Budget, between
from dmplay.chance import Reals
from dmplay.solvers import plan_graphs
from dmplay.solvers.plan_graphs import PlanGraph
from dmplay.solvers.pooled_beliefs import Pooled
from dmplay.solvers.team import CERTAIN, Plan, Team
from dmplay.solvers.team_search import Search

EXACT = 5e9  # work for the best plan of all
PART = 5e8  # for the best plan of some turns
MENDED = 3e9  # for making what is found better
DRAWN, WIDTH = 4, 3  # plans begun at random, and their nodes a turn


class TeamPlan(NamedTuple):
    """A joint plan, what it earns, and what bounds that."""

    plans: tuple[Plan, ...]
    value: float
    bound: float  # no joint plan has more
    pooled: float  # nor one planner who sees what all agents observe

    @property
    def exact(self) -> bool:
        """Whether no plan is better."""
        return self.value == self.bound


def planned(team: Team, turns: int) -> TeamPlan:
    """The best joint plan of so many turns; where that takes too long, the best that is found."""
    budget = _budget(EXACT)
    pooled = Pooled(team, turns, budget)
    with between(0.0, 0.6):
        plans, bound = Search(pooled, budget).run()
    if plans:
        return TeamPlan(plans, bound, bound, pooled.most)
    with between(0.6, 1.0):
        plans, value = _found(team, turns)
    return TeamPlan(plans, value, max(bound, value), pooled.most)


def _budget(work: float) -> Budget:
    return Budget("a joint plan", "try fewer turns, or search", work)


def _found(team: Team, turns: int) -> tuple[tuple[Plan, ...], float]:
    """The best plan that is found by making some better."""
    budget = _budget(MENDED)
    begun = [plan_graphs.drawn(team, turns, 1, 0), *_repeated(team, turns)]
    values = [plan_graphs.worth(team, one, budget) for one in begun]
    order = np.argsort(values)[::-1].tolist()
    best, value = begun[order[0]], values[order[0]]
    begun = [begun[k] for k in order]
    begun += [plan_graphs.drawn(team, turns, WIDTH, number) for number in range(DRAWN)]
    with budget.to_its_end():
        for one in begun:
            better = plan_graphs.improved(team, one, budget)
            earned = plan_graphs.worth(team, better, budget)
            best, value = (better, earned) if earned > value else (best, value)
    return best, value


def _repeated(team: Team, turns: int) -> Iterator[tuple[Plan, ...]]:
    """Plans made of the best ones of 1, 2, ... turns, at whose ends everybody forgets."""
    known: dict[tuple[bytes, int], tuple[Plan, ...] | None] = {}
    for length in range(1, turns):
        parts: list[tuple[Plan, ...]] = []
        start, left = team.start, turns
        while left:
            many = min(length, left)
            key = np.round(start, CERTAIN).tobytes(), many
            if key not in known:
                known[key] = _part(replace(team, start=start), many)
            plans = known[key]
            if plans is None:
                return
            parts.append(plans)
            start, left = _end(replace(team, start=start), plans), left - many
        yield tuple(sum(each, ()) for each in zip(*parts, strict=True))


def _part(team: Team, turns: int) -> tuple[Plan, ...] | None:
    """The best joint plan of some turns, None where it takes long."""
    budget, plans = _budget(PART), None
    with budget.to_its_end():
        plans = Search(Pooled(team, turns, budget), budget).run().plans
    return plans


def _end(team: Team, plans: tuple[Plan, ...]) -> Reals:
    """The distribution of the state after the last turn."""
    after = PlanGraph(team, plans, _budget(PART)).reached()[-1].sum(axis=0)
    return np.asarray(after / after.sum())

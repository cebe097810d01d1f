"""The league: what every agent earns, beside the best that is known.

`python -m tests.benchmarks league [--problem NAME ...] [--games N]`. A seat that is not measured is
held by the problem's usual partner; agents that take their time play fewer games, as is said.
"""

import json
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from dmplay import catalog
from dmplay.core import Policy, Problem
from dmplay.errors import DmplayError
from dmplay.names import problem_names
from dmplay.rollouts import rollout

GAMES = 1000
FEWER = {"expectimax": 10, "search": 5, "axelrod": 100, "chase-belief": 4}  # times fewer games
LONG = ("2048", "cart-pole", "mountain-car")  # games in which a search plays ten times fewer still
TURNS = {"mountain-car": 200}  # where nothing else ends a game soon
SEED = 1
TRUTH = Path(__file__).parent.parent / "truth"


class Known(NamedTuple):
    """The best return that is known for the game measured, and where it is from."""

    number: float
    source: str


class Standing(NamedTuple):
    """What one agent earned."""

    agent: str
    mean: float
    error: float
    games: int
    seconds: float


def truth(family: str, case: str, *keys: str | int) -> float:
    """A number of an exact case."""
    cases = json.loads((TRUTH / f"{family}.json").read_text())["cases"]
    found = next(one for one in cases if one["id"].startswith(case))["expect"]
    for key in keys:
        found = found[key]
    return float(found)


def fully_observed(problem: Problem) -> float:
    """The best mean return of one who saw the state, over the usual number of turns."""
    from dmplay.belief import prior
    from dmplay.solvers import value_iteration
    from dmplay.tabular import tabulate

    tables = tabulate(problem)
    if problem.horizon is None:
        values = value_iteration.optimal(tables, problem.discount).max(axis=1)
    else:
        values = value_iteration.sweep(tables, problem.discount, problem.horizon)
    return float(prior(problem) @ values)


def best_known(name: str, problem: Problem) -> Known | None:
    """The optimum, a bound on it, or the literature's number; None where none is at hand."""
    found: dict[str, Callable[[], Known]] = {
        "hexworld": lambda: Known(fully_observed(problem), "optimum, by policy iteration"),
        "2048": lambda: Known(387_222, "literature: nneonneo/2048-ai, where p_two is 0.9"),
        "cart-pole": lambda: Known(500, "optimum: all turns"),
        "simple-regulator": lambda: regulator(problem),
        "collision-avoidance": lambda: Known(
            truth("collision", "collision/grid_value_from_start/0000", "value"),
            "tests/truth: the optimum on the grid",
        ),
        "crying-baby": lambda: Known(fully_observed(problem), "bound: one who sees the state"),
        "machine-replacement": lambda: Known(
            truth("machine", "machine/value_grid/0014", "values", -1), "tests/truth: optimum"
        ),
        "catch": lambda: Known(fully_observed(problem), "bound: one who sees the state"),
        "prisoners-dilemma": lambda: Known(-10, "both silent in all ten rounds"),
        "rock-paper-scissors": lambda: Known(10, "every round won; the value is 0"),
    }
    return found[name]() if name in found else None


def regulator(problem: Problem) -> Known:
    """The optimum of the usual number of turns from the usual start."""
    from dmplay.problems.simple_regulator import SimpleRegulator
    from dmplay.solvers import linear_regulator

    assert isinstance(problem, SimpleRegulator)
    value = linear_regulator.finite(problem, linear_regulator.OPTIMAL, problem.horizon or 0)
    return Known(value.mean(0.3, 0.1), "optimum, by the Riccati recursion (F.5)")


def standing(name: str, problem: Problem, seat: int, agent: str, games: int) -> Standing | None:
    """What an agent earns in a seat; None where it does not fit."""
    try:
        seated: list[Policy] = [
            catalog.agent(problem, i, agent if i == seat else catalog.partner(problem, i))
            for i in range(len(problem.agents))
        ]
    except DmplayError:
        return None
    fewer = FEWER.get(agent, 1) * (10 if agent == "search" and name in LONG else 1)
    many = max(10, games // fewer)
    turns = TURNS.get(name, problem.horizon)
    began = time.perf_counter()
    found = rollout(problem, seated, episodes=many, turns=turns, seed=SEED).returns[:, seat]
    spent = time.perf_counter() - began
    return Standing(agent, float(found.mean()), float(found.std() / math.sqrt(many)), many, spent)


def report(games: int, problems: list[str], agents: list[str]) -> None:
    """Prints the table of each problem, the best agent first."""
    for name in problems or list(problem_names()):
        problem = catalog.load(name)
        known = best_known(name, problem)
        seats = range(len(problem.agents)) if name == "predator-prey" else range(1)
        for seat in seats:
            print(f"\n{name}, {problem.agents[seat]}")
            if known:
                print(f"  {'best known':<24}{known.number:>12.4g}{'':>10}  {known.source}")
            rows = [
                standing(name, problem, seat, agent, games)
                for agent in catalog.agents(problem)
                if not agents or agent in agents
            ]
            for one in sorted(filter(None, rows), key=lambda one: -one.mean):
                print(
                    f"  {one.agent:<24}{one.mean:>12.4g}{'+-':>4}{one.error:>6.2g}"
                    f"  {one.games} games, {one.seconds:.1f} s",
                    flush=True,
                )

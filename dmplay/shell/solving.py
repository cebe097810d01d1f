"""What a problem's solution looks like: values and best actions, and how they were found."""

import hashlib
import os
from collections.abc import Callable, Mapping
from json import dumps, loads
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dmplay import __version__, belief, catalog
from dmplay.chance import Bools, Reals
from dmplay.core import Labels, Problem
from dmplay.problems._matrix_game import MatrixGame
from dmplay.problems.collision_avoidance import CollisionAvoidance
from dmplay.problems.simple_regulator import SimpleRegulator
from dmplay.rollouts import rollout
from dmplay.solvers import (
    alpha_vectors,
    collision_grid,
    linear_regulator,
    matrix_game,
    sparse,
    value_iteration,
)
from dmplay.solvers.alpha_vectors import Stage
from dmplay.solvers.value_iteration import best
from dmplay.tabular import joint_actions, tabulate

Row = dict[str, object]
GAMES = 1000  # of the simulation where nothing is solved
SWEEPS = 10_000  # of value iteration at most
STILL = 1e-10  # a change that ends it
DRAWN = 3  # states of hidden problems whose every vector is worth listing
TURNS = 20  # played by default where a problem has no end of its own


class Solution(NamedTuple):
    """A method, what it came to, and a row a state, vector or equilibrium."""

    method: str
    result: str
    rows: list[Row]


def solve(problem: Problem) -> Solution:
    """The solution of a problem by the method that fits it; a simulation where none does."""
    return _method(problem)(problem)


def _method(problem: Problem) -> Callable[[Any], Solution]:
    hidden = problem.observations is not None
    small = isinstance(problem.states, int) and len(problem.agents) == 1
    methods: list[tuple[bool, Callable[[Any], Solution]]] = [
        (isinstance(problem, MatrixGame), _equilibria),
        (isinstance(problem, CollisionAvoidance), _encounter),
        (isinstance(problem, SimpleRegulator), _regulator),
        (small and not hidden, _sweeps),
        (small and len(problem.enumerated()) <= DRAWN, _vectors),
        (small, _first),
        (isinstance(problem.states, int) and problem.shared_reward, _planner),
    ]
    return next((method for fits, method in methods if fits), _simulation)


def _names(problem: Problem, able: Bools) -> str:
    labels = problem.actions[0]
    assert isinstance(labels, Labels)
    return " ".join(labels[a] for a in np.flatnonzero(able))


def _sweeps(problem: Problem) -> Solution:
    tables = tabulate(problem)
    values = np.zeros(len(tables.transition))
    sweeps, change = 0, np.inf
    while change >= STILL and sweeps < SWEEPS:
        after = value_iteration.action_values(tables, problem.discount, values).max(axis=1)
        change = float(abs(after - values).max())
        values = after
        sweeps += 1
    q = value_iteration.optimal(tables, problem.discount)
    off = float(abs(q.max(axis=1) - values).max())
    rows: list[Row] = [
        {
            "state": problem.notation(s),
            "value": float(row.max()),
            "best": _names(problem, best(row)),
        }
        for s, row in zip(problem.enumerated(), q, strict=True)
    ]
    told = f"change below {STILL:g} after {sweeps} sweeps; {off:.1g} from policy iteration"
    return Solution("value iteration", told, rows)


def _vectors(problem: Problem) -> Solution:
    tables = tabulate(problem)
    start = belief.prior(problem)
    if problem.discount < 1.0 and problem.horizon == TURNS:
        stage: Stage = alpha_vectors.infinite(tables, problem.discount)
        method = "alpha vectors, without end"
    else:
        stage = alpha_vectors.stages(tables, problem.discount, problem.horizon or TURNS)[-1]
        method = f"alpha vectors, {problem.horizon or TURNS} turns"
    names = [problem.notation(s) for s in problem.enumerated()]
    rows: list[Row] = [
        {f"at {name}": float(value) for name, value in zip(names, vector, strict=True)}
        | {"first": _names(problem, able)}
        for vector, able in zip(stage.vectors, stage.actions, strict=True)
    ]
    value = float((stage.vectors @ start).max())
    return Solution(method, f"{len(rows)} vectors; value {value:.6g} at the start", rows)


def _first(problem: Problem) -> Solution:
    """The value of each first action, by the agent that knows the optimum."""
    name = catalog.hint(problem, 0)
    agent = catalog.agent(problem, 0, name or "random")
    q = agent.values(agent.begin(np.full(1, -1)))
    if q is None:
        return _simulation(problem)
    rows: list[Row] = [
        {"first": problem.action_name(0, a), "value": float(value), "best": "*" if able else ""}
        for a, (value, able) in enumerate(zip(q[0], best(q[0]), strict=True))
    ]
    told = f"value {q.max():.6g} at the start, {problem.horizon} turns to go"
    return Solution(f"the agent {name}", told, rows)


def _equilibria(problem: MatrixGame) -> Solution:
    found = matrix_game.nash(problem.payoffs)
    rows: list[Row] = []
    for profile in found:
        row: Row = {}
        pay = matrix_game.utilities(problem.payoffs, profile)
        for seat, (agent, mix) in enumerate(zip(problem.agents, profile, strict=True)):
            row[agent] = _mix(problem, seat, mix)
            row[f"pays {agent}"] = float(pay[seat])
        rows.append(row)
    return Solution("support enumeration", f"{len(rows)} Nash equilibria of one round", rows)


def _mix(problem: Problem, seat: int, mix: Reals) -> str:
    chosen = np.flatnonzero(mix > value_iteration.SLACK)
    return " ".join(
        problem.action_name(seat, float(a)) + (f" {mix[a]:.4g}" if mix[a] < 1 - 1e-9 else "")
        for a in chosen
    )


def _encounter(problem: Problem) -> Solution:
    q = collision_grid.optimal(problem)
    rows: list[Row] = []
    for time in (40, 30, 20, 10, 5):
        for h in (0.0, 100.0):
            state = np.array([[h, 0.0, 0.0, float(time)]])
            values = collision_grid.interpolate(q[time], state)[0]
            rows.append(
                {"seconds": time, "height": h, "value": float(values.max())}
                | {"best": _names(problem, best(values))}
            )
    told = "21 heights x 21 rates x 3 advisories x 41 seconds; level flight, no advisory before"
    return Solution("backward induction on a grid", told, rows)


def _regulator(problem: SimpleRegulator) -> Solution:
    turns = problem.horizon
    value = (
        linear_regulator.infinite(problem, linear_regulator.OPTIMAL)
        if problem.discount < 1.0
        else linear_regulator.finite(problem, linear_regulator.OPTIMAL, turns)
    )
    rows: list[Row] = [
        {"state": s, "value": value.at(s), "best": -s} for s in (-1.0, -0.3, 0.0, 0.3, 1.0)
    ]
    span = "without end" if problem.discount < 1.0 else f"{turns} turns"
    told = f"U(s) = -({value.curvature:.6g} s^2 + {value.constant:.6g}), a = -s"
    return Solution(f"closed form, {span}", told, rows)


def _planner(problem: Problem) -> Solution:
    q = sparse.optimal(sparse.listed(problem), problem.discount)
    states, joint = problem.enumerated(), joint_actions(problem)
    values = q.max(axis=1)
    order = np.argsort(-values, kind="stable")
    rows: list[Row] = []
    for s in [*order[:5], *order[-5:]]:
        acts = [
            " ".join(problem.action_name(seat, a) for seat, a in enumerate(joint[j]))
            for j in np.flatnonzero(best(q[s]))
        ]
        shown = acts if len(acts) <= 3 else [*acts[:3], f"and {len(acts) - 3} more"]
        rows.append({"state": problem.notation(states[s]), "value": float(values[s])}
                    | {"best": ", ".join(shown)})  # fmt: skip
    told = f"mean {values.mean():.6g} over {len(values)} states; the five best and worst below"
    return Solution("policy iteration of one planner who sees all, an upper bound", told, rows)


def _simulation(problem: Problem) -> Solution:
    rows: list[Row] = []
    seats = range(len(problem.agents))
    names = [catalog.quick(problem, seat) for seat in seats]
    policies = [catalog.agent(problem, seat, name) for seat, name in enumerate(names)]
    played = rollout(problem, policies, episodes=GAMES, seed=1, turns=problem.horizon)
    for seat, (agent, name) in enumerate(zip(problem.agents, names, strict=True)):
        sample = played.returns[:, seat]
        error = sample.std(ddof=1) / np.sqrt(len(sample))
        rows.append({"seat": agent, "agent": name, "mean return": float(sample.mean())}
                    | {"standard error": float(error)})  # fmt: skip
    told = f"{GAMES} games of seed 1, {played.turns.mean():.4g} turns each"
    return Solution("simulation of its agents: no exact solution is known here", told, rows)


def cached(name: str, parameters: Mapping[str, object]) -> Solution:
    """The solution, kept in the user's cache folder by name, parameters and version."""
    loaded = catalog.resolve(name, parameters)
    key = dumps([__version__, loaded.name, loaded.parameters], sort_keys=True, default=str)
    root = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    file = Path(root) / "dmplay" / "solve" / f"{hashlib.sha256(key.encode()).hexdigest()[:16]}.json"
    try:
        return Solution(**loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        pass
    found = solve(loaded.problem)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(dumps(found._asdict()), encoding="utf-8")
    except OSError:
        pass  # a solution that is not kept is found again
    return found


def told(name: str, found: Solution) -> str:
    """The solution for people: method, result and a table."""
    columns = list(found.rows[0]) if found.rows else []
    cells = [columns] + [[_cell(row[column]) for column in columns] for row in found.rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in cells
    ]
    return "\n".join([f"{name}: {found.method}", found.result, "", *lines])


def _cell(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def print_solution(name: str, parameters: Mapping[str, object], *, json: bool) -> None:
    """Prints the solution of a problem."""
    found = cached(name, parameters)
    print(dumps({"problem": name} | found._asdict()) if json else told(name, found))

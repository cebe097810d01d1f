"""Solutions of problems of one agent whose finite state is hidden."""

import numpy as np

from dmplay import belief
from dmplay.core import Problem
from dmplay.errors import BadPolicy, TooMuch
from dmplay.finding import agents
from dmplay.policies.valued import Planner
from dmplay.solutions.played import simulation
from dmplay.solutions.solution import Row, Solution, names
from dmplay.solvers import alpha_vectors
from dmplay.solvers.alpha_vectors import Stage
from dmplay.solvers.value_iteration import best
from dmplay.tabular import tabulate

DRAWN = 3  # states whose every vector is worth listing
TURNS = 20  # played by default where a problem has no end of its own


def vectors(problem: Problem) -> Solution:
    """The alpha vectors of a game without end or, where that has no value, of some turns."""
    tables = tabulate(problem)
    start = belief.prior(problem)
    found = agents.adviser(problem, 0, problem.horizon)
    counts = found is not None and found[1].whole_game  # a game of so many turns
    if problem.discount < 1.0 and problem.horizon in (None, TURNS) and not counts:
        stage: Stage = alpha_vectors.infinite(tables, problem.discount)
        method = "alpha vectors, without end"
    else:
        stage = alpha_vectors.stages(tables, problem.discount, problem.horizon or TURNS)[-1]
        method = f"alpha vectors, {problem.horizon or TURNS} turns"
    states = [problem.notation(s) for s in problem.enumerated()]
    rows: list[Row] = [
        {f"at {name}": float(value) for name, value in zip(states, vector, strict=True)}
        | {"first": names(problem, able)}
        for vector, able in zip(stage.vectors, stage.actions, strict=True)
    ]
    value = float((stage.vectors @ start).max())
    more = f", at most {stage.gap:.1g} more" if stage.gap else ""
    return Solution(method, f"{len(rows)} vectors; value {value:.6g} at the start{more}", rows)


def first(problem: Problem) -> Solution:
    """The value of each first action, by the agent that knows the optimum."""
    found = agents.adviser(problem, 0, problem.horizon)
    if found is None:
        return simulation(problem)
    name, agent = found
    try:
        q = agent.values(agent.begin(np.full(1, -1)))
    except (BadPolicy, TooMuch):  # more plans than can be listed
        return simulation(problem, ["search"])
    if q is None:
        return simulation(problem)
    rows: list[Row] = [
        {"first": problem.action_name(0, a), "value": float(value), "best": "*" if able else ""}
        for a, (value, able) in enumerate(zip(q[0], best(q[0]), strict=True))
    ]
    ahead = f", {agent.horizon} turns to go" if isinstance(agent, Planner) else ""
    told = f"value {q.max():.6g} at the start{ahead}"
    return Solution(f"the agent {name}", told, rows)

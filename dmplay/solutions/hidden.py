"""Solutions of problems of one agent whose finite state is hidden."""

from dataclasses import replace

import numpy as np

from dmplay import belief
from dmplay.budget import within
from dmplay.chance import Ints
from dmplay.core import Problem
from dmplay.describe import at_most, counted
from dmplay.errors import BadParameter, BadPolicy, TooMuch
from dmplay.finding import agents
from dmplay.policies.point_based import PointBased, closer, told
from dmplay.policies.valued import LIGHT, LONGEST, Planner
from dmplay.solutions.played import TURNS, planning, simulation, working
from dmplay.solutions.solution import Row, Solution, names
from dmplay.solvers import alpha_vectors
from dmplay.solvers.alpha_vectors import Stage
from dmplay.solvers.value_iteration import best
from dmplay.tabular import tabulate

DRAWN = 3  # states whose every vector is worth listing
LISTED = 4e9  # operations that listing them may take
LONG = 100  # turns of a game: of longer ones a thousand are not searched


def vectors(problem: Problem) -> Solution:
    """The alpha vectors of a game without end or, where that has no value, of some turns.

    Where there are too many, the bounds that are known without listing them. So where states have
    actions of their own: a vector does not tell which of them it is for.
    """
    legal = problem.legal(problem.enumerated())
    if legal is not None and not legal.all():
        return first(problem)
    try:
        with within(LISTED):
            return _vectors(problem)
    except (BadParameter, TooMuch):
        return first(problem)


def _vectors(problem: Problem) -> Solution:
    tables = tabulate(problem)
    start = belief.prior(problem)
    turns = planning(problem.horizon)
    found = agents.adviser(problem, 0, turns)
    counts = found is not None and found[1].whole_game  # a game of so many turns
    usual = turns == TURNS == problem.horizon and not counts
    far = turns is not None and problem.discount**turns < LIGHT
    if problem.discount < 1.0 and (turns is None or usual or far):
        stage: Stage = alpha_vectors.infinite(tables, problem.discount)
        method = "alpha vectors, without end"
    else:
        stage = alpha_vectors.stages(tables, problem.discount, turns or TURNS)[-1]
        method = f"alpha vectors, {counted(turns or TURNS, 'turn')}"
    states = [problem.notation(s) for s in problem.enumerated()]
    rows: list[Row] = [
        {f"at {name}": float(value) for name, value in zip(states, vector, strict=True)}
        | {"first": names(problem, able)}
        for vector, able in zip(stage.vectors, stage.actions, strict=True)
    ]
    value = float((stage.vectors @ start).max())
    more = f", at most {at_most(stage.gap)} more" if stage.gap else ""
    return Solution(
        method, f"{counted(len(rows), 'vector')}; value {value:.6g} at the start{more}", rows
    )


def first(problem: Problem) -> Solution:
    """The value of each first action, by the agent that knows the optimum."""
    turns = planning(problem.horizon) or (TURNS if problem.discount >= 1.0 else None)
    found = agents.adviser(problem, 0, turns)
    if found is None:
        return simulation(problem)
    name, agent = found
    try:
        if isinstance(agent, PointBased):
            return _bounded(agent, turns)
        q = agent.values(agent.begin(np.full(1, -1)))
    except (BadPolicy, TooMuch):  # more plans than can be listed
        if turns is not None and turns > LONG:
            raise
        return simulation(problem, ["search"])
    if q is None:
        return simulation(problem)
    may = _legal(problem)
    rows: list[Row] = [
        {"first": problem.action_name(0, a), "value": float(value), "best": "*" if able else ""}
        for a, value, able in zip(may.tolist(), q[0, may], best(q[0, may]), strict=True)
    ]
    ahead = f", {counted(agent.horizon, 'turn')} to go" if isinstance(agent, Planner) else ""
    told = f"value {q[0, may].max():.6g} at the start{ahead}"
    return Solution(f"the agent {name}", told, rows)


def _legal(problem: Problem) -> Ints:
    """The actions that a state in which games start allows; all where each is over."""
    legal = problem.legal(problem.enumerated()[belief.prior(problem) > 0])
    some = np.ones(problem.action_counts[0], bool) if legal is None else legal[:, 0].any(axis=0)
    return np.flatnonzero(some if some.any() else ~some)


def _bounded(agent: PointBased, turns: int | None) -> Solution:
    """Two bounds of the value of each first action."""
    endless = agent.problem.discount < 1.0  # else a game of some turns is all there is
    if agent.turns is None and turns is not None:
        if not endless and turns > LONGEST:
            needed = f"got {turns}, expected at most {LONGEST} where nothing is discounted"
            raise BadParameter(f"--turns: {needed}")
        if not endless or turns <= LONG:  # however little the end counts, as so many are asked for
            agent = replace(agent, horizon=turns)
    agent = replace(agent, work=working())
    problem, may = agent.problem, _legal(agent.problem)
    try:
        found = agent.bounds
    except TooMuch:  # for so many turns
        if not endless:
            raise
        agent = replace(agent, horizon=0)
        found = agent.bounds
    each = zip(may.tolist(), found.lower[may], found.upper[may], strict=True)
    rows: list[Row] = [
        {
            "first": problem.action_name(0, a),
            "lower bound": float(low),
            "upper bound": float(high),
            "best": "*" if able else "",
        }
        for (a, low, high), able in zip(each, best(found.lower[may]), strict=True)
    ]
    span = counted(agent.turns, "turn") if agent.turns else "without end"
    more = closer(found, agent.work, "--work ")
    known = f"{told(found)}; {counted(found.beliefs, 'belief')}{more}"
    return Solution(f"point-based, {span}", known, rows)

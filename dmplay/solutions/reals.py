"""Solutions of problems whose state is made of real numbers."""

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Reals
from dmplay.core import Problem
from dmplay.describe import counted
from dmplay.policies.cart_pole import Regulate
from dmplay.policies.mountain_car import GRID, swept
from dmplay.problems.cart_pole import CartPole
from dmplay.problems.simple_regulator import SimpleRegulator
from dmplay.solutions.solution import Row, Solution, names
from dmplay.solvers import collision_grid, grid_iteration, linear_regulator
from dmplay.solvers.value_iteration import best, greedy

STARTS = (-0.5, -1.2, -0.9, 0.0, 0.3)  # of the car, at rest
LONGEST = 1000  # turns it is driven


def encounter(problem: Problem) -> Solution:
    """Values of level flight at some times and heights."""
    q = collision_grid.optimal(problem)
    rows: list[Row] = []
    for time in (40, 30, 20, 10, 5):
        for h in (0.0, 100.0):
            state = np.array([[h, 0.0, 0.0, float(time)]])
            values = collision_grid.interpolate(q, time, state)[0]
            rows.append(
                {"seconds": time, "height": h, "value": float(values.max())}
                | {"best": names(problem, best(values))}
            )
    told = "21 heights x 21 rates x 3 advisories x 41 seconds; level flight, no advisory before"
    return Solution("backward induction on a grid", told, rows)


def regulator(problem: SimpleRegulator) -> Solution:
    """The value function in closed form."""
    turns = problem.horizon
    value = (
        linear_regulator.infinite(problem, linear_regulator.OPTIMAL)
        if problem.discount < 1.0
        else linear_regulator.finite(problem, linear_regulator.OPTIMAL, turns)
    )
    rows: list[Row] = [
        {"state": s, "value": value.at(s), "best": 0.0 - s} for s in (-1.0, -0.3, 0.0, 0.3, 1.0)
    ]
    span = "without end" if problem.discount < 1.0 else counted(turns, "turn")
    told = f"U(s) = -({value.curvature:.6g} s^2 + {value.constant:.6g}), a = -s"
    return Solution(f"closed form, {span}", told, rows)


def balance(problem: CartPole) -> Solution:
    """The gain of the pole's regulator."""
    found = Regulate(problem, 0).regulator
    rows: list[Row] = [
        {"of": name, "weight": float(weight)}
        for name, weight in zip(("x", "v", "theta", "omega"), found.gain, strict=True)
    ]
    told = (
        f"residual {found.residual:.1g} after {counted(found.sweeps, 'sweep')}; a turn leaves "
        f"at most {found.radius:.4g} of a deviation in the end; right where the weighted sum "
        "is below 0"
    )
    return Solution("Riccati equation of the cart and pole linearised at rest", told, rows)


def drive(problem: Problem) -> Solution:
    """Turns to go by value iteration, and those that its policy takes."""
    found = swept(problem, GRID)
    starts = np.array([[x, 0.0] for x in STARTS])
    q = grid_iteration.action_values(problem, GRID, found.values, starts)
    rows: list[Row] = [
        {
            "start": problem.notation(s),
            "value": float(row.max()),
            "best": names(problem, best(row)),
            "turns driven": turns,
        }
        for s, row, turns in zip(starts, q, driven(problem, found.values, starts), strict=True)
    ]
    told = (
        f"{GRID.points[0]} x {GRID.points[1]} points; change {found.change:.1g} after "
        f"{counted(found.sweeps, 'sweep')}"
    )
    return Solution("value iteration on an interpolated grid", told, rows)


def driven(problem: Problem, values: Reals, s: Reals) -> list[int | None]:
    """The turns that the best actions by these values take from each state, None if too many."""
    turns, budget = np.zeros(len(s), np.int64), Budget("a drive", "search needs none")
    while (going := ~problem.terminal(s)).any() and turns.max() < LONGEST:
        budget.spend(10 * ROUND, int(turns.max()) / LONGEST)
        a = greedy(grid_iteration.action_values(problem, GRID, values, s))
        s = problem.step(s, a[:, None], np.zeros((len(s), 0))).state
        turns += going
    return [None if far else many for many, far in zip(turns.tolist(), going, strict=True)]

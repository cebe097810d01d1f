"""Measure joint plans: value, upper bound, published optimum and processor seconds."""

import time
from collections.abc import Callable

from dmplay.solvers.decpomdp.dec_pomdp_model import DecPomdp
from dmplay.solvers.decpomdp.joint_plan_search import find_joint_plan
from tests.support.literature_dec_pomdps import (
    format_broadcast,
    format_dectiger,
    format_meeting,
    format_recycling,
    parse_team_file,
)

PUBLISHED_VALUES = {  # undiscounted optima from masplan.org/optimal_values
    "Dec-Tiger": {2: -4.0, 3: 5.190812, 4: 4.802755, 5: 7.026451, 6: 10.381625, 7: 9.9935},
    "broadcast channel": {2: 2.0, 3: 2.99, 4: 3.89, 25: 22.881523, 50: 45.501604},
    "recycling robots": {2: 7.0, 3: 10.660125, 4: 13.38, 10: 31.863889, 15: 47.248521},
    "meeting, 2 x 2": {2: 0.91, 3: 1.550444, 4: 2.241577, 5: 2.970496},
    "meeting, 3 x 3": {3: 0.1332, 4: 0.4329},
}
SOURCE_FUNCTIONS: dict[str, Callable[[], str]] = {
    "Dec-Tiger": format_dectiger,
    "broadcast channel": format_broadcast,
    "recycling robots": format_recycling,
    "meeting, 2 x 2": format_meeting,
    "meeting, 3 x 3": lambda: format_meeting(3),
}


def report(runs: int) -> None:
    """Print a line for each problem and turn limit; use the first `runs` turn limits of each
    problem.
    """
    print(f"{'team':<20}{'turns':>6}{'value':>12}{'at most':>12}{'in print':>12}{'seconds':>9}")
    for name, published in PUBLISHED_VALUES.items():
        team = DecPomdp.from_problem(parse_team_file(SOURCE_FUNCTIONS[name]()))
        for turns, optimum in list(published.items())[:runs]:
            start_time = time.process_time()
            plan = find_joint_plan(team, turns)
            seconds = time.process_time() - start_time
            print(
                f"{name:<20}{turns:>6}{plan.value:>12.6f}{plan.upper_bound:>12.6f}"
                f"{optimum:>12.6f}{seconds:>9.2f}",
                flush=True,
            )

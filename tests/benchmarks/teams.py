"""Joint plans: what they earn, what bounds it, what is in print, and seconds of the processor."""

import time
from collections.abc import Callable

from dmplay.solvers.team import DecPomdp
from dmplay.solvers.team_plan import find_joint_plan
from tests.support.teams import broadcast, dectiger, meeting, read, recycling

PRINTED = {  # optima, undiscounted: masplan.org/optimal_values
    "Dec-Tiger": {2: -4.0, 3: 5.190812, 4: 4.802755, 5: 7.026451, 6: 10.381625, 7: 9.9935},
    "broadcast channel": {2: 2.0, 3: 2.99, 4: 3.89, 25: 22.881523, 50: 45.501604},
    "recycling robots": {2: 7.0, 3: 10.660125, 4: 13.38, 10: 31.863889, 15: 47.248521},
    "meeting, 2 x 2": {2: 0.91, 3: 1.550444, 4: 2.241577, 5: 2.970496},
    "meeting, 3 x 3": {3: 0.1332, 4: 0.4329},
}
MADE: dict[str, Callable[[], str]] = {
    "Dec-Tiger": dectiger,
    "broadcast channel": broadcast,
    "recycling robots": recycling,
    "meeting, 2 x 2": meeting,
    "meeting, 3 x 3": lambda: meeting(3),
}


def report(runs: int) -> None:
    """Prints a line for each problem and number of turns; the first `runs` numbers of turns."""
    print(f"{'team':<20}{'turns':>6}{'value':>12}{'at most':>12}{'in print':>12}{'seconds':>9}")
    for name, printed in PRINTED.items():
        team = DecPomdp.from_problem(read(MADE[name]()))
        for turns, optimum in list(printed.items())[:runs]:
            since = time.process_time()
            found = find_joint_plan(team, turns)
            spent = time.process_time() - since
            print(
                f"{name:<20}{turns:>6}{found.value:>12.6f}{found.upper_bound:>12.6f}"
                f"{optimum:>12.6f}{spent:>9.2f}",
                flush=True,
            )

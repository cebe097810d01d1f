"""Tell an aircraft when to climb or descend to miss another one; each change of advice costs.

Source: appendix F.6; CollisionAvoidance.jl. Decisions: The middle branch of F.9 is used as printed:
a / dt. (`--set repaired=true` uses (a - rate) / dt, which levels off at the advised rate.) A
collision is a distance of less than 50 m; 50 m exactly is none. The last action is taken at time 0.
The game starts 40 s before time 0, without an advisory; the height h is uniform from -200 to 200 m,
and its rate from -10 to 10 m/s.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.core.arrays import Array, Bools
from dmplay.core.batch_columns import (
    clip,
    keep_states_where,
    select,
    split_columns,
    stack_columns,
    unwrap_single_row,
)
from dmplay.core.chance import Categorical, Chance, Uniform
from dmplay.core.parameters import parameter
from dmplay.core.problem import ContinuousStates, Outcome
from dmplay.core.spaces import Labels
from dmplay.core.state_grid import GridAxis, StateGrid
from dmplay.problems._shared.real_state import RealStateProblem

ADVISED_RATES = np.array([-5.0, 0.0, 5.0])  # m/s, by action
GUST_ACCELERATIONS = np.array([-2.0, 0.0, 2.0])  # m/s^2
GUST_CHANCE = Categorical.from_probabilities(np.array([[0.25, 0.5, 0.25]]))
MAX_ACCELERATION = 1.0  # m/s^2, by which the aircraft can change its vertical rate
COLLISION_DISTANCE = 50.0  # m
COLLISION_COST, ADVISORY_CHANGE_COST = 1.0, 0.01
START_HEIGHT_BOUND, START_RATE_BOUND, START_TIME = 200.0, 10.0, 40.0


@dataclass(frozen=True)
class CollisionAvoidance(RealStateProblem):
    """Two aircraft head on; a state is h (m), its rate (m/s), the last advisory and the time."""

    repaired: bool = parameter(False, "level off at the advised rate, unlike F.9 as printed")

    actions = (Labels(("descend", "no-advisory", "climb")),)
    action_aliases = {  # noqa: RUF012 - never written
        "-5": "descend", "0": "no-advisory", "none": "no-advisory", "5": "climb",
    }  # fmt: skip
    state_count = ContinuousStates(4)
    state_grid = StateGrid(
        (
            GridAxis("height, m", np.linspace(-200.0, 200.0, 21)),
            GridAxis("climb rate", np.linspace(-10.0, 10.0, 21), drawn=(0.0,)),
            GridAxis("last advisory", ADVISED_RATES, is_interpolated=False, drawn=(0.0,)),
            GridAxis(
                "seconds to collision",
                np.arange(-1.0, 41.0),  # the aircraft have passed at -1
                is_interpolated=False,
                drawn=range(41),
            ),
        ),
        x=3,
        y=0,
        note="Drawn: climb rate 0, no earlier advisory.",
    )
    reward_bounds = -(COLLISION_COST + ADVISORY_CHANGE_COST), 0.0
    return_bounds = -(COLLISION_COST + ADVISORY_CHANGE_COST * (START_TIME + 1)), 0.0

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return the distributions of the height and its rate."""
        height, rate = np.full(rows, START_HEIGHT_BOUND), np.full(rows, START_RATE_BOUND)
        return (Uniform(-height, height), Uniform(-rate, rate))

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """Return start states `[B, 4]` with no advisory yet and 40 s to go."""
        height, rate = events
        return np.stack([height, rate, np.zeros(rows), np.full(rows, START_TIME)], axis=1)

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Return the distribution of the gust."""
        return (GUST_CHANCE,)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Return the outcome of one second (F.5 to F.9), with the costs of the state before it."""
        h, dh, a_prev, t_col = split_columns(s)
        advised = ADVISED_RATES[unwrap_single_row(a[:, 0])]
        gust = GUST_ACCELERATIONS[unwrap_single_row(events[0])]
        next_rate = dh + (self._compute_acceleration(dh, advised) + gust)
        collides = (abs(h) < COLLISION_DISTANCE) & (t_col == 0)
        cost = COLLISION_COST * collides + ADVISORY_CHANGE_COST * (advised != a_prev)
        moved = stack_columns((h + dh, next_rate, advised, t_col - 1.0))
        next_states = keep_states_where(t_col < 0, s, moved)
        return Outcome(next_states, stack_columns([0.0 - cost * (t_col >= 0)]), next_states)

    def _compute_acceleration(self, dh: Array, advised: Array) -> Array:
        """Return the acceleration by which the aircraft follows the advised rate (F.9)."""
        difference = advised - dh
        small_response = difference if self.repaired else advised
        large_response = clip(difference, -MAX_ACCELERATION, MAX_ACCELERATION)
        is_small = abs(difference) < MAX_ACCELERATION
        return select(advised == 0, 0.0, select(is_small, small_response, large_response))

    def compute_gust(self, state: Array, next_state: Array) -> float:
        """Return the gust of a turn in m/s^2, from the states `[4]` before and after it."""
        _, dh, _, _ = state
        _, next_rate, advised, _ = next_state
        return float(next_rate - dh - self._compute_acceleration(dh, advised))

    def terminal(self, s: Array) -> Bools:
        """Return whether the time is over, so that the aircraft have passed."""
        return np.asarray(s[:, 3] < 0)

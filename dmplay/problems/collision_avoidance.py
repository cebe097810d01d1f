"""Tell an aircraft to climb or to descend, as seldom as you can, before an intruder passes.

Source: appendix F.6; CollisionAvoidance.jl. Decisions: the middle branch of F.9 is taken as it is
printed, a / dt (`repaired` reads it as (a - rate) / dt, which would level off at the advised rate);
within 50 m is strict; the last action is taken at time 0 and there is none after; the game starts
40 s before with no advisory, h uniform within 200 m and the rate within 10 m/s.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Categorical, Chance, Span
from dmplay.columns import Column, chosen, column, columns, joined, listed, size, stayed, within
from dmplay.core import Continuous, Labels, Outcome, parameter
from dmplay.problems._reals import RealState

RATES = np.array([-5.0, 0.0, 5.0])  # m/s, by action
GUSTS = np.array([-2.0, 0.0, 2.0])  # m/s^2
GUST = Categorical.of(np.array([[0.25, 0.5, 0.25]]))
LIMIT = 1.0  # m/s^2, what the aircraft can do about its vertical rate
NEAR = 50.0  # m
NEAR_COST, CHANGE_COST = 1.0, 0.01
FIRST_HEIGHT, FIRST_RATE, FIRST_TIME = 200.0, 10.0, 40.0


@dataclass(frozen=True)
class CollisionAvoidance(RealState):
    """Two aircraft head on; a state is h (m), its rate (m/s), the last advisory and the time."""

    repaired: bool = parameter(False, "whether a rate close to the advised one becomes that one")

    actions = (Labels(("descend", "no-advisory", "climb")),)
    aliases = {  # noqa: RUF012 - never written
        "-5": "descend", "0": "no-advisory", "none": "no-advisory", "5": "climb",
    }  # fmt: skip
    states = Continuous(4)

    def opening(self, rows: int) -> tuple[Chance, ...]:
        """The height and its rate."""
        height, rate = np.full(rows, FIRST_HEIGHT), np.full(rows, FIRST_RATE)
        return (Span(-height, height), Span(-rate, rate))

    def place(self, rows: int, events: tuple[Array, ...]) -> Array:
        """No advisory yet, 40 s to go."""
        height, rate = events
        return np.stack([height, rate, np.zeros(rows), np.full(rows, FIRST_TIME)], axis=1)

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """The gust."""
        return (GUST,)

    def move(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """One second (F.5 to F.9); the costs are those of the state acted in."""
        h, dh, a_prev, t_col = columns(s)
        advised, gust = listed(RATES, column(a[:, 0])), listed(GUSTS, column(events[0]))
        faster = dh + (self._acceleration(dh, advised) + gust)
        collides = (size(h) < NEAR) & (t_col == 0)
        cost = NEAR_COST * collides + CHANGE_COST * (advised != a_prev)
        moved = stayed(t_col < 0, joined((h + dh, faster, advised, t_col - 1.0)), s)
        return Outcome(moved, joined([0.0 - cost * (t_col >= 0)]), moved)

    def _acceleration(self, dh: Column, advised: Column) -> Column:
        """What the aircraft does about its vertical rate (F.9)."""
        short = advised - dh
        close = short if self.repaired else advised
        turned = chosen(size(short) < LIMIT, close, within(short, -LIMIT, LIMIT))
        return chosen(advised == 0, 0.0, turned)

    def terminal(self, s: Array) -> Bools:
        """The time is over: the aircraft have passed."""
        return np.asarray(s[:, 3] < 0)

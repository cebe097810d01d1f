"""Soccer on a field of four by five, as Littman has it (1994)."""

from dataclasses import dataclass

import numpy as np

from dmplay import DiscreteUniform, Labels, Outcome, Problem
from dmplay.chance import Array, Chance, Ints

HIGH, WIDE = 4, 5
WAYS = np.array([[-1, 0], [0, 1], [1, 0], [0, -1], [0, 0]])  # rows and columns
GOAL = (1, 2)  # rows


@dataclass(frozen=True)
class Soccer(Problem):
    """Who carries the ball over the other's edge scores; who walks into the other loses it.

    A state is where both are and who has the ball. In each turn either moves first, by a toss;
    after a goal both stand where the game began, and a toss says who has the ball.
    """

    discount: float = 0.9
    agents = ("left", "right")
    actions = (Labels(("north", "east", "south", "west", "stand")),) * 2
    state_count = 2 * (HIGH * WIDE) ** 2

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Who has the ball."""
        return (DiscreteUniform(np.full(rows, 2), 2),)

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """Both in the middle rows, apart."""
        return self.told(np.full(rows, 2 * WIDE + 1), np.full(rows, WIDE + 3), events[0])

    def told(self, left: Array, right: Array, ball: Array) -> Ints:
        """The number of a state."""
        return np.asarray((left * HIGH * WIDE + right) * 2 + ball)

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Who moves first, and who has the ball if there is a goal."""
        two = np.full(len(s), 2)
        return (DiscreteUniform(two, 2), DiscreteUniform(two, 2))

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """One moves, then the other."""
        both, ball = np.divmod(s, 2)
        at = np.stack(np.divmod(both, HIGH * WIDE), axis=1)
        goals = np.zeros(len(s))
        rows = np.arange(len(s))
        for turn in range(2):
            who = events[0] ^ turn
            here = np.stack(np.divmod(at[rows, who], WIDE), axis=1)
            there = here + WAYS[a[rows, who]]
            over = np.where(who == 0, there[:, 1] == WIDE, there[:, 1] == -1)
            scored = over & (ball == who) & np.isin(here[:, 0], GOAL) & (goals == 0)
            goals += scored * np.where(who == 0, 1.0, -1.0)
            inside = ((there >= 0) & (there < [HIGH, WIDE])).all(axis=1)
            cell = np.where(inside, there[:, 0] * WIDE + there[:, 1], at[rows, who])
            into = (cell == at[rows, 1 - who]) & (goals == 0)
            ball = np.where(into, 1 - who, ball)
            at[rows, who] = np.where(into, at[rows, who], cell)
        moved = self.told(at[:, 0], at[:, 1], ball)
        moved = np.where(goals != 0, self.initial_states(len(s), (events[1],)), moved)
        return Outcome(moved, np.stack([goals, -goals], axis=1), moved)

    def format_state(self, s: Array) -> str:
        """Two cells and who has the ball."""
        both, ball = divmod(int(s), 2)
        return "{} {} {}".format(*divmod(both, HIGH * WIDE), self.agents[ball])

    def parse_state(self, text: str) -> Array:
        """The state of such a line."""
        *cells, ball = text.split()
        left, right = (np.array(int(cell)) for cell in cells)
        return self.told(left, right, np.array(self.agents.index(ball)))

"""Soccer on a field of four rows and five columns (Littman, 1994)."""

from dataclasses import dataclass

import numpy as np

from dmplay import DiscreteUniform, Labels, Outcome, Problem
from dmplay.core.arrays import Array, Ints
from dmplay.core.chance import Chance

HEIGHT, WIDTH = 4, 5
STEPS = np.array([[-1, 0], [0, 1], [1, 0], [0, -1], [0, 0]])  # changes of row and column
GOAL_ROWS = (1, 2)  # rows


@dataclass(frozen=True)
class Soccer(Problem):
    """Carry the ball over the opponent's edge to score; walk into the opponent and lose the ball.

    A state is both positions and the owner of the ball. In each turn a coin toss decides which
    agent moves first. After a goal both agents return to their start cells, and a toss assigns the
    ball.
    """

    discount: float = 0.9
    agents = ("left", "right")
    actions = (Labels(("north", "east", "south", "west", "stand")),) * 2
    state_count = 2 * (HEIGHT * WIDTH) ** 2

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return the distribution of the ball's owner."""
        return (DiscreteUniform(np.full(rows, 2), 2),)

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """Return the initial states: both agents in the middle rows, in separate columns."""
        return self.encode_state(np.full(rows, 2 * WIDTH + 1), np.full(rows, WIDTH + 3), events[0])

    def encode_state(self, left: Array, right: Array, ball: Array) -> Ints:
        """Return the number of each state."""
        return np.asarray((left * HEIGHT * WIDTH + right) * 2 + ball)

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Return the chances of the first mover, and of the ball's owner after a goal."""
        two = np.full(len(s), 2)
        return (DiscreteUniform(two, 2), DiscreteUniform(two, 2))

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Move one agent, then the other."""
        cells, ball = np.divmod(s, 2)
        positions = np.stack(np.divmod(cells, HEIGHT * WIDTH), axis=1)
        goals = np.zeros(len(s))
        rows = np.arange(len(s))
        for turn in range(2):
            mover = events[0] ^ turn
            origin = np.stack(np.divmod(positions[rows, mover], WIDTH), axis=1)
            target = origin + STEPS[a[rows, mover]]
            past_edge = np.where(mover == 0, target[:, 1] == WIDTH, target[:, 1] == -1)
            scored = past_edge & (ball == mover) & np.isin(origin[:, 0], GOAL_ROWS) & (goals == 0)
            goals += scored * np.where(mover == 0, 1.0, -1.0)
            inside = ((target >= 0) & (target < [HEIGHT, WIDTH])).all(axis=1)
            cell = np.where(inside, target[:, 0] * WIDTH + target[:, 1], positions[rows, mover])
            blocked = (cell == positions[rows, 1 - mover]) & (goals == 0)
            ball = np.where(blocked, 1 - mover, ball)
            positions[rows, mover] = np.where(blocked, positions[rows, mover], cell)
        next_state = self.encode_state(positions[:, 0], positions[:, 1], ball)
        next_state = np.where(goals != 0, self.initial_states(len(s), (events[1],)), next_state)
        return Outcome(next_state, np.stack([goals, -goals], axis=1), next_state)

    def format_state(self, s: Array) -> str:
        """Return both cells and the owner of the ball as text."""
        cells, ball = divmod(int(s), 2)
        return "{} {} {}".format(*divmod(cells, HEIGHT * WIDTH), self.agents[ball])

    def parse_state(self, text: str) -> Array:
        """Parse the text of a state."""
        *cells, ball = text.split()
        left, right = (np.array(int(cell)) for cell in cells)
        return self.encode_state(left, right, np.array(self.agents.index(ball)))

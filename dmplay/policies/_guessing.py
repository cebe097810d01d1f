"""What a seat that sees little takes for possible, beside partners who act by what they see.

A particle filter (section 19.6): some games as they may have gone, all alike likely, each with its
state and what the partners remember. Its luck is the same in all games, so that the same history
always leads to the same guesses.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Ints, Reals
from dmplay.core import Memory, Percept, Problem
from dmplay.dice import generate_uniforms
from dmplay.solvers.cast import OpponentModel

N_PARTICLES = 500  # games as they may have gone
CANDIDATES_PER_PARTICLE = (
    4  # times as many are tried each turn, of which those stay that show what was seen
)
MAX_BATCH_ELEMENTS = 2**22  # of those that are tried together
PARTICLE_SEED = 1


@dataclass(frozen=True)
class ParticleFilter:
    """The guesses of one seat, beside a cast in which nobody acts for it.

    They are a memory: states `[B, G, ...]`, then what each of the cast remembers there.
    """

    opponent_model: OpponentModel

    def begin(self, beliefs: Reals) -> Memory:
        """Guesses before the first turn, by beliefs `[B, S]` of the state."""
        u = generate_uniforms(PARTICLE_SEED, self.opponent_model.seat, 0, rows=1, count=N_PARTICLES)
        s = sample_states(self.opponent_model.problem, beliefs, np.tile(u, (len(beliefs), 1)))
        flat = s.reshape(-1, *s.shape[2:])
        return (
            s,
            *(
                _unflatten_particles(part, len(s))
                for memory in self.opponent_model.begin_memories(flat)
                for part in memory
            ),
        )

    def update(
        self, particles: Memory, percept: Percept, turns_done: Ints, beliefs: Reals
    ) -> Memory:
        """Guesses after one more turn; where none is like it, states by the belief."""
        blocks = [*self._iter_row_blocks(particles, turns_done)]
        found = []
        for turn, rows in blocks:
            now = tuple(part[rows] for part in particles)
            did, saw = percept.action[rows], percept.observation[rows]
            found.append(self._filter_particles(now, did, saw, turn, beliefs[rows]))
        back = np.argsort(np.concatenate([rows for _, rows in blocks]))
        return tuple(np.concatenate(each)[back] for each in zip(*found, strict=True))

    def _iter_row_blocks(self, particles: Memory, turns_done: Ints) -> Iterator[tuple[int, Ints]]:
        """Rows that are followed together, with the turns that they did."""
        size = sum(part[0].size for part in particles) * CANDIDATES_PER_PARTICLE
        most = max(MAX_BATCH_ELEMENTS // size, 1)
        for turn in np.flatnonzero(np.bincount(turns_done)).tolist():
            rows = np.flatnonzero(turns_done == turn)
            yield from ((turn, rows[at : at + most]) for at in range(0, len(rows), most))

    def _filter_particles(
        self, particles: Memory, own_actions: Array, observations: Array, turn: int, beliefs: Reals
    ) -> Memory:
        """The guesses of some rows after the seat did and saw this."""
        cast, rows = self.opponent_model, len(own_actions)
        tries = np.arange(N_PARTICLES * CANDIDATES_PER_PARTICLE)
        u = generate_uniforms(
            PARTICLE_SEED, cast.seat, turn + 1, rows=len(tries), count=cast.uniforms_per_turn
        )
        u = np.tile(u, (rows, 1))
        s, *parts = (_flatten_particles(part[:, tries % N_PARTICLES]) for part in particles)
        memories = cast.split_memory(tuple(parts))
        joint = cast.choose_joint_actions(s, memories, np.repeat(own_actions, len(tries)), u)
        outcome = cast.step_states(s, joint, u)
        told = cast.update_memories(memories, joint, outcome)
        fits = (outcome.observations[:, cast.seat] == np.repeat(observations, len(tries))).reshape(
            rows, -1
        )
        first = np.argsort(~fits, axis=1, kind="stable")
        many = fits.sum(axis=1)[:, None]
        place = np.arange(N_PARTICLES) * np.where(many, many, len(tries)) // N_PARTICLES
        kept = np.take_along_axis(first, place, axis=1) + np.arange(rows)[:, None] * len(tries)
        after = outcome.state[kept]
        lost = np.flatnonzero(many == 0)
        if len(lost):
            after[lost] = sample_states(cast.problem, beliefs[lost], u[kept[lost], 0])
        return (after, *(part[kept] for memory in told for part in memory))


def sample_states(problem: Problem, beliefs: Reals, u: Reals) -> Array:
    """States `[B, N, ...]` by beliefs `[B, S]` and uniforms `[B, N]`."""
    places = np.empty(u.shape, np.int64)
    for row, likely in enumerate(beliefs):
        possible = np.flatnonzero(likely)
        edges = np.cumsum(likely[possible])[:-1]
        places[row] = possible[np.searchsorted(edges, u[row], side="right")]
    return np.asarray(problem.enumerate_states()[places])


def _flatten_particles(part: Array) -> Array:
    """All guesses of all rows one after another."""
    return part.reshape(-1, *part.shape[2:])


def _unflatten_particles(part: Array, rows: int) -> Array:
    """The guesses of each row."""
    return part.reshape(rows, -1, *part.shape[1:])

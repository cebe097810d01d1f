"""A particle filter for a seat whose partners act on their own observations (section 19.6).

The particles are equally likely games as they may have gone, each with its state and the memories
of the partners. The uniforms are the same in all games, so the same history always leads to the
same particles.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np

from dmplay.core.arrays import Array, Ints, Reals
from dmplay.core.policy import Memory, Percept
from dmplay.core.problem import Problem
from dmplay.core.uniforms import generate_uniforms
from dmplay.solvers.search.simulated_opponents import OpponentModel

N_PARTICLES = 500  # per row
CANDIDATES_PER_PARTICLE = 4  # each turn, of which those stay that match the observation
MAX_BATCH_ELEMENTS = 2**22  # array elements of the rows filtered together
PARTICLE_SEED = 1


@dataclass(frozen=True)
class ParticleFilter:
    """The particles of one seat, given a model of the others in which no policy acts for it.

    They are a memory: states `[B, G, ...]`, then the memories of the others `[B, G, ...]`.
    """

    opponent_model: OpponentModel

    def begin(self, beliefs: Reals) -> Memory:
        """Return the first particles, sampled from beliefs `[B, S]` of the state."""
        u = generate_uniforms(PARTICLE_SEED, self.opponent_model.seat, 0, rows=1, count=N_PARTICLES)
        s = sample_states(self.opponent_model.problem, beliefs, np.tile(u, (len(beliefs), 1)))
        parts = chain(*self.opponent_model.begin_memories(s.reshape(-1, *s.shape[2:])))
        return (s, *(part.reshape(len(s), -1, *part.shape[1:]) for part in parts))

    def update(
        self, particles: Memory, percept: Percept, turns_done: Ints, beliefs: Reals
    ) -> Memory:
        """Return the particles after one more turn.

        A row without a candidate that matches gets states sampled from its belief.
        """
        blocks = [*self._iter_row_blocks(particles, turns_done)]
        parts = []
        for turn, rows in blocks:
            block_particles = tuple(part[rows] for part in particles)
            actions, observations = percept.action[rows], percept.observation[rows]
            parts.append(
                self._filter_particles(block_particles, actions, observations, turn, beliefs[rows])
            )
        order = np.argsort(np.concatenate([rows for _, rows in blocks]))
        return tuple(np.concatenate(arrays)[order] for arrays in zip(*parts, strict=True))

    def _iter_row_blocks(self, particles: Memory, turns_done: Ints) -> Iterator[tuple[int, Ints]]:
        """Yield the number of turns played and the rows that are filtered together."""
        size = sum(part[0].size for part in particles) * CANDIDATES_PER_PARTICLE
        max_rows = max(MAX_BATCH_ELEMENTS // size, 1)
        for turn in np.flatnonzero(np.bincount(turns_done)).tolist():
            rows = np.flatnonzero(turns_done == turn)
            for start in range(0, len(rows), max_rows):
                yield turn, rows[start : start + max_rows]

    def _filter_particles(
        self, particles: Memory, own_actions: Array, observations: Array, turn: int, beliefs: Reals
    ) -> Memory:
        """Return the particles of some rows after the seat's actions and observations."""
        cast, row_count = self.opponent_model, len(own_actions)
        candidates = np.arange(N_PARTICLES * CANDIDATES_PER_PARTICLE)
        u = generate_uniforms(
            PARTICLE_SEED, cast.seat, turn + 1, rows=len(candidates), count=cast.uniforms_per_turn
        )
        u = np.tile(u, (row_count, 1))
        s, *parts = (
            part[:, candidates % N_PARTICLES].reshape(-1, *part.shape[2:]) for part in particles
        )
        memories = cast.split_memory(tuple(parts))
        joint = cast.choose_joint_actions(s, memories, np.repeat(own_actions, len(candidates)), u)
        outcome = cast.step_states(s, joint, u)
        next_memories = cast.update_memories(memories, joint, outcome)
        candidate_observations = outcome.observations[:, cast.seat].reshape(row_count, -1)
        matches = candidate_observations == observations[:, None]
        matching_first = np.argsort(~matches, axis=1, kind="stable")
        match_counts = matches.sum(axis=1)[:, None]
        pick_counts = np.where(match_counts, match_counts, len(candidates))
        picks = np.arange(N_PARTICLES) * pick_counts // N_PARTICLES
        row_starts = np.arange(row_count)[:, None] * len(candidates)
        selected = row_starts + np.take_along_axis(matching_first, picks, axis=1)
        states = outcome.state[selected]
        unmatched = np.flatnonzero(match_counts == 0)
        if len(unmatched):
            uniforms = u[selected[unmatched], 0]
            states[unmatched] = sample_states(cast.problem, beliefs[unmatched], uniforms)
        return (states, *(part[selected] for memory in next_memories for part in memory))


def sample_states(problem: Problem, beliefs: Reals, u: Reals) -> Array:
    """Return states `[B, N, ...]` sampled from beliefs `[B, S]` by uniforms `[B, N]`."""
    indices = np.empty(u.shape, np.int64)
    for row, belief in enumerate(beliefs):
        support = np.flatnonzero(belief)
        edges = np.cumsum(belief[support])[:-1]
        indices[row] = support[np.searchsorted(edges, u[row], side="right")]
    return np.asarray(problem.enumerate_states()[indices])

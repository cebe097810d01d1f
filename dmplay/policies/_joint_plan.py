"""Plans of two agents who hear the same."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay import belief
from dmplay.chance import Array, Bools, Ints, Reals, mean
from dmplay.core import Memory, Percept, parameter
from dmplay.policies.kinds import Seated
from dmplay.solvers import alpha_vectors, joint_plans
from dmplay.solvers.envelope import envelope
from dmplay.solvers.value_iteration import greedy
from dmplay.tabular import joint_actions, tabulate

LONGEST = 4  # turns of a joint plan: with five there are too many to compare


@dataclass(frozen=True)
class JointPlan(Seated):
    """Follows the plans of `horizon` turns that together earn both most, made anew every turn.

    Both hear the same, so each knows what the other believes and plans. The values are the sum of
    both rewards over these turns.
    """

    horizon: int = parameter(LONGEST, f"turns planned, 1 to {LONGEST}", 1, LONGEST)

    def __post_init__(self) -> None:
        """Refuses more turns than it can plan."""
        super().__post_init__()
        _ = self._vectors  # refuses a game of too many plans

    @cached_property
    def _vectors(self) -> list[Reals]:
        """What pairs of plans are worth from each state `[N, S]`, by their first joint action."""
        stage = joint_plans.openings(self.problem, self.horizon)
        found = []
        for a, b in joint_actions(self.problem):
            first, second = stage.plans[0].actions == a, stage.plans[1].actions == b
            worth = stage.values[:, first][:, :, second].reshape(len(stage.values), -1).T
            found.append(worth[envelope(worth).needed])
        return found

    @cached_property
    def _beside(self) -> tuple[Reals, Reals]:
        """The probability of what is heard and the next state, `[A, A of the other, O, S, S]`.

        Beside what the partner does, and beside anything.
        """
        tables = tabulate(self.problem)
        kinds = self.problem.observation_counts[self.seat]
        own = tables.seen.reshape(*tables.seen.shape[:2], -1, kinds).sum(axis=3 - self.seat)
        both = tables._replace(observation=own).joint.transpose(1, 2, 0, 3)
        shaped: Reals = both.reshape(*self.problem.action_counts, *both.shape[1:])
        foreseen = shaped if self.seat == 0 else shaped.swapaxes(0, 1)
        return foreseen, np.broadcast_to(foreseen.mean(axis=1, keepdims=True), foreseen.shape)

    def begin(self, observation: Array) -> Memory:
        """What both believe, the distribution of the start state, and do."""
        return self._known(np.tile(belief.prior(self.problem), (len(observation), 1)))

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """Bayes' rule beside the partner's plan; where that is ruled out, beside a random one."""
        b, planned = memory
        turn = percept.action, planned[:, 1 - self.seat], percept.observation
        return self._known(surprised(b, turn, *self._beside))

    def _known(self, b: Reals) -> Memory:
        """Beliefs, and the first of the best joint actions `[B, 2]`, the same for both seats."""
        return b, joint_actions(self.problem)[greedy(self._jointly(b))]

    def _jointly(self, b: Reals) -> Reals:
        """Q `[B, joint actions]` of beliefs `[B, S]`."""
        return np.stack([alpha_vectors.values(vectors, b) for vectors in self._vectors]).T

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """One's own part of the best joint action."""
        return memory[1][:, self.seat]

    def values(self, memory: Memory) -> Reals:
        """Q of each action beside the partner's best one."""
        q = self._jointly(memory[0]).reshape(-1, *self.problem.action_counts)
        return np.asarray(q.max(axis=2 - self.seat))


def surprised(b: Reals, turn: Sequence[Ints], foreseen: Reals, surprising: Reals) -> Reals:
    """The beliefs `[B, S]` after a turn, each part of it `[B]`, by what was likely `[..., S, S']`.

    That is beside a foreseen partner or, where this rules out what was seen, beside another.
    """
    places, after = np.ravel_multi_index(tuple(turn), foreseen.shape[:-2]), np.empty_like(b)
    for place in np.flatnonzero(np.bincount(places)):
        rows = np.flatnonzero(places == place)
        kind, before = np.unravel_index(place, foreseen.shape[:-2]), b.take(rows, axis=0)
        after[rows], likelihood = belief.bayes(mean(before, foreseen[kind]))
        out = np.flatnonzero(likelihood == 0.0)
        after[rows[out]] = belief.bayes(mean(before[out], surprising[kind])).belief
    return after

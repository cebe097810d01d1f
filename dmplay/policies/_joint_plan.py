"""Plans of two agents who hear the same."""

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
    def _foreseen(self) -> Reals:
        """The probability of what is heard and the next state, `[A, A of the other, O, S, S]`."""
        tables = tabulate(self.problem)
        kinds = self.problem.observation_counts[self.seat]
        own = tables.seen.reshape(*tables.seen.shape[:2], -1, kinds).sum(axis=3 - self.seat)
        both = tables._replace(observation=own).joint.transpose(1, 2, 0, 3)
        shaped: Reals = both.reshape(*self.problem.action_counts, *both.shape[1:])
        return shaped if self.seat == 0 else shaped.swapaxes(0, 1)

    def begin(self, observation: Array) -> Memory:
        """What both believe: the distribution of the start state."""
        return (np.tile(belief.prior(self.problem), (len(observation), 1)),)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """Bayes' rule beside the partner's plan; where that is ruled out, beside a random one."""
        (b,) = memory
        partner = self._planned(b)[:, 1 - self.seat]
        foreseen = self._foreseen[percept.action, partner, percept.observation]
        surprising = self._foreseen.mean(axis=1)[percept.action, percept.observation]
        return (surprised(b, foreseen, surprising),)

    def _jointly(self, b: Reals) -> Reals:
        """Q `[B, joint actions]` of beliefs `[B, S]`."""
        return np.stack([alpha_vectors.values(vectors, b) for vectors in self._vectors], axis=1)

    def _planned(self, b: Reals) -> Ints:
        """The first of the best joint actions `[B, 2]`, the same for both seats."""
        return np.asarray(joint_actions(self.problem)[greedy(self._jointly(b))])

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """One's own part of the best joint action."""
        return np.asarray(self._planned(memory[0])[:, self.seat])

    def values(self, memory: Memory) -> Reals:
        """Q of each action beside the partner's best one."""
        q = self._jointly(memory[0]).reshape(-1, *self.problem.action_counts)
        return np.asarray(q.max(axis=2 - self.seat))


def surprised(b: Reals, foreseen: Reals, surprising: Reals) -> Reals:
    """The beliefs `[B, S]` after a turn, by what was likely `[B, S, S']` beside a foreseen partner.

    Where that rules out what was seen, by what else was likely.
    """
    joint = mean(b, foreseen)
    possible = joint.any(axis=1, keepdims=True)
    return belief.bayes(np.where(possible, joint, mean(b, surprising))).belief

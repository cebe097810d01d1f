"""Plans of two agents who hear the same."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from dmplay import belief
from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Percept, parameter
from dmplay.policies._believing import Flow, by_turn
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
    def _joint(self) -> Ints:
        """Every joint action `[A, 2]`."""
        return joint_actions(self.problem)

    @cached_property
    def _vectors(self) -> list[Reals]:
        """What pairs of plans are worth from each state `[N, S]`, by their first joint action."""
        stage = joint_plans.openings(self.problem, self.horizon)
        found = []
        for a, b in self._joint:
            first, second = stage.plans[0].actions == a, stage.plans[1].actions == b
            worth = stage.values[:, first][:, :, second].reshape(len(stage.values), -1).T
            found.append(worth[envelope(worth).needed])
        return found

    @cached_property
    def _beside(self) -> "Beside":
        """By one's own action, the other's and what is heard."""
        tables = tabulate(self.problem)
        kinds = self.problem.observation_counts[self.seat]
        own = tables.seen.reshape(*tables.seen.shape[:2], -1, kinds).sum(axis=3 - self.seat)
        both = tables._replace(observation=own).joint.transpose(1, 2, 0, 3)
        shaped: Reals = both.reshape(*self.problem.action_counts, *both.shape[1:])
        foreseen = shaped if self.seat == 0 else shaped.swapaxes(0, 1)
        anything = np.broadcast_to(foreseen.mean(axis=1, keepdims=True), foreseen.shape)
        return Beside.of(foreseen, anything)

    def begin(self, observation: Array) -> Memory:
        """What both believe, the distribution of the start state, and do."""
        return self._known(np.tile(belief.prior(self.problem), (len(observation), 1)))

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """Bayes' rule beside the partner's plan; where that is ruled out, beside a random one."""
        b, planned = memory
        turn = percept.action, planned[:, 1 - self.seat], percept.observation
        return self._known(self._beside.after(b, turn))

    def _known(self, b: Reals) -> Memory:
        """Beliefs, and the first of the best joint actions `[B, 2]`, the same for both seats."""
        return b, self._joint.take(greedy(self._jointly(b)), axis=0)

    def _jointly(self, b: Reals) -> Reals:
        """Q `[B, joint actions]` of beliefs `[B, S]`."""
        b = np.asfortranarray(b)  # state by state, once
        return np.stack([alpha_vectors.values(vectors, b) for vectors in self._vectors]).T

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """One's own part of the best joint action."""
        return memory[1][:, self.seat]

    def values(self, memory: Memory) -> Reals:
        """Q of each action beside the partner's best one."""
        q = self._jointly(memory[0]).reshape(-1, *self.problem.action_counts)
        return np.asarray(q.max(axis=2 - self.seat))


class Beside(NamedTuple):
    """What turns teach beside a foreseen partner or, where this rules out what was seen, another.

    A turn is some numbers, of so many each: what was done and seen.
    """

    many: tuple[int, ...]
    foreseen: tuple[Flow, ...]  # of each turn, row-major
    surprising: tuple[Flow, ...]

    @classmethod
    def of(cls, foreseen: Reals, surprising: Reals) -> "Beside":
        """By how likely a turn leads from each state to the next, `[..., S, S']`."""
        *many, size, _ = foreseen.shape
        both = (each.reshape(-1, size, size) for each in (foreseen, surprising))
        return cls(tuple(many), *(tuple(map(Flow.of, each)) for each in both))

    def after(self, b: Reals, turn: Sequence[Ints]) -> Reals:
        """The beliefs `[B, S]` after a turn, each part of it `[B]`."""
        place, *rest = turn
        for many, part in zip(self.many[1:], rest, strict=True):
            place = place * many + part
        return by_turn(b, place, self._after)

    def _after(self, before: Reals, turn: int) -> Reals:
        after, likelihood = belief.bayes(self.foreseen[turn].carried(before))
        out = np.flatnonzero(likelihood == 0.0)
        if len(out):
            after[out] = belief.bayes(self.surprising[turn].carried(before[out])).belief
        return after

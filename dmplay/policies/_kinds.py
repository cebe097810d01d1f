"""The simplest kinds of policy memory, to derive from: the last sight, a reply, a belief."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay import belief
from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Exact, Memory, Percept, Problem, exact
from dmplay.tabular import joint_actions


@dataclass(frozen=True)
class Reactive(ABC):
    """A policy that acts on what it saw last."""

    problem: Problem
    seat: int

    @property
    def draws(self) -> int:
        """None."""
        return 0

    def begin(self, observation: Array) -> Memory:
        """The first observation."""
        return (observation,)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The new observation."""
        return (percept.observation,)

    @abstractmethod
    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Actions `[B]` from the observation `memory[0]`."""

    def values(self, memory: Memory) -> Reals | None:
        """Unknown."""
        return None


@dataclass(frozen=True)
class Always(Reactive):
    """A policy of one action; a subclass says which."""

    action = 0

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """That action."""
        return np.full(len(memory[0]), self.action)


@dataclass(frozen=True)
class Rule(ABC):
    """A rule for a repeated game of two: a first action, then a reply to the last round."""

    problem: Problem
    seat: int

    first = 0

    @property
    def draws(self) -> int:
        """None."""
        return 0

    @abstractmethod
    def reply(self, own: Ints, other: Ints) -> Array:
        """The next actions `[B]` after a round."""

    def begin(self, observation: Array) -> Memory:
        """The first action."""
        return (np.full(len(observation), self.first),)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The reply to the round."""
        assert percept.actions is not None
        own, other = percept.actions[:, self.seat], percept.actions[:, 1 - self.seat]
        return (self.reply(own, other),)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """What the rule says."""
        return memory[0]

    def values(self, memory: Memory) -> Reals | None:
        """Unknown."""
        return None


@dataclass(frozen=True)
class Believer(ABC):
    """A policy that acts on its seat's exact belief, for problems of few states.

    Partners act unseen; it takes them to act uniformly at random.
    """

    problem: Problem
    seat: int

    @property
    def draws(self) -> int:
        """None."""
        return 0

    @cached_property
    def _prior(self) -> Reals:
        return belief.prior(self.problem)

    @cached_property
    def _turns(self) -> tuple[Ints, Ints, Exact]:
        """Every turn from every state: the state's index, the own action, what comes of it.

        The probabilities include the partners' actions.
        """
        states, choices = self.problem.enumerated(), joint_actions(self.problem)
        a = np.tile(choices, (len(states), 1))
        p, outcome = exact(self.problem, np.repeat(states, len(choices), axis=0), a)
        share = len(self.problem.actions[self.seat]) / len(choices)
        before = np.repeat(np.arange(len(states)), len(choices))
        return before, a[:, self.seat], Exact(p * share, outcome)

    @cached_property
    def _likely(self) -> Reals:
        """The probability of an own observation and the next state, `[A, O, S, S]`."""
        before, action, (p, outcome) = self._turns
        size, own = int(before[-1]) + 1, len(self.problem.actions[self.seat])
        after = self.problem.index(outcome.state.reshape(p.size, *outcome.state.shape[2:]))
        seen = len((self.problem.observations or ())[self.seat])
        likely = np.zeros((own, seen, size, size))
        turn = action[:, None], outcome.observations[:, :, self.seat], before[:, None]
        np.add.at(likely, (*turn, after.reshape(p.shape)), p)
        return likely

    @cached_property
    def expected(self) -> Reals:
        """The reward `[S, A]` expected of each own action in each state."""
        before, action, (p, outcome) = self._turns
        rewards = np.zeros((int(before[-1]) + 1, len(self.problem.actions[self.seat])))
        paid = (p * outcome.rewards[:, :, self.seat]).cumsum(axis=1)[:, -1]
        np.add.at(rewards, (before, action), paid)
        return rewards

    def begin(self, observation: Array) -> Memory:
        """The distribution of the start state."""
        return (np.repeat(self._prior[None], len(observation), axis=0),)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """Bayes' rule, row by row."""
        likely = self._likely[percept.action, percept.observation]
        joint = weighted(memory[0], likely)
        return (joint / joint.cumsum(axis=1)[:, -1:],)

    @abstractmethod
    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Actions `[B]` from the belief `memory[0]` `[B, S]`."""

    def values(self, memory: Memory) -> Reals | None:
        """Unknown."""
        return None


def weighted(b: Reals, each: Reals) -> Reals:
    """The mean `[B, K]` of `each` (`[B or 1, S, K]`) under beliefs `[B, S]`.

    State by state: a row has the same bits in any batch.
    """
    total = b[:, 0, None] * each[:, 0]
    for s in range(1, b.shape[1]):
        total = total + b[:, s, None] * each[:, s]
    return np.asarray(total)

"""Policies for predator-prey."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from dmplay.chance import Array, Bools, Categorical, Ints, Reals
from dmplay.core import Memory, parameter
from dmplay.errors import BadPolicy
from dmplay.hexes import DIRECTIONS
from dmplay.policies._kept import kept
from dmplay.policies.kinds import Reactive, Settled
from dmplay.policies.roster import Roster
from dmplay.problems.predator_prey import PredatorPrey
from dmplay.solvers import best_response, markov_game, sparse
from dmplay.solvers.value_iteration import greedy

WAITED = 300_000  # outcomes of all states and moves that are listed in a moment


@dataclass(frozen=True)
class _Runner(Settled):
    """A policy that looks at how far each move, if it does not slip, leaves it from the others."""

    problem: PredatorPrey

    def chosen(self, s: Array, legal: Bools | None) -> Array:
        """The first of the best moves."""
        hunt = self.problem
        others = hunt.hunted if self.seat in hunt.hunters else hunt.hunters
        far = [hunt.far[s[:, self.seat], :, s[:, other]] for other in others]
        return self._best(np.min(far, axis=0))

    @abstractmethod
    def _best(self, far: Ints) -> Array:
        """The first of the best moves `[B]` by the steps `[B, 6]` to the nearest of the others."""


@dataclass(frozen=True)
class Chase(_Runner):
    """Goes to the nearest of the other kind."""

    def _best(self, far: Ints) -> Array:
        return np.asarray(np.argmin(far, axis=1))


@dataclass(frozen=True)
class Flee(_Runner):
    """Stays as far as it can from the nearest of the other kind."""

    def _best(self, far: Ints) -> Array:
        return np.asarray(np.argmax(far, axis=1))


RUNNERS: dict[str, type[_Runner]] = {"chase": Chase, "flee": Flee}
ANSWERED = ("natural", *RUNNERS, "random")


@dataclass(frozen=True)
class BestResponse(Settled):
    """The best answer to others who all play `to`: natural (chase or flee), chase, flee or random.

    It plans a hunt without end, by policy iteration; its values are against these others.
    """

    problem: PredatorPrey
    to: str = parameter(
        "natural", "what the others play: natural, chase, flee or random", among=ANSWERED
    )

    def __post_init__(self) -> None:
        """Refuses a game without end and discount."""
        super().__post_init__()
        if self.problem.discount >= 1.0:
            raise BadPolicy("a hunt without end needs a discount below 1")

    def likely(self, seat: int) -> Reals:
        """How likely the agent of a seat takes each action in each state `[S, 6]`."""
        states, many = self.problem.enumerated(), len(DIRECTIONS)
        if self.to == "random":
            return np.full((len(states), many), 1 / many)
        name = _natural(self.problem, seat) if self.to == "natural" else self.to
        runner = RUNNERS[name](self.problem, seat)
        return np.eye(many)[runner.choose((states,), None, np.zeros((len(states), 0)))]

    def chosen(self, s: Array, legal: Bools | None) -> Array:
        """The first of the best moves."""
        return greedy(self.values((s,)))

    def values(self, memory: Memory) -> Reals:
        """Q of each move against these others."""
        return np.asarray(_best_q(self)[self.problem.index(memory[0])])

    def in_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """The answer to these others, where all play one thing that it answers."""
        seats = range(len(self.problem.agents))
        natural = {_natural(self.problem, seat) for seat in seats if seat != self.seat}
        played = {*rivals}
        if len(played) != 1 or played == natural or rivals[0] not in ANSWERED:
            return self
        return replace(self, to=rivals[0])


@kept
def _best_q(agent: BestResponse) -> Reals:
    play = [agent.likely(seat) for seat in range(agent.problem.walkers)]
    model = best_response.faced(agent.problem, agent.seat, play)
    return sparse.optimal(model, agent.problem.discount)


@dataclass(frozen=True)
class Equilibrium(Reactive):
    """Mixes its moves so that one against one neither gains by another policy.

    What a prey loses a predator gains, to scale, so that this also secures the most against any
    opponent. The values are against the other's part of the equilibrium.
    """

    problem: PredatorPrey

    draws = 1  # for the move

    def __post_init__(self) -> None:
        """Refuses games whose equilibrium it does not find."""
        super().__post_init__()
        hunt = self.problem
        if hunt.walkers != 2 or hunt.states > markov_game.LARGEST:
            got = f"{hunt.walkers} agents on {len(hunt.hexes)} hexes"
            raise BadPolicy(f"equilibrium: got {got}, expected two on at most 22")
        if hunt.discount >= 1.0:
            raise BadPolicy("a hunt without end needs a discount below 1")

    @cached_property
    def _found(self) -> markov_game.Equilibrium:
        return markov_game.equilibrium(self.problem)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """A move drawn from the mix of this state."""
        return Categorical(self._edges.take(self.problem.index(memory[0]), axis=0)).sample(u)

    @cached_property
    def _edges(self) -> Reals:
        """The cumulative probabilities `[S, 5]` of the moves."""
        return Categorical.of(self._found.play[self.seat]).cumulative

    def values(self, memory: Memory) -> Reals:
        """Q of each move against the other's part."""
        return np.asarray(self._found.q[self.seat][self.problem.index(memory[0])])


def _natural(problem: PredatorPrey, seat: int) -> str:
    """What an agent of this seat's kind does."""
    return "chase" if seat in problem.hunters else "flee"


def roster(problem: PredatorPrey, seat: int) -> Roster:
    """Who hunts; the best answer advises where it is found while one waits, else natural play."""
    natural = _natural(problem, seat)
    each = 3**problem.predators * max(len(problem.hexes), 3) ** problem.prey
    quick = problem.states * len(DIRECTIONS) * each <= WAITED
    return Roster(
        {**RUNNERS, "best-response": BestResponse, "equilibrium": Equilibrium},
        adviser="best-response" if quick and problem.discount < 1.0 else natural,
        partner=natural,
    )

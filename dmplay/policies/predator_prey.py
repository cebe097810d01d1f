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
from dmplay.policies._kept import memoize
from dmplay.policies.kinds import ReactivePolicy, StationaryPolicy
from dmplay.policies.roster import Roster
from dmplay.problems.predator_prey import PredatorPrey
from dmplay.solvers import best_response, markov_game, sparse
from dmplay.solvers.value_iteration import select_greedy_actions

MAX_QUICK_OUTCOMES = 300_000  # outcomes of all states and moves that are listed in a moment


@dataclass(frozen=True)
class _DistancePolicy(StationaryPolicy):
    """A policy that looks at how far each move, if it does not slip, leaves it from the others."""

    problem: PredatorPrey

    def choose_from_states(self, s: Array, legal: Bools | None) -> Array:
        """The first of the best moves."""
        hunt = self.problem
        others = hunt.prey_seats if self.seat in hunt.predator_seats else hunt.predator_seats
        far = [hunt.move_distances[s[:, self.seat], :, s[:, other]] for other in others]
        return self._choose_by_distance(np.min(far, axis=0))

    @abstractmethod
    def _choose_by_distance(self, distances: Ints) -> Array:
        """The first of the best moves `[B]` by the steps `[B, 6]` to the nearest of the others."""


@dataclass(frozen=True)
class Chase(_DistancePolicy):
    """Goes to the nearest of the other kind."""

    def _choose_by_distance(self, far: Ints) -> Array:
        return np.asarray(np.argmin(far, axis=1))


@dataclass(frozen=True)
class Flee(_DistancePolicy):
    """Stays as far as it can from the nearest of the other kind."""

    def _choose_by_distance(self, far: Ints) -> Array:
        return np.asarray(np.argmax(far, axis=1))


DISTANCE_POLICIES: dict[str, type[_DistancePolicy]] = {"chase": Chase, "flee": Flee}
OPPONENT_MODELS = ("natural", *DISTANCE_POLICIES, "random")


@dataclass(frozen=True)
class BestResponse(StationaryPolicy):
    """The best answer to others who all play `to`: natural (chase or flee), chase, flee or random.

    It plans a hunt without end, by policy iteration; its values are against these others.
    """

    problem: PredatorPrey
    to: str = parameter(
        "natural", "what the others play: natural, chase, flee or random", choices=OPPONENT_MODELS
    )

    def __post_init__(self) -> None:
        """Refuses a game without end and discount."""
        super().__post_init__()
        if self.problem.discount >= 1.0:
            raise BadPolicy("a hunt without end needs a discount below 1")

    def action_probabilities(self, seat: int) -> Reals:
        """How likely the agent of a seat takes each action in each state `[S, 6]`."""
        states, many = self.problem.enumerate_states(), len(DIRECTIONS)
        if self.to == "random":
            return np.full((len(states), many), 1 / many)
        name = _natural_policy_name(self.problem, seat) if self.to == "natural" else self.to
        runner = DISTANCE_POLICIES[name](self.problem, seat)
        return np.eye(many)[runner.choose((states,), None, np.zeros((len(states), 0)))]

    def choose_from_states(self, s: Array, legal: Bools | None) -> Array:
        """The first of the best moves."""
        return select_greedy_actions(self.action_values((s,)))

    def action_values(self, memory: Memory) -> Reals:
        """Q of each move against these others."""
        return np.asarray(_solve_best_response(self)[self.problem.state_indices(memory[0])])

    def adapt_to_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """The answer to these others, where all play one thing that it answers."""
        seats = range(len(self.problem.agents))
        natural = {_natural_policy_name(self.problem, seat) for seat in seats if seat != self.seat}
        played = {*rivals}
        if len(played) != 1 or played == natural or rivals[0] not in OPPONENT_MODELS:
            return self
        return replace(self, to=rivals[0])


@memoize
def _solve_best_response(agent: BestResponse) -> Reals:
    play = [agent.action_probabilities(seat) for seat in range(agent.problem.walker_count)]
    model = best_response.build_induced_mdp(agent.problem, agent.seat, play)
    return sparse.compute_optimal_q(model, agent.problem.discount)


@dataclass(frozen=True)
class HuntEquilibrium(ReactivePolicy):
    """Mixes its moves so that one against one neither gains by another policy.

    What a prey loses a predator gains, to scale, so that this also secures the most against any
    opponent. The values are against the other's part of the equilibrium.
    """

    problem: PredatorPrey

    uniform_count = 1  # for the move

    def __post_init__(self) -> None:
        """Refuses games whose equilibrium it does not find."""
        super().__post_init__()
        hunt = self.problem
        if hunt.walker_count != 2 or hunt.state_count > markov_game.MAX_STATES:
            got = f"{hunt.walker_count} agents on {len(hunt.hexes)} hexes"
            raise BadPolicy(f"equilibrium: got {got}, expected two on at most 22")
        if hunt.discount >= 1.0:
            raise BadPolicy("a hunt without end needs a discount below 1")

    @cached_property
    def _solution(self) -> markov_game.MarkovGameEquilibrium:
        return markov_game.find_equilibrium(self.problem)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """A move drawn from the mix of this state."""
        return Categorical(
            self._cumulative_probabilities.take(self.problem.state_indices(memory[0]), axis=0)
        ).sample_events(u)

    @cached_property
    def _cumulative_probabilities(self) -> Reals:
        """The cumulative probabilities `[S, 5]` of the moves."""
        return Categorical.from_probabilities(self._solution.policies[self.seat]).cumulative

    def action_values(self, memory: Memory) -> Reals:
        """Q of each move against the other's part."""
        return np.asarray(self._solution.q[self.seat][self.problem.state_indices(memory[0])])


def _natural_policy_name(problem: PredatorPrey, seat: int) -> str:
    """What an agent of this seat's kind does."""
    return "chase" if seat in problem.predator_seats else "flee"


def build_roster(problem: PredatorPrey, seat: int) -> Roster:
    """Who hunts; the best answer advises where it is found while one waits, else natural play."""
    natural = _natural_policy_name(problem, seat)
    each = 3**problem.predators * max(len(problem.hexes), 3) ** problem.prey
    quick = problem.state_count * len(DIRECTIONS) * each <= MAX_QUICK_OUTCOMES
    return Roster(
        {**DISTANCE_POLICIES, "best-response": BestResponse, "equilibrium": HuntEquilibrium},
        hint_provider="best-response" if quick and problem.discount < 1.0 else natural,
        default_partner=natural,
    )

"""Policies for predator-prey."""

from abc import abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import AdviceQuestion, ReactivePolicy, StationaryPolicy
from dmplay.agents.horizon import HorizonPolicy
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.best_actions import select_greedy_actions
from dmplay.core.chance import Categorical
from dmplay.core.hexgrid import DIRECTIONS
from dmplay.core.memoization import memoize
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory
from dmplay.errors import BadPolicy
from dmplay.solvers.games import induced_mdp, markov_game_policy_iteration
from dmplay.solvers.mdp import sparse_mdp

from .rules import PredatorPrey

MAX_PLANNED_STATES = 200_000  # states times turns of which the values of all moves are kept
MAX_QUICK_OUTCOMES = 300_000  # outcomes of all states and moves that can be enumerated in a moment


@dataclass(frozen=True)
class _DistancePolicy(StationaryPolicy):
    """A policy that compares, for each move without a slip, the distance to the other kind."""

    problem: PredatorPrey

    def choose_from_states(self, s: Array, legal: Bools | None) -> Array:
        """Return the first of the best moves in each state."""
        hunt = self.problem
        other_seats = hunt.prey_seats if self.seat in hunt.predator_seats else hunt.predator_seats
        distances = [
            hunt.move_distances[s[:, self.seat], :, s[:, other_seat]] for other_seat in other_seats
        ]
        return self._choose_by_distance(np.min(distances, axis=0))

    @abstractmethod
    def _choose_by_distance(self, distances: Ints) -> Array:
        """Return the first of the best moves `[B]`, by steps `[B, 6]` to the nearest other."""


@dataclass(frozen=True)
class Chase(_DistancePolicy):
    """Moves toward the nearest agent of the other kind.
    It takes the first of e, ne, nw, w, sw and se that, without a slip, ends the fewest steps away.
    """

    def _choose_by_distance(self, distances: Ints) -> Array:
        return np.asarray(np.argmin(distances, axis=1))


@dataclass(frozen=True)
class Flee(_DistancePolicy):
    """Moves as far as possible from the nearest agent of the other kind.
    It takes the first of e, ne, nw, w, sw and se that, without a slip, ends the most steps away.
    """

    def _choose_by_distance(self, distances: Ints) -> Array:
        return np.asarray(np.argmax(distances, axis=1))


DISTANCE_POLICIES: dict[str, type[_DistancePolicy]] = {"chase": Chase, "flee": Flee}
OPPONENT_MODELS = ("natural", *DISTANCE_POLICIES, "random")


@dataclass(frozen=True)
class BestResponse(HorizonPolicy, StationaryPolicy):
    """Takes the action with the highest value if the other agents play as it assumes.

    They are assumed to play `to`; natural means that predators chase and prey flee. It plans for an
    infinite horizon, by policy iteration, or for `horizon` turns; its values are against these
    agents.
    """

    problem: PredatorPrey
    to: str = parameter(
        "natural",
        "assumed policy of the other agents: natural, chase, flee or random",
        choices=OPPONENT_MODELS,
    )

    def __post_init__(self) -> None:
        """Raise BadPolicy if the discount is 1, as an infinite horizon then has no value."""
        super().__post_init__()
        if self.problem.discount >= 1.0:
            raise BadPolicy("an infinite horizon needs a discount below 1")

    def action_probabilities(self, seat: int) -> Reals:
        """Return the probability `[S, 6]` with which the agent of a seat takes each action."""
        states, action_count = self.problem.enumerate_states(), len(DIRECTIONS)
        if self.to == "random":
            return np.full((len(states), action_count), 1 / action_count)
        name = _natural_policy_name(self.problem, seat) if self.to == "natural" else self.to
        policy = DISTANCE_POLICIES[name](self.problem, seat)
        return np.eye(action_count)[policy.choose((states,), None, np.zeros((len(states), 0)))]

    def predict_actions(self, memory: Memory, seat: int) -> Reals:
        """Return the probability `[B, 6]` of each move of another seat."""
        return np.asarray(self.action_probabilities(seat)[self.problem.state_indices(memory[0])])

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the first of the best moves in each state."""
        if self.horizon:
            return select_greedy_actions(self.action_values(memory), self.problem.reward_scale)
        return super().choose(memory, legal, u)

    def choose_from_states(self, s: Array, legal: Bools | None) -> Array:
        """Return the first of the best moves in each state."""
        return select_greedy_actions(self.action_values((s,)), self.problem.reward_scale)

    def values_with_turns_left(self, info_state: Array, turns_left: int | None) -> Reals:
        """Return Q `[B, 6]` of states against these others, with these rewards to come."""
        s = self.problem.state_indices(info_state)
        if turns_left is None:
            return np.asarray(_solve_best_response(self)[s])
        return np.asarray(_solve_finite_best_response(self)[turns_left - 1, s])

    def adapt_to_game(self, question: AdviceQuestion) -> Self:
        """Return the best response to the opponents' common policy, else this policy.

        It plans the turns left. The opponents stay natural if they play different policies, natural
        ones, or one it cannot model.
        """
        policy, names = super().adapt_to_game(question), {*question.opponents}
        natural_names = {_natural_policy_name(self.problem, seat) for seat in self._other_seats}
        if len(names) == 1 and names != natural_names and names <= {*OPPONENT_MODELS}:
            return replace(policy, to=question.opponents[0])
        return policy

    @property
    def _other_seats(self) -> list[int]:
        """The seats of the other agents."""
        return [seat for seat in range(len(self.problem.agents)) if seat != self.seat]

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return exact values against the assumed play of the others."""
        basis = super().values_basis(question)._replace(accuracy=Accuracy.EXACT)
        assumed = {self.to}
        if self.to == "natural":
            assumed = {_natural_policy_name(self.problem, seat) for seat in self._other_seats}
        if {*question.actual_opponents} == assumed:
            return basis
        verb = "other agents play" if len(self._other_seats) > 1 else "other agent plays"
        assumption = f"if the {verb} {' or '.join(sorted(assumed))}"
        return basis._replace(assumed_players=assumption)

    def can_plan_turns(self, turns: int) -> bool:
        """Return whether the values of that many turns can be computed and stored in time."""
        return self.problem.state_count * turns <= MAX_PLANNED_STATES


@memoize
def _solve_best_response(agent: BestResponse) -> Reals:
    """Return Q `[S, 6]` of the best response to the other seats' policies."""
    return sparse_mdp.compute_optimal_q(_build_best_response_mdp(agent), agent.problem.discount)


@memoize
def _solve_finite_best_response(agent: BestResponse) -> Reals:
    """Return Q `[T, S, 6]` of the best response with 1 to `horizon` turns left."""
    return sparse_mdp.compute_finite_horizon_q(
        _build_best_response_mdp(agent), agent.problem.discount, agent.horizon
    )


def _build_best_response_mdp(agent: BestResponse) -> sparse_mdp.SparseMdp:
    """Return the MDP of an agent's seat among the others that it assumes."""
    policies = [agent.action_probabilities(seat) for seat in range(agent.problem.walker_count)]
    return induced_mdp.build_induced_mdp(agent.problem, agent.seat, policies)


@dataclass(frozen=True)
class HuntEquilibrium(ReactivePolicy):
    """Plays a mixed Nash equilibrium of the hunt of one predator against one prey.

    A predator gains what a prey loses, up to a factor, so that this policy also secures the most
    against any opponent. The values are against the opponent's part of the equilibrium.
    """

    problem: PredatorPrey

    uniform_count = 1  # for the choice of the move

    def __post_init__(self) -> None:
        """Raise BadPolicy unless the hunt has two agents, few states and a discount below 1."""
        super().__post_init__()
        hunt = self.problem
        if hunt.walker_count != 2 or hunt.state_count > markov_game_policy_iteration.MAX_STATES:
            actual = f"{hunt.walker_count} agents on {len(hunt.hexes)} hexes"
            raise BadPolicy(f"equilibrium: got {actual}, expected 2 agents on at most 22 hexes")
        if hunt.discount >= 1.0:
            raise BadPolicy("an infinite horizon needs a discount below 1")

    @cached_property
    def _solution(self) -> markov_game_policy_iteration.MarkovGameEquilibrium:
        """The equilibrium policies of both agents and their Q."""
        return markov_game_policy_iteration.find_equilibrium(self.problem)

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return exact values without a turn limit."""
        basis, has_limit = super().values_basis(question), question.turn_limit is not None
        return basis._replace(accuracy=Accuracy.EXACT, ignores_turn_limit=has_limit)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return moves drawn from the equilibrium's mixed strategy in each state."""
        states = self.problem.state_indices(memory[0])
        return Categorical(self._cumulative_probabilities.take(states, axis=0)).sample_events(u)

    def choice_probabilities(self, memory: Memory) -> Reals:
        """Return the mixed strategy of each row `[B, A]`."""
        return self._solution.policies[self.seat][self.problem.state_indices(memory[0])]

    @cached_property
    def _cumulative_probabilities(self) -> Reals:
        """The cumulative probabilities `[S, 5]` of the moves."""
        return Categorical.from_probabilities(self._solution.policies[self.seat]).cumulative

    def action_values(self, memory: Memory) -> Reals:
        """Return Q of each move against the opponent's part of the equilibrium."""
        return np.asarray(self._solution.q[self.seat][self.problem.state_indices(memory[0])])


def _natural_policy_name(problem: PredatorPrey, seat: int) -> str:
    """Return the name of a seat's natural policy: chase for a predator, flee for a prey."""
    return "chase" if seat in problem.predator_seats else "flee"


def list_agents(problem: PredatorPrey, seat: int) -> Roster:
    """Return the agents of the hunt.

    The best response gives the hints if it is quick to solve and the discount is below 1, else the
    natural policy does.
    """
    natural_name = _natural_policy_name(problem, seat)
    outcomes_per_action = 3**problem.predators * max(len(problem.hexes), 3) ** problem.prey
    is_quick = problem.state_count * len(DIRECTIONS) * outcomes_per_action <= MAX_QUICK_OUTCOMES
    return Roster(
        {**DISTANCE_POLICIES, "best-response": BestResponse, "equilibrium": HuntEquilibrium},
        hint_provider="best-response" if is_quick and problem.discount < 1.0 else natural_name,
        default_partner=natural_name,
        rule_of_thumb=natural_name,
    )


AGENTS = list_agents

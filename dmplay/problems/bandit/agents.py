"""Policies for the bandit: by the belief over the listed bandits, or by counts of wins alone."""

from dataclasses import dataclass

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import SeatPolicy
from dmplay.agents.horizon import MAX_HORIZON
from dmplay.algorithms.ucb1 import compute_upper_bounds
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.best_actions import select_greedy_actions
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept, requires_fields
from dmplay.problems._shared import constant_state_agents
from dmplay.problems._shared.constant_state_agents import Greedy, ThompsonSampling
from dmplay.problems._shared.hidden_chances import SUCCESS


@dataclass(frozen=True)
class EpsilonGreedy(Greedy):
    """Pulls a random arm with probability epsilon, else the arm with the best chance of a win."""

    uniform_count = 2  # to explore or not, and for the arm

    epsilon: float = parameter(0.1, "probability of a random arm", 0.0, 1.0)

    def choice_probabilities(self, memory: Memory) -> Reals:
        """Return the probability `[B, A]` of each arm."""
        q = self.action_values(memory)
        best = np.eye(q.shape[1])[select_greedy_actions(q, self.problem.reward_scale)]
        return np.asarray((1.0 - self.epsilon) * best + self.epsilon / q.shape[1])

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return a random arm in some rows, and the best in the others (section 15.3)."""
        best = super().choose(memory, legal, u[:, :0])
        arms = self.problem.actions[self.seat].sample_actions(u[:, 1], legal)
        return np.where(u[:, 0] < self.epsilon, arms, best)


@dataclass(frozen=True)
class Ucb1(SeatPolicy):
    """Pulls the arm with the highest upper confidence bound on its mean (UCB1, section 15.4).

    It knows only its own wins and pulls of each arm, not the list of bandits.
    """

    exploration: float = parameter(1.4142135623730951, "factor on the width of the bound", 0.0)

    def initial_memory(self, observation: Array) -> Memory:
        """Return the wins and pulls `[B, A]` of each arm: none."""
        counts = np.zeros((len(observation), self.problem.action_counts[self.seat]))
        return (counts, counts)

    @requires_fields("action", "observation")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the counts with the last pull."""
        pulled = np.eye(memory[0].shape[1])[percept.action]
        wins = memory[0] + pulled * (percept.observation == SUCCESS)[:, None]
        return (wins, memory[1] + pulled)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the first arm with the highest bound; an arm that was not pulled has no bound."""
        wins, pulls = memory
        return select_greedy_actions(compute_upper_bounds(wins, pulls, self.exploration))


@dataclass(frozen=True)
class Optimal(constant_state_agents.Optimal):
    """Takes the best arm for its belief and the pulls left, by exact search."""

    horizon: int = parameter(20, "number of turns planned", 1, MAX_HORIZON)


AGENTS = Roster(
    {"greedy": Greedy, "epsilon-greedy": EpsilonGreedy, "ucb1": Ucb1,
     "thompson": ThompsonSampling, "optimal": Optimal},
    hint_provider="optimal", rule_of_thumb="greedy",
)  # fmt: skip

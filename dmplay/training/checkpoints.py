"""The expected return of learned policies: exact if states can be listed, else by games."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.agents.learned_policy import LearnedPolicy
from dmplay.algorithms.exploration import choose_greedy
from dmplay.algorithms.features import rate_actions
from dmplay.algorithms.finite_mdp import FiniteMdp, build_finite_mdp
from dmplay.core.arrays import Ints, Reals
from dmplay.core.best_actions import select_greedy_actions
from dmplay.core.problem import Problem, initial_state_distribution
from dmplay.errors import BadParameter, BudgetExceeded, DmplayError
from dmplay.registry.agents import load_agent, load_roster
from dmplay.simulation.rollouts import RolloutSpec, rollout_entrants
from dmplay.solvers.mdp.mdp_values import MAX_SWEEPS

MAX_EXACT_STATES = 2000
EVALUATION_SEED = 1_000_000_007  # of games on which all checkpoints of all seeds are evaluated
MAX_EXACT_CHANGE = 1e-10


@dataclass(frozen=True)
class Evaluator:
    """Evaluates policies of a problem from its initial states, up to its turn limit."""

    problem: Problem
    games: int = 1000  # for problems whose states cannot be listed

    @cached_property
    def mdp(self) -> FiniteMdp | None:
        """The problem as a finite MDP; None if it has too many states, or hidden ones."""
        problem, count = self.problem, self.problem.state_count
        is_listed = isinstance(count, int) and count <= MAX_EXACT_STATES
        if problem.partially_observable or not is_listed:
            return None
        try:
            initial_state_distribution(problem)
            return build_finite_mdp(problem)
        except (BadParameter, BudgetExceeded):
            return None

    def evaluate(self, policy: LearnedPolicy) -> float:
        """Return the expected return of a policy, or its mean in games on common uniforms."""
        if self.mdp is None:
            return self._play(policy)
        legal = np.isfinite(self.mdp.rewards)
        q = rate_actions(policy.weights, policy.features.activate(self.mdp.states))
        values = self.evaluate_actions(choose_greedy(q, legal))
        return self._play(policy) if values is None else self.average_start(values)

    def _play(self, policy: object) -> float:
        """Return the mean return of games."""
        spec = RolloutSpec(range(self.games), seed=EVALUATION_SEED, keep=("returns",))
        (rollout,) = rollout_entrants(self.problem, [[policy]], spec)  # type: ignore[list-item]
        return float(rollout.returns.mean())

    def average_start(self, values: Reals) -> float:
        """Return the mean of values `[S]` over the initial states."""
        p, states = initial_state_distribution(self.problem)
        return float(p @ values[self.problem.state_indices(states)])

    def evaluate_actions(self, actions: Ints) -> Reals | None:
        """Return V `[S]` of a policy: algorithm 7.3, or a sweep for each turn of a horizon.

        None if without a discount the policy may never end.
        """
        mdp = self.mdp
        assert mdp is not None
        rows = np.arange(len(mdp.states))
        p, next_states = mdp.probabilities[rows, actions], mdp.next_states[rows, actions]
        rewards = mdp.rewards[rows, actions]
        if self.problem.horizon:
            values: Reals = np.zeros(len(rows))
            for _ in range(self.problem.horizon):
                values = rewards + mdp.discount * (p * values[next_states]).sum(axis=1)
            return values
        system = np.eye(len(rows))
        np.subtract.at(system, (rows[:, None], next_states), mdp.discount * p)
        system[mdp.terminal] = np.eye(len(rows))[mdp.terminal]
        try:
            return np.asarray(np.linalg.solve(system, rewards))
        except np.linalg.LinAlgError:
            return None

    @cached_property
    def optimal_values(self) -> Reals | None:
        """V* `[S]`, by value iteration and a linear system; None if unknown."""
        mdp = self.mdp
        if mdp is None:
            return None
        values: Reals = np.zeros(len(mdp.states))
        for _ in range(self.problem.horizon or MAX_SWEEPS):
            previous, values = values, mdp.compute_action_values(values).max(axis=1)
            if not self.problem.horizon and abs(values - previous).max() < MAX_EXACT_CHANGE:
                q = mdp.compute_action_values(values)
                return self.evaluate_actions(select_greedy_actions(q, self.problem.reward_scale))
        return values if self.problem.horizon else None

    @cached_property
    def optimal_actions(self) -> Ints | None:
        """An optimal action `[S]` in each state, with all turns to go; None if unknown."""
        if self.optimal_values is None or self.mdp is None:
            return None
        q = self.mdp.compute_action_values(self.optimal_values)
        return select_greedy_actions(q, self.problem.reward_scale)

    @cached_property
    def optimum(self) -> tuple[float, str]:
        """The best expected return and its source, or that of the agent that gives hints.

        The return is nan if there is none.
        """
        if self.optimal_values is not None:
            return self.average_start(self.optimal_values), "exact"
        roster = load_roster(self.problem)
        name = "optimal" if "optimal" in roster.agents else roster.hint_provider
        try:
            agent = load_agent(self.problem, 0, name or "", turns=self.problem.horizon)
            return self._play(agent), f"agent {name}"
        except DmplayError:
            return float("nan"), "unknown"

"""Markov games of any number of agents, by best-response dynamics and fictitious play.

First the agents reply in turn to the policies of the others until nobody changes: then no agent
gains by another policy. If that cycles, each replies to the others' average past behavior
(fictitious play, Brown 1951, with policies of the state alone). The result includes each agent's
regret at the start (section 25.2); with more than two agents, or two that are not opposed, it need
not vanish.
"""

from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.best_actions import compute_reward_scale, compute_tolerance
from dmplay.core.problem import Problem, initial_state_distribution
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.errors import BadPolicy
from dmplay.solvers.mdp.transition_graph import TransitionGraph

WORK_LIMIT = 2e10
# rounds of replies to the latest policies, then to their averages
PURE_ROUNDS, FICTITIOUS_PLAY_ROUNDS = 20, 64
CONVERGENCE_TOLERANCE = 1e-9  # distance of values from their limit, at a scale of 1
DISCOUNT_REQUIRED_MESSAGE = "got an infinite horizon and discount 1, expected a discount below 1"


class BestResponseResult(NamedTuple):
    """The policy of each agent, its values, and its regret."""

    graph: TransitionGraph
    policies: list[Reals]  # [S, A] of each agent
    values: Reals  # [S, n]
    q: list[Reals]  # [S, A] of each agent against the others' policies; -inf for illegal actions
    regrets: Reals  # [n], gain by the best response at the start
    round_count: int


class _InducedMdp(NamedTuple):
    """The MDP of one agent that results from fixing the other agents' policies."""

    graph: TransitionGraph
    seat: int
    state_action_cells: Ints  # [R], flat index of state and own action of each joint action
    others_probabilities: Reals  # [R], probability of the other agents' part of each joint action
    legality_penalty: Reals  # [S, A], 0 for legal actions, else -inf
    discount: float

    def compute_action_values(self, values: Reals) -> Reals:
        """Return Q `[S, A]` of the agent's actions, given values `[S]` of the next states."""
        weighted_values = self.graph.probabilities * values[self.graph.next_states]
        next_values = np.add.reduceat(weighted_values, self.graph.outcome_starts[:-1])
        rewards = self.graph.rewards[:, self.seat]
        q = self.others_probabilities * (rewards + self.discount * next_values)
        sums = np.bincount(self.state_action_cells, q, self.legality_penalty.size).astype(float)
        return sums.reshape(self.legality_penalty.shape) + self.legality_penalty

    def iterate_values(self, values: Reals, policy: Reals | None, budget: Budget) -> Reals:
        """Return the agent's values `[S]` under a policy, or its optimal values for None."""
        is_terminal = np.diff(self.graph.action_starts) == 0
        horizon_factor = self.discount / (1.0 - self.discount)
        scale = compute_reward_scale(self.graph.rewards)
        while True:
            budget.spend_work(10 * ARRAY_CALL_WORK + 20.0 * len(self.graph.probabilities))
            q = self.compute_action_values(values)
            if policy is None:
                new_values = q.max(axis=1)
            else:
                new_values = (policy * np.where(policy > 0, q, 0)).sum(axis=1)
            new_values[is_terminal] = 0.0
            change = float(np.abs(new_values - values).max())
            values = new_values
            if horizon_factor * change <= compute_tolerance(values, CONVERGENCE_TOLERANCE, scale):
                return values


def find_equilibrium(problem: Problem, graph: TransitionGraph) -> BestResponseResult:
    """Return the joint policy with the smallest maximum regret among those tried.

    Raises BadPolicy if the problem is undiscounted.
    """
    if problem.discount == 1.0:
        raise BadPolicy(DISCOUNT_REQUIRED_MESSAGE)
    budget = Budget("best responses", "try fewer states, or the agent search", WORK_LIMIT)
    scale = compute_reward_scale(graph.rewards)
    legal_masks = [_mark_legal_actions(problem, graph, seat) for seat in range(len(problem.agents))]
    policies = [mask / mask.sum(axis=1, keepdims=True) for mask in legal_masks]
    result = best = evaluate_policies(problem, graph, policies, budget)
    for round_number in range(1, PURE_ROUNDS + FICTITIOUS_PLAY_ROUNDS + 1):
        tolerance = compute_tolerance(best.values, CONVERGENCE_TOLERANCE, scale)
        if best.regrets.max() <= tolerance or budget.work_spent > budget.work_limit / 2:
            break
        step = 1.0 if round_number <= PURE_ROUNDS else 1.0 / (round_number - PURE_ROUNDS)
        for seat, policy in enumerate(policies):
            induced_mdp = _build_induced_mdp(problem, graph, policies, legal_masks, seat)
            values = induced_mdp.iterate_values(result.values[:, seat], None, budget)
            best_actions = induced_mdp.compute_action_values(values).argmax(axis=1)
            policies[seat] = policy + step * (np.eye(policy.shape[1])[best_actions] - policy)
        result = evaluate_policies(problem, graph, policies, budget)
        result = result._replace(round_count=round_number)
        best = result if result.regrets.max() < best.regrets.max() else best
    return best


def evaluate_policies(
    problem: Problem, graph: TransitionGraph, policies: list[Reals], budget: Budget | None = None
) -> BestResponseResult:
    """Return the values of a joint policy, and each agent's regret at the start."""
    budget = budget or Budget("best responses", "try fewer states", WORK_LIMIT)
    probabilities, start = initial_state_distribution(problem)
    start_states = graph.find_state_indices(problem, start)
    start_distribution = np.bincount(start_states, probabilities, len(graph.states))
    legal_masks = [_mark_legal_actions(problem, graph, seat) for seat in range(len(policies))]
    zeros = np.zeros(len(graph.states))
    values, q, regrets = [], [], []
    for seat, policy in enumerate(policies):
        induced_mdp = _build_induced_mdp(problem, graph, policies, legal_masks, seat)
        values.append(induced_mdp.iterate_values(zeros, policy, budget))
        q.append(induced_mdp.compute_action_values(values[-1]))
        best_values = induced_mdp.iterate_values(values[-1], None, budget)
        regrets.append(max(float(start_distribution @ (best_values - values[-1])), 0.0))
    state_values = np.stack(values, axis=1)
    return BestResponseResult(graph, list(policies), state_values, q, np.array(regrets), 0)


def _mark_legal_actions(problem: Problem, graph: TransitionGraph, seat: int) -> Reals:
    """Return 1 for each legal action of a seat `[S, A]`, else 0; terminal states have action 0."""
    mask = np.zeros((len(graph.states), problem.action_counts[seat]))
    mask[graph.source_states, graph.joint_actions[:, seat]] = 1.0
    mask[np.diff(graph.action_starts) == 0, 0] = 1.0
    return mask


def _build_induced_mdp(
    problem: Problem,
    graph: TransitionGraph,
    policies: list[Reals],
    legal_masks: list[Reals],
    seat: int,
) -> _InducedMdp:
    """Return the MDP of a seat given the policies of all other seats."""
    source_states, others_probabilities = graph.source_states, np.ones(len(graph.rewards))
    for other, policy in enumerate(policies):
        if other != seat:
            others_probabilities *= policy[source_states, graph.joint_actions[:, other]]
    cells = source_states * legal_masks[seat].shape[1] + graph.joint_actions[:, seat]
    legality_penalty = np.where(legal_masks[seat] > 0, 0.0, -np.inf)
    return _InducedMdp(graph, seat, cells, others_probabilities, legality_penalty, problem.discount)

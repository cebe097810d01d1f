"""Improvement of joint plans by alternating maximization over one agent's layer at a time.

Each node gets the action and the next nodes that are best where it is reached, given the partners'
plans; a node that is not reached is optimized for a random case (alternating maximization, as in
JESP, Nair et al., IJCAI 2003; on graphs of nodes: Pajarinen and Peltonen, NIPS 2011). The value
never falls, but it may stop at a plan that no agent can improve alone.
"""

from collections.abc import Iterator

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.uniforms import generate_uniforms
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.solvers.decpomdp.dec_pomdp_model import (
    AgentPlan,
    DecPomdp,
    PlanLayer,
    compute_joint_indices,
    list_joint_nodes,
)

PLAN_SEED = 1
MAX_IDLE_SWEEPS = 2  # sweeps without improvement
MIN_IMPROVEMENT = 1e-9
MAX_SWEEPS = 50  # each with another random case for unreached nodes


def sample_random_plans(
    team: DecPomdp, turns: int, nodes_per_turn: int, plan_number: int
) -> tuple[AgentPlan, ...]:
    """Return random plans with this number of nodes per turn; each plan number gives others."""
    plans = []
    counts = zip(team.action_counts, team.observation_counts, strict=True)
    for seat, (action_count, observation_count) in enumerate(counts):
        shape = turns * nodes_per_turn, 1 + observation_count
        by_turn = _generate_plan_uniforms(seat, plan_number, shape).reshape(
            turns, nodes_per_turn, -1
        )
        actions = (action_count * by_turn[:, :, 0]).astype(int)
        next_nodes = (nodes_per_turn * by_turn[:, :, 1:]).astype(int)
        next_nodes[-1] = 0
        plans.append(tuple(map(PlanLayer, actions, next_nodes)))
    return tuple(plans)


def _generate_plan_uniforms(stream: int, number: int, shape: tuple[int, int]) -> Reals:
    """Return the uniforms `shape` of one number in a stream of plans."""
    rows, count = shape
    return generate_uniforms(PLAN_SEED, stream, number, first_episode=0, rows=rows, count=count)


def evaluate_plans(team: DecPomdp, plans: tuple[AgentPlan, ...], budget: Budget) -> float:
    """Return the expected return of agents with these plans."""
    return PlanGraph(team, plans, budget).value


def improve_plans(
    team: DecPomdp, plans: tuple[AgentPlan, ...], budget: Budget
) -> tuple[AgentPlan, ...]:
    """Return these plans, improved as far as the budget allows."""
    graph = PlanGraph(team, plans, budget)
    idle_sweeps, best = 0, -np.inf
    with budget.stop_when_exceeded():
        for sweep_number in range(MAX_SWEEPS):
            value = graph.improve_all_layers(sweep_number)
            idle_sweeps = 0 if value > best + MIN_IMPROVEMENT else idle_sweeps + 1
            best = max(best, value)
            if idle_sweeps == MAX_IDLE_SWEEPS:
                break
    return graph.plans


class PlanGraph:
    """The plans of all agents as a graph of nodes, layer by layer."""

    def __init__(self, team: DecPomdp, plans: tuple[AgentPlan, ...], budget: Budget) -> None:
        self.team, self.budget, self.turns = team, budget, len(plans[0])
        self._layers = [list(layers) for layers in zip(*plans, strict=True)]

    @property
    def plans(self) -> tuple[AgentPlan, ...]:
        """The current plans."""
        return tuple(tuple(plan) for plan in zip(*self._layers, strict=True))

    @property
    def value(self) -> float:
        """The expected return of the current plans."""
        values: Reals = np.zeros((1, len(self.team.initial_belief)))
        for turn in reversed(range(self.turns)):
            values = self._backup_values(turn, values)
        return float(values[0] @ self.team.initial_belief)

    def compute_reach_probabilities(self) -> list[Reals]:
        """Return the probability of each joint node and state `[Q, S]`, by turn.

        The last element is the distribution after the last turn.
        """
        result = [
            np.zeros((self._count_joint_nodes(turn), len(self.team.initial_belief)))
            for turn in range(self.turns)
        ]
        result.append(np.zeros((1, len(self.team.initial_belief))))
        result[0][0] = self.team.initial_belief
        for turn in range(self.turns):
            next_nodes = self._find_next_joint_nodes(turn)
            for action, rows in self._iter_joint_actions(turn):
                propagated = self.team.propagate_states(result[turn][rows], action)
                joint = propagated[:, :, None] * self.team.observation_model[action]
                np.add.at(result[turn + 1], next_nodes[rows], joint.swapaxes(1, 2))
        return result

    def improve_all_layers(self, sweep_number: int) -> float:
        """Improve each layer, the last one first, and return the value of the resulting plans."""
        reached = self.compute_reach_probabilities()
        values = np.zeros((1, len(self.team.initial_belief)))
        for turn in reversed(range(self.turns)):
            for seat in range(len(self.team.action_counts)):
                weights = self._weigh_joint_nodes(turn, seat, reached[turn], sweep_number)
                total, next_nodes = self._score_node_actions(turn, seat, weights, values)
                actions = total.argmax(axis=1)
                next_nodes = next_nodes[np.arange(len(actions)), actions]
                self._layers[turn][seat] = PlanLayer(actions, next_nodes)
            values = self._backup_values(turn, values)
        return float(values[0] @ self.team.initial_belief)

    def compute_action_values(self, seat: int) -> list[Reals]:
        """Return the action values `[K, A]` of an agent's nodes by turn, given the partners.

        They are nan for a node that is not reached.
        """
        reached = self.compute_reach_probabilities()
        values = np.zeros((1, len(self.team.initial_belief)))
        result: list[Reals] = []
        for turn in reversed(range(self.turns)):
            total, _ = self._score_node_actions(turn, seat, reached[turn], values)
            seat_nodes = list_joint_nodes(self._count_nodes(turn))[:, seat]
            mass = np.bincount(seat_nodes, reached[turn].sum(axis=1), len(total))
            result.append(total / np.where(mass > 0, mass, np.nan)[:, None])
            values = self._backup_values(turn, values)
        return result[::-1]

    def _count_nodes(self, turn: int) -> tuple[int, ...]:
        """Return the number of nodes of each agent; 1 after the last turn."""
        if turn == self.turns:
            return (1,) * len(self.team.action_counts)
        return tuple(len(layer.actions) for layer in self._layers[turn])

    def _count_joint_nodes(self, turn: int) -> int:
        """Return the number of joint nodes of a turn."""
        return int(np.prod(self._count_nodes(turn)))

    def _iter_joint_actions(
        self, turn: int, free_seat: int | None = None
    ) -> Iterator[tuple[int, Ints]]:
        """Yield each joint action that is chosen, with its joint nodes.

        The action of `free_seat`, if given, counts as 0.
        """
        node_columns = list_joint_nodes(self._count_nodes(turn)).T
        action_columns = [
            layer.actions[node_column]
            for layer, node_column in zip(self._layers[turn], node_columns, strict=True)
        ]
        if free_seat is not None:
            action_columns[free_seat] = np.zeros_like(action_columns[free_seat])
        actions = compute_joint_indices(action_columns, self.team.action_counts)
        for action in np.unique(actions).tolist():
            rows = np.flatnonzero(actions == action)
            self.budget.spend_work(ARRAY_CALL_WORK + 2.0 * len(rows) * self.team.propagation_work)
            yield action, rows

    def _find_next_joint_nodes(self, turn: int) -> Ints:
        """Return the next joint node `[Q, O]` for each joint node and joint observation."""
        node_columns = list_joint_nodes(self._count_nodes(turn)).T
        observation_columns = self.team.joint_observations.T
        steps = zip(self._layers[turn], node_columns, observation_columns, strict=True)
        return compute_joint_indices(
            [layer.next_nodes[node_column[:, None], o] for layer, node_column, o in steps],
            self._count_nodes(turn + 1),
        )

    def _backup_values(self, turn: int, values: Reals) -> Reals:
        """Return the values `[Q, S]` of a turn, given those `[Q', S']` of the next turn."""
        result = np.empty((self._count_joint_nodes(turn), len(self.team.initial_belief)))
        next_nodes = self._find_next_joint_nodes(turn)
        for action, rows in self._iter_joint_actions(turn):
            weighted_values = values[next_nodes[rows]] * self.team.observation_model[action].T
            expected_values = self.team.backup_values(weighted_values.sum(axis=1), action)
            result[rows] = self.team.rewards[:, action] + self.team.discount * expected_values
        return result

    def _weigh_joint_nodes(
        self, turn: int, seat: int, reach_probabilities: Reals, sweep_number: int
    ) -> Reals:
        """Return the weights of joint nodes and states for optimizing an agent's nodes.

        They are the reach probabilities; an unreached node gets random weights at one random node
        of the partners.
        """
        counts = self._count_nodes(turn)
        node_weights = np.moveaxis(reach_probabilities.reshape(*counts, -1), seat, 0).copy()
        unreached = np.flatnonzero(~node_weights.reshape(len(node_weights), -1).any(axis=1))
        if len(unreached):
            state_count = reach_probabilities.shape[1]
            u = _generate_plan_uniforms(turn, sweep_number, (len(unreached), 1 + state_count))
            flat_weights = node_weights.reshape(len(node_weights), -1, state_count)
            partner_nodes = (flat_weights.shape[1] * u[:, 0]).astype(int)
            random_weights = -np.log1p(-u[:, 1:]) * reach_probabilities.sum(axis=0)
            flat_weights[unreached, partner_nodes] = random_weights
        return np.moveaxis(node_weights, 0, seat).reshape(reach_probabilities.shape)

    def _score_node_actions(
        self, turn: int, seat: int, node_weights: Reals, values: Reals
    ) -> tuple[Reals, Ints]:
        """Return weighted action values `[K, A]` and the best next nodes of an agent's nodes."""
        team, next_counts = self.team, self._count_nodes(turn + 1)
        seat_nodes = list_joint_nodes(self._count_nodes(turn))[:, seat]
        action_count, observation_count = team.action_counts[seat], team.observation_counts[seat]
        rewards = np.zeros((seat_nodes.max() + 1, action_count))
        next_scores = np.zeros((len(rewards), action_count, observation_count, next_counts[seat]))
        values = np.moveaxis(values.reshape(*next_counts, -1), seat, -1)  # [others' K', S', K']
        values = values.reshape(-1, len(team.initial_belief), next_counts[seat])
        partner_next_nodes = self._find_partners_next_nodes(turn, seat)
        is_weighted = np.asarray(node_weights.any(axis=1))
        for action, action_rows in self._iter_joint_actions(turn, seat):
            rows = action_rows[is_weighted[action_rows]]
            variants = team.vary_seat_action(action, seat)
            work_per_action = ARRAY_CALL_WORK + 2.0 * team.propagation_work
            self.budget.spend_work(action_count * len(rows) * work_per_action)
            propagated = team.propagate_seat_actions(node_weights[rows], action, seat)
            observation_probabilities = self._split_observation_model(variants, seat)
            for index, joint_node in enumerate(rows.tolist()):
                node = seat_nodes[joint_node]
                rewards[node] += node_weights[joint_node] @ team.rewards[:, variants]
                joint = propagated[:, index, None, None] * observation_probabilities
                flat_values = values[partner_next_nodes[joint_node]].reshape(-1, next_counts[seat])
                score = joint.reshape(action_count * observation_count, -1) @ flat_values
                next_scores[node] += score.reshape(action_count, observation_count, -1)
        total = rewards + team.discount * next_scores.max(axis=3).sum(axis=2)
        return total, next_scores.argmax(axis=3)

    def _split_observation_model(self, actions: list[int], seat: int) -> Reals:
        """Return the probabilities `[A, O, R, S']` of the seat's and its partners' observations."""
        counts, state_count = self.team.observation_counts, len(self.team.initial_belief)
        probabilities = self.team.observation_model[actions].swapaxes(1, 2)
        probabilities = probabilities.reshape(len(actions), *counts, state_count)
        probabilities = np.moveaxis(probabilities, seat + 1, 1)
        return np.asarray(probabilities.reshape(len(actions), counts[seat], -1, state_count))

    def _find_partners_next_nodes(self, turn: int, seat: int) -> Ints:
        """Return the partners' next joint node `[Q, R]` by joint node and observation."""
        others = [other for other in range(len(self.team.action_counts)) if other != seat]
        observation_counts = [self.team.observation_counts[other] for other in others]
        node_columns = list_joint_nodes(self._count_nodes(turn)).T
        next_counts = self._count_nodes(turn + 1)
        columns = zip(others, list_joint_nodes(observation_counts).T, strict=True)
        steps = [
            self._layers[turn][other].next_nodes[node_columns[other][:, None], observation_column]
            for other, observation_column in columns
        ]
        return compute_joint_indices(steps, tuple(next_counts[other] for other in others))

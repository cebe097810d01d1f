"""Joint plans made better by turns: one agent's layer of nodes at a time, all else as it is.

Each node takes the action and the next nodes that are best where it is reached, beside what the
partners do; one that is not reached is made for some other case (alternating maximisation, as in
JESP, Nair et al., IJCAI 2003; on graphs of nodes: Pajarinen and Peltonen, NIPS 2011). The value
never falls, but it may stay at a plan that no agent alone can mend.
"""

from collections.abc import Iterator

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Ints, Reals
from dmplay.dice import generate_uniforms
from dmplay.solvers.team import (
    AgentPlan,
    DecPomdp,
    PlanLayer,
    compute_joint_indices,
    list_joint_nodes,
)

PLAN_SEED = 1
MAX_IDLE_SWEEPS = 2  # sweeps in which nothing gets better
MIN_IMPROVEMENT = 1e-9
MAX_SWEEPS = 50  # of sweeps, at most


def sample_random_plans(
    team: DecPomdp, turns: int, nodes_per_turn: int, plan_number: int
) -> tuple[AgentPlan, ...]:
    """Plans of so many nodes a turn that do anything: of each number other ones."""
    plans = []
    for seat, (many, kinds) in enumerate(
        zip(team.action_counts, team.observation_counts, strict=True)
    ):
        u = generate_uniforms(
            PLAN_SEED,
            seat,
            plan_number,
            first_episode=0,
            rows=turns * nodes_per_turn,
            count=1 + kinds,
        )
        shaped = u.reshape(turns, nodes_per_turn, 1 + kinds)
        actions, then = (
            (many * shaped[:, :, 0]).astype(int),
            (nodes_per_turn * shaped[:, :, 1:]).astype(int),
        )
        then[-1] = 0
        plans.append(tuple(map(PlanLayer, actions, then)))
    return tuple(plans)


def evaluate_plans(team: DecPomdp, plans: tuple[AgentPlan, ...], budget: Budget) -> float:
    """What agents with these plans earn."""
    return PlanGraph(team, plans, budget).value


def improve_plans(
    team: DecPomdp, plans: tuple[AgentPlan, ...], budget: Budget
) -> tuple[AgentPlan, ...]:
    """These plans, or better ones, as far as the budget goes."""
    graph = PlanGraph(team, plans, budget)
    still, best = 0, -np.inf
    with budget.stop_when_exceeded():
        for number in range(MAX_SWEEPS):
            value = graph.improve_all_layers(number)
            still = 0 if value > best + MIN_IMPROVEMENT else still + 1
            best = max(best, value)
            if still == MAX_IDLE_SWEEPS:
                break
    return graph.plans


class PlanGraph:
    """The plans of all agents, turn by turn."""

    def __init__(self, team: DecPomdp, plans: tuple[AgentPlan, ...], budget: Budget) -> None:
        self.team, self.budget, self.turns = team, budget, len(plans[0])
        self._layers = [list(layers) for layers in zip(*plans, strict=True)]

    @property
    def plans(self) -> tuple[AgentPlan, ...]:
        """As they are now."""
        return tuple(tuple(plan) for plan in zip(*self._layers, strict=True))

    @property
    def value(self) -> float:
        """What they earn."""
        values: Reals = np.zeros((1, len(self.team.initial_belief)))
        for turn in reversed(range(self.turns)):
            values = self._backup_values(turn, values)
        return float(values[0] @ self.team.initial_belief)

    def compute_reach_probabilities(self) -> list[Reals]:
        """How likely each joint node and state `[Q, S]` of each turn are, and what comes after."""
        found = [
            np.zeros((self._count_joint_nodes(turn), len(self.team.initial_belief)))
            for turn in range(self.turns)
        ]
        found.append(np.zeros((1, len(self.team.initial_belief))))
        found[0][0] = self.team.initial_belief
        for turn in range(self.turns):
            then = self._find_next_joint_nodes(turn)
            for action, rows in self._iter_joint_actions(turn):
                came = self.team.propagate_states(found[turn][rows], action)
                joint = came[:, :, None] * self.team.observation_model[action]
                np.add.at(found[turn + 1], then[rows], joint.swapaxes(1, 2))
        return found

    def improve_all_layers(self, sweep_number: int) -> float:
        """Makes each layer better, the last first; what the plans then earn."""
        reached, values = (
            self.compute_reach_probabilities(),
            np.zeros((1, len(self.team.initial_belief))),
        )
        for turn in reversed(range(self.turns)):
            for seat in range(len(self.team.action_counts)):
                self._improve_layer(
                    turn,
                    seat,
                    self._fill_unreached_nodes(turn, seat, reached[turn], sweep_number),
                    values,
                )
            values = self._backup_values(turn, values)
        return float(values[0] @ self.team.initial_belief)

    def compute_action_values(self, seat: int) -> list[Reals]:
        """What each action `[K, A]` at an agent's nodes is worth beside the partners, by turn."""
        reached, values = (
            self.compute_reach_probabilities(),
            np.zeros((1, len(self.team.initial_belief))),
        )
        found: list[Reals] = []
        for turn in reversed(range(self.turns)):
            total, _ = self._score_node_actions(turn, seat, reached[turn], values)
            own = list_joint_nodes(self._count_nodes(turn))[:, seat]
            mass = np.bincount(own, reached[turn].sum(axis=1), len(total))
            found.append(total / np.where(mass > 0, mass, 1.0)[:, None])
            values = self._backup_values(turn, values)
        return found[::-1]

    def _count_nodes(self, turn: int) -> tuple[int, ...]:
        """How many nodes each agent has; one when all is over."""
        if turn == self.turns:
            return (1,) * len(self.team.action_counts)
        return tuple(len(layer.actions) for layer in self._layers[turn])

    def _count_joint_nodes(self, turn: int) -> int:
        return int(np.prod(self._count_nodes(turn)))

    def _iter_joint_actions(
        self, turn: int, free_seat: int | None = None
    ) -> Iterator[tuple[int, Ints]]:
        """Each joint action that is taken, and in which joint nodes; but for what a seat does."""
        each = list_joint_nodes(self._count_nodes(turn)).T
        chosen = [layer.actions[own] for layer, own in zip(self._layers[turn], each, strict=True)]
        if free_seat is not None:
            chosen[free_seat] = np.zeros_like(chosen[free_seat])
        actions = compute_joint_indices(chosen, self.team.action_counts)
        for action in np.unique(actions).tolist():
            rows = np.flatnonzero(actions == action)
            self.budget.spend_work(ARRAY_CALL_WORK + 2.0 * len(rows) * self.team.propagation_work)
            yield action, rows

    def _find_next_joint_nodes(self, turn: int) -> Ints:
        """The joint node `[Q, O]` to which a joint observation leads."""
        each, seen = list_joint_nodes(self._count_nodes(turn)).T, self.team.joint_observations.T
        steps = zip(self._layers[turn], each, seen, strict=True)
        return compute_joint_indices(
            [layer.next_nodes[own[:, None], o] for layer, own, o in steps],
            self._count_nodes(turn + 1),
        )

    def _backup_values(self, turn: int, values: Reals) -> Reals:
        """The values `[Q, S]` of a turn from those `[Q', S']` of the next."""
        found = np.empty((self._count_joint_nodes(turn), len(self.team.initial_belief)))
        then = self._find_next_joint_nodes(turn)
        for action, rows in self._iter_joint_actions(turn):
            ahead = (values[then[rows]] * self.team.observation_model[action].T).sum(axis=1)
            later = self.team.backup_values(ahead, action)
            found[rows] = self.team.rewards[:, action] + self.team.discount * later
        return found

    def _fill_unreached_nodes(
        self, turn: int, seat: int, reach_probabilities: Reals, sweep_number: int
    ) -> Reals:
        """The joint nodes and states that each node of an agent is made for."""
        counts = self._count_nodes(turn)
        met = np.moveaxis(reach_probabilities.reshape(*counts, -1), seat, 0).copy()
        idle = np.flatnonzero(~met.reshape(len(met), -1).any(axis=1))
        if len(idle):
            u = generate_uniforms(
                PLAN_SEED,
                turn,
                sweep_number,
                first_episode=0,
                rows=len(idle),
                count=1 + reach_probabilities.shape[1],
            )
            others = met.reshape(len(met), -1, reach_probabilities.shape[1])
            place = (others.shape[1] * u[:, 0]).astype(int)
            others[idle, place] = -np.log1p(-u[:, 1:]) * reach_probabilities.sum(axis=0)
        return np.moveaxis(met, 0, seat).reshape(reach_probabilities.shape)

    def _improve_layer(self, turn: int, seat: int, node_weights: Reals, values: Reals) -> None:
        """Gives an agent's nodes of a turn their best actions and next nodes."""
        total, then = self._score_node_actions(turn, seat, node_weights, values)
        actions = total.argmax(axis=1)
        self._layers[turn][seat] = PlanLayer(actions, then[np.arange(len(actions)), actions])

    def _score_node_actions(
        self, turn: int, seat: int, node_weights: Reals, values: Reals
    ) -> tuple[Reals, Ints]:
        """What each action `[K, A]` is worth where a node is met, and the best nodes next."""
        team, later = self.team, self._count_nodes(turn + 1)
        own = list_joint_nodes(self._count_nodes(turn))[:, seat]
        many, kinds = team.action_counts[seat], team.observation_counts[seat]
        paid = np.zeros((own.max() + 1, many))
        ahead = np.zeros((len(paid), many, kinds, later[seat]))
        values = np.moveaxis(values.reshape(*later, -1), seat, -1)  # [others' K', S', K']
        values = values.reshape(-1, len(team.initial_belief), later[seat])
        then = self._find_partners_next_nodes(turn, seat)
        able = np.asarray(node_weights.any(axis=1))
        for action, alike in self._iter_joint_actions(turn, seat):
            rows = alike[able[alike]]
            each = team.list_seat_variants(action, seat)
            self.budget.spend_work(
                many * len(rows) * (ARRAY_CALL_WORK + 2.0 * team.propagation_work)
            )
            came = team.propagate_seat_actions(node_weights[rows], action, seat)
            seen = self._split_observation_model(each, seat)
            for place, row in enumerate(rows.tolist()):
                paid[own[row]] += node_weights[row] @ team.rewards[:, each]
                joint = came[:, place, None, None] * seen
                flat = values[then[row]].reshape(-1, later[seat])
                score = joint.reshape(many * kinds, -1) @ flat
                ahead[own[row]] += score.reshape(many, kinds, -1)
        total = paid + team.discount * ahead.max(axis=3).sum(axis=2)
        return total, ahead.argmax(axis=3)

    def _split_observation_model(self, actions: list[int], seat: int) -> Reals:
        """How likely an agent and the others observe what they do `[A, O, R, S']`."""
        many, kinds = len(actions), self.team.observation_counts[seat]
        seen = (
            self.team.observation_model[actions]
            .swapaxes(1, 2)
            .reshape(many, *self.team.observation_counts, -1)
        )
        seen = np.moveaxis(seen, seat + 1, 1)
        return np.asarray(seen.reshape(many, kinds, -1, len(self.team.initial_belief)))

    def _find_partners_next_nodes(self, turn: int, seat: int) -> Ints:
        """Where the others' observations lead them `[Q, R]`, jointly."""
        others = [other for other in range(len(self.team.action_counts)) if other != seat]
        seen = list_joint_nodes([self.team.observation_counts[other] for other in others]).T
        each, later = list_joint_nodes(self._count_nodes(turn)).T, self._count_nodes(turn + 1)
        steps = [
            self._layers[turn][other].next_nodes[each[other][:, None], seen[k]]
            for k, other in enumerate(others)
        ]
        return compute_joint_indices(steps, tuple(later[other] for other in others))

"""Monte Carlo tree search by upper confidence bounds (UCT, section 9.6), through `step` alone.

A node is what the seat did and saw since the root: states where they are seen, else observations
(POMCP; Silver and Veness, 2010). Where they are many or real, an edge tells some apart, as many as
the root of its visits (double progressive widening; Couetoux and others, 2011), and so a node has
some of many actions. Simulations run in waves, side by side: those of one wave that meet in a node
count each other as visits, so that they part. The n-th simulation of each first action has the same
dice and the same start, so that actions are compared on equal luck.
"""

from typing import NamedTuple
from zlib import crc32

import numpy as np

from dmplay.budget import Budget
from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Outcome, Problem
from dmplay.solvers.cast import OpponentModel
from dmplay.solvers.search_nodes import TreeBatch
from dmplay.solvers.search_subtree import restore_trees
from dmplay.solvers.search_tree import SearchConfig, SearchRequest

MIN_LEAD_ERRORS = 3.0  # standard errors by which another action is better than the usual one


class UctResult(NamedTuple):
    """What a search found out about each action that it tried, for B rows."""

    actions: Array  # [B, K]
    mean_returns: Reals  # [B, K], the mean return; -inf where it was never tried
    squared_errors: Reals  # [B, K], of the means, squared; infinite where there are none

    def keep_usual_unless_better(self, action_mask: Bools, usual_actions: Array) -> Bools:
        """The actions marked `[B, K]`, or the usual one `[B]` unless they are surely better."""
        row = np.arange(len(usual_actions))
        same = self.actions == usual_actions[:, None]
        own, best = np.argmax(same, axis=1), np.argmax(action_mask, axis=1)
        lead = self.mean_returns[row, best] - self.mean_returns[row, own]
        doubt = MIN_LEAD_ERRORS * np.sqrt(
            self.squared_errors[row, best] + self.squared_errors[row, own]
        )
        stays = same.any(axis=1) & ~(lead > doubt)
        return np.where(stays[:, None], same, action_mask)


def run_uct(config: SearchConfig, request: SearchRequest, u: Reals) -> tuple[UctResult, TreeBatch]:
    """What is found out about each action, by uniforms `[B, draws]`, and the trees that grew."""
    rows = len(u)
    grown = _UctSearch(config, request, config.make_budget(rows))
    told = u.reshape(rows, config.simulations, config.depth, -1)
    for wave in config.simulation_waves:
        grown.run_simulations(len(wave), told, config.estimate_turn_work(rows, wave))
    return grown.summarize_roots(), grown.trees


class SimulationBatch(NamedTuple):
    """Simulations under way."""

    lane_indices: Ints  # [N], of the wave
    states: Array  # [N, ...]
    memories: tuple[Memory, ...]  # of each of the cast
    turns_done: Ints  # [N], turns done
    turn_limits: Ints  # [N], turns that they may do

    def select_lanes(self, mask: Bools) -> "SimulationBatch":
        """Some of them."""
        if mask.all():
            return self
        lane, state, memories, turn, left = self
        kept = tuple(tuple(part[mask] for part in memory) for memory in memories)
        return SimulationBatch(lane[mask], state[mask], kept, turn[mask], left[mask])


def _concatenate_batches(parts: list[SimulationBatch]) -> SimulationBatch:
    """Lanes put aside one after the other."""
    if len(parts) == 1:
        return parts[0]
    lane, state, memories, turn, left = zip(*parts, strict=True)
    each = tuple(
        tuple(np.concatenate(part) for part in zip(*memory, strict=True))
        for memory in zip(*memories, strict=True)
    )
    joined = [np.concatenate(part) for part in (lane, state, turn, left)]
    return SimulationBatch(joined[0], joined[1], each, joined[2], joined[3])


class _UctSearch:
    """The simulations of a batch."""

    def __init__(self, config: SearchConfig, request: SearchRequest, budget: Budget) -> None:
        self.config, self.request, self.budget = config, request, budget
        self.trees = TreeBatch(config, request)
        if request.packed_trees:
            restore_trees(self.trees, request.packed_trees)
        self.squared_return_sums = np.zeros(
            (len(request.turns_left), config.action_slots)
        )  # of the returns of first actions

    def summarize_roots(self) -> UctResult:
        """What is known of the actions at the roots."""
        nodes = self.trees
        visits = nodes.visits[:: nodes.nodes_per_tree]
        means: Reals = np.full(visits.shape, -np.inf)
        np.divide(nodes.return_sums[:: nodes.nodes_per_tree], visits, out=means, where=visits > 0)
        errors: Reals = np.full(visits.shape, np.inf)
        spread = self.squared_return_sums - np.where(visits > 1, means, 0.0) ** 2 * visits
        np.divide(spread, visits * (visits - 1), out=errors, where=visits > 1)
        errors = np.maximum(errors, 0.0)
        actions = np.arange(visits.shape[1])[None].repeat(len(visits), axis=0)
        return UctResult(
            nodes.offered_actions[:: nodes.nodes_per_tree]
            if self.config.widens_actions
            else actions,
            means,
            errors,
        )

    def run_simulations(self, simulation_count: int, uniforms: Reals, turn_work: float) -> None:
        """Runs so many simulations of every row and learns from them."""
        tree, asked, nodes = self.config, self.request, self.trees
        row = np.repeat(
            np.arange(len(asked.turns_left)), np.where(asked.turns_left > 0, simulation_count, 0)
        )
        if not len(row):
            return
        node = row * nodes.nodes_per_tree
        legal = None if asked.legal_actions_mask is None else asked.legal_actions_mask[row]
        if tree.widens_actions:
            begun = tuple(tuple(part[row, 0] for part in memory) for memory in asked.memories)
            self._offer_policy_actions(node, begun, legal, uniforms[row, 0, 0])
        slot, nth = nodes.select_slots(node, legal)
        memories = tuple(tuple(part[row, nth] for part in memory) for memory in asked.memories)
        u = uniforms[row, nth]  # the n-th of each action has the n-th dice
        start = np.zeros(len(row), np.int64)
        lanes = SimulationBatch(
            np.arange(len(row)), asked.root_states[row, nth], memories, start, asked.turns_left[row]
        )
        path: list[tuple[Ints, Ints, Ints, Reals]] = []  # lanes, their nodes, slots and rewards
        outside: list[SimulationBatch] = []
        while True:
            self.budget.spend_work(turn_work)
            now = u[lanes.lane_indices, lanes.turns_done]
            lanes, child, known, paid = self._step_lanes(lanes, node, slot, now)
            path.append((lanes.lane_indices, node, slot, paid))
            going = ~tree.problem.terminal(lanes.states) & (lanes.turns_done < lanes.turn_limits)
            outside.append(lanes.select_lanes(going & ~known))
            on = going & known & (lanes.turns_done < tree.depth)
            if not on.any():
                break
            lanes, node = lanes.select_lanes(on), child[on]
            able = tree.problem.legal_actions_mask(lanes.states)
            legal = None if able is None else able[:, tree.seat]
            if tree.widens_actions:
                self._offer_policy_actions(
                    node, lanes.memories, legal, u[lanes.lane_indices, lanes.turns_done]
                )
            slot, _ = nodes.select_slots(node, legal)
        outside.append(lanes.select_lanes(going & known))  # at the greatest depth
        gain = self._run_playouts(_concatenate_batches(outside), u, turn_work)
        self._backup_returns(row, path, gain)

    def _offer_policy_actions(
        self, nodes: Ints, memories: tuple[Memory, ...], legal_actions_mask: Bools | None, u: Reals
    ) -> None:
        """Offers in nodes that are come to first what the seat's part of the cast would do."""
        tree = self.config
        actor, place = (
            tree.opponent_model.seat_policies[tree.seat],
            tree.opponent_model.uniform_slices[tree.seat],
        )
        new = self.trees.find_unopened_lanes(nodes) if actor else nodes[:0]
        if actor is None or not len(new):
            return
        memory = tuple(part[new] for part in memories[tree.seat])
        able = None if legal_actions_mask is None else legal_actions_mask[new]
        self.trees.offer_actions(
            nodes[new], actor.choose(memory, able, u[new][:, place][:, : actor.uniform_count])
        )

    def _step_lanes(
        self, batch: SimulationBatch, node: Ints, slot: Ints, u: Reals
    ) -> tuple[SimulationBatch, Ints, Bools, Reals]:
        """The lanes after a turn, the nodes they come to, which are known, and what it paid."""
        tree = self.config
        own = self.trees.offered_actions[node, slot] if tree.widens_actions else slot
        joint = tree.opponent_model.choose_joint_actions(batch.states, batch.memories, own, u)
        outcome = tree.opponent_model.step_states(batch.states, joint, u)
        sights = (
            outcome.observations[:, tree.seat]
            if tree.problem.partially_observable
            else outcome.state
        )
        if tree.observation_count:
            sight = (
                sights
                if tree.problem.partially_observable
                else tree.problem.state_indices(outcome.state)
            )
            child, known = self.trees.find_or_add_child(node, slot * tree.observation_slots + sight)
        else:
            key, luck = (
                hash_observations(tree.problem, sights),
                u[:, tree.opponent_model.uniform_slices[tree.seat].start],
            )
            child, known = self.trees.find_or_widen_child(node, slot, key, luck, outcome)
            if not tree.problem.partially_observable:
                state, rewards = self.trees.node_states[child], outcome.rewards.copy()
                rewards[:, tree.seat] = self.trees.node_rewards[child]
                outcome = Outcome(state, rewards, state)
        return (
            _advance_batch(tree.opponent_model, batch, joint, outcome),
            child,
            known,
            outcome.rewards[:, tree.seat],
        )

    def _run_playouts(self, batch: SimulationBatch, u: Reals, turn_work: float) -> Reals:
        """What simulations `[N]` of a wave earn after they left the tree."""
        tree, problem = self.config, self.config.problem
        gain, weight = np.zeros(len(u)), 1.0
        if tree.leaf_evaluator is not None:
            own = batch.memories[tree.seat]
            gain[batch.lane_indices] = tree.leaf_evaluator(
                batch.states, own, batch.turn_limits - batch.turns_done
            )
            return gain
        batch = batch._replace(turn_limits=np.minimum(batch.turn_limits, tree.depth))
        batch = batch.select_lanes(batch.turns_done < batch.turn_limits)
        while len(batch.lane_indices):
            self.budget.spend_work(turn_work)
            now = u[batch.lane_indices, batch.turns_done]
            joint = tree.opponent_model.choose_joint_actions(
                batch.states, batch.memories, None, now
            )
            outcome = tree.opponent_model.step_states(batch.states, joint, now)
            gain[batch.lane_indices] += weight * outcome.rewards[:, tree.seat]
            weight *= problem.discount
            batch = _advance_batch(tree.opponent_model, batch, joint, outcome)
            batch = batch.select_lanes(
                (batch.turns_done < batch.turn_limits) & ~problem.terminal(batch.states)
            )
        return gain

    def _backup_returns(
        self, row: Ints, path: list[tuple[Ints, Ints, Ints, Reals]], returns: Reals
    ) -> None:
        """Adds the returns from each node on to what is known of it."""
        for lane, node, slot, paid in path[::-1]:
            returns[lane] = paid + self.config.problem.discount * returns[lane]
            self.trees.add_returns(node, slot, returns[lane])
        np.add.at(self.squared_return_sums, (row, path[0][2]), returns**2)


def _advance_batch(
    opponent_model: OpponentModel, batch: SimulationBatch, joint: Array, outcome: Outcome
) -> SimulationBatch:
    """The lanes once a turn is done."""
    memories = opponent_model.update_memories(batch.memories, joint, outcome)
    return SimulationBatch(
        batch.lane_indices, outcome.state, memories, batch.turns_done + 1, batch.turn_limits
    )


def hash_observations(problem: Problem, observations: Array) -> Ints:
    """A number `[N]` for each sight: of equal ones the same, of others hardly ever."""
    if observations.dtype.hasobject:  # states of a guest
        return np.array(
            [crc32(problem.format_state(one).encode()) for one in observations], np.int64
        )
    flat = np.ascontiguousarray(observations).reshape(len(observations), -1)
    raw = (flat + 0.0 if flat.dtype.kind == "f" else flat).view(np.uint8)
    words = np.zeros((len(raw), -(-raw.shape[1] // 8) * 8), np.uint8)
    words[:, : raw.shape[1]] = raw
    key = np.zeros(len(raw), np.uint64)
    for word in words.view(np.uint64).T:
        key = (key ^ word) * np.uint64(0x9E3779B97F4A7C15)
        key ^= key >> np.uint64(29)
    return key.view(np.int64)

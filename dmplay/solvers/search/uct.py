"""Monte Carlo tree search by upper confidence bounds (UCT, section 9.6), using only `step`.

A node stands for the seat's actions and observations since the root: states if they are observed,
else observations (POMCP; Silver and Veness, 2010). If observations are many or real numbers, an
edge distinguishes only as many as the root of its visits (double progressive widening; Couetoux and
others, 2011), and likewise a node offers only some of many actions. Simulations run in waves, side
by side: those of one wave that meet in a node count each other as visits, so that they diverge. The
n-th simulation of each first action has the same uniforms and the same start, so that actions are
compared on common random numbers.
"""

from typing import NamedTuple
from zlib import crc32

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.policy import Memory
from dmplay.core.problem import Outcome, Problem
from dmplay.core.work_budget import Budget
from dmplay.solvers.search.search_config import SearchConfig, SearchRequest
from dmplay.solvers.search.search_tree_batch import TreeBatch
from dmplay.solvers.search.simulated_opponents import OpponentModel

MIN_LEAD_ERRORS = 3.0  # by which another action must lead the usual one


class UctResult(NamedTuple):
    """The statistics of each action that a search tried, for B rows."""

    actions: Array  # [B, K]
    mean_returns: Reals  # [B, K]; -inf for actions never tried
    squared_errors: Reals  # [B, K], of the means; infinite if unknown

    def prefer_usual_action(self, action_mask: Bools, usual_actions: Array) -> Bools:
        """Return `action_mask` `[B, K]`, or only the usual action if no marked one clearly leads.

        An action leads clearly if its mean return is MIN_LEAD_ERRORS standard errors higher. The
        result equals `action_mask` in rows in which the usual action was not tried.
        """
        rows = np.arange(len(usual_actions))
        is_usual = self.actions == usual_actions[:, None]
        usual_slots, best_slots = np.argmax(is_usual, axis=1), np.argmax(action_mask, axis=1)
        lead = self.mean_returns[rows, best_slots] - self.mean_returns[rows, usual_slots]
        errors = self.squared_errors[rows, best_slots] + self.squared_errors[rows, usual_slots]
        keeps_usual = is_usual.any(axis=1) & ~(lead > MIN_LEAD_ERRORS * np.sqrt(errors))
        return np.where(keeps_usual[:, None], is_usual, action_mask)


def run_uct(config: SearchConfig, request: SearchRequest, u: Reals) -> UctResult:
    """Run a search by uniforms `[B, uniforms]` and return the root statistics."""
    row_count = len(u)
    uct_search = _UctSearch(config, request, config.make_budget(row_count))
    wave_uniforms = u.reshape(row_count, config.simulations, config.depth, -1)
    for wave in config.simulation_waves:
        turn_work = config.estimate_turn_work(row_count, wave)
        uct_search.run_simulations(len(wave), wave_uniforms, turn_work)
    return uct_search.summarize_roots()


class SimulationBatch(NamedTuple):
    """Simulations in progress."""

    lane_indices: Ints  # [N], within the wave
    states: Array  # [N, ...]
    memories: tuple[Memory, ...]  # of each seat
    turns_done: Ints  # [N]
    turn_limits: Ints  # [N]

    def select_simulations(self, mask: Bools) -> "SimulationBatch":
        """Return the simulations that the mask marks."""
        if mask.all():
            return self
        lane_indices, states, memories, turns_done, turn_limits = self
        selected_memories = tuple(tuple(part[mask] for part in memory) for memory in memories)
        return SimulationBatch(
            lane_indices[mask], states[mask], selected_memories, turns_done[mask], turn_limits[mask]
        )


def _concatenate_batches(parts: list[SimulationBatch]) -> SimulationBatch:
    """Return several batches of simulations as one."""
    if len(parts) == 1:
        return parts[0]
    lane_indices, states, memories, turns_done, turn_limits = zip(*parts, strict=True)
    joined_memories = tuple(
        tuple(np.concatenate(part) for part in zip(*memory, strict=True))
        for memory in zip(*memories, strict=True)
    )
    joined = [np.concatenate(part) for part in (lane_indices, states, turns_done, turn_limits)]
    return SimulationBatch(joined[0], joined[1], joined_memories, joined[2], joined[3])


class _UctSearch:
    """The simulations of a batch of searches, and their statistics."""

    def __init__(self, config: SearchConfig, request: SearchRequest, budget: Budget) -> None:
        self.config, self.request, self.budget = config, request, budget
        self.trees = TreeBatch(config, request)
        # of first actions
        self.squared_return_sums = np.zeros((len(request.turns_left), config.action_slots))

    def summarize_roots(self) -> UctResult:
        """Return the statistics of the actions at the roots."""
        trees = self.trees
        visits = trees.visits[:: trees.nodes_per_tree]
        means: Reals = np.full(visits.shape, -np.inf)
        np.divide(trees.return_sums[:: trees.nodes_per_tree], visits, out=means, where=visits > 0)
        errors: Reals = np.full(visits.shape, np.inf)
        deviations = self.squared_return_sums - np.where(visits > 1, means, 0.0) ** 2 * visits
        np.divide(deviations, visits * (visits - 1), out=errors, where=visits > 1)
        errors = np.maximum(errors, 0.0)
        if self.config.widens_actions:
            actions = trees.offered_actions[:: trees.nodes_per_tree]
        else:
            actions = np.arange(visits.shape[1])[None].repeat(len(visits), axis=0)
        return UctResult(actions, means, errors)

    def run_simulations(self, simulation_count: int, uniforms: Reals, turn_work: float) -> None:
        """Run `simulation_count` simulations in every row and add their returns to the trees."""
        config, request, trees = self.config, self.request, self.trees
        rows = np.repeat(np.flatnonzero(request.turns_left > 0), simulation_count)
        if not len(rows):
            return
        nodes = rows * trees.nodes_per_tree
        legal = None if request.legal_actions_mask is None else request.legal_actions_mask[rows]
        if config.widens_actions:
            root_memories = tuple(
                tuple(part[rows, 0] for part in memory) for memory in request.memories
            )
            self._offer_policy_actions(nodes, root_memories, legal, uniforms[rows, 0, 0])
        slot, visit_numbers = trees.select_slots(nodes, legal)
        memories = tuple(
            tuple(part[rows, visit_numbers] for part in memory) for memory in request.memories
        )
        # The n-th simulation of each action has the n-th uniforms.
        u = uniforms[rows, visit_numbers]
        lanes, start = np.arange(len(rows)), np.zeros(len(rows), np.int64)
        states = request.root_states[rows, visit_numbers]
        batch = SimulationBatch(lanes, states, memories, start, request.turns_left[rows])
        path: list[tuple[Ints, Ints, Ints, Reals]] = []  # lanes, nodes, slots, rewards
        leaving: list[SimulationBatch] = []
        while True:
            self.budget.spend_work(turn_work)
            turn_uniforms = u[batch.lane_indices, batch.turns_done]
            batch, children, existed, rewards = self._step_simulations(
                batch, nodes, slot, turn_uniforms
            )
            path.append((batch.lane_indices, nodes, slot, rewards))
            unfinished = ~config.problem.terminal(batch.states)
            unfinished &= batch.turns_done < batch.turn_limits
            leaving.append(batch.select_simulations(unfinished & ~existed))
            continues = unfinished & existed & (batch.turns_done < config.depth)
            if not continues.any():
                break
            batch, nodes = batch.select_simulations(continues), children[continues]
            mask = config.problem.legal_actions_mask(batch.states)
            legal = None if mask is None else mask[:, config.seat]
            if config.widens_actions:
                turn_uniforms = u[batch.lane_indices, batch.turns_done]
                self._offer_policy_actions(nodes, batch.memories, legal, turn_uniforms)
            slot, _ = trees.select_slots(nodes, legal)
        leaving.append(batch.select_simulations(unfinished & existed))  # at the maximum depth
        returns = self._run_playouts(_concatenate_batches(leaving), u, turn_work)
        self._backup_returns(rows, path, returns)

    def _offer_policy_actions(
        self, nodes: Ints, memories: tuple[Memory, ...], legal_actions_mask: Bools | None, u: Reals
    ) -> None:
        """Offer the action of the seat's own policy at nodes reached for the first time."""
        config = self.config
        policy = config.opponent_model.seat_policies[config.seat]
        uniform_slice = config.opponent_model.uniform_slices[config.seat]
        new_lanes = self.trees.find_lanes_at_new_nodes(nodes) if policy else nodes[:0]
        if policy is None or not len(new_lanes):
            return
        memory = tuple(part[new_lanes] for part in memories[config.seat])
        mask = None if legal_actions_mask is None else legal_actions_mask[new_lanes]
        policy_uniforms = u[new_lanes][:, uniform_slice][:, : policy.uniform_count]
        self.trees.offer_actions(nodes[new_lanes], policy.choose(memory, mask, policy_uniforms))

    def _step_simulations(
        self, batch: SimulationBatch, node: Ints, slot: Ints, u: Reals
    ) -> tuple[SimulationBatch, Ints, Bools, Reals]:
        """Return the simulations after a turn, their nodes, if these existed, and rewards."""
        config, model = self.config, self.config.opponent_model
        seat_actions = self.trees.offered_actions[node, slot] if config.widens_actions else slot
        joint = model.choose_joint_actions(batch.states, batch.memories, seat_actions, u)
        outcome = model.step_states(batch.states, joint, u)
        observations, is_hidden = outcome.state, config.problem.partially_observable
        if is_hidden:
            observations = outcome.observations[:, config.seat]
        if config.observation_count:
            indices = observations if is_hidden else config.problem.state_indices(observations)
            edges = slot * config.observation_slots + indices
            children, existed = self.trees.find_or_add_child(node, edges)
        else:
            keys = hash_observations(config.problem, observations)
            widening_uniforms = u[:, model.uniform_slices[config.seat].start]
            children, existed = self.trees.find_or_widen_child(
                node, slot, keys, widening_uniforms, outcome
            )
            if not is_hidden:
                states, rewards = self.trees.node_states[children], outcome.rewards.copy()
                rewards[:, config.seat] = self.trees.node_rewards[children]
                outcome = Outcome(states, rewards, states)
        batch = _extend_simulations(model, batch, joint, outcome)
        return batch, children, existed, outcome.rewards[:, config.seat]

    def _run_playouts(self, batch: SimulationBatch, u: Reals, turn_work: float) -> Reals:
        """Return the returns `[N]` of the simulations of a wave after they leave the tree.

        They are the values of the leaf evaluator if there is one, else the rewards of a playout.
        """
        config, problem, model = self.config, self.config.problem, self.config.opponent_model
        returns, weight = np.zeros(len(u)), 1.0
        if config.leaf_evaluator is not None:
            memory, turns_left = batch.memories[config.seat], batch.turn_limits - batch.turns_done
            returns[batch.lane_indices] = config.leaf_evaluator(batch.states, memory, turns_left)
            return returns
        batch = batch._replace(turn_limits=np.minimum(batch.turn_limits, config.depth))
        batch = batch.select_simulations(batch.turns_done < batch.turn_limits)
        while len(batch.lane_indices):
            self.budget.spend_work(turn_work)
            turn_uniforms = u[batch.lane_indices, batch.turns_done]
            joint = model.choose_joint_actions(batch.states, batch.memories, None, turn_uniforms)
            outcome = model.step_states(batch.states, joint, turn_uniforms)
            returns[batch.lane_indices] += weight * outcome.rewards[:, config.seat]
            weight *= problem.discount
            batch = _extend_simulations(model, batch, joint, outcome)
            unfinished = (batch.turns_done < batch.turn_limits) & ~problem.terminal(batch.states)
            batch = batch.select_simulations(unfinished)
        return returns

    def _backup_returns(
        self, row: Ints, path: list[tuple[Ints, Ints, Ints, Reals]], returns: Reals
    ) -> None:
        """Back up the returns along the path and add them to the statistics of each node."""
        for lane, node, slot, rewards in path[::-1]:
            returns[lane] = rewards + self.config.problem.discount * returns[lane]
            self.trees.add_returns(node, slot, returns[lane])
        np.add.at(self.squared_return_sums, (row, path[0][2]), returns**2)


def _extend_simulations(
    opponent_model: OpponentModel, batch: SimulationBatch, joint: Array, outcome: Outcome
) -> SimulationBatch:
    """Return the simulations with one turn more."""
    memories = opponent_model.update_memories(batch.memories, joint, outcome)
    return SimulationBatch(
        batch.lane_indices, outcome.state, memories, batch.turns_done + 1, batch.turn_limits
    )


def hash_observations(problem: Problem, observations: Array) -> Ints:
    """Return a 64-bit hash `[N]` of each observation: equal ones agree, others hardly ever do."""
    if observations.dtype.hasobject:  # states of an external environment
        return np.array(
            [crc32(problem.format_state(state).encode()) for state in observations], np.int64
        )
    flat = np.ascontiguousarray(observations).reshape(len(observations), -1)
    data = (flat + 0.0 if flat.dtype.kind == "f" else flat).view(np.uint8)
    padded = np.zeros((len(data), -(-data.shape[1] // 8) * 8), np.uint8)
    padded[:, : data.shape[1]] = data
    keys = np.zeros(len(data), np.uint64)
    for word in padded.view(np.uint64).T:
        keys = (keys ^ word) * np.uint64(0x9E3779B97F4A7C15)
        keys ^= keys >> np.uint64(29)
    return keys.view(np.int64)

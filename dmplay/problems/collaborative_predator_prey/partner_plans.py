"""Plans of one predator beside a partner whose rule is known: a POMDP for a single planner.

Its state is that of the hunt with the node of the partner's rule. Point-based value iteration
(Pineau, Gordon and Thrun 2003) finds the values of plans at sampled beliefs, which are lower
bounds; the fast informed bound (Hauskrecht 2000) is an upper bound. Looking ahead from a belief
brings both closer.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from dmplay.agents.partner_machine import PartnerMachine
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.uniforms import generate_uniforms
from dmplay.core.work_budget import Budget

from .rules import CAPTURE_REWARD, MOVE_REWARD, CollaborativePredatorPrey

BELIEF_COUNT = 12  # sampled beliefs of each turn, and plans found for it
RANDOM_SHARE = 0.3  # of the actions by which beliefs are sampled
SAMPLING_TURNS = 10  # turns that the other actions of these samples look ahead
SAMPLING_SEED = 1
MAX_PLAN_NUMBERS = 8_000_000  # numbers stored for all plans, 64 MB
WORK_PER_NUMBER = 100.0  # operations for each state of a belief that is backed up
VALUE_DECIMALS = 9  # further decimals of values differ between machines


@dataclass(frozen=True)
class PairedHunt:
    """A hunt beside a partner: the moves of both, with the partner's node in the state.

    Arrays of states are `[..., N, own hex, partner's hex, prey's hex]` inside, and `[..., N * S]`
    in the problem's order outside.
    """

    problem: CollaborativePredatorPrey
    seat: int
    chances: tuple[tuple[float, ...], ...]  # [N, A], of each action of the partner
    next_nodes: tuple[tuple[tuple[int, ...], ...], ...]  # [N, A, O]

    @classmethod
    def from_machine(
        cls, problem: CollaborativePredatorPrey, seat: int, machine: PartnerMachine
    ) -> "PairedHunt":
        """Return the hunt of a seat beside the partner with this rule."""
        next_nodes = tuple(tuple(map(tuple, rows)) for rows in machine.next_nodes.tolist())
        return cls(problem, seat, tuple(map(tuple, machine.probabilities.tolist())), next_nodes)

    @property
    def size(self) -> int:
        """The number of states times nodes."""
        return len(self.chances) * self.problem.state_count

    @property
    def action_count(self) -> int:
        """The number of directions."""
        return self.problem.action_counts[self.seat]

    def split(self, values: Reals) -> Reals:
        """Return values `[..., N * S]` by node, own hex, partner's hex and prey's hex."""
        hexes = (len(self.problem.hexes),) * 3
        parts = values.reshape(*values.shape[:-1], -1, *hexes)
        return np.ascontiguousarray(parts.swapaxes(-3, -2)) if self.seat else parts

    def join(self, values: Reals) -> Reals:
        """Return values by node and hexes as `[..., N * S]`."""
        parts = values.swapaxes(-3, -2) if self.seat else values
        return np.ascontiguousarray(parts).reshape(*values.shape[:-4], -1)

    @cached_property
    def rewards(self) -> Reals:
        """The reward of every node and state `[N * S]`, which no action changes."""
        is_caught = self.problem.is_prey_captured(self.problem.enumerate_states())
        return np.tile(np.where(is_caught, CAPTURE_REWARD, MOVE_REWARD), len(self.chances))

    @cached_property
    def senses(self) -> Bools:
        """The mask `[O, N * S]` of the states in which the seat gets each observation."""
        observations = np.arange(self.problem.observation_counts[self.seat])[:, None]
        is_seen = self.problem.observation_table[:, self.seat] == observations
        return np.tile(is_seen, len(self.chances))

    @cached_property
    def _partner_senses(self) -> Ints:
        """The partner's observation by its hex and the prey's `[H, H]`."""
        table = self.problem.observation_table[:, 1 - self.seat]
        size = len(self.problem.hexes)
        by_hex: Ints = table.reshape(size, size, size)  # does not depend on the own hex
        return by_hex[:, 0] if self.seat else by_hex[0]

    @cached_property
    def _prey_moves(self) -> Reals:
        """The probability `[H * H, H, H]` of each move of a free prey, by the predators' hexes."""
        count = len(self.problem.hexes)
        moves = self.problem.prey_move_probabilities.reshape(*(count,) * 4)
        moves = moves.swapaxes(0, 1) if self.seat else moves
        return np.where(self._is_caught[..., None], 0.0, moves).reshape(-1, count, count)

    @cached_property
    def _feeds(self) -> tuple[Bools, Bools]:
        """The masks `[H, 1, H]` and `[H, H]` of states in which the seat, or the partner, feeds."""
        same = np.eye(len(self.problem.hexes), dtype=bool)
        return same[:, None], same

    @cached_property
    def _is_caught(self) -> Bools:
        """The mask `[H, H, H]` of the states in which the prey is caught."""
        own_feeds, partner_feeds = self._feeds
        return own_feeds | partner_feeds

    @cached_property
    def _partner_moves(self) -> list[tuple[int, Array, Reals]]:
        """Each action of the partner, the nodes in which it is possible, and its chances there."""
        chances = np.array(self.chances)
        return [
            (action, np.flatnonzero(column), column[column > 0.0][:, None, None, None])
            for action, column in enumerate(chances.T)
            if column.any()
        ]

    def predict(self, beliefs: Reals, actions: Ints | None = None) -> Reals:
        """Return beliefs `[B, A, N * S]` after each action, or `[B, 1, N * S]` after one of each.

        They are not conditioned on an observation.
        """
        walks = self.problem.walk_probabilities.swapaxes(1, 2)
        walks = walks[None, :, None] if actions is None else walks[actions][:, None, None]
        moving, feeding = self._move_others(self.split(beliefs))
        flat = moving.reshape(*moving.shape[:3], -1)[:, None]
        shape = (len(beliefs), walks.shape[1], *moving.shape[1:])
        return self.join(np.matmul(walks, flat).reshape(shape) + feeding[:, None])

    def _move_others(self, joint: Reals) -> tuple[Reals, Reals]:
        """Return beliefs after the moves of prey and partner, before the seat's own move.

        The first are those in which the seat moves, the second those in which it feeds and stays.
        """
        (own_feeds, partner_feeds), count = self._feeds, len(self.problem.hexes)
        rows = joint.reshape(-1, count * count, count).swapaxes(0, 1)
        free = np.matmul(rows, self._prey_moves).swapaxes(0, 1).reshape(joint.shape)
        caught = [  # by the partner, by the seat, by both; the prey's next hex is uniform
            np.where(mask, joint, 0.0).sum(axis=-1, keepdims=True) / count
            for mask in (
                partner_feeds & ~own_feeds,
                own_feeds & ~partner_feeds,
                own_feeds & partner_feeds,
            )
        ]
        moving, feeding = np.zeros_like(joint), np.zeros_like(joint)
        next_nodes = np.array(self.next_nodes)
        for action, nodes, chances in self._partner_moves:
            walk = self.problem.walk_probabilities[action].T
            moved = np.matmul(walk, free[:, nodes]) + caught[0][:, nodes]
            fed = np.matmul(walk, caught[1][:, nodes]) + caught[2][:, nodes]
            for row, node in enumerate(nodes):
                for observation, next_node in enumerate(next_nodes[node, action]):
                    is_seen = self._partner_senses == observation
                    chance = np.where(is_seen, chances[row], 0.0)
                    moving[:, next_node] += chance * moved[:, row]
                    feeding[:, next_node] += chance * fed[:, row]
        return moving, feeding

    def back_up(self, values: Reals, action: int) -> Reals:
        """Return the expected values `[M, N * S]` after an action, given next values."""
        after, walks = self.split(values), self.problem.walk_probabilities
        (own_feeds, partner_feeds), count = self._feeds, len(self.problem.hexes)
        staying, moved = np.zeros_like(after), np.zeros_like(after)
        next_nodes = np.array(self.next_nodes)
        for partner_action, nodes, chances in self._partner_moves:
            choices = [
                np.where(self._partner_senses == observation, after[:, following], 0.0)
                for observation, following in enumerate(next_nodes[nodes, partner_action].T)
            ]
            expected = chances * np.sum(choices, axis=0)
            staying[:, nodes] += expected
            moved[:, nodes] += np.matmul(walks[partner_action], expected)
        own_moves = [
            np.matmul(walks[action], part.reshape(*part.shape[:3], -1)).reshape(part.shape)
            for part in (moved, staying)
        ]
        rows = own_moves[0].reshape(-1, count * count, count).swapaxes(0, 1)
        free = np.matmul(rows, self._prey_moves.swapaxes(1, 2)).swapaxes(0, 1).reshape(after.shape)
        # The value if the prey is caught by these; its next hex is uniform.
        by_none, by_partner, by_self, by_both = (
            part.mean(axis=-1, keepdims=True) for part in (*own_moves, moved, staying)
        )
        fed = np.where(
            own_feeds,
            np.where(partner_feeds, by_both, by_self),
            np.where(partner_feeds, by_partner, by_none),
        )
        return self.join(np.where(self._is_caught, fed, free))

    def look_ahead(
        self, beliefs: Reals, turns_left: int, vectors: Sequence[Reals], depth: int
    ) -> Reals:
        """Return the values `[B, A]` of beliefs `[B, N * S]` by vectors after `depth` turns.

        The beliefs need not sum to 1.
        """
        rewards = np.repeat((beliefs @ self.rewards)[:, None], self.action_count, axis=1)
        if turns_left == 1:
            return rewards
        after = self.predict(beliefs)
        if depth == 1 or turns_left == 2:
            values = self.choose_vectors(after, vectors[turns_left - 2])[0]
            return np.asarray(rewards + self.problem.discount * values)
        observed = after[:, :, None] * self.senses
        rows = observed.reshape(-1, self.size)
        best = self.look_ahead(rows, turns_left - 1, vectors, depth - 1).max(axis=1)
        values = best.reshape(observed.shape[:3]).sum(axis=2)
        return np.asarray(rewards + self.problem.discount * values)

    def choose_vectors(self, after: Reals, vectors: Reals) -> tuple[Reals, Ints]:
        """Return the values `[B, A]` of beliefs `[B, A, N * S]`, and the best vectors `[B, A, O]`.

        The vector is chosen after the observation.
        """
        observed = (self.senses[:, None] * vectors).reshape(-1, self.size)
        values = (after.reshape(-1, self.size) @ observed.T).reshape(
            *after.shape[:2], len(self.senses), len(vectors)
        )
        best = np.round(values, VALUE_DECIMALS).argmax(axis=-1)
        return np.take_along_axis(values, best[..., None], axis=-1)[..., 0].sum(axis=-1), best


def can_find_plans(hunt: PairedHunt, turns: int) -> bool:
    """Return whether plans of that many turns can be found and stored in about a second."""
    return hunt.size * turns * BELIEF_COUNT <= MAX_PLAN_NUMBERS


@lru_cache(maxsize=2)  # up to 64 MB each
def find_upper_bounds(hunt: PairedHunt, turns: int) -> tuple[Reals, ...]:
    """Return the fast informed bound `[A, N * S]` of each action, by turns left."""
    budget = Budget("bounds of the hunt", "try fewer turns")
    bounds = [np.tile(hunt.rewards, (hunt.action_count, 1))]
    while len(bounds) < turns:
        work = WORK_PER_NUMBER * hunt.action_count * hunt.size
        budget.spend_work(work, len(bounds) / turns)
        observed = (bounds[-1][:, None] * hunt.senses).reshape(-1, hunt.size)
        best = [
            hunt.back_up(observed, action)
            .reshape(hunt.action_count, -1, hunt.size)
            .max(axis=0)
            .sum(axis=0)
            for action in range(hunt.action_count)
        ]
        bounds.append(hunt.rewards + hunt.problem.discount * np.array(best))
    return tuple(bounds)


@lru_cache(maxsize=2)  # up to 64 MB each
def find_plans(hunt: PairedHunt, turns: int) -> tuple[Reals, ...]:
    """Return the values `[G, N * S]` of the plans that were found, by turns left."""
    beliefs = _sample_beliefs(hunt, turns)
    budget = Budget("plans of the hunt", "try fewer turns")
    plans = [hunt.rewards[None]]
    if turns > 1:  # all plans of two turns
        later = [hunt.back_up(plans[0], action) for action in range(hunt.action_count)]
        plans.append(hunt.rewards + hunt.problem.discount * np.concatenate(later))
    while len(plans) < turns:
        budget.spend_work(WORK_PER_NUMBER * hunt.size * BELIEF_COUNT, len(plans) / turns)
        plans.append(_improve_plans(hunt, beliefs[-len(plans) - 1], plans[-1]))
    return tuple(plans)


def _improve_plans(hunt: PairedHunt, beliefs: Reals, plans: Reals) -> Reals:
    """Return the values of the best plans of beliefs, whose later parts are some `plans`."""
    values, best = hunt.choose_vectors(hunt.predict(beliefs), plans)
    actions = np.round(values, VALUE_DECIMALS).argmax(axis=1)
    improved = np.empty((len(beliefs), hunt.size))
    for action in np.unique(actions):
        rows = np.flatnonzero(actions == action)
        later = (hunt.senses * plans[best[rows, action]]).sum(axis=1)
        improved[rows] = hunt.rewards + hunt.problem.discount * hunt.back_up(later, int(action))
    return improved


def _sample_beliefs(hunt: PairedHunt, turns: int) -> list[Reals]:
    """Return beliefs `[B, N * S]` of each turn, from games that the plans may be about."""
    states = hunt.problem.state_count
    beliefs = np.zeros((1, hunt.size))
    beliefs[0, :states] = 1.0 / states
    sampled, beliefs = [beliefs], beliefs.repeat(BELIEF_COUNT, axis=0)
    bounds = find_upper_bounds(hunt, min(turns, SAMPLING_TURNS))
    for turn in range(1, turns):
        u = generate_uniforms(SAMPLING_SEED, 0, turn, rows=BELIEF_COUNT, count=3)
        q = beliefs @ bounds[min(turns - turn + 1, len(bounds)) - 1].T
        actions = np.round(q, VALUE_DECIMALS).argmax(axis=1)
        random = (u[:, 1] * hunt.action_count).astype(np.int64)
        actions = np.where(u[:, 0] < RANDOM_SHARE, random, actions)
        after = hunt.predict(beliefs, actions) * hunt.senses  # [B, O, N * S]
        chances = after.sum(axis=-1).cumsum(axis=1)
        observations = (u[:, 2:] * chances[:, -1:] >= chances).sum(axis=1)
        observations = np.minimum(observations, len(hunt.senses) - 1)
        beliefs = after[np.arange(BELIEF_COUNT), observations]
        beliefs /= beliefs.sum(axis=1, keepdims=True)
        sampled.append(beliefs)
    return sampled

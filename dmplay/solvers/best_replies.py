"""Markov games of any number of agents, each for itself, by best replies to one another.

First each in turn replies to what the others do, until nobody changes: then nobody gains by
another policy. Where that goes round, each replies to how often the others did each thing so far
(fictitious play, Brown 1951, in policies of the state alone). What is played is told with what each
could still gain at the start (section 25.2); of more than two agents, or of two who are not
opposed, that need not vanish.
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Ints, Reals
from dmplay.core import Problem, initial_state_distribution
from dmplay.errors import BadPolicy
from dmplay.solvers.graph import TransitionGraph
from dmplay.solvers.value_iteration import compute_tolerance

WORK_LIMIT = 2e10
PURE_ROUNDS, FICTITIOUS_PLAY_ROUNDS = 20, 64  # rounds of replies to the last, and to all so far
CONVERGENCE_TOLERANCE = 1e-9  # how near values come to their limit, where they are about 1
DISCOUNT_REQUIRED_MESSAGE = "got a game of several at once without end, expected a discount below 1"


class BestResponseResult(NamedTuple):
    """What each does in every state, and what it could gain by another policy."""

    graph: TransitionGraph
    policies: list[Reals]  # [S, A] of each
    values: Reals  # [S, n]
    q: list[Reals]  # [S, A] of each, against the others' part; -inf of what is not legal
    regrets: Reals  # [n], at the start
    round_count: int


class _InducedMdp(NamedTuple):
    """What one agent faces while the others' play is fixed."""

    graph: TransitionGraph
    seat: int
    state_action_cells: Ints  # [R], the state and own action of each joint action
    others_probabilities: Reals  # [R], how likely the others do their part
    legality_penalty: Reals  # [S, A], 0 of what is legal, else -inf
    discount: float

    def compute_action_values(self, values: Reals) -> Reals:
        """Q `[S, A]` of its own actions."""
        later = np.add.reduceat(
            self.graph.probabilities * values[self.graph.next_states],
            self.graph.outcome_starts[:-1],
        )
        q = self.others_probabilities * (self.graph.rewards[:, self.seat] + self.discount * later)
        sums = np.bincount(self.state_action_cells, q, self.legality_penalty.size).astype(float)
        return sums.reshape(self.legality_penalty.shape) + self.legality_penalty

    def iterate_values(self, values: Reals, policy: Reals | None, budget: Budget) -> Reals:
        """Its values while it plays so or, without a mix, as well as it can."""
        over = np.diff(self.graph.action_starts) == 0
        far = self.discount / (1.0 - self.discount)
        while True:
            budget.spend_work(10 * ARRAY_CALL_WORK + 20.0 * len(self.graph.probabilities))
            q = self.compute_action_values(values)
            after = (
                q.max(axis=1)
                if policy is None
                else (policy * np.where(policy > 0, q, 0)).sum(axis=1)
            )
            after[over] = 0.0
            change = float(np.abs(after - values).max())
            values = after
            if far * change <= compute_tolerance(values, CONVERGENCE_TOLERANCE):
                return values


def find_equilibrium(problem: Problem, graph: TransitionGraph) -> BestResponseResult:
    """The best play that is found: that by which the least is to be gained."""
    if problem.discount == 1.0:
        raise BadPolicy(DISCOUNT_REQUIRED_MESSAGE)
    budget = Budget("best replies", "try fewer states, or search", WORK_LIMIT)
    able = [_mark_legal_actions(problem, graph, seat) for seat in range(len(problem.agents))]
    play = [one / one.sum(axis=1, keepdims=True) for one in able]
    found = best = evaluate_policies(problem, graph, play, budget)
    for done in range(1, PURE_ROUNDS + FICTITIOUS_PLAY_ROUNDS + 1):
        close = compute_tolerance(best.values, CONVERGENCE_TOLERANCE)
        if best.regrets.max() <= close or budget.work_spent > budget.work_limit / 2:
            break
        step = 1.0 if done <= PURE_ROUNDS else 1.0 / (done - PURE_ROUNDS)
        for seat, mix in enumerate(play):
            facing = _build_induced_mdp(problem, graph, play, able, seat)
            values = facing.iterate_values(found.values[:, seat], None, budget)
            reply = np.eye(mix.shape[1])[facing.compute_action_values(values).argmax(axis=1)]
            play[seat] = mix + step * (reply - mix)
        found = evaluate_policies(problem, graph, play, budget)._replace(round_count=done)
        best = found if found.regrets.max() < best.regrets.max() else best
    return best


def evaluate_policies(
    problem: Problem, graph: TransitionGraph, policies: list[Reals], budget: Budget | None = None
) -> BestResponseResult:
    """What this play is worth, and what each could gain by another policy."""
    budget = budget or Budget("best replies", "try fewer states", WORK_LIMIT)
    likely, start = initial_state_distribution(problem)
    first = np.bincount(graph.find_state_indices(problem, start), likely, len(graph.states))
    able = [_mark_legal_actions(problem, graph, seat) for seat in range(len(policies))]
    none = np.zeros(len(graph.states))
    values, q, gains = [], [], []
    for seat, mix in enumerate(policies):
        facing = _build_induced_mdp(problem, graph, policies, able, seat)
        values.append(facing.iterate_values(none, mix, budget))
        q.append(facing.compute_action_values(values[-1]))
        most = facing.iterate_values(values[-1], None, budget)
        gains.append(max(float(first @ (most - values[-1])), 0.0))
    return BestResponseResult(
        graph, list(policies), np.stack(values, axis=1), q, np.array(gains), 0
    )


def _mark_legal_actions(problem: Problem, graph: TransitionGraph, seat: int) -> Reals:
    """1 of each action of a seat that is legal `[S, A]`; where it is over, of the first."""
    able = np.zeros((len(graph.states), problem.action_counts[seat]))
    able[graph.source_states, graph.joint_actions[:, seat]] = 1.0
    able[np.diff(graph.action_starts) == 0, 0] = 1.0
    return able


def _build_induced_mdp(
    problem: Problem,
    graph: TransitionGraph,
    policies: list[Reals],
    legal_masks: list[Reals],
    seat: int,
) -> _InducedMdp:
    """What a seat faces while all others play so."""
    owner, weight = graph.source_states, np.ones(len(graph.rewards))
    for other, mix in enumerate(policies):
        if other != seat:
            weight *= mix[owner, graph.joint_actions[:, other]]
    cells = owner * legal_masks[seat].shape[1] + graph.joint_actions[:, seat]
    barred = np.where(legal_masks[seat] > 0, 0.0, -np.inf)
    return _InducedMdp(graph, seat, cells, weight, barred, problem.discount)

"""The tree of Monte Carlo tree search: selection, expansion, playout and backup.

Source: section 9.6, Monte Carlo Tree Search; with hidden states, chapter 22, Online Belief State
Planning. A node is a history of the seat's actions and of their outcomes: the next state or, if
states are hidden, the observation.
"""

from dataclasses import dataclass, field
from math import inf, log, sqrt
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Reals
from dmplay.core.problem import Problem


@dataclass(eq=False)
class ActionStatistics:
    """The statistics N(h, a) and Q(h, a) of an action, and the nodes of its outcomes."""

    label: str
    visits: int = 0
    mean: float = 0.0
    outcomes: dict[str, "SearchHistory"] = field(default_factory=dict)


@dataclass(eq=False)
class SearchHistory:
    """A node of the tree: the actions tried in it, by their index."""

    actions: dict[int, ActionStatistics] = field(default_factory=dict)

    @property
    def decision_count(self) -> int:
        """The number of actions chosen here, N(h)."""
        return sum(statistics.visits for statistics in self.actions.values())


class Decision(NamedTuple):
    """One action of a simulation inside the tree, with its reward and outcome."""

    node: SearchHistory
    action: int  # index among the candidate actions
    action_label: str
    reward: float
    outcome_label: str


@dataclass(eq=False)
class MonteCarloTree:
    """A tree that grows by one simulation at a time, for one seat of a problem."""

    problem: Problem
    seat: int
    states: Array  # [K, ...], possible states at the root
    probabilities: Reals  # [K]
    depth: int  # turns of each simulation
    rng: np.random.Generator
    root: SearchHistory = field(default_factory=SearchHistory)
    lowest_return: float = inf
    highest_return: float = -inf

    @property
    def have_returns_differed(self) -> bool:
        """True if two returns differed so far."""
        return self.lowest_return < self.highest_return

    @property
    def exploration_constant(self) -> float:
        """The constant c of UCB1: the spread of the returns so far, or 1 if they are equal."""
        return self.highest_return - self.lowest_return if self.have_returns_differed else 1.0

    def sample_root_state(self) -> Array:
        """Return a state of the root, drawn from its probabilities."""
        index = np.searchsorted(self.probabilities.cumsum(), self.rng.random(), "right")
        return np.asarray(self.states[min(int(index), len(self.states) - 1)])

    def select_path(self, state: Array) -> tuple[list[Decision], Array]:
        """Return the decisions from the root to a new outcome or an end, and the last state."""
        node, decisions = self.root, list[Decision]()
        while len(decisions) < self.depth and not self.problem.terminal(state[None])[0]:
            action = max(self.list_legal_actions(state), key=lambda a: self.compute_score(node, a))
            label = self.format_action(state, action)
            state, reward, outcome = self.simulate_turn(state, action)
            decisions.append(Decision(node, action, label, reward, outcome))
            statistics = node.actions.get(action)
            if statistics is None or outcome not in statistics.outcomes:
                break
            node = statistics.outcomes[outcome]
        return decisions, state

    def compute_score(self, node: SearchHistory, action: int) -> float:
        """Return the UCB1 score Q(h, a) + c sqrt(ln N(h) / N(h, a)); infinite if never tried."""
        if action not in node.actions:
            return inf
        statistics = node.actions[action]
        exploration = self.exploration_constant * sqrt(log(node.decision_count) / statistics.visits)
        return statistics.mean + exploration

    def add_new_node(self, decisions: list[Decision]) -> None:
        """Add the node after these decisions to the tree if it is new."""
        if not decisions:
            return
        node, action, label, _, outcome = decisions[-1]
        statistics = node.actions.setdefault(action, ActionStatistics(label))
        statistics.outcomes.setdefault(outcome, SearchHistory())

    def play_out(self, state: Array, turns: int) -> list[float]:
        """Return the rewards of at most this many turns in which the seat acts at random."""
        rewards: list[float] = []
        while len(rewards) < turns and not self.problem.terminal(state[None])[0]:
            action = int(self.rng.choice(self.list_legal_actions(state)))
            state, reward, _ = self.simulate_turn(state, action)
            rewards.append(reward)
        return rewards

    def back_up(self, decisions: list[Decision], value: float) -> float:
        """Update Q and N of the actions from the leaf to the root; return the root's return."""
        for decision in reversed(decisions):
            value = decision.reward + self.problem.discount * value
            statistics = decision.node.actions[decision.action]
            statistics.visits += 1
            statistics.mean += (value - statistics.mean) / statistics.visits
        self.lowest_return = min(self.lowest_return, value)
        self.highest_return = max(self.highest_return, value)
        return value

    def list_legal_actions(self, state: Array) -> list[int]:
        """Return the indices of the seat's candidate actions that are legal in a state."""
        legal = self.problem.legal_actions_mask(state[None])
        count = len(self.problem.actions[self.seat].candidate_actions())
        return list(range(count)) if legal is None else np.flatnonzero(legal[0, self.seat]).tolist()

    def simulate_turn(self, state: Array, action: int) -> tuple[Array, float, str]:
        """Return the next state, the seat's reward and the outcome's label.

        The other agents act uniformly at random.
        """
        problem, seat, joint = self.problem, self.seat, []
        mask = problem.legal_actions_mask(state[None])
        for other, action_set in enumerate(problem.actions):
            legal = None if mask is None else mask[:, other]
            joint.append(action_set.sample_actions(self.rng.random(1), legal)[0])
        joint[seat] = problem.actions[seat].candidate_actions()[action]
        uniforms = self.rng.random((1, problem.uniform_counts.step))
        outcome = problem.step(state[None], np.array([joint]), uniforms)
        label = problem.format_state(outcome.state[0])
        if problem.partially_observable:
            label = problem.observations[seat].format_observation(outcome.observations[0, seat])
        return outcome.state[0], float(outcome.rewards[0, seat]), label

    def format_action(self, state: Array, action: int) -> str:
        """Return the label of a candidate action in a state."""
        labels = self.problem.action_labels(state)
        value = self.problem.actions[self.seat].candidate_actions()[action]
        if labels and labels[self.seat].labels:
            return labels[self.seat][int(value)]
        return self.problem.format_action(self.seat, value)

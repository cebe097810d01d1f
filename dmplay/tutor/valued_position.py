"""The exact values of a position, and the possible outcomes of each action."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dmplay.agents.base import AdviceQuestion, models_opponents
from dmplay.core.action_values import Accuracy
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.hexgrid import list_hexes
from dmplay.core.policy import Memory
from dmplay.core.problem import Outcome, Problem, build_percept, enumerate_possible_outcomes
from dmplay.core.session import SeatedPolicy, Session
from dmplay.game.hints.action_breakdown import ActionBreakdown, break_down_action
from dmplay.game.hints.outcome_forecast import AssumedPlayers, enumerate_joint_actions
from dmplay.registry import agents
from dmplay.tutor.positions import PositionInGame

MIN_PROBABILITY_DIFFERENCE = 1e-6  # probabilities that differ by less are equal


class ActionOutcome(NamedTuple):
    """A possible outcome of an action, as the player perceives it."""

    probability: float
    text: str  # the next state, the observation, or the actions of the other agents
    reward: float  # expected reward of this turn, given this outcome
    value_after: float  # expected return of the best play from the next turn on
    ends_game: bool
    belief: Reals | None = None  # [S], if the state is hidden


class ValuedPosition:
    """The present position of a session, with the values of the agent that gives the hints.

    It follows the session: after a turn it is the next position.
    """

    def __init__(self, position: PositionInGame, hint_agent: agents.HintAgent) -> None:
        self.position = position
        self.hint_agent = hint_agent
        self.session, self.seat, self.problem = position.session, position.seat, position.problem
        self._seated_policy = SeatedPolicy(self.session, self.seat, hint_agent.policy)

    @property
    def labels(self) -> Sequence[str]:
        """The labels of the player's actions."""
        return self.session.action_labels(self.seat)

    @property
    def memory(self) -> Memory:
        """The memory of the agent that gives the hints."""
        return self._seated_policy.current_memory()

    @property
    def legal_actions_mask(self) -> Bools:
        """The mask `[A]` of the legal actions."""
        legal = self.session.legal_actions_mask(self.seat)
        return np.ones(len(self.labels), bool) if legal is None else legal

    @property
    def values(self) -> Reals:
        """The value `[A]` of each action, -inf if it is illegal."""
        values = self._seated_policy.action_values()
        assert values is not None
        return np.where(self.legal_actions_mask, values, -np.inf)

    @property
    def turns_left(self) -> int | None:
        """The number of turns that can still be played; None without a turn limit."""
        limit = self.session.turn_limit
        return None if limit is None else limit - len(self.session.turns)

    def compute_rewards(self) -> Reals:
        """Return the expected reward `[A]` of this turn for each action, -inf if it is illegal."""
        rewards = np.full(len(self.labels), -np.inf)
        for action in np.flatnonzero(self.legal_actions_mask).tolist():
            if self.problem.partially_observable:
                rewards[action] = self._break_down_action(action).reward
                continue
            weights, _, outcome = self._enumerate_events(action)
            rewards[action] = weights @ outcome.rewards[:, self.seat]
        return rewards

    def list_outcomes(self, action: int) -> list[ActionOutcome]:
        """Return the possible outcomes of an action, likeliest first.

        Events that the player cannot tell apart are one outcome.
        """
        if self.problem.partially_observable:
            return self._list_observations(action)
        arrays = self._enumerate_events(action)
        outcomes = [
            self._summarize_events(text, events, *arrays)
            for text, events in self._group_events(*arrays).items()
        ]
        return sorted(outcomes, key=lambda item: -item.probability)

    def find_likeliest_outcome(self, action: int) -> ActionOutcome | None:
        """Return the likeliest outcome of an action; None if several are equally likely."""
        likeliest, *others = self.list_outcomes(action)
        lead = likeliest.probability - others[0].probability if others else 1.0
        return None if lead < MIN_PROBABILITY_DIFFERENCE else likeliest

    def _break_down_action(self, action: int) -> ActionBreakdown:
        """Return the parts of the value of an action in a problem with hidden states."""
        parts = break_down_action(
            self._seated_policy, action, self._opponent_model, is_last_turn=self.turns_left == 1
        )
        assert parts is not None
        return parts

    def _list_observations(self, action: int) -> list[ActionOutcome]:
        """Return the possible observations after an action, likeliest first."""
        parts = self._break_down_action(action)
        is_over = self.problem.terminal(self.problem.enumerate_states())
        return [
            ActionOutcome(
                item.probability,
                item.text,
                item.reward,
                item.value_after,
                parts.is_last_turn or not np.any(np.asarray(item.belief)[~is_over]),
                item.belief,
            )
            for item in parts.outcomes
        ]

    def _group_events(
        self, weights: Reals, joint_actions: Array, outcome: Outcome
    ) -> dict[str, Ints]:
        """Return the indices of the events by the part of them that the player perceives."""
        events_by_text: dict[str, list[int]] = {}
        for event in range(len(weights)):
            text = self._describe_event(joint_actions[event], outcome, event)
            events_by_text.setdefault(text, []).append(event)
        return {text: np.array(events) for text, events in events_by_text.items()}

    def _enumerate_events(self, action: int) -> tuple[Reals, Array, Outcome]:
        """Return the events after an action: probabilities `[N]`, joint actions and outcomes.

        All agents see the state. The other agents act as the values assume.
        """
        joint = enumerate_joint_actions(self.session, self.seat, action, self._opponent_model)
        states = np.repeat(self.session.state[None], len(joint.actions), axis=0)
        rows, p, outcome = enumerate_possible_outcomes(self.problem, states, joint.actions)
        return joint.probabilities[rows] * p, joint.actions[rows], outcome

    @property
    def _opponent_model(self) -> AssumedPlayers | None:
        """The model of the other agents that the values assume; None if they act at random."""
        if not models_opponents(self.hint_agent.policy):
            return None
        return AssumedPlayers(self.hint_agent.policy, self.memory, self.hint_agent.basis.players)

    def _describe_event(self, joint_action: Array, outcome: Outcome, event: int) -> str:
        """Return the part of an event that the player perceives as text."""
        problem, seat = self.problem, self.seat
        if problem.state_count != 1:
            return f"to {self._format_state(outcome.state[event])}"
        return ", ".join(
            f"{agent} plays {problem.format_action(other, joint_action[other])}"
            for other, agent in enumerate(problem.agents)
            if other != seat
        )

    def _format_state(self, state: Array) -> str:
        """Return a state as text, with the names of the agents if it is a hex for each."""
        text, agents = self.problem.format_state(state), self.problem.agents
        if not (list_hexes(self.problem) and 1 < len(agents) == len(text.split())):
            return text
        return ", ".join(map(" ".join, zip(agents, text.split(), strict=True)))

    def _summarize_events(
        self, text: str, events: Ints, weights: Reals, joint_actions: Array, outcome: Outcome
    ) -> ActionOutcome:
        """Return the outcome that consists of events that the player cannot tell apart."""
        probability = float(weights[events].sum())
        reward = float(weights[events] @ outcome.rewards[events, self.seat]) / probability
        first = events[:1]
        first_outcome = Outcome(*(array[first] for array in outcome))
        is_last_turn = self.turns_left == 1
        ends_game = is_last_turn or bool(self.problem.terminal(outcome.state[events]).all())
        value_after = 0.0
        if not ends_game:
            policy = self.hint_agent.policy
            percept = build_percept(self.problem, self.seat, joint_actions[first], first_outcome)
            values = policy.action_values(policy.update_memory(self.memory, percept))
            legal = self.problem.legal_actions_mask(first_outcome.state)
            assert values is not None
            value_after = float(
                values.max() if legal is None else values[legal[:, self.seat]].max()
            )
        return ActionOutcome(probability, text, reward, value_after, ends_game)

    def sum_outcomes(self, outcomes: Sequence[ActionOutcome]) -> float:
        """Return the value of an action from its outcomes: the mean of reward plus later value."""
        discount = self.problem.discount
        return sum(
            item.probability * (item.reward + discount * item.value_after) for item in outcomes
        )


def find_exact_agent(session: Session, question: AdviceQuestion) -> agents.HintAgent | None:
    """Return the agent with exact values of the game of a question; None if there is none.

    None too if actions are real numbers, or if there are too many hidden states for beliefs.
    """
    problem = session.problem
    if not problem.actions[question.seat].labels:
        return None
    if problem.partially_observable and not session.has_visible_beliefs:
        return None
    agent = agents.find_hint_provider(problem, question)
    return agent if agent is not None and _is_exact(agent) else None


def _is_exact(agent: agents.HintAgent) -> bool:
    """Return whether the values of an agent are exact in the game of its question."""
    return agent.basis.accuracy is Accuracy.EXACT and agent.basis.has_exact_regrets


def is_repeated_game(problem: Problem) -> bool:
    """Return whether a problem is a game of two with one state."""
    return problem.state_count == 1 and len(problem.agents) == 2

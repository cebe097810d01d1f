"""A position: what one seat knows at its turn, and what can be said of each of its actions.

Screens, lessons, graders and programs ask a position; none of them computes outcomes or values on
its own. A position holds what its seat perceived (a `View`) and no session, so that hidden states
and the random numbers of the game are out of reach.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Self, TypeVar

import numpy as np

from dmplay.agents.base import AdviceQuestion, SeatPolicy, models_opponents
from dmplay.core.action_values import UNKNOWN_BASIS, Accuracy, ActionValues, Horizon
from dmplay.core.arrays import Array, Bools, Reals, readonly_copy
from dmplay.core.chance import FiniteChance
from dmplay.core.policy import Memory, Percept, forbid_writes
from dmplay.core.problem import Problem, find_seat, mark_inactive_agents
from dmplay.core.seat_history import SeatHistory
from dmplay.core.session import (
    Session,
    View,
    call_memory_method,
    list_action_labels,
    make_view,
    validate_policy_actions,
)
from dmplay.core.spaces import Labels
from dmplay.core.text import format_count
from dmplay.core.typed_text import parse_history, parse_state, read_belief
from dmplay.core.uniforms import SeededUniforms
from dmplay.core.work_budget import limit_total_work
from dmplay.draw.options import Forecast
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded
from dmplay.game.action_breakdown import ActionBreakdown, Payoff, PossibleOutcome
from dmplay.game.turn_events import (
    TurnEvents,
    enumerate_observations,
    find_unique_states,
    list_next_states,
    list_observations,
    sample_next_states,
)
from dmplay.registry.agents import HintAgent, find_hint_provider, load_hint_agent
from dmplay.registry.problem_module_exports import get_problem_name
from dmplay.registry.problems import ProblemLike, load_problem
from dmplay.solvers.search.simulated_opponents import make_start_state

T = TypeVar("T")
ADVICE_WORK_LIMIT = 1.5e9  # operations of one question, about one second
SEARCH_AGENT = "search"  # this agent limits its own work
MAX_VALUED_OUTCOMES = 2000  # maximum number of outcomes whose values are computed


class Position:
    """A seat's knowledge at its turn, and the answers to questions about its actions.

    The `agent` is the one whose values and model of the other players the answers are about. If its
    planning takes too much work, or if it fails, a tree search replaces it.
    """

    def __init__(  # noqa: PLR0913 - the knowledge of a seat has these parts
        self,
        view: View[Problem],
        question: AdviceQuestion,
        agent: HintAgent | None,
        *,
        turns_done: int | None = None,
        memory: Memory | None = None,
        inactive_agents: Bools | None = None,
        belief: Reals | None = None,
        uniforms: Reals | None = None,
    ) -> None:
        self.view, self.question, self.agent = view, question, agent
        self.problem, self.seat = view.problem, view.seat
        self.turns_done = view.turns_played if turns_done is None else turns_done
        self._memory, self._belief, self._uniforms = memory, belief, uniforms
        self._inactive_agents = inactive_agents
        self._forget_answers()

    def __repr__(self) -> str:
        name, seat = get_problem_name(self.problem), self.problem.agents[self.seat]
        return f"<Position of {seat} in {name}, after {format_count(self.turns_done, 'turn')}>"

    def _forget_answers(self) -> None:
        """Forget the answers that depend on the agent."""
        self._breakdowns: dict[int, ActionBreakdown | None] = {}
        self._choice: float | ActionValues | None = None

    @classmethod
    def of_session(
        cls, session: Session, question: AdviceQuestion, agent: HintAgent | None = None
    ) -> Self:
        """Return the position of a question's seat in a session.

        Without `agent`, it is the one that gives the hints of the game in question.
        """
        agent = agent or find_hint_provider(session.problem, question)
        return cls.with_agent(session, question, agent)

    @classmethod
    def with_agent(
        cls,
        session: Session,
        question: AdviceQuestion,
        agent: HintAgent | None,
        memory: Memory | None = None,
    ) -> Self:
        """Return the position with this agent, or without one, and with its memory if known.

        The agent chooses with the uniforms of its seat in this turn.
        """
        seats = range(len(session.problem.agents))
        inactive = np.array([session.is_inactive(seat) for seat in seats])
        uniforms = None
        if agent is not None:
            stream, turn = 1 + question.seat, len(session.turns) + 1
            count = max(agent.policy.uniform_count, 1)  # a search, which may replace it, needs one
            uniforms = session.uniform_source.generate_uniforms(stream, turn, 0, count)[0]
        view = session.view(question.seat)
        return cls(
            view, question, agent, memory=memory, inactive_agents=inactive, uniforms=uniforms
        )

    @classmethod
    def from_text(  # noqa: PLR0913 - a position has these parts
        cls,
        problem: ProblemLike,
        seat: int | str = 0,
        *,
        state: str = "",
        history: Sequence[str] = (),
        belief: str | Array | Sequence[float] | Mapping[str, float] = "",
        turns_left: int | None = None,
        players: Sequence[str] = (),
    ) -> Self:
        """Return the position of a seat that texts describe.

        `state` is a visible state. If states are hidden, `history` lists the actions of the seat
        and its observations, such as "feed crying", or `belief` has the probability of each state,
        such as "hungry 0.3 sated 0.7", or numbers in the order of states. Without `turns_left`,
        the game has the problem's horizon, or no turn limit. `players` are the names of the agents
        of all seats, if they are known.

        Raise BadParameter for a text that does not fit the problem.
        """
        problem = load_problem(problem)
        seat = find_seat(problem, seat)
        has_belief = len(belief) > 0
        _check_texts(problem, seat, state, history, turns_left, players, has_belief=has_belief)
        turns_done = len(history)
        turn_limit = problem.horizon if turns_left is None else turns_done + turns_left
        question = AdviceQuestion(seat, turn_limit, tuple(players))
        agent = find_hint_provider(problem, question)
        if not problem.partially_observable:
            s = parse_state(problem, state) if state else make_start_state(problem)[0]
            return cls.at_state(problem, question, agent, s, turns_done)
        if has_belief:
            return cls.at_belief(problem, question, agent, read_belief(problem, belief))
        return cls.after_history(problem, question, agent, parse_history(problem, seat, history))

    @classmethod
    def at_state(
        cls,
        problem: Problem,
        question: AdviceQuestion,
        agent: HintAgent | None,
        state: Array,
        turns_done: int = 0,
    ) -> Self:
        """Return the position in a state that every agent sees, after this number of turns."""
        view = _make_view(problem, question, [state])
        return cls(view, question, agent, turns_done=turns_done)

    @classmethod
    def after_history(
        cls,
        problem: Problem,
        question: AdviceQuestion,
        agent: HintAgent | None,
        turns: Sequence[tuple[int, int]],
    ) -> Self:
        """Return the position after the seat's action and observation in each of some turns."""
        actions, observations = zip(*turns, strict=True) if turns else ((), ())
        null = problem.observations[question.seat].null_observation(1)[0]
        view = _make_view(problem, question, [null, *map(np.asarray, observations)], actions)
        return cls(view, question, agent)

    @classmethod
    def at_belief(
        cls,
        problem: Problem,
        question: AdviceQuestion,
        agent: HintAgent | None,
        belief: Reals,
        turns_done: int = 0,
    ) -> Self:
        """Return the position with a belief `[S]` after this number of turns."""
        null = problem.observations[question.seat].null_observation(1)[0]
        view = replace(_make_view(problem, question, [null]), beliefs=[belief])
        return cls(view, question, agent, turns_done=turns_done, belief=belief)

    # What the seat knows

    @property
    def state(self) -> Array:
        """The state, which every agent sees; raise BadParameter if states are hidden."""
        if self.problem.partially_observable:
            raise BadParameter("the state is hidden at this position; ask for the belief")
        return self.view.observation

    @property
    def labels(self) -> Labels:
        """The labels of the seat's actions; empty if actions are real numbers."""
        return self.view.action_labels

    @property
    def legal_actions_mask(self) -> Bools:
        """The mask `[A]` of the legal actions."""
        legal = self.view.legal_actions_mask
        return np.ones(len(self.labels), bool) if legal is None else legal

    @property
    def legal_actions(self) -> list[int]:
        """The indices of the legal actions."""
        return [int(action) for action in np.flatnonzero(self.legal_actions_mask)]

    @property
    def turns_left(self) -> int | None:
        """The number of turns that can still be played; None without a turn limit."""
        limit = self.question.turn_limit
        return None if limit is None else limit - self.turns_done

    @cached_property
    def active_others(self) -> list[int]:
        """The other seats that act in this turn."""
        inactive = self._inactive_agents
        if inactive is None and not self.problem.partially_observable:
            inactive = mark_inactive_agents(self.problem, self.state[None])[0]
        seats = range(len(self.problem.agents))
        return [
            seat for seat in seats if seat != self.seat and (inactive is None or not inactive[seat])
        ]

    def validate_action(self, action: float | str) -> float:
        """Return an action, or that of a label, as it is played.

        Raise IllegalAction if it is not legal here, and UnknownName if there is no such label.
        """
        if isinstance(action, str):
            action = self.problem.parse_action(self.seat, action)
        prefix = f"turn {self.turns_done + 1}, {self.problem.agents[self.seat]}"
        action_set = self.labels or self.problem.actions[self.seat]
        mask = self.view.legal_actions_mask
        return action_set.validate_action(action, prefix, mask, self.problem.illegal_reason)

    def format_action(self, action: float) -> str:
        """Return the label of an action, or its number as text."""
        if self.labels:
            return self.labels[int(action)]
        return self.problem.format_action(self.seat, action)

    # Values

    @property
    def memory(self) -> Memory:
        """The memory of the agent after what the seat perceived; there must be an agent."""
        if self._memory is None:
            assert self.agent is not None
            self._memory = self._compute_policy_memory(self.agent.policy)
        return self._memory

    def _compute_policy_memory(self, policy: SeatPolicy) -> Memory:
        """Return the memory of a policy after what the seat perceived."""
        view, prefix = self.view, f"turn {self.turns_done + 1}"
        if self._belief is not None:
            memory = policy.memory_at_turn(view.observation[None], self.turns_done)
            if policy.current_belief(memory) is None:
                raise BadParameter("the agent that gives the hints has no belief to change")
            return (self._belief[None], *memory[1:])
        if self.turns_done != view.turns_played:
            return policy.memory_at_turn(view.observation[None], self.turns_done)
        *_, memory = iter_memories(policy, view, prefix)
        return memory

    def ask(self, query: Callable[[SeatPolicy, Memory], T]) -> T:
        """Return the result of a query to the agent with its memory; there must be an agent.

        If planning takes too much work or the agent fails, a tree search replaces it from now on.
        """
        assert self.agent is not None
        if self.agent.name != SEARCH_AGENT:
            try:
                with limit_total_work(ADVICE_WORK_LIMIT):
                    return query(self.agent.policy, self.memory)
            except (BadPolicy, BudgetExceeded):
                self.agent = load_hint_agent(self.problem, self.question, SEARCH_AGENT)
                self._memory = None
                self._forget_answers()
        return query(self.agent.policy, self.memory)

    def values(self) -> ActionValues | None:
        """Return the value of each legal action; None if the agent has none.

        They are estimates with standard errors if the agent samples returns.
        """
        q = self._compute_q()
        if self.agent is None:
            return None
        if q is not None:
            return self.agent.attach_basis(q, self.view.legal_actions_mask)
        choice = self._ask_for_choice()
        return choice if isinstance(choice, ActionValues) else None

    def choose(self) -> tuple[float | None, ActionValues | None]:
        """Return the action that the agent chooses, and its estimates if it samples returns.

        If the estimates are too close to call, there is no action. There must be an agent.
        """
        choice = self._ask_for_choice()
        if not isinstance(choice, ActionValues):
            return choice, None
        return None if choice.is_too_close else float(choice.best_actions[0]), choice

    def _ask_for_choice(self) -> float | ActionValues:
        """Return the estimates of the agent, or its choice if it makes none."""
        if self._choice is None:
            self._choice = self.ask(self._choose_or_estimate)
        return self._choice

    def _choose_or_estimate(self, policy: SeatPolicy, memory: Memory) -> float | ActionValues:
        """Return the estimates of a policy, or its choice if it makes none."""
        turn, count = self.turns_done + 1, policy.uniform_count
        u = self._uniforms
        if u is None or len(u) < count:
            u = SeededUniforms(0).generate_uniforms(1 + self.seat, turn, 0, count)[0]
        legal = self.view.legal_actions_mask
        arguments = memory, None if legal is None else readonly_copy(legal[None]), u[None, :count]
        estimates = policy.estimate_returns(*arguments)
        if estimates is not None:
            assert self.agent is not None
            return estimates._replace(basis=self.agent.basis)
        prefix = f"turn {turn}, {self.problem.agents[self.seat]}"
        choice = forbid_writes(prefix, policy.choose, *arguments)
        return float(validate_policy_actions(policy, choice, 1, prefix)[0])

    def _compute_q(self) -> Reals | None:
        """Return the value of each action `[A]`, as the agent computes it; None if it has none."""
        if self.agent is None or not self.labels:
            return None
        prefix = f"turn {self.turns_done + 1}"
        q = self.ask(lambda policy, memory: forbid_writes(prefix, policy.action_values, memory))
        return None if q is None or np.isnan(q[0]).all() else q[0]

    @property
    def current_belief(self) -> Reals | None:
        """The belief `[S]` that the agent's values are about; None if it is not known."""
        if self.agent is not None:
            beliefs = self.agent.policy.current_belief(self.memory)
            if beliefs is not None:
                return np.asarray(beliefs[0])
        if len(self.problem.agents) == 1 and self.view.beliefs is not None:
            return self.view.belief
        return None

    def values_for_belief(self, belief: Reals) -> Reals | None:
        """Return the value of each action `[..., A]`, nan if illegal, for other beliefs `[..., S]`.

        None if the agent's values are not those of a belief of this length.
        """
        if self.agent is None or not self.labels:
            return None
        current, beliefs = self.current_belief, np.atleast_2d(belief)
        if current is None or not self.memory or self.memory[0].shape != (1, belief.shape[-1]):
            return None
        values = self.ask(
            lambda policy, memory: policy.action_values(
                (beliefs, *(part.repeat(len(beliefs), axis=0) for part in memory[1:]))
            )
        )
        if values is None:
            return None
        return np.where(self.legal_actions_mask, values, np.nan).reshape(*belief.shape[:-1], -1)

    @property
    def is_last_planned_turn(self) -> bool:
        """True if the agent's values count no turn after this one."""
        assert self.agent is not None
        basis, turn_limit = self.agent.basis, self.question.turn_limit
        if basis.horizon is Horizon.PLAN:
            return (self.turns_done + 1) % basis.horizon_turns == 0
        is_last = turn_limit is not None and self.turns_done + 1 >= turn_limit
        return basis.horizon is Horizon.ROUND or (is_last and not basis.turns_scope)

    def best_actions(self) -> list[str]:
        """Return the labels of the actions of greatest value; [] if the agent has no values.

        Of estimates, these are all actions that may have it.
        """
        values = self.values()
        return [] if values is None else [self.labels[action] for action in values.best_actions]

    def break_down(self, action: int | str) -> ActionBreakdown | None:
        """Return the parts of the value of an action; None if they cannot be listed.

        They cannot be listed if the agent has no values, if random events are real numbers, or if
        the agent has no model of the other agents that act in this turn.
        """
        index = int(self.validate_action(action))
        if index not in self._breakdowns:
            self._breakdowns[index] = self._break_down(index)
        return self._breakdowns[index]

    def _break_down(self, action: int) -> ActionBreakdown | None:
        """Return the parts of the value of an action, not cached; None if they are unknown."""
        q = self._compute_q()
        if q is None or not self._lists_events:
            return None
        try:
            events = self._list_events(action)
        except (BadParameter, BudgetExceeded):
            return None
        is_alone = not (self.problem.partially_observable or self.active_others)
        has_model = events.is_modelled or is_alone or self.current_belief is not None
        if not has_model or len(events.probabilities) > MAX_VALUED_OUTCOMES:
            return None
        return self.ask(
            lambda policy, memory: self._break_down_by_events(
                policy, memory, events, action, float(q[action])
            )
        )

    def _break_down_by_events(
        self, policy: SeatPolicy, memory: Memory, events: TurnEvents, action: int, value: float
    ) -> ActionBreakdown:
        """Return the parts of the value of an action that has these possible events."""
        problem, probabilities = self.problem, events.probabilities
        count = len(probabilities)
        next_memory = policy.update_memory(
            tuple(array.repeat(count, axis=0) for array in memory), events.percept
        )
        values_after, blind_value = np.zeros(count), 0.0
        replies, next_replies = self._predict_replies(events), None
        is_last_turn = self.is_last_planned_turn
        if not is_last_turn:
            legal = problem.legal_actions_mask(events.states)
            seat_legal = None if legal is None else legal[:, self.seat]
            values_after = policy.state_values(next_memory, seat_legal)
            values_after = np.where(events.is_over, 0.0, values_after)
            if events.beliefs is not None:
                blind_value = _compute_blind_value(policy, next_memory, seat_legal, events)
            if replies is not None:
                predicted = policy.predict_actions(next_memory, 1 - self.seat)
                next_replies = None if predicted is None else probabilities @ predicted
        discount, seen_value = problem.discount, float(probabilities @ values_after)
        return ActionBreakdown(
            action,
            value,
            discount,
            events.merge_outcomes(problem, self.seat, values_after),
            replies,
            next_replies,
            discount * max(seen_value - blind_value, 0.0) if events.beliefs is not None else 0.0,
            is_last_turn,
            problem.reward_scale,
        )

    # Outcomes

    def outcomes(self, action: int | str) -> tuple[PossibleOutcome, ...]:
        """Return the outcomes of an action that the seat can tell apart, likeliest first.

        The values after the outcomes are nan if the agent has no values. Raise BadParameter if the
        outcomes cannot be listed, and BudgetExceeded if there are too many.
        """
        breakdown = self.break_down(action)
        if breakdown is not None:
            return breakdown.outcomes
        if not self._lists_events:
            raise BadParameter("expected outcomes that can be listed, not real numbers")
        events = self._list_events(int(self.validate_action(action)))
        values_after = np.full(len(events.probabilities), np.nan)
        return events.merge_outcomes(self.problem, self.seat, values_after)

    def expected_rewards(self) -> Reals:
        """Return the expected reward `[A]` of this turn for each action, -inf if it is illegal."""
        rewards = np.full(len(self.labels), -np.inf)
        for action in self.legal_actions:
            events = self._list_events(action)
            rewards[action] = events.probabilities @ events.rewards
        return rewards

    def list_payoffs(self, action: int | str) -> list[Payoff]:
        """Return the expected reward of an action for each way in which the others may act."""
        events = list_next_states(
            self.problem, self.seat, self.state, self.predict_actions, self.validate_action(action)
        )
        assert events.joint_actions is not None
        joint_actions, indices = np.unique(events.joint_actions, axis=0, return_inverse=True)
        indices = indices.reshape(-1)
        probabilities = np.bincount(indices, events.probabilities)
        rewards = np.bincount(indices, events.probabilities * events.rewards) / probabilities
        pairs = zip(probabilities.tolist(), rewards.tolist(), strict=True)
        return [Payoff(joint, *pair) for joint, pair in zip(joint_actions, pairs, strict=True)]

    def forecast(self, action: float | str) -> Forecast:
        """Return the outcomes of an action for a drawing, likeliest first.

        They are next states, or observations if states are hidden. If the next states cannot be
        listed, they are 200 samples from fixed quasi-random uniforms, with random other agents.
        """
        action = self.validate_action(action)
        if self.problem.partially_observable:
            events = self._list_observations(int(action))
            outcomes, beliefs = events.percept.observation, events.beliefs
            probabilities = events.probabilities
        else:
            try:
                if not self._lists_events:
                    return sample_next_states(self.problem, self.seat, self.state, action)
                events = list_next_states(
                    self.problem, self.seat, self.state, self.predict_actions, action
                )
            except BudgetExceeded:  # too many outcomes to list
                return sample_next_states(self.problem, self.seat, self.state, action)
            outcomes, indices = find_unique_states(self.problem, events.states)
            probabilities, beliefs = np.bincount(indices, events.probabilities).astype(float), None
        order = np.argsort(-probabilities, kind="stable")
        result = Forecast(
            action,
            probabilities[order],
            outcomes[order],
            None if beliefs is None else beliefs[order],
            reply_probabilities=self._predict_replies(events) if events.is_modelled else None,
        )
        if not events.is_modelled:
            return result
        assert self.agent is not None
        return result._replace(other_players=self.agent.basis.players)

    @cached_property
    def _lists_events(self) -> bool:
        """True if the events of a turn can be listed: no real numbers that are random."""
        problem, seats = self.problem, range(len(self.problem.agents))
        if not all(problem.actions[seat].labels for seat in seats if seat != self.seat):
            return False
        if problem.partially_observable:
            return True
        chances = problem.chance(self.state[None], np.zeros((1, len(problem.agents)), int))
        return all(isinstance(chance, FiniteChance) for chance in chances)

    def _list_events(self, action: int) -> TurnEvents:
        """Return the possible events of a turn with this action."""
        if self.problem.partially_observable:
            return self._list_observations(action)
        return list_next_states(self.problem, self.seat, self.state, self.predict_actions, action)

    def predict_actions(self, seat: int) -> Reals | None:
        """Return the probability `[A']` of each action of another seat in the agent's model.

        None if the agent has no model of that seat.
        """
        if self.agent is None or not models_opponents(self.agent.policy):
            return None
        predicted = self.ask(lambda policy, memory: policy.predict_actions(memory, seat))
        return None if predicted is None else predicted[0]

    def _predict_replies(self, events: TurnEvents) -> Reals | None:
        """Return the probability `[A']` of each action of the only other agent; None if many."""
        if len(self.problem.agents) != 2 or events.joint_actions is None or not self.active_others:
            return None
        replies = events.joint_actions[:, 1 - self.seat].astype(int)
        reply_count = self.problem.action_counts[1 - self.seat]
        return np.bincount(replies, events.probabilities, reply_count).astype(float)

    def _list_observations(self, action: int) -> TurnEvents:
        """Return the possible observations after an action, in the order of their labels.

        The belief and the other agents' actions are those of the agent; without a model, the others
        act at random. Raise BadParameter if there is no belief.
        """
        problem, agent = self.problem, self.agent
        predicted = None
        if agent is not None:
            predicted = self.ask(
                lambda policy, memory: policy.forecast_observations(memory, action)
            )
        if predicted is not None:
            probabilities, beliefs = predicted
            reward = self.ask(lambda policy, memory: policy.expected_reward(memory, action))
            rewards = np.full(len(probabilities), reward)
        else:
            belief = self.current_belief
            if belief is None:
                belief = None if self.view.beliefs is None else self.view.belief
            if belief is None:
                raise BadParameter("too many states to compute the possible observations")
            probabilities, beliefs, rewards = enumerate_observations(
                problem, self.seat, action, belief
            )
        events = list_observations(problem, self.seat, action, probabilities, beliefs, rewards)
        return events._replace(is_modelled=predicted is not None)


def iter_memories(policy: SeatPolicy, view: View[Problem], error_prefix: str) -> Iterator[Memory]:
    """Yield the memory of a policy before the first turn that its seat perceived, and after each.

    Raise BadPolicy, with the prefix, for a memory that is none.
    """
    memory = call_memory_method(
        error_prefix, policy.initial_memory, 1, readonly_copy(view.observations[0][None])
    )
    yield memory
    has_labels = bool(view.problem.actions[view.seat].labels)
    for turn in range(view.turns_played):
        action = np.array([view.actions[turn]])
        percept = Percept(
            action.astype(np.int64) if has_labels else action,
            readonly_copy(view.observations[turn + 1][None]),
            None if view.joint_actions is None else readonly_copy(view.joint_actions[turn][None]),
            np.array([view.rewards[turn]])
            if view.rewards is not None and view.problem.rewards_observable
            else None,
        )
        memory = call_memory_method(error_prefix, policy.update_memory, 1, memory, percept)
        yield memory


def _check_texts(  # noqa: PLR0913, PLR0917 - the texts of a position
    problem: Problem,
    seat: int,
    state: str,
    history: Sequence[str],
    turns_left: int | None,
    players: Sequence[str],
    *,
    has_belief: bool,
) -> None:
    """Raise BadParameter unless these parts of a position fit the problem and one another."""
    count = len(problem.agents)
    if seat not in range(count):
        raise BadParameter(f"seat: got {seat!r}, expected 0 to {count - 1}")
    if problem.partially_observable and state:
        raise BadParameter("state: the states are hidden, expected a history or a belief")
    if not problem.partially_observable and (history or has_belief):
        name = "history" if history else "belief"
        raise BadParameter(f"{name}: all agents see the state, expected a state")
    if history and has_belief:
        raise BadParameter("belief: expected a history or a belief, not both")
    if turns_left is not None and turns_left < 1:
        raise BadParameter(f"turns_left: got {turns_left}, expected 1 or more")
    if players and len(players) != count:
        raise BadParameter(f"players: got {len(players)}, expected one for each of {count} agents")


def _make_view(
    problem: Problem,
    question: AdviceQuestion,
    observations: Sequence[Array],
    actions: Sequence[float] = (),
) -> View[Problem]:
    """Return the view of a seat with these observations and its actions between them."""
    seat, hidden, state = question.seat, problem.partially_observable, observations[-1]
    legal = None if hidden else problem.legal_actions_mask(state[None])
    return make_view(
        problem,
        seat,
        SeatHistory([*observations], [*actions], [], [], [], []),
        None if legal is None else legal[0, seat],
        turn_limit=question.turn_limit,
        rewards_visible=False,  # texts do not tell them
        shows_belief=hidden,
        current_labels=None if hidden else list_action_labels(problem, seat, state),
    )


def find_exact_agent(session: Session, question: AdviceQuestion) -> HintAgent | None:
    """Return the agent with exact values of the game of a question; None if there is none.

    None too if actions are real numbers, or if there are too many hidden states for beliefs.
    """
    problem = session.problem
    if not problem.actions[question.seat].labels:
        return None
    if problem.partially_observable and not session.has_visible_beliefs:
        return None
    agent = find_hint_provider(problem, question)
    basis = agent.basis if agent else UNKNOWN_BASIS
    is_exact = basis.accuracy is Accuracy.EXACT and basis.has_exact_regrets
    return agent if is_exact else None


def _compute_blind_value(
    policy: SeatPolicy, memory: Memory, legal: Bools | None, events: TurnEvents
) -> float:
    """Return the value of playing on if one action follows whatever is observed.

    `memory` and `legal` have a row for each observation.
    """
    q = policy.action_values(memory)
    assert q is not None
    q = q if legal is None else np.where(legal, q, -np.inf)
    q = np.where(events.is_over[:, None], 0.0, q)
    return float((events.probabilities[:, None] * q).sum(axis=0).max())

"""Base classes of policies: one seat, simple memories, and greedy choice by value."""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from dmplay.core.action_values import UNKNOWN_BASIS, Accuracy, ActionValues, ValuesBasis
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.best_actions import select_greedy_actions
from dmplay.core.parameters import check_parameters
from dmplay.core.policy import Memory, Percept, Policy, requires_fields
from dmplay.core.problem import Problem
from dmplay.core.session import DEFAULT_TURN_LIMIT, Session
from dmplay.core.text import format_count
from dmplay.errors import BadParameter

MAX_TABULAR_STATES = 1000  # maximum number of states for which a table of all states is computed


def summarize_agent(agent_class: object) -> str:
    """Return the first line of an agent's description."""
    return (agent_class.__doc__ or "").partition("\n")[0]


def describe_rule(agent_class: object) -> str:
    """Return the first line of an agent's description as a clause, without the book's section."""
    text = _remove_section(summarize_agent(agent_class)).rstrip(".")
    return f"{text[:1].lower()}{text[1:]}"


def address_opponent(description: str) -> str:
    """Return the description of an agent as its opponent reads it.

    It has "you" for the opponent, and no section of the book, whose name is not beside it.
    """
    text = description.replace("the opponent's", "your").replace("the opponent", "you")
    return _remove_section(text)


def _remove_section(text: str) -> str:
    """Return a text without the section of the book, such as ` (section 24.7)`."""
    return re.sub(r" \(section [\w.]+\)", "", text)


SCRIPTED_PLAYERS = ("script", "replay")  # players that repeat listed actions


@dataclass(frozen=True)
class AdviceQuestion:
    """The game that advice is about: whose seat, how many turns, and which other players.

    Hints, values, forecasts, overlays, reviews, grades and ghosts all ask with it. What the seat
    knows is its memory: its own observations and actions.
    """

    seat: int = 0
    turn_limit: int | None = None  # None for a game without a turn limit
    players: tuple[str, ...] = ()  # the name of each seat's player; () if unknown
    assumes_players: bool = False  # whether a person chose the other players as an assumption
    earlier_turns: int = 0  # first turns, in which other players had some of the seats
    scripts: "tuple[SeatPolicy, ...]" = ()  # the policies of players that repeat listed actions

    @classmethod
    def of_session(
        cls,
        session: Session,
        seat: int,
        players: Sequence[str] = (),
        scripts: "tuple[SeatPolicy, ...]" = (),
    ) -> Self:
        """Return the question about a seat of a session with these players in its seats."""
        return cls(seat, session.turn_limit, tuple(players), scripts=scripts)

    @property
    def opponents(self) -> tuple[str, ...]:
        """The names of the players in the other seats."""
        return tuple(name for seat, name in enumerate(self.players) if seat != self.seat)

    @property
    def actual_opponents(self) -> tuple[str, ...]:
        """The names of the players in the other seats, () if a person only assumes them."""
        return () if self.assumes_players else self.opponents

    def describe_turns_left(self, turns_done: int) -> str:
        """Return the number of turns left as text, '' if there is no turn limit.

        The limit of agents' games that would never end counts as none.
        """
        limit = self.turn_limit
        if limit is None or limit == DEFAULT_TURN_LIMIT or turns_done >= limit:
            return ""
        return f"{format_count(limit - turns_done, 'turn')} left"


@dataclass(frozen=True)
class SeatPolicy(Policy):
    """A policy for one seat, whose other dataclass fields are its parameters.

    A subclass defines `initial_memory`, `update_memory` and `choose`, as `Policy` has them. Unless
    it overrides them, it consumes no uniforms, does not depend on the clock, has no action values,
    and is the same in every game.
    """

    problem: Problem
    seat: int

    positional_parameter: ClassVar[str] = ""  # the parameter whose name may be omitted
    # the optional package that it needs, which may be slow to import
    required_package: ClassVar[str] = ""
    # whether the agent's name alone means a plan for the current game
    plans_whole_game: ClassVar[bool] = False

    def __post_init__(self) -> None:
        """Raise BadParameter if a parameter is out of bounds."""
        check_parameters(self)

    @property
    def uniform_count(self) -> int:
        """The number of uniforms that one row of a choice consumes: none."""
        return 0

    @property
    def depends_on_clock(self) -> bool:
        """True if its choice depends on the speed of the machine."""
        return False

    def action_values(self, memory: Memory) -> Reals | None:
        """Return None, as the action values are unknown."""
        return None

    def value_bounds(self, memory: Memory, actions: Array) -> tuple[Reals, Reals] | None:
        """Return a lower and an upper bound `[B]` of the value of one action of each row.

        They are equal if the value is exact. If actions are real numbers, `choose` must return the
        action whose bounds are the greatest. None if there are no bounds.
        """
        return None

    def state_values(self, memory: Memory, legal: Bools | None) -> Reals:
        """Return the value `[B]` of playing on: that of the best legal action.

        `legal` is `[B, A]`, None if all actions are legal. The policy must have action values.
        """
        q = self.action_values(memory)
        assert q is not None
        return np.asarray((q if legal is None else np.where(legal, q, -np.inf)).max(axis=1))

    def choice_probabilities(self, memory: Memory) -> Reals | None:
        """Return the probability `[B, A]` of each action, if all are legal; None if unknown.

        It is 1 for the chosen action of a policy that consumes no uniforms.
        """
        labels = self.problem.actions[self.seat].labels
        if self.uniform_count or not labels:
            return None
        row_count = len(memory[0]) if memory else 1
        choices = self.choose(memory, None, np.zeros((row_count, 0)))
        return np.asarray(np.eye(len(labels))[np.asarray(choices, np.int64)])

    def predict_actions(self, memory: Memory, seat: int) -> Reals | None:
        """Return the probability `[B, A]` of each action of another seat in its model.

        None if it has no model of that seat.
        """
        return None

    def estimate_returns(
        self, memory: Memory, legal: Bools | None, u: Reals
    ) -> ActionValues | None:
        """Return estimates of the value of each action by sampling; None if it makes none.

        `memory`, `legal` and the uniforms of a choice have one row.
        """
        return None

    def forecast_observations(self, memory: Memory, action: int) -> tuple[Reals, Reals] | None:
        """Return the probability `[O]` of each observation, and the belief `[O, S]` after it.

        `memory` has one row. None if it has no model of the other players but random play.
        """
        return None

    def current_belief(self, memory: Memory) -> Reals | None:
        """Return the beliefs `[B, S]` that its values are about, the first array of its memory.

        None if its memory holds no belief.
        """
        return None

    def state_belief(self, memory: Memory) -> Reals | None:
        """Return the beliefs `[B, S]` over the states of the problem; None if it has none."""
        return self.current_belief(memory)

    def replace_state_belief(self, memory: Memory, belief: Reals) -> Memory | None:
        """Return the memory of one row as if the belief over states were `belief` `[S]`.

        None if its values are not those of a belief.
        """
        current = self.current_belief(memory)
        if current is None or not memory or memory[0].shape != (1, len(belief)):
            return None
        return (belief[None], *memory[1:])

    def expected_reward(self, memory: Memory, action: int) -> float:
        """Return the expected reward of an action, in the model of `forecast_observations`."""
        raise NotImplementedError

    def describe_model(self, memory: Memory) -> str:
        """Return its present estimate of how other agents play, '' if it has none."""
        return ""

    def memory_at_turn(self, observation: Array, turns_done: int) -> Memory:
        """Return the memory with which it acts on an observation after `turns_done` turns.

        It is that of a game that begins there, as most policies do not count turns.
        """
        return self.initial_memory(observation)

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return the basis of its action values in the game of a question.

        A subclass overrides what differs: `super().values_basis(question)._replace(...)`.
        """
        return ValuesBasis(opponents=question.opponents if models_opponents(self) else ())

    def adapt_to_game(self, question: AdviceQuestion) -> Self:
        """Return this policy adapted to the turn limit and the players of a game."""
        return self

    def with_policy_maker(self, policy_maker: "PolicyMaker") -> Self:
        """Return this policy with a function that makes the policies of other seats by name."""
        return self


def bound_action_values(policy: SeatPolicy, memory: Memory) -> Reals | None:
    """Return a lower and an upper bound `[2, B, A]` of the value of each labelled action.

    None if the policy has no bounds.
    """
    count, labels = len(memory[0]), policy.problem.actions[policy.seat].labels
    bounds = [policy.value_bounds(memory, np.full(count, a)) for a in range(len(labels))]
    pairs = [np.stack(pair) for pair in bounds if pair is not None]
    return np.stack(pairs, axis=-1) if len(pairs) == len(labels) else None


def bound_best_number(policy: SeatPolicy, memory: Memory, legal: Bools | None) -> Reals | None:
    """Return a lower and an upper bound `[2, B]` of the value of the best real number.

    None if the policy has no bounds; it is then not asked for a choice.
    """
    if type(policy).value_bounds is SeatPolicy.value_bounds:
        return None
    numbers = policy.choose(memory, legal, np.zeros((len(memory[0]), policy.uniform_count)))
    bounds = policy.value_bounds(memory, numbers)
    return None if bounds is None else np.stack(bounds)


# (seat, name) -> a policy for that seat, None for random play
PolicyMaker = Callable[[int, str], SeatPolicy | None]


def models_opponents(policy: SeatPolicy) -> bool:
    """Return whether a policy predicts the other players: their actions, or what follows them."""
    kind = type(policy)
    return (
        kind.predict_actions is not SeatPolicy.predict_actions
        or kind.forecast_observations is not SeatPolicy.forecast_observations
    )


def find_values_basis(policy: Policy, question: AdviceQuestion) -> ValuesBasis:
    """Return the basis of a policy's action values in the game of a question.

    Exact values are conditional unless the other players are those of the game. A policy without
    `values_basis` has values of unknown accuracy. Raise BadParameter if it returns anything else.
    """
    basis = getattr(policy, "values_basis", lambda question: UNKNOWN_BASIS)(question)
    if not isinstance(basis, ValuesBasis):
        location = f"{type(policy).__name__}.values_basis"
        raise BadParameter(f"{location}: got {basis!r}, expected a ValuesBasis")
    is_assumption = bool(basis.assumed_players) or question.assumes_players
    is_conditional = basis.accuracy is Accuracy.EXACT and is_assumption
    return basis._replace(accuracy=Accuracy.CONDITIONAL) if is_conditional else basis


class GreedyPolicy(ABC):
    """A mixin that takes the first legal action with the greatest value."""

    problem: Problem

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the first of the best legal actions of each row."""
        q = self.action_values(memory)
        q = q if legal is None else np.where(legal, q, -np.inf)
        return select_greedy_actions(q, self.problem.reward_scale)

    @abstractmethod
    def action_values(self, memory: Memory) -> Reals:
        """Return Q of each action, of shape `[B, A]`."""


@dataclass(frozen=True)
class ReactivePolicy(SeatPolicy):
    """A policy that acts on its last observation, `memory[0]`."""

    def initial_memory(self, observation: Array) -> Memory:
        """Return a memory that holds the initial observation."""
        return (observation,)

    @requires_fields("observation")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return a memory that holds the new observation."""
        return (percept.observation,)


@dataclass(frozen=True)
class StationaryPolicy(ReactivePolicy, ABC):
    """A policy whose action is a function of the state.

    If there are few states and all actions are legal, it computes the actions of all states once.
    """

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the action in each state, looked up in the table of all states if there is one."""
        (s,), states = memory, self.problem.state_count
        if legal is not None or not isinstance(states, int) or states > MAX_TABULAR_STATES:
            return self.choose_from_states(s, legal)
        return np.asarray(self._action_table.take(self.problem.state_indices(s)))

    @cached_property
    def _action_table(self) -> Array:
        """The action in every state `[S]`."""
        return self.choose_from_states(self.problem.enumerate_states(), None)

    @abstractmethod
    def choose_from_states(self, s: Array, legal: Bools | None) -> Array:
        """Return the action in each state `[B]`; `legal` is None if all actions are legal."""


@dataclass(frozen=True)
class ConstantPolicy(ReactivePolicy):
    """A policy that always takes the same action, which a subclass sets."""

    action = 0

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the constant action for each row."""
        return np.full(len(memory[0]), self.action)


@dataclass(frozen=True)
class RepeatedGameRule(SeatPolicy, ABC):
    """A rule for a repeated two-player game: a first action, then a reply to the last round."""

    first_action = 0

    @abstractmethod
    def reply(self, own_actions: Ints, opponent_actions: Ints) -> Array:
        """Return the next actions `[B]` after a round."""

    def initial_memory(self, observation: Array) -> Memory:
        """Return a memory that holds the first action."""
        return (np.full(len(observation), self.first_action),)

    @requires_fields("actions")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return a memory that holds the reply to the last round."""
        assert percept.actions is not None
        return (self.reply(percept.actions[:, self.seat], percept.actions[:, 1 - self.seat]),)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the action that is stored in the memory."""
        return memory[0]

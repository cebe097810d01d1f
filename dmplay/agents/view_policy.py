"""Plain agents: functions of a view, and objects with `act(view)`, which play game by game."""

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.parameters import NUMBER_TYPES
from dmplay.core.policy import Memory, Percept
from dmplay.core.problem import WAIT_LABEL, Problem, find_wait_action
from dmplay.core.seat_history import SeatHistory
from dmplay.core.session import has_visible_beliefs, list_action_labels, make_view
from dmplay.core.spaces import Labels
from dmplay.core.typed_text import read_belief
from dmplay.errors import BadPolicy, DmplayError


def is_plain_agent(agent: object) -> bool:
    """Return whether this is a plain agent: it has `act`, or is a function of a view.

    A function of a view has one argument, or its first argument is called `view`.
    """
    if hasattr(agent, "choose"):
        return False
    arguments = [] if isinstance(agent, type) else list_arguments(agent)
    return hasattr(agent, "act") or len(arguments) == 1 or arguments[:1] == ["view"]


def list_arguments(function: object) -> list[str]:
    """Return the names of the arguments that a call has to give; empty if they are unknown."""
    try:
        parameters = inspect.signature(function).parameters.values()  # type: ignore[arg-type]
    except (TypeError, ValueError):  # not a function, or one without a signature
        return []
    kinds = inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD
    return [item.name for item in parameters if item.kind in kinds and item.default is item.empty]


class Choice(NamedTuple):
    """A choice that an object has made in a game, with what it was asked."""

    turns: int
    legal: Bools | None
    u: list[float]
    action: float


class PlainGame:
    """A game as its seat has seen it, and the object that plays it.

    The object has made the choices in order. After an undo, and for other random numbers, a new
    object makes the earlier choices again.
    """

    def __init__(self, history: SeatHistory, choices: list[Choice]) -> None:
        self.history, self.choices = history, choices
        self.stated_beliefs: dict[int, Reals] = {}  # by the number of turns before the choice
        self.player: Any = None


class GameNode:
    """The position in a game after a number of turns; later turns may have been appended to it."""

    def __init__(self, game: PlainGame, turns: int) -> None:
        self.game, self.turns = game, turns


@dataclass(frozen=True)
class ViewPolicy:
    """A policy that lets a plain agent choose in each game, from the view of its seat.

    `agent` is a function, an object with `act`, which is the same for all games, or its class, of
    which each game has its own object. It gets the view and, if it has a second argument, one
    uniform. It returns an action, or an action and the belief that it states. The memory holds a
    GameNode for each row.
    """

    problem: Problem
    seat: int
    name: str
    agent: Any
    turn_limit: int | None = None
    parameters: Mapping[str, object] = field(default_factory=dict)

    @cached_property
    def function(self) -> Any:
        """The function that chooses: the agent itself, or its `act`."""
        return getattr(self.agent, "act", self.agent)

    @cached_property
    def uniform_count(self) -> int:
        """The number of uniforms of a choice: one if there is a second argument."""
        return int(len([name for name in list_arguments(self.function) if name != "self"]) > 1)

    @cached_property
    def _shows_beliefs(self) -> bool:
        """True if views show beliefs."""
        return has_visible_beliefs(self.problem)

    def _state_labels(self, state: Array) -> Labels | None:
        """Return the action labels in a state; None if they are hidden, or the same in all."""
        has_same_labels = type(self.problem).action_labels is Problem.action_labels
        if has_same_labels or self.problem.partially_observable:
            return None
        return list_action_labels(self.problem, self.seat, state)

    def initial_memory(self, observation: Array) -> Memory:
        """Return a new game for each row."""
        histories = (SeatHistory([first], [], [], [], [], []) for first in observation)
        return (np.array([GameNode(PlainGame(history, []), 0) for history in histories], object),)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the games after one more turn."""
        nodes = [self._append_turn(node, percept, row) for row, node in enumerate(memory[0])]
        return (np.array(nodes, object),)

    def _append_turn(self, node: GameNode, percept: Percept, row: int) -> GameNode:
        """Return a game after the turn in a row of a percept.

        The turn is appended to the game, or to a copy if the game went on in another way.
        """
        game, turns = node.game, node.turns
        if len(game.history.actions) > turns:
            choices = [choice for choice in game.choices if choice.turns <= turns]
            game = PlainGame(game.history.copy_until_turn(turns), choices)
        history, action = game.history, float(percept.action[row])
        labels = self._state_labels(history.observations[turns])
        if labels:
            history.action_labels.append(labels[int(action)])
        history.observations.append(percept.observation[row])
        history.actions.append(action)
        if percept.actions is not None:
            history.joint_actions.append(percept.actions[row])
        if percept.reward is not None:
            history.rewards.append(float(percept.reward[row]))
        return GameNode(game, turns + 1)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the action of each game; a seat that can only wait is not asked."""
        masks = [None] * len(u) if legal is None else legal
        rows = zip(memory[0], masks, u.tolist(), strict=True)
        return np.array([self._choose_in_game(*row) for row in rows])

    def _choose_in_game(self, node: GameNode, legal: Bools | None, u: list[float]) -> float:
        """Return the action in one game."""
        space, game = self.problem.actions[self.seat], node.game
        if legal is not None and space.describe_actions(legal) == WAIT_LABEL:
            return find_wait_action(self.problem, self.seat)
        if not isinstance(self.agent, type):
            return self._call(self.function, Choice(node.turns, legal, u, 0.0), game)
        if game.choices and game.choices[-1].turns >= node.turns:  # It has been asked before.
            for choice in game.choices:
                if choice.turns == node.turns and choice.u == u:
                    return choice.action
            game.choices = [choice for choice in game.choices if choice.turns < node.turns]
            game.player = None
        if game.player is None:
            game.player = self._make_player()
            for choice in game.choices:
                self._call(game.player.act, choice, game)
        choice = Choice(node.turns, legal, u, 0.0)
        action = self._call(game.player.act, choice, game)
        game.choices.append(choice._replace(action=action))
        return action

    def _make_player(self) -> Any:
        """Return a new object of the agent's class, which may take the problem and the seat."""
        takes_problem = len(list_arguments(self.agent)) > 1
        arguments = (self.problem, self.seat) if takes_problem else ()
        return self.agent(*arguments, **self.parameters)

    def _call(self, function: Any, choice: Choice, game: PlainGame) -> float:
        """Return the action that a function chooses; raise BadPolicy if it returns none."""
        problem, seat, turns = self.problem, self.seat, choice.turns
        labels = self._state_labels(game.history.observations[turns])
        view = make_view(
            problem,
            seat,
            game.history,
            choice.legal,
            turns=turns,
            turn_limit=self.turn_limit,
            rewards_visible=problem.rewards_observable,
            shows_belief=self._shows_beliefs,
            current_labels=labels,
        )
        parameters = {} if isinstance(self.agent, type) else self.parameters
        answer = function(view, *choice.u, **parameters)
        error_prefix = f"turn {turns + 1}, {problem.agents[seat]}: {self.name}"
        if isinstance(answer, tuple) and len(answer) == 2:
            answer, stated = answer
            game.stated_beliefs[turns] = self._read_belief(stated, error_prefix)
        if isinstance(answer, NUMBER_TYPES) or (
            isinstance(answer, np.ndarray) and not answer.shape
        ):
            return answer  # type: ignore[return-value]
        if not isinstance(answer, str):
            expected = "expected the name or the number of an action"
            raise BadPolicy(f"{error_prefix} returned {answer!r}, {expected}")
        try:
            return labels.parse_action(answer) if labels else problem.parse_action(seat, answer)
        except DmplayError as error:
            raise BadPolicy(f"{error_prefix}: {error}") from None

    def _read_belief(self, stated: Any, error_prefix: str) -> Reals:
        """Return the belief `[S]` that is stated with an action; raise BadPolicy if it is none."""
        try:
            if not self._shows_beliefs:
                raise BadPolicy("got one, but there is no belief over hidden states")
            is_array = isinstance(stated, np.ndarray | tuple)
            return read_belief(self.problem, [*map(float, stated)] if is_array else stated)
        except (DmplayError, TypeError, ValueError) as error:
            raise BadPolicy(f"{error_prefix}: belief: {error}") from None

    def stated_belief(self, memory: Memory) -> Reals | None:
        """Return the belief `[B, S]` stated with the last choice of each game, NaN for none."""
        stated = [node.game.stated_beliefs.get(node.turns) for node in memory[0]]
        size = next((len(belief) for belief in stated if belief is not None), 0)
        nothing = np.full(size, np.nan)
        return np.array([nothing if row is None else row for row in stated]) if size else None

    def action_values(self, memory: Memory) -> None:
        """Return None, because a plain agent has no values."""

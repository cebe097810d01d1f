"""The checks of an agent: its choices are legal, and the same alone as in a batch of games."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from dmplay.agents.view_policy import ViewPolicy
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.policy import (
    Memory,
    Percept,
    Policy,
    forbid_writes,
    required_fields,
    requires_fields,
)
from dmplay.core.problem import WAIT_LABEL, Problem
from dmplay.core.session import call_memory_method, validate_policy_actions
from dmplay.core.user_code_locations import describe_error_location, locate_function
from dmplay.core.violation import Violation, make_violation
from dmplay.errors import BadPolicy, DmplayError, IllegalAction
from dmplay.simulation.random_play import SEED, make_arrays_readonly
from dmplay.simulation.rollouts import RolloutSpec, rollout_entrants

CHECKED_TURNS = 3  # turns in which the agents of a problem's module choose
RELATIVE_TOLERANCE = 1e-9  # difference of action values that is due to the order of a sum
SINGLE_GAME_REMEDY = "alone; expected the same choice from the same memory, in any batch and order"
Choices = list[float | None]  # one for each game; None if the agent can only wait


class CheckedTurn(NamedTuple):
    """The choices of an agent in one turn of B games, with its inputs."""

    episodes: Ints  # [B]
    legal: Bools | None  # [B, A]
    u: Reals  # [B, uniform_count]
    choices: Choices
    action_values: Reals | None  # [B, A]


class CheckedPolicy:
    """A policy that passes every call on to an agent, checks the answers and records them.

    Its memory is that of the agent, after an array of the numbers of the games.
    """

    def __init__(self, problem: Problem, seat: int, policy: Policy) -> None:
        self.problem, self.seat, self.policy = problem, seat, policy
        self.uniform_count = policy.uniform_count
        self.update_memory = requires_fields(*required_fields(policy))(partial(self._update_memory))
        self.turns, self.percepts = list[CheckedTurn](), list[Percept]()
        self._turn, self.location, self.method = 1, "", "choose"

    @property
    def choices(self) -> list[Choices]:
        """The choices of every turn."""
        return [turn.choices for turn in self.turns]

    def initial_memory(self, observation: Array) -> Memory:
        """Return the memory of new games, whose calls replace the recorded ones."""
        self.first_observation = observation
        self.turns, self.percepts, self._turn = [], [], 1
        episodes = np.arange(len(observation))
        return episodes, *self._validate_memory(episodes, "initial_memory", observation)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the agent's choices, and record them if they are legal."""
        self._turn = len(self.turns) + 1
        episodes, *own_memory = memory
        actions, choices, action_values = self._choose_checked(
            episodes, tuple(own_memory), legal, u
        )
        self.turns.append(CheckedTurn(episodes, legal, u, choices, action_values))
        return actions

    def action_values(self, memory: Memory) -> Reals | None:
        """Return the agent's values `[B, A]`; None if it has none."""
        return self.policy.action_values(memory[1:])

    def compare_choices(self, other_choices: Sequence[Choices], remedy: str) -> None:
        """Raise BadPolicy for the first choice that differs from the recorded one."""
        for turn, (recorded, other) in enumerate(zip(self.turns, other_choices, strict=False), 1):
            self._turn = turn
            games = zip(recorded.episodes, recorded.choices, other, strict=False)
            for episode, choice, other_choice in games:
                self._check_choice(episode, choice, other_choice, remedy)

    def check_games_alone(self) -> None:
        """Play each game alone, turn by turn; raise BadPolicy if a choice differs.

        In each turn, the last game comes first. An agent that stores anything outside of its memory
        then gets its games in another order.
        """
        self._turn = 1
        memories = [
            self._validate_memory(
                np.array([episode]), "initial_memory", self.first_observation[[episode]]
            )
            for episode in range(len(self.first_observation))
        ]
        for turn, (recorded, percept) in enumerate(zip(self.turns, self.percepts, strict=True), 1):
            self._turn = turn
            for row, episode in reversed([*enumerate(recorded.episodes)]):
                single, rows, memory = recorded.episodes[row : row + 1], [row], memories[episode]
                legal = None if recorded.legal is None else recorded.legal[rows]
                _, (choice,), values = self._choose_checked(single, memory, legal, recorded.u[rows])
                self._check_choice(episode, recorded.choices[row], choice, SINGLE_GAME_REMEDY)
                self._compare_values(recorded.action_values, row, values)
                fields: list[Any] = [
                    field if field is None or not len(field) else field[rows] for field in percept
                ]
                memories[episode] = self._validate_memory(
                    single, "update_memory", memory, Percept(*fields)
                )

    def _update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the memory after a turn, and record the percept."""
        self.percepts.append(percept)
        episodes = memory[0]
        return episodes, *self._validate_memory(episodes, "update_memory", memory[1:], percept)

    def _validate_memory(self, episodes: Ints, method: str, *args: object) -> Memory:
        """Return the memory from a method of the agent; raise BadPolicy if it is not a memory."""
        location = self._set_call_location(episodes, method)
        function: Callable[..., object] = getattr(self.policy, method)
        memory = call_memory_method(location, function, len(episodes), *args)
        return make_arrays_readonly(*memory)

    def _choose_checked(
        self, episodes: Ints, memory: Memory, legal: Bools | None, u: Reals
    ) -> tuple[Array, Choices, Reals | None]:
        """Return the agent's actions, its choices and its action values.

        Raise IllegalAction for an illegal choice, and BadPolicy for values of another shape.
        """
        location, count = self._set_call_location(episodes, "choose"), len(episodes)
        make_arrays_readonly(*memory, u)
        answer = forbid_writes(location, self.policy.choose, memory, legal, u)
        actions = validate_policy_actions(self.policy, answer, count, location)
        action_set = self.problem.actions[self.seat]
        choices: Choices = []
        for row, (episode, action) in enumerate(zip(episodes, actions.tolist(), strict=True)):
            row_legal = None if legal is None else legal[row]
            can_only_wait = action_set.describe_actions(row_legal) == WAIT_LABEL
            self._set_call_location(np.array([episode]), "choose")
            choices.append(
                None
                if can_only_wait
                else action_set.validate_action(action, self.location, row_legal)
            )
        self._set_call_location(episodes, "action_values")
        values = getattr(self.policy, "action_values", lambda _: None)(memory)
        if values is not None and action_set.labels:
            shape = (count, len(action_set.labels))
            if np.shape(values) != shape:
                message = f"got action values of shape {np.shape(values)}, expected {shape} or None"
                raise BadPolicy(f"{self.location}: {message}")
        return actions, choices, values

    def _check_choice(
        self, episode: int, choice: float | None, other: float | None, remedy: str
    ) -> None:
        """Raise BadPolicy if another choice in a game is not the recorded one."""
        if choice is not None and other is not None and choice != other:
            location = self._set_call_location(np.array([episode]), "choose")
            first, second = (self.problem.format_action(self.seat, a) for a in (choice, other))
            raise BadPolicy(f"{location}: chose {first} in a batch of games, and {second} {remedy}")

    def _compare_values(self, values: Reals | None, row: int, single: Reals | None) -> None:
        """Raise BadPolicy if the action values of a game alone are not those in the batch."""
        tolerance = RELATIVE_TOLERANCE
        if values is None or single is None:
            return
        if not np.allclose(values[row], single[0], tolerance, tolerance, equal_nan=True):
            self.method = "action_values"
            message = "got other action values in a batch of games than alone, expected the same"
            raise BadPolicy(f"{self.location}: {message}")

    def _set_call_location(self, episodes: Ints, method: str) -> str:
        """Store the location of a call of the agent's method; return it as text."""
        first, last = episodes[[0, -1]]
        games = f"episode {first}" if len(episodes) == 1 else f"episodes {first} to {last}"
        self.method = method
        self.location = f"seed {SEED}, {games}, turn {self._turn}, {self.problem.agents[self.seat]}"
        return self.location


def play_checked_games(
    checked: CheckedPolicy, policies: Sequence[Policy], episodes: int, turns: int
) -> None:
    """Play games with the checked policy in its seat, and these policies in the other seats."""
    seated = [*policies[: checked.seat], checked, *policies[checked.seat + 1 :]]
    rollout_entrants(checked.problem, [seated], RolloutSpec(range(episodes), turns, SEED))


def find_agent_violation(
    problem: Problem, seat: int, policies: Sequence[Policy], episodes: int
) -> Violation | None:
    """Return the first violation of a seat's policy in games of these policies, or None."""
    checked = CheckedPolicy(problem, seat, policies[seat])
    try:
        play_checked_games(checked, policies, episodes, CHECKED_TURNS)
        checked.check_games_alone()
    except Exception as error:
        return agent_error_to_violation(error, checked)
    return None


def agent_error_to_violation(error: Exception, checked: CheckedPolicy | None) -> Violation:
    """Return the violation of an error that an agent raised; raise any other error again.

    Without a policy, the error is one of its file or of its `__init__`.
    """
    source_line, _, sentence = describe_error_location(error).partition(": ")
    if source_line:
        return Violation(source_line, f"{checked.location}: {sentence}" if checked else sentence)
    is_bad_policy = isinstance(error, BadPolicy | IllegalAction)
    if not (is_bad_policy or (checked and not isinstance(error, DmplayError))):
        raise error
    if not checked:
        return Violation("", str(error))
    # NumPy and Python themselves may refuse an answer, or the arguments of a call.
    sentence = str(error) if is_bad_policy else f"{type(error).__name__}: {error}"
    is_located = sentence.startswith(f"seed {SEED}, ")
    sentence = sentence if is_located else f"{checked.location}: {sentence}"
    if isinstance(checked.policy, ViewPolicy):
        return Violation(locate_function(checked.policy.function), sentence)
    return make_violation(type(checked.policy), checked.method, sentence)

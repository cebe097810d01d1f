"""The rules of a problem as one game asks them, a row at a time."""

import math
from typing import NamedTuple, TypeVar

import numpy as np

from dmplay.chance import (
    FINITE_CHANCE_TYPES,
    Array,
    Bools,
    Reals,
    sample_unbatched,
    to_event_arrays,
)
from dmplay.core import (
    Outcome,
    Percept,
    Problem,
    array_bytes,
    intern_array,
    make_readonly,
    readonly_copy,
)

MAX_CACHED_ANSWERS = (
    4096  # answers that are remembered; and pairs of a state and a joint action where any are
)

T = TypeVar("T")


class StateInfo(NamedTuple):
    """What holds in a state, however a game came to it."""

    legal_actions_mask: Bools | None  # [n, A]; None for all
    inactive_agents: Bools  # [n], who only waits
    terminal: bool


class StepResult(NamedTuple):
    """What came of a turn, without the batch axis."""

    actions: Array  # [n]
    state: Array  # [...]
    observations: Array  # [n], or the state
    rewards: Reals  # [n]


class ProblemDynamics:
    """A problem that is asked each time."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self._no_inactive_agents = make_readonly(np.zeros(len(problem.agents), bool))

    def state_info(self, state: Array) -> StateInfo:
        """What holds in a state."""
        problem, s = self.problem, state[None]
        legal, terminal = problem.legal_actions_mask(s), bool(problem.terminal(s)[0])
        if legal is None:
            return StateInfo(None, self._no_inactive_agents, terminal)
        return StateInfo(legal[0], problem.inactive_agents(s)[0], terminal)

    def resolve_turn(self, state: Array, joint: Array, draws: Reals) -> StepResult:
        """What comes of a joint action under these draws."""
        return self._step_result(joint, self.problem.step(state[None], joint[None], draws[None]))

    def _step_result(self, joint: Array, outcome: Outcome) -> StepResult:
        state = readonly_copy(outcome.state[0])
        seen = (
            readonly_copy(outcome.observations[0]) if self.problem.partially_observable else state
        )
        return StepResult(
            make_readonly(joint), state, seen, make_readonly(outcome.rewards[0] + 0.0)
        )

    def build_percept(self, seat: int, actions: Array, outcome: Outcome) -> Percept:
        """What a turn taught a seat, as a batch of one row."""
        return self.problem.build_percept(seat, actions, outcome)


class CachedDynamics(ProblemDynamics):
    """A problem in which little can happen: what it was asked before is not asked again."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        self._state_infos: dict[bytes, StateInfo] = {}
        self._step_results: dict[tuple[object, ...], StepResult] = {}
        self._percepts: dict[tuple[object, ...], Percept] = {}

    def state_info(self, state: Array) -> StateInfo:
        """What holds in a state."""
        known, key = self._state_infos, array_bytes(state)
        if key not in known:
            known[key] = super().state_info(state)
        return known[key]

    def resolve_turn(self, state: Array, joint: Array, draws: Reals) -> StepResult:
        """What comes of a joint action under these draws."""
        s, a, u = state[None], joint[None], draws[None]
        chances = self.problem.chance(s, a)
        if not all([isinstance(chance, FINITE_CHANCE_TYPES) for chance in chances]):
            return super().resolve_turn(state, joint, draws)
        events = sample_unbatched(chances, u)
        known, key = self._step_results, (array_bytes(state), array_bytes(joint), *events)
        if key not in known:
            _clear_if_full(known)
            known[key] = self._step_result(
                joint, self.problem.resolve_events(s, a, to_event_arrays(events))
            )
        return known[key]

    def build_percept(self, seat: int, actions: Array, outcome: Outcome) -> Percept:
        """What a turn taught a seat, in arrays into which nobody ever can write."""
        _, rewards, seen = outcome
        known, key = (
            self._percepts,
            (seat, array_bytes(actions), array_bytes(seen), array_bytes(rewards)),
        )
        if key not in known:
            _clear_if_full(known)
            taught = super().build_percept(seat, actions, outcome)
            parts = {
                k: intern_array(part) for k, part in taught._asdict().items() if part is not None
            }
            known[key] = taught._replace(**parts)
        return known[key]


def _clear_if_full(cache: dict[tuple[object, ...], T]) -> None:
    """Forgets everything where there is no more room."""
    if len(cache) >= MAX_CACHED_ANSWERS:
        cache.clear()


def make_dynamics(problem: Problem, initial_state: Array) -> ProblemDynamics:
    """The rules for a game that begins in this state."""
    many, exact = problem.state_count, initial_state.dtype.kind in "iub"
    little = (
        isinstance(many, int) and 0 < many * math.prod(problem.action_counts) <= MAX_CACHED_ANSWERS
    )
    return CachedDynamics(problem) if little and exact else ProblemDynamics(problem)

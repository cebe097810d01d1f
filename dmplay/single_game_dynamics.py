"""The dynamics of a problem for one game, without the batch axis."""

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
    check_rewards,
    intern_array,
    make_readonly,
    readonly_copy,
)

MAX_CACHED_ANSWERS = (
    # maximum cached answers, and maximum pairs of state and joint action of a problem that is
    # cached
    4096
)

T = TypeVar("T")


class StateInfo(NamedTuple):
    """The facts about a state that do not depend on the game's history."""

    legal_actions_mask: Bools | None  # [n, A]; None for all
    inactive_agents: Bools  # [n], agents that only wait
    terminal: bool


class StepResult(NamedTuple):
    """The result of one turn, without the batch axis."""

    actions: Array  # [n]
    state: Array  # [...]
    observations: Array  # [n], or the state
    rewards: Reals  # [n]


class ProblemDynamics:
    """The dynamics of a problem, computed again at each call."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self._no_inactive_agents = make_readonly(np.zeros(len(problem.agents), bool))

    def state_info(self, state: Array) -> StateInfo:
        """Return the legal actions, the inactive agents and whether the state is terminal."""
        problem, s = self.problem, state[None]
        legal, terminal = problem.legal_actions_mask(s), bool(problem.terminal(s)[0])
        if legal is None:
            return StateInfo(None, self._no_inactive_agents, terminal)
        return StateInfo(legal[0], problem.inactive_agents(s)[0], terminal)

    def resolve_turn(self, state: Array, joint: Array, draws: Reals) -> StepResult:
        """Return the result of a joint action with these uniforms."""
        return self._step_result(joint, self.problem.step(state[None], joint[None], draws[None]))

    def _step_result(self, joint: Array, outcome: Outcome) -> StepResult:
        """Return the outcome of one row as read-only arrays without the batch axis."""
        check_rewards(self.problem, outcome.rewards)
        state = readonly_copy(outcome.state[0])
        observations = (
            readonly_copy(outcome.observations[0]) if self.problem.partially_observable else state
        )
        return StepResult(
            make_readonly(joint), state, observations, make_readonly(outcome.rewards[0] + 0.0)
        )

    def build_percept(self, seat: int, actions: Array, outcome: Outcome) -> Percept:
        """Return the information that a turn gives a seat, as a batch of one row."""
        return self.problem.build_percept(seat, actions, outcome)


class CachedDynamics(ProblemDynamics):
    """The dynamics of a small problem, with a cache of all results."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        self._state_infos: dict[bytes, StateInfo] = {}
        self._step_results: dict[tuple[object, ...], StepResult] = {}
        self._percepts: dict[tuple[object, ...], Percept] = {}

    def state_info(self, state: Array) -> StateInfo:
        """Return the facts about a state, from the cache if possible."""
        cache, key = self._state_infos, array_bytes(state)
        if key not in cache:
            cache[key] = super().state_info(state)
        return cache[key]

    def resolve_turn(self, state: Array, joint: Array, draws: Reals) -> StepResult:
        """Return the result of a joint action, cached by state, action and sampled events.

        Turns whose chances are not finite are not cached.
        """
        s, a, u = state[None], joint[None], draws[None]
        chances = self.problem.chance(s, a)
        if not all([isinstance(chance, FINITE_CHANCE_TYPES) for chance in chances]):
            return super().resolve_turn(state, joint, draws)
        events = sample_unbatched(chances, u)
        cache, key = self._step_results, (array_bytes(state), array_bytes(joint), *events)
        if key not in cache:
            _clear_if_full(cache)
            cache[key] = self._step_result(
                joint, self.problem.resolve_events(s, a, to_event_arrays(events))
            )
        return cache[key]

    def build_percept(self, seat: int, actions: Array, outcome: Outcome) -> Percept:
        """Return the information that a turn gives a seat, in shared read-only arrays."""
        _, rewards, observations = outcome
        cache, key = (
            self._percepts,
            (seat, array_bytes(actions), array_bytes(observations), array_bytes(rewards)),
        )
        if key not in cache:
            _clear_if_full(cache)
            percept = super().build_percept(seat, actions, outcome)
            arrays = {
                k: intern_array(array)
                for k, array in percept._asdict().items()
                if array is not None
            }
            cache[key] = percept._replace(**arrays)
        return cache[key]


def _clear_if_full(cache: dict[tuple[object, ...], T]) -> None:
    """Clear the cache if it is full."""
    if len(cache) >= MAX_CACHED_ANSWERS:
        cache.clear()


def make_dynamics(problem: Problem, initial_state: Array) -> ProblemDynamics:
    """Return the dynamics for a game with this initial state, cached if the problem is small.

    Small means a finite problem with integer states and at most MAX_CACHED_ANSWERS pairs of a state
    and a joint action.
    """
    state_count, has_integer_states = problem.state_count, initial_state.dtype.kind in "iub"
    is_small = (
        isinstance(state_count, int)
        and 0 < state_count * math.prod(problem.action_counts) <= MAX_CACHED_ANSWERS
    )
    return CachedDynamics(problem) if is_small and has_integer_states else ProblemDynamics(problem)

"""The base class of problems, and the exact enumeration of their outcomes."""

import inspect
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import product
from typing import NamedTuple, Self, dataclass_transform

import numpy as np

from dmplay.core import user_code_locations
from dmplay.core.arrays import (
    Array,
    Bools,
    Ints,
    Reals,
    is_within,
    readonly_copy,
    select_seat_observations,
)
from dmplay.core.best_actions import compute_reward_scale
from dmplay.core.chance import Chance, FiniteChance, sample_chance_events
from dmplay.core.parameters import INTEGER_TYPES, check_parameters, parameter
from dmplay.core.policy import FIELD_OMITTED, Percept
from dmplay.core.spaces import Interval, Labels, ObservationSpace, normalize_label
from dmplay.core.state_grid import StateGrid
from dmplay.core.work_budget import Budget
from dmplay.errors import BadParameter, BudgetExceeded, UnknownName

MAX_LISTING_BYTES = 384 * 2**20  # maximum bytes of an array over all states, or over their outcomes
INIT_REFUSED_MESSAGE = (
    "declare parameters as fields with a default, such as `price: float = 5.0`, not in __init__"
)
MAX_SCALE_STATES = 256  # states whose rewards tell the scale of all
WAIT_LABEL = "wait"  # label of the only legal action of an inactive agent


class ContinuousStates(NamedTuple):
    """A state space that is part of R^dimensions."""

    dimensions: int


class UniformCounts(NamedTuple):
    """The number of uniforms that one row consumes at the start, and in each turn."""

    start: int
    step: int


class StatePart(NamedTuple):
    """A part of the state, such as the hex of a walker.

    `labels` names its values, and `value_of_state` `[S]` has the index of the value in each state.
    """

    labels: Sequence[str]
    value_of_state: Ints

    def sum_states(self, numbers: Reals) -> Reals:
        """Return the sum `[V]` of numbers `[S]` over the states with each value."""
        return np.bincount(self.value_of_state, numbers, len(self.labels)).astype(float)


class StateParts(NamedTuple):
    """The parts of a state whose beliefs are shown in separate tables, and their plural noun."""

    noun: str
    parts: Sequence[StatePart]


class Outcome(NamedTuple):
    """The outcome of one joint action, for B rows and n agents.

    The arrays are `state` `[B, ...]` and `rewards` `[B, n]`. In a partially observable problem,
    `observations` are label indices or texts `[B, n]`, or numbers `[B, n, size]`; else they are the
    next state itself.
    """

    state: Array  # [B, ...]
    rewards: Reals  # [B, n]
    observations: Array  # [B, n, ...]; the next state itself if it is fully observable


class AfterstateModel(NamedTuple):
    """The features of afterstates, which are states after an action, before chance acts."""

    feature_count: int
    # from states `[B, ...]`, the rewards `[B, A]` of all actions, -inf if illegal, and the features
    # `[K, B, A]` of their afterstates: indices below `feature_count`
    list_features: Callable[[Array], tuple[Reals, Ints]]


def check_problem(problem: object, turn_limit: int | None) -> None:
    """Raise BadParameter unless this is a Problem and the turn limit is None, or 0 or more."""
    if not isinstance(problem, Problem):
        source = "dmplay.load_problem(NAME)"
        if isinstance(problem, type) and issubclass(problem, Problem):
            source = f"{problem.__name__}()"
        raise BadParameter(f"got {problem!r}, expected a problem, such as {source}")
    if turn_limit is not None and (not isinstance(turn_limit, INTEGER_TYPES) or turn_limit < 0):
        raise BadParameter(f"turns: got {turn_limit!r}, expected a whole number, 0 or more")


def choose_turn_limit(turns: int | None, turn_limit: int | None) -> int | None:
    """Return the turn limit that a caller gives under one of two names, or None.

    Raise BadParameter if both are given and differ.
    """
    if turns is not None and turn_limit is not None and turns != turn_limit:
        got = f"got {turns!r} and {turn_limit!r}"
        raise BadParameter(f"turns and turn_limit: {got}, expected one of them")
    return turn_limit if turns is None else turns


def validate_outcome(problem: "Problem", outcome: "Outcome") -> None:
    """Raise BadParameter for a reward or an observation that no record or table can hold.

    A reward `[B, n]` may not be NaN, infinite or too large to be summed, and an observation must be
    the index of one of its labels. The error names the line of user-defined code.
    """
    rewards = outcome.rewards
    if not is_within(rewards, -MAX_REWARD, MAX_REWARD):
        row, seat = (axis[0] for axis in (~(np.abs(rewards) <= MAX_REWARD)).nonzero())
        raise BadParameter(
            f"{_locate_resolve_events(problem)}: got the reward {rewards[row, seat]:g} "
            f"of {problem.agents[int(seat)]}, expected a number "
            f"from {-MAX_REWARD:g} to {MAX_REWARD:g}"
        )
    for seat, space in enumerate(problem.observations):
        if not isinstance(space, Labels):
            continue
        column = outcome.observations[:, seat]
        if not is_within(column, 0, len(space) - 1):
            wrong = column[(column < 0) | (column >= len(space))][0]
            raise BadParameter(
                f"{_locate_resolve_events(problem)}: got the observation {wrong} "
                f"of {problem.agents[seat]}, expected 0 to {len(space) - 1}"
            )


def _locate_resolve_events(problem: "Problem") -> str:
    """Return the line on which a problem defines `resolve_events`, or its class, and the name."""
    location = user_code_locations.locate_definition(type(problem), "resolve_events")
    return f"{location or type(problem).__name__} resolve_events"


MAX_REWARD = 1e290  # of one turn; the sum over any game is finite, too


@dataclass_transform(frozen_default=True)
@dataclass(frozen=True)
class Problem(ABC):
    """A decision problem with n agents and one Markov state.

    Arrays are batch-first and C-ordered. An attribute that never varies is a plain class attribute;
    one that depends on the parameters is a property. The dynamics are `chance` and
    `resolve_events`; everything else is derived from these two.
    """

    discount: float = parameter(1.0, "factor on the rewards of each later turn", 0.0, 1.0)

    def __init_subclass__(cls) -> None:
        """Use a class attribute with a parameter's name, as in `discount = 0.95`, as default."""
        super().__init_subclass__()
        if "__init__" in vars(cls):
            location = user_code_locations.locate_definition(cls, "__init__")
            raise BadParameter(f"{location} __init__: {INIT_REFUSED_MESSAGE}")
        bases = [_ensure_dataclass(base) for base in cls.__bases__ if issubclass(base, Problem)]
        inherited_types = {
            base_field.name: base_field.type for base in bases for base_field in fields(base)
        }
        annotations = inspect.get_annotations(cls)
        new_default_types = {
            name: inherited_types[name]
            for name in inherited_types
            if name in vars(cls) and name not in annotations
        }
        if new_default_types:
            cls.__annotations__ = new_default_types | annotations

    def __new__(cls, *args: object, **kwargs: object) -> Self:
        """Return an instance; a subclass without a decorator becomes a dataclass first."""
        _ensure_dataclass(cls)
        return super().__new__(cls)

    @property
    def agents(self) -> tuple[str, ...]:
        """The names of the agents, in seat order."""
        return ("agent",)

    @property
    @abstractmethod
    def actions(self) -> tuple[Labels | Interval, ...]:
        """The action set of each agent."""

    @cached_property
    def action_counts(self) -> tuple[int, ...]:
        """The number of actions of each agent; 0 if its actions are real numbers."""
        return tuple(len(action_set.labels) for action_set in self.actions)

    @property
    def observations(self) -> tuple[ObservationSpace, ...]:
        """The observation space of each agent, all of one type; () if agents see the state."""
        return ()

    @cached_property
    def observation_counts(self) -> tuple[int, ...]:
        """The number of possible observations of each agent; BadParameter if they lack labels."""
        labels = [space for space in self.observations if isinstance(space, Labels)]
        if len(labels) < len(self.observations):
            name = type(self).__name__
            raise BadParameter(f"{name} has observations without labels, which cannot be listed")
        return tuple(map(len, labels))

    @cached_property
    def partially_observable(self) -> bool:
        """True if agents see less than the state."""
        return bool(self.observations)

    @property
    def state_count(self) -> int | float | ContinuousStates:
        """The number of states, `math.inf`, or a part of R^dimensions; 1 for simple games."""
        return 1

    @property
    def horizon(self) -> int | None:
        """The number of turns of a game, or None; the dynamics have no horizon."""
        return None

    @property
    def is_finite_horizon(self) -> bool:
        """True if the end after `horizon` turns is a rule; by default it is only a usual length."""
        return False

    @property
    def afterstates(self) -> AfterstateModel | None:
        """The features of the states after an action, before chance acts; None if unknown."""
        return None

    @property
    def can_run_forever(self) -> bool:
        """True if a game may never end, so that games of agents alone need a turn limit."""
        return True

    @property
    def shared_reward(self) -> bool:
        """True if all agents always receive the same reward."""
        return False

    @property
    def reward_bounds(self) -> tuple[float, float] | None:
        """The smallest and the largest reward of a turn, or None if unknown."""
        return None

    @cached_property
    def reward_scale(self) -> float:
        """The power of 2 to which tolerances of values are relative, from the size of rewards."""
        bounds = self.reward_bounds
        rewards = _rewards_of_first_states(self) if bounds is None else np.array(bounds)
        return compute_reward_scale(rewards)

    @property
    def return_bounds(self) -> tuple[float, float] | None:
        """The smallest and the largest return of a game, if the rewards' bounds are too wide."""
        return None

    @property
    def state_bounds(self) -> tuple[Array, Array] | None:
        """The smallest and the largest value of each number of a state, or None if unknown."""
        return None

    @property
    def state_grid(self) -> StateGrid | None:
        """The grid on which the values of states of real numbers are computed and drawn, if any."""
        return None

    @property
    def rewards_observable(self) -> bool:
        """True if a seat may see its reward each turn; by default only if states are not hidden."""
        return not self.partially_observable

    @property
    def illegal_reason(self) -> str:
        """The verb phrase that tells a player why a known action cannot be played now."""
        return "is not legal now"

    @property
    def action_aliases(self) -> Mapping[str, str]:
        """Other names of actions: alias -> label."""
        return {}

    def __post_init__(self) -> None:
        """Raise BadParameter if a parameter has a wrong type or is out of bounds."""
        check_parameters(self)

    @abstractmethod
    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return the independent chances that are sampled before each of `rows` games."""

    @abstractmethod
    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """Return initial states `[rows, ...]`, given an event `[rows]` of each initial chance."""

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Return the independent chances of a turn in states `[B, ...]`; () unless overridden."""
        return ()

    @abstractmethod
    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Return the outcome of joint actions `a` `[B, n]`, given an event `[B]` of each chance."""

    @abstractmethod
    def format_state(self, s: Array) -> str:
        """Return one state, without the batch axis, as a line of text that loses nothing."""

    @abstractmethod
    def parse_state(self, text: str) -> Array:
        """Return the state that `format_state` wrote."""

    def describe_state(self, s: Array) -> str:
        """Return one state as text for readers; real numbers have three significant digits."""
        if isinstance(self.state_count, ContinuousStates):
            return " ".join(f"{number:.3g}" for number in s)
        return self.format_state(s)

    def terminal(self, s: Array) -> Bools:
        """Return a mask `[B]` of the terminal states, which absorb and have reward 0."""
        return np.zeros(len(s), bool)

    def legal_actions_mask(self, s: Array) -> Bools | None:
        """Return the mask `[B, n, A]` of the legal actions; None if all are legal."""
        return None

    def action_labels(self, s: Array) -> tuple[Labels, ...] | None:
        """Return the action labels of each agent in one state, or None if they do not depend on it.

        Their number is that of `actions`, whose labels mean the same in every state; transcripts
        record the labels of `actions`. A seat reads its labels, so they must not reveal a hidden
        state.
        """
        return None

    def format_transcript_state(self, s: Array) -> str:
        """Return the state as transcripts record it: `format_state`, if it does not grow."""
        return self.format_state(s)

    def description(self) -> str:
        """Return the description of the problem: the docstring of its class."""
        return inspect.getdoc(type(self)) or ""

    def enumerate_states(self) -> Array:
        """Return all states `[S, ...]` in index order; raise BadParameter without a finite list."""
        if not isinstance(self.state_count, int):
            raise BadParameter(f"{type(self).__name__} has no finite list of states")
        check_listing_size(self, self.state_count)
        return np.arange(self.state_count)

    def state_indices(self, s: Array) -> Ints:
        """Return the index `[B]` of each state in `enumerate_states`."""
        return s

    def state_parts(self, seat: int) -> StateParts | None:
        """Return the parts of a state whose beliefs a seat is shown; None for the whole state."""
        return None

    def joint_belief_update(
        self, belief: Reals, actions: Sequence[int | None], observations: Sequence[int | None]
    ) -> Reals:
        """Return the joint probability `[S]` of these observations and each next state.

        The current state has the distribution `belief` `[S]`. None means unknown: an unknown action
        is taken to be uniformly random, an unknown observation is ignored.
        """
        support = np.flatnonzero(belief)
        pairs = zip(actions, self.action_counts, strict=True)
        options = [range(action_count) if a is None else (a,) for a, action_count in pairs]
        joint_actions = np.array(list(product(*options)))
        s = np.repeat(self.enumerate_states()[support], len(joint_actions), axis=0)
        p, outcome = enumerate_outcomes(self, s, np.tile(joint_actions, (len(support), 1)))
        weight = p * np.repeat(belief[support] / len(joint_actions), len(joint_actions))[:, None]
        for seat, observation in enumerate(observations):
            if observation is not None:
                weight = weight * (outcome.observations[:, :, seat] == observation)
        next_states = next_state_indices(self, outcome).reshape(-1)
        return np.bincount(next_states, weight.reshape(-1), minlength=len(belief)).astype(float)

    @cached_property
    def uniform_counts(self) -> UniformCounts:
        """The number of uniforms that one row consumes at the start, and in each turn."""
        initial_chances = self.initial_chance(1)
        start_count = sum(chance.uniform_count for chance in initial_chances)
        s = self.initial_states(
            1, sample_chance_events(initial_chances, np.zeros((1, start_count)))
        )
        a = np.array([[action_set.candidate_actions()[0] for action_set in self.actions]])
        return UniformCounts(start_count, sum(chance.uniform_count for chance in self.chance(s, a)))

    def sample_initial_states(self, u: Reals) -> Array:
        """Return initial states `[B, ...]` from uniforms `[B, uniform_counts.start]`."""
        return self.initial_states(len(u), sample_chance_events(self.initial_chance(len(u)), u))

    def step(self, s: Array, a: Array, u: Reals) -> Outcome:
        """Return the outcome of one turn of B rows.

        The states are `s`, the joint actions `a` `[B, n]`, the uniforms `u` `[B,
        uniform_counts.step]`.
        """
        return self.resolve_events(s, a, sample_chance_events(self.chance(s, a), u))

    def initial_observations(self, s: Array) -> Array:
        """Return the observations `[B, n, ...]` of hidden initial states; null by default."""
        return np.stack([space.null_observation(len(s)) for space in self.observations], axis=1)

    @property
    def kind(self) -> str:
        """The class of problem, such as MDP, POMDP or Markov game, derived from its attributes."""
        if self.state_count == 1:
            return "simple game"
        if len(self.agents) == 1:
            return "POMDP" if self.partially_observable else "MDP"
        if not self.partially_observable:
            return "Markov game"
        return "Dec-POMDP" if self.shared_reward else "POMG"

    def parse_action(self, seat: int, text: str) -> float:
        """Return the action that a typed text names: an index, or a number of the interval."""
        return self.actions[seat].parse_action(self.action_aliases.get(normalize_label(text), text))

    def format_action(self, seat: int, action: float) -> str:
        """Return the label of an action, or its number as text."""
        return self.actions[seat].format_action(action)


def mark_inactive_agents(problem: Problem, s: Array) -> Bools:
    """Return a mask `[B, n]` of the inactive agents, whose only legal action is to wait."""
    inactive = np.zeros((len(s), len(problem.agents)), bool)
    legal = problem.legal_actions_mask(s) if len(problem.agents) > 1 else None
    if legal is None:
        return inactive
    for seat, action_set in enumerate(problem.actions):
        if WAIT_LABEL in action_set.labels:
            can_wait = legal[:, seat, action_set.labels.index(WAIT_LABEL)]
            inactive[:, seat] = can_wait & (legal[:, seat].sum(axis=1) == 1)
    return inactive


def find_wait_action(problem: Problem, seat: int) -> int:
    """Return the index of the wait action of a seat."""
    return problem.actions[seat].labels.index(WAIT_LABEL)


def make_initial_observation(problem: Problem, s: Array, seat: int) -> Array:
    """Return a seat's initial observations `[B, ...]`: the states if it sees them."""
    if problem.partially_observable:
        return readonly_copy(select_seat_observations(problem.initial_observations(s), seat))
    return readonly_copy(s)


def build_percept(
    problem: Problem,
    seat: int,
    actions: Array,
    outcome: Outcome,
    field_names: Collection[str] = Percept._fields,
) -> Percept:
    """Return the information that a turn with joint actions `[B, n]` gives a seat, as copies.

    Only the fields in `field_names` are copied; the others are empty.
    """

    def copy_if_required(name: str, array: Array) -> Array:
        """Return a copy of an array if its field is required, else FIELD_OMITTED."""
        return readonly_copy(array) if name in field_names else FIELD_OMITTED

    observation, joint_actions, reward = outcome.observations, None, None
    if problem.partially_observable:
        observation = select_seat_observations(outcome.observations, seat)
    else:
        joint_actions = copy_if_required("actions", actions)
    if problem.rewards_observable:
        reward = copy_if_required("reward", outcome.rewards[:, seat])
    action = copy_if_required("action", actions[:, seat])
    return Percept(action, copy_if_required("observation", observation), joint_actions, reward)


def find_seat(problem: Problem, seat: str | int) -> int:
    """Return the index of a seat, from the name of its agent or from the index itself.

    Raise UnknownName if no agent has this name, and BadParameter for another index.
    """
    if isinstance(seat, str):
        if seat not in problem.agents:
            raise UnknownName("seat", seat, problem.agents)
        return int(problem.agents.index(seat))
    if not isinstance(seat, INTEGER_TYPES) or seat not in range(len(problem.agents)):
        raise BadParameter(f"seat: got {seat!r}, expected 0 to {len(problem.agents) - 1}")
    return int(seat)


def _ensure_dataclass(problem_class: type[Problem]) -> type[Problem]:
    """Return a subclass as a frozen dataclass, applying the decorator if it is missing."""
    if "__dataclass_fields__" in vars(problem_class):
        return problem_class
    return dataclass(frozen=True)(problem_class)


class OutcomeDistribution(NamedTuple):
    """Every outcome of a turn with its probability, for B rows and K joint events."""

    probabilities: Reals  # [B, K]
    outcomes: Outcome  # arrays [B, K, ...]


def enumerate_outcomes(problem: Problem, s: Array, a: Array) -> OutcomeDistribution:
    """Return every outcome of joint actions in these states, with its probability.

    The states `s` are `[B, ...]`, the joint actions `a` `[B, n]`, given as indices. The
    probabilities are `[B, K]`, the arrays of the outcomes `[B, K, ...]`. Raise IllegalAction for an
    index without an action, BadParameter if chance samples real numbers, BudgetExceeded if there
    are too many outcomes to list. The states, and the legality of the actions in them, are not
    checked.
    """
    check_problem(problem, None)
    for agent, action_set, seat_actions in zip(problem.agents, problem.actions, a.T, strict=True):
        if action_set.labels and len(a):
            for action in (seat_actions.min(), seat_actions.max()):
                action_set.validate_action(action.item(), agent)
    chances = _require_finite_chances(problem, problem.chance(s, a))
    probabilities, events = _enumerate_joint_events(chances, len(s))
    count = probabilities.shape[1]
    states, actions = np.repeat(s, count, axis=0), np.repeat(a, count, axis=0)
    outcome = problem.resolve_events(states, actions, events)
    validate_outcome(problem, outcome)
    arrays = [array.reshape(len(s), count, *array.shape[1:]) for array in outcome]
    return OutcomeDistribution(probabilities, Outcome(*arrays))


def enumerate_possible_outcomes(
    problem: Problem, s: Array, a: Array
) -> tuple[Ints, Reals, Outcome]:
    """Return the N outcomes of positive probability: their rows, probabilities and outcomes."""
    chances = _require_finite_chances(problem, problem.chance(s, a))
    probabilities, events = _enumerate_joint_events(chances, len(s))
    row, _ = nonzero = np.nonzero(probabilities)
    possible_events = tuple(event.reshape(probabilities.shape)[nonzero] for event in events)
    outcome = problem.resolve_events(s[row], a[row], possible_events)
    validate_outcome(problem, outcome)
    return row, probabilities[nonzero], outcome


def _rewards_of_first_states(problem: Problem) -> Reals:
    """Return the rewards `[N]` of the first states of a finite problem; 1 if none are listed.

    In each state, every legal action of every agent occurs in one of the joint actions.
    """
    if not isinstance(problem.state_count, int) or not all(problem.action_counts):
        return np.ones(1)
    try:
        states = problem.enumerate_states()[:MAX_SCALE_STATES]
        legal = problem.legal_actions_mask(states)
        first = np.zeros((len(states), 1), int) if legal is None else legal.argmax(axis=2)
        rewards = [np.zeros(0)]
        for action in range(max(problem.action_counts)):
            choices = np.minimum(action, np.array(problem.action_counts) - 1)
            is_legal = True if legal is None else legal[:, range(len(choices)), choices]
            a = np.where(is_legal, choices, first)
            rewards.append(enumerate_possible_outcomes(problem, states, a)[2].rewards.ravel())
    except (BadParameter, BudgetExceeded):
        return np.ones(1)
    return np.concatenate(rewards)


def check_listing_size(problem: Problem, number_count: float) -> None:
    """Raise BudgetExceeded if a list of this many numbers over the states would be too large."""
    task = f"listing the states of {type(problem).__name__}"
    budget = Budget(task, "try a smaller problem", memory_limit=MAX_LISTING_BYTES)
    budget.check_memory(24.0 * number_count)


def next_state_indices(problem: Problem, outcome: Outcome) -> Ints:
    """Return the indices `[B, K]` of the next states that `enumerate_outcomes` lists."""
    row_count, event_count, *state_shape = outcome.state.shape
    states = outcome.state.reshape(row_count * event_count, *state_shape)
    return checked_state_indices(problem, states).reshape(row_count, event_count)


def checked_state_indices(problem: Problem, s: Array) -> Ints:
    """Return the index `[B]` of each state; raise BadParameter for an invalid state."""
    indices, count = problem.state_indices(s), problem.state_count
    if isinstance(count, int) and len(s) and not 0 <= indices.min() <= indices.max() < count:
        got = f"got state indices {indices.min()} to {indices.max()}"
        raise BadParameter(f"{got}, expected 0 to {count - 1}, to match state_count")
    return indices


def initial_state_distribution(problem: Problem) -> tuple[Reals, Array]:
    """Return the probabilities `[K]` and the initial states `[K, ...]`; a state may occur twice."""
    chances = _require_finite_chances(problem, problem.initial_chance(1))
    probabilities, events = _enumerate_joint_events(chances, 1)
    return probabilities[0], problem.initial_states(probabilities.shape[1], events)


def _require_finite_chances(
    problem: Problem, chances: tuple[Chance, ...]
) -> tuple[FiniteChance, ...]:
    """Return the chances; raise BadParameter if one of them samples real numbers."""
    finite = tuple(chance for chance in chances if isinstance(chance, FiniteChance))
    if len(finite) < len(chances):
        name = type(problem).__name__
        raise BadParameter(f"{name} draws real numbers, so its outcomes cannot be listed")
    return finite


def _enumerate_joint_events(
    chances: tuple[FiniteChance, ...], rows: int
) -> tuple[Reals, tuple[Array, ...]]:
    """Return the probabilities `[B, K]` of all joint events, and the events, each `[B * K]`."""
    distributions = [
        np.broadcast_to(p, (rows, p.shape[1])) for p in (c.probabilities() for c in chances)
    ]
    counts = [p.shape[1] for p in distributions]
    joint_count = math.prod(counts)
    task = f"listing {rows * joint_count} outcomes"
    budget = Budget(task, "try a smaller problem", memory_limit=MAX_LISTING_BYTES)
    budget.check_memory(8.0 * rows * joint_count * (4 + 3 * len(counts)))
    event_grid = np.indices(counts).reshape(len(counts), joint_count)
    probabilities = np.ones((rows, joint_count))
    events = []
    for indices, p in zip(event_grid, distributions, strict=True):
        probabilities = probabilities * p[:, indices]
        # An impossible event is replaced by the first one; its weight is 0 in any case.
        events.append(np.where(p[:, indices] > 0, indices, 0).reshape(-1))
    return probabilities, tuple(events)

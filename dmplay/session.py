"""One game as a state machine, without input or output: what was done, drawn, seen and paid."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from operator import add
from typing import Generic, NamedTuple, Protocol, TypeVar

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import (
    ContinuousStates,
    Labels,
    Memory,
    Outcome,
    Percept,
    Policy,
    Problem,
    call_policy,
    check_policy,
    check_problem,
    intern_array,
    make_readonly,
    readonly_copy,
)
from dmplay.describe import describe_end_reason, format_count
from dmplay.dice import NATURE_STREAM
from dmplay.displayed import NotebookDisplay
from dmplay.errors import BadPolicy, EpisodeOver, IllegalAction
from dmplay.knowledge import BeliefHistory, ChunkedList, HistorySnapshot, SeatHistory
from dmplay.rules import StateInfo, make_dynamics
from dmplay.tabular import Tabular

DEFAULT_TURN_LIMIT = 10_000  # where nothing else ends a game
MAX_FAST_BELIEF_STATES = 4096  # states that a view shows a belief over, where it is quick to have
MAX_TABULAR_BELIEF_STATES = 2**16  # of them where what can happen is listed
MAX_LISTED_STATES = 64  # states; a longer belief, written as a list, is no use to a reader

P_co = TypeVar("P_co", bound=Problem, covariant=True)


class EpisodeUniforms(Protocol):
    """Where the draws of a game come from: `dice.Dice`, or a script in a test."""

    def generate_uniforms(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        """Uniforms `[1, count]`."""


class Turn(NamedTuple):
    """One finished turn, without the batch axis."""

    actions: Array  # [n]
    uniforms: Reals  # [d]
    state: Array  # [...]
    observations: Array  # [n], or the state
    rewards: Reals  # [n]


@dataclass(frozen=True)
class View(Generic[P_co]):
    """All that a seat may know, and nothing else."""

    problem: P_co
    seat: int
    observations: Sequence[Array]  # one more than turns; the first is -1 where states are hidden
    actions: Sequence[float]  # its own
    joint_actions: Sequence[Array] | None  # everybody's `[n]`, where every agent sees the state
    rewards: Sequence[float] | None  # its own, where observable or once the game is over
    legal_actions_mask: Bools | None  # [A]; None for all
    beliefs: Sequence[Reals] | None  # [S] each, where states are hidden and few enough
    end_reason: str | None
    turn_limit: int | None
    state_action_labels: Labels | None = (
        None  # what its actions are called now, where that depends on the state
    )
    past_action_labels: Sequence[str] = ()  # and what its own were called, then
    player_label: str = (
        "you"  # who has it, as told to who looks on: by name where agents alone play
    )

    @property
    def turns_played(self) -> int:
        """How many turns were played."""
        return len(self.actions)

    @property
    def observation(self) -> Array:
        """The latest observation, or the state where every agent sees it."""
        return self.observations[-1]

    @property
    def last_action_label(self) -> str:
        """The name of its latest action; nothing before the first."""
        if self.past_action_labels:
            return self.past_action_labels[-1]
        return self.problem.format_action(self.seat, self.actions[-1]) if self.actions else ""

    @property
    def action_labels(self) -> Labels:
        """What its actions are called now; none of reals."""
        return (
            self.problem.actions[self.seat].labels
            if self.state_action_labels is None
            else self.state_action_labels
        )

    @property
    def belief(self) -> Reals:
        """The latest of its beliefs, for those who know that it has them."""
        assert self.beliefs is not None
        return self.beliefs[-1]


def belief_size(problem: Problem) -> float:
    """How many hidden states a belief is over; infinity where there is no belief."""
    if not problem.partially_observable or isinstance(problem.state_count, ContinuousStates):
        return math.inf
    labelled = all(isinstance(known, Labels) for known in problem.observations)
    return problem.state_count if labelled else math.inf


class _CurrentFacts(NamedTuple):
    """What was asked after the last turn: front ends ask often."""

    last_turn: Turn | Array  # or the first state
    state_info: StateInfo
    natural_end_reason: str | None  # that the game has come to by itself


class Session(NotebookDisplay):
    """One game; a seat without a policy is played from outside, through `advance`.

    It has `limit` turns at most, by default the problem's horizon. Raises BadPolicy where there is
    not a policy, or None, for each seat.
    """

    def __init__(
        self,
        problem: Problem,
        uniform_source: EpisodeUniforms,
        policies: Sequence[Policy | None] = (),
        *,
        turn_limit: int | None = None,
        initial_uniforms: Reals | None = None,
    ) -> None:
        check_problem(problem, turn_limit)
        self.problem = problem
        self.uniform_source = uniform_source
        self.turn_limit = problem.horizon if turn_limit is None else turn_limit
        count = problem.uniform_counts.start
        self.initial_uniforms = readonly_copy(
            uniform_source.generate_uniforms(NATURE_STREAM, 0, 0, count)[0]
            if initial_uniforms is None
            else initial_uniforms
        )
        self.initial_state = readonly_copy(
            problem.sample_initial_states(self.initial_uniforms[None])[0]
        )
        self.turns: list[Turn] = []
        self.reroll_counts: dict[int, int] = {}  # turn -> how often its dice were thrown anew
        self.hint_counts: Counter[str] = (
            Counter()
        )  # agent -> how often whoever plays it was given advice
        self._forced_end_reason: str | None = None
        self._dynamics = make_dynamics(problem, self.initial_state)
        self._cached_facts: _CurrentFacts | None = None
        self._running_sums: list[tuple[float, ...]] = []  # the next weight, returns [n], totals [n]
        self._histories: dict[int, SeatHistory] = {}  # by seat, for its views
        self.seated_policies = [
            None if policy is None else SeatedPolicy(self, seat, policy)
            for seat, policy in enumerate(policies or [None] * len(problem.agents))
        ]
        if len(self.seated_policies) != len(problem.agents):
            told = f"{len(self.seated_policies)} policies"
            raise BadPolicy(f"got {told}, expected one, or None, for each of {problem.agents}")

    def copy_at_start(self, policies: Sequence[Policy | None] = ()) -> "Session":
        """The same game before its first turn, its seats played by these policies, if any."""
        source, limit, opening = self.uniform_source, self.turn_limit, self.initial_uniforms
        return Session(self.problem, source, policies, turn_limit=limit, initial_uniforms=opening)

    @property
    def state(self) -> Array:
        """The present state, without the batch axis."""
        return self.turns[-1].state if self.turns else self.initial_state

    @property
    def end_reason(self) -> str | None:
        """Why the game is over: terminal, horizon, turn limit, or what `end` was told; or None."""
        return self._forced_end_reason or self._current_facts().natural_end_reason

    def _current_facts(self) -> _CurrentFacts:
        """What is known now, asked once a turn."""
        last = self.turns[-1] if self.turns else self.initial_state
        if self._cached_facts is None or self._cached_facts.last_turn is not last:
            place = self._dynamics.state_info(self.state)
            self._cached_facts = _CurrentFacts(last, place, self._natural_end_reason(place))
        return self._cached_facts

    def _natural_end_reason(self, state_info: StateInfo) -> str | None:
        """The end that the game has come to by itself."""
        if state_info.terminal:
            return "terminal"
        if self.turn_limit is not None and len(self.turns) >= self.turn_limit:
            return "horizon" if self.turn_limit == self.problem.horizon else "turn limit"
        return None

    @property
    def over(self) -> bool:
        """Whether no more turns can be played."""
        return self.end_reason is not None

    def end(self, reason: str) -> None:
        """Ends the game here, unless it is over already."""
        if not self.over:
            self._forced_end_reason = reason

    def legal_actions_mask(self, seat: int) -> Bools | None:
        """The actions `[A]` open to a seat; None for all."""
        legal = self._current_facts().state_info.legal_actions_mask
        return None if legal is None else readonly_copy(legal[seat])

    def action_labels(self, seat: int) -> Labels:
        """What the actions of a seat are called now; none of reals."""
        called = self.problem.action_labels(self.state)
        return called[seat] if called else self.problem.actions[seat].labels

    def format_action(self, seat: int, action: float) -> str:
        """What an action is called now, or its number."""
        labels = self.action_labels(seat)
        return labels[int(action)] if labels else self.problem.format_action(seat, action)

    def is_inactive(self, seat: int) -> bool:
        """Whether a seat is not asked now, as it is another's turn."""
        return bool(self._current_facts().state_info.inactive_agents[seat])

    def active_seats(self, seats: Sequence[int]) -> list[int]:
        """Those of some seats whose turn it is."""
        return [seat for seat in seats if not self.is_inactive(seat)]

    def is_waiting_for_others(self, seats: Sequence[int]) -> bool:
        """Whether some seats play, and it is the turn of others alone."""
        going = bool(seats) and not self.over and not self.active_seats(seats)
        return going and bool(self.active_seats(range(len(self.problem.agents))))

    def choose_policy_actions(self) -> list[float | None]:
        """What each policy does now; None for a seat played from outside, or not asked."""
        return [
            None if follower is None or self.is_inactive(seat) else follower.choose()
            for seat, follower in enumerate(self.seated_policies)
        ]

    def can_reproduce_turns(self, turns: Turn) -> bool:
        """Whether each policy acts in the next turns `[T, ...]` as was done, and tells so at once:
        all of them are asked together, and none is a waiting seat's.
        """
        asked = [follower for follower in self.seated_policies if follower]
        if not asked:
            return True
        s = np.concatenate([self.state[None], turns.state[:-1]])
        with suppress(Exception):  # of what is written for one row alone
            waiting = self.problem.inactive_agents(s).any()
            return not waiting and all(follower.can_reproduce_turns(s, turns) for follower in asked)
        return False

    def fill_in_actions(self, actions: Sequence[float | None] = ()) -> list[float | None]:
        """The given actions, and those that the policies choose now for the rest.

        Who only waits is not asked.
        """
        agents = self.problem.agents
        given = list(actions) or [None] * len(agents)
        if len(given) != len(agents):
            raise IllegalAction(f"got {len(given)} actions, expected one for each of {agents}")
        if None not in given:
            return given
        every = enumerate(zip(given, self.seated_policies, strict=True))
        return [
            action if action is not None else self._choose_for_seat(seat, follower)
            for seat, (action, follower) in every
        ]

    def _choose_for_seat(self, seat: int, seated_policy: "SeatedPolicy | None") -> float | None:
        if self.is_inactive(seat):
            return self.problem.wait_action(seat)
        return seated_policy.choose() if seated_policy else None

    def advance(self, actions: Sequence[float | None] = (), uniforms: Reals | None = None) -> Turn:
        """Plays one turn: the given actions, and those of the policies for the rest.

        Raises IllegalAction, and changes nothing, where the state does not allow an action.
        """
        if self.over:
            why = describe_end_reason(self.end_reason)
            raise EpisodeOver(f"turn {len(self.turns) + 1}: the game is over ({why})")
        decided = enumerate(self.fill_in_actions(actions))
        joint = np.array([self.validate_action(seat, action) for seat, action in decided])
        number = len(self.turns) + 1
        if uniforms is None:
            reroll = self.reroll_counts.get(number, 0)
            uniforms = self.uniform_source.generate_uniforms(
                NATURE_STREAM, number, reroll, self.problem.uniform_counts.step
            )[0]
        did, state, seen, rewards = self._dynamics.resolve_turn(self.state, joint, uniforms)
        turn = Turn(did, readonly_copy(uniforms), state, seen, rewards)
        self.turns.append(turn)
        return turn

    def next_turn_numbers(self, count: int) -> range:
        """The numbers of the next so many turns."""
        return range(len(self.turns) + 1, len(self.turns) + 1 + count)

    def append_turns(self, turns: Iterable[Turn]) -> None:
        """Plays turns as they were worked out before, from this state on."""
        self.turns.extend(turns)

    def validate_action(self, seat: int, action: float | None) -> float:
        """The action as it will act; raises IllegalAction where the state does not allow it."""
        problem = self.problem
        where = f"turn {len(self.turns) + 1}, {problem.agents[seat]}"
        if action is None:
            raise IllegalAction(f"{where}: no action given")
        known = self.action_labels(seat) or problem.actions[seat]
        return known.validate_action(action, where, self.legal_actions_mask(seat))

    def turns_to_undo(self, seats: Sequence[int], choices: int) -> int:
        """How many turns ago these seats, or of none everybody, made so many choices."""
        befores = [self.initial_state, *(turn.state for turn in self.turns[:-1])][: len(self.turns)]
        many = 0
        for turns, state in enumerate(reversed(befores), 1):
            many += not seats or not self.problem.inactive_agents(state[None])[0, seats].all()
            if many == choices:
                return turns
        if many < len(self.turns):
            raise IllegalAction(f"undo {choices}: you chose in {format_count(many, 'turn')}")
        return choices

    def undo(self, turns: int = 1) -> list[Turn]:
        """Takes back the last turns and returns them; the same action gives the same outcome."""
        if not 1 <= turns <= len(self.turns):
            played = f"{len(self.turns)} turn{'s were' if len(self.turns) != 1 else ' was'} played"
            raise IllegalAction(f"undo {turns}: {played}")
        self._forced_end_reason = None
        taken = self.turns[-turns:]
        del self.turns[-turns:]
        left = len(self.turns)  # a view stays what it was
        del self._running_sums[left + 1 :]
        self._histories = {
            seat: told.copy_until_turn(left) for seat, told in self._histories.items()
        }
        for follower in self.seated_policies:
            if follower:
                follower.forget_undone_turns()
        return taken

    def reroll(self, draws: Reals | None = None) -> Turn:
        """Plays the last turn again, the same actions under other dice."""
        actions = self.undo()[0].actions
        number = len(self.turns) + 1
        self.reroll_counts[number] = self.reroll_counts.get(number, 0) + 1
        return self.advance(list(actions), draws)

    def observation_after(self, seat: int, turn: int) -> Array:
        """What a seat saw after a turn; before the first, the state or -1."""
        if turn == 0:
            first: Array = self.problem.initial_observation(self.initial_state[None], seat)[0]
            return first
        return self._seat_observation(seat, self.turns[turn - 1])

    def _seat_observation(self, seat: int, turn: Turn) -> Array:
        seen: Array = (
            turn.observations[seat] if self.problem.partially_observable else turn.observations
        )
        return seen

    def build_percept(self, seat: int, turn: int) -> Percept:
        """What a turn (from 1) taught a seat, as a batch of one row."""
        actions, _, state, observations, rewards = self.turns[turn - 1]
        outcome = Outcome(state[None], rewards[None], observations[None])
        return self._dynamics.build_percept(seat, actions[None], outcome)

    @cached_property
    def has_visible_beliefs(self) -> bool:
        """Whether seats have a belief to show: hidden states, finite and few enough."""
        if isinstance(self.problem, Tabular):
            return belief_size(self.problem) <= MAX_TABULAR_BELIEF_STATES
        quick = type(self.problem).joint_belief_update is not Problem.joint_belief_update
        return belief_size(self.problem) <= (MAX_FAST_BELIEF_STATES if quick else MAX_LISTED_STATES)

    def current_beliefs(self) -> Reals:
        """What each seat believes now `[n, S]`."""
        seats = range(len(self.seated_policies))
        return np.array(
            [BeliefHistory(self.problem, seat, self._update_history(seat))[-1] for seat in seats]
        )

    def _update_history(self, seat: int, *, rewards_visible: bool = False) -> SeatHistory:
        """What a seat was told, up to the last turn; rewards only where they may be known."""
        if seat not in self._histories:
            self._histories[seat] = SeatHistory(*(ChunkedList() for _ in SeatHistory._fields))
            self._histories[seat].observations.append(intern_array(self.observation_after(seat, 0)))
        told = self._histories[seat]
        hidden = self.problem.partially_observable
        many = told.actions.length
        new = self.turns[many:]
        before = self.turns[many - 1].state if many else self.initial_state
        for turn, state in zip(new, [before, *(turn.state for turn in new)], strict=False):
            called = self.problem.action_labels(state)
            if called:
                told.action_labels.append(called[seat][int(turn.actions[seat])])
        told.observations.extend([intern_array(self._seat_observation(seat, turn)) for turn in new])
        told.actions.extend([float(turn.actions[seat]) for turn in new])
        if not hidden:
            told.joint_actions.extend([intern_array(turn.actions) for turn in new])
        if rewards_visible:
            unpaid = self.turns[told.rewards.length :]
            told.rewards.extend([float(turn.rewards[seat]) for turn in unpaid])
        return told

    def view(self, seat: int, *, rewards_visible: bool = False) -> View[Problem]:
        """What this seat may know; its rewards, though they are not observed, where it is paid."""
        ending = self.end_reason
        rewards_visible = rewards_visible or self.problem.rewards_observable or ending is not None
        problem, told = self.problem, self._update_history(seat, rewards_visible=rewards_visible)
        return View(
            problem=problem,
            seat=seat,
            observations=HistorySnapshot(told.observations),
            actions=HistorySnapshot(told.actions),
            joint_actions=None
            if problem.partially_observable
            else HistorySnapshot(told.joint_actions),
            rewards=HistorySnapshot(told.rewards) if rewards_visible else None,
            legal_actions_mask=self.legal_actions_mask(seat),
            beliefs=BeliefHistory(problem, seat, told) if self.has_visible_beliefs else None,
            end_reason=ending,
            turn_limit=self.turn_limit,
            state_action_labels=self.action_labels(seat)
            if problem.action_labels(self.state)
            else None,
            past_action_labels=HistorySnapshot(told.action_labels),
        )

    def returns(self) -> Reals:
        """The discounted sum of rewards of each agent `[n]`."""
        return np.array(self._current_sums()[1 : 1 + len(self.seated_policies)])

    def seat_return(self, seat: int) -> float:
        """The discounted sum of rewards of one agent."""
        return self._current_sums()[1 + seat]

    def total_rewards(self) -> Reals:
        """The plain sum of rewards of each agent `[n]`."""
        return np.array(self._current_sums()[1 + len(self.seated_policies) :])

    def _current_sums(self) -> tuple[float, ...]:
        """Both sums, each turn added once, in order."""
        if not self._running_sums:
            self._running_sums.append((1.0, *[0.0] * (2 * len(self.seated_policies))))
        if len(self._running_sums) > len(self.turns):
            return self._running_sums[-1]
        for turn in self.turns[len(self._running_sums) - 1 :]:
            weight, *sums = self._running_sums[-1]
            rewards: list[float] = turn.rewards.tolist()
            added = [weight * reward for reward in rewards] + rewards
            self._running_sums.append((weight * self.problem.discount, *map(add, sums, added)))
        return self._running_sums[-1]


class SeatedPolicy:
    """A policy that follows one seat of a session: to play it, or only to advise."""

    def __init__(self, session: Session, seat: int, policy: Policy) -> None:
        check_policy(policy, seat)
        self.session, self.seat, self.policy = session, seat, policy
        self._memories: list[Memory] = []

    def __str__(self) -> str:
        """The turn and the seat that it is to choose for."""
        return f"turn {len(self.session.turns) + 1}, {self.session.problem.agents[self.seat]}"

    def forget_undone_turns(self) -> None:
        """Drops what turns taken back had taught."""
        del self._memories[len(self.session.turns) + 1 :]

    def current_memory(self) -> Memory:
        """The policy's memory now, after every turn played."""
        self.forget_undone_turns()
        if not self._memories:
            seen = readonly_copy(np.asarray(self.session.observation_after(self.seat, 0))[None])
            self._memories.append(call_memory_method(self, self.policy.initial_memory, 1, seen))
        for turn in range(len(self._memories), len(self.session.turns) + 1):
            percept = self.session.build_percept(self.seat, turn)
            known = self._memories[-1]
            self._memories.append(
                call_memory_method(self, self.policy.update_memory, 1, known, percept)
            )
        return self._memories[-1]

    def choose(self) -> float:
        """The action the policy takes now."""
        session = self.session
        turn = len(session.turns) + 1
        # A reroll is nature's alone: the seats act again as they did.
        u = session.uniform_source.generate_uniforms(
            1 + self.seat, turn, 0, self.policy.uniform_count
        )
        legal = session.legal_actions_mask(self.seat)
        able = None if legal is None else readonly_copy(legal[None])
        chosen = call_policy(self, self.policy.choose, self.current_memory(), able, u)
        return float(validate_choices(self.policy, chosen, 1, self)[0])

    def can_reproduce_turns(self, s: Array, turns: Turn) -> bool:
        """Whether the policy acts in the next turns `[T, ...]`, from these states, as was done.

        What it remembers after each is found as if it had to forget all the others, and then
        from that found for the turn before: where both are the same, it is what it remembers. Else
        it is told of one turn after the other, and only asked at once.
        """
        problem, seat, many = self.session.problem, self.seat, len(s)
        outcome = Outcome(turns.state, turns.rewards, turns.observations)
        percept = problem.build_percept(seat, turns.actions, outcome)
        first = tuple(make_readonly(part.repeat(many, axis=0)) for part in self.current_memory())
        after = self.policy.update_memory(first, percept)
        pairs = zip(first, after, strict=True)
        before = tuple(make_readonly(np.concatenate([now[:1], then[:-1]])) for now, then in pairs)
        if not all(map(np.array_equal, after, self.policy.update_memory(before, percept))):
            before, after = self._memories_in_sequence(percept, many)
        draw, numbers = (
            self.session.uniform_source.generate_uniforms,
            self.session.next_turn_numbers(many),
        )
        us = [draw(1 + seat, turn, 0, self.policy.uniform_count) for turn in numbers]
        legal = problem.legal_actions_mask(s)
        able = None if legal is None else readonly_copy(legal[:, seat])
        chosen = self.policy.choose(before, able, np.concatenate(us))
        rows = zip(*(part[:, None] for part in after), strict=True)
        self._memories += rows if after else [()] * many
        return np.array_equal(chosen, turns.actions[:, seat])

    def _memories_in_sequence(self, percept: Percept, count: int) -> tuple[Memory, Memory]:
        """What it remembers before and after each of so many turns."""
        kept = [self.current_memory()]
        for turn in range(count):
            told = (None if part is None else part[turn : turn + 1] for part in percept)
            kept.append(self.policy.update_memory(kept[-1], Percept._make(told)))
        each = [make_readonly(np.concatenate(parts)) for parts in zip(*kept, strict=True)]
        return tuple(part[:-1] for part in each), tuple(part[1:] for part in each)

    def action_values(self) -> Reals | None:
        """The value of each action `[A]` now, where the policy knows it."""
        values = call_policy(self, self.policy.action_values, self.current_memory())
        return None if values is None else values[0]


def validate_choices(policy: Policy, choice: object, rows: int, error_prefix: object) -> Array:
    """What a policy chose, an action for each row; raises BadPolicy for anything else."""
    answer = np.asarray(choice)
    if answer.shape != (rows,) or answer.dtype.kind not in "biuf":
        wanted = "one action" if rows == 1 else f"{rows} actions"
        given = " ".join(repr(choice).split())
        told = f"{type(policy).__name__} chose {given}, expected an array of {wanted}"
        raise BadPolicy(f"{error_prefix}: {told}")
    return answer


def call_memory_method(
    error_prefix: object, method: Callable[..., object], rows: int, *args: object
) -> Memory:
    """The memory that a policy's method answers, arrays with a row for each game.

    Raises BadPolicy for anything else.
    """
    memory = call_policy(error_prefix, method, *args)
    if not isinstance(memory, tuple | list):
        got = repr(memory)
    elif all([isinstance(one, np.ndarray) and one.shape[:1] == (rows,) for one in memory]):
        return tuple(memory)
    else:
        got = f"({', '.join([str(np.asarray(one).shape) for one in memory])})"
    told = f"{method.__qualname__} gave {got}, expected a tuple of arrays of {format_count(rows, 'row')}"
    raise BadPolicy(f"{error_prefix}: {told}")

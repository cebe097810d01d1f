"""One game as a state machine without I/O: actions, uniforms, states and rewards."""

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from operator import add
from typing import Generic, NamedTuple, Protocol, TypeVar

import numpy as np

from dmplay.core import belief
from dmplay.core.arrays import (
    Array,
    Bools,
    Reals,
    make_readonly,
    readonly_copy,
    select_seat_observations,
)
from dmplay.core.notebook_display import NotebookDisplay
from dmplay.core.policy import (
    Memory,
    Percept,
    Policy,
    check_policy,
    describe_policies,
    forbid_writes,
    is_policy_sequence,
)
from dmplay.core.problem import (
    ContinuousStates,
    Outcome,
    Problem,
    build_percept,
    check_problem,
    choose_turn_limit,
    find_wait_action,
    make_initial_observation,
    mark_inactive_agents,
    validate_outcome,
)
from dmplay.core.seat_history import BeliefHistory, HistorySnapshot, SeatHistory
from dmplay.core.spaces import Labels
from dmplay.core.tabular import Tabular
from dmplay.core.text import describe_end_reason, format_count
from dmplay.core.uniforms import NATURE_STREAM, SeededUniforms, generate_uniforms_of_turns
from dmplay.errors import BadParameter, BadPolicy, EpisodeOver, IllegalAction

DEFAULT_TURN_LIMIT = 10_000  # turn limit if nothing else ends a game
MAX_FAST_BELIEF_STATES = 4096  # maximum states of a displayed belief if its update is fast
MAX_TABULAR_BELIEF_STATES = 2**16  # maximum states of a displayed belief if the problem is Tabular
MAX_LISTED_STATES = 64  # maximum states of any other belief; a longer list is of no use to a reader

NO_STATED_BELIEFS: Mapping[int, Reals] = {}

P_co = TypeVar("P_co", bound=Problem, covariant=True)


class EpisodeUniforms(Protocol):
    """The source of a game's uniforms: `SeededUniforms`, or a script in a test."""

    def generate_uniforms(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        """Return the uniforms `[1, count]` of a stream in one turn."""


class Turn(NamedTuple):
    """One finished turn, without the batch axis."""

    actions: Array  # [n]
    uniforms: Reals  # [d]
    state: Array  # [...]
    observations: Array  # [n], or the state
    rewards: Reals  # [n]
    # seat -> the belief `[S]` that its player stated when it chose its action, if it stated one
    stated_beliefs: Mapping[int, Reals] = NO_STATED_BELIEFS


@dataclass(frozen=True)
class View(Generic[P_co]):
    """The information that one seat may have about the game, and nothing else."""

    problem: P_co
    seat: int
    observations: Sequence[Array]  # one more than turns; the first is -1 if the state is hidden
    actions: Sequence[float]  # the seat's own
    joint_actions: Sequence[Array] | None  # of all agents `[n]`, if the state is fully observable
    rewards: Sequence[float] | None  # the seat's own, if observable or once the game is over
    legal_actions_mask: Bools | None  # [A]; None for all
    # [S] each, if the state is hidden and there are few enough states
    beliefs: Sequence[Reals] | None
    end_reason: str | None
    turn_limit: int | None
    # the current action labels, if they depend on the state
    state_action_labels: Labels | None = None
    # the labels of the seat's past actions, if they depend on the state
    past_action_labels: Sequence[str] = ()
    # the player's name for onlookers: "you", or the agent's name if no person plays
    player_label: str = "you"
    # the player of the other seat whose rule the beliefs take into account; "" if they assume that
    # all other agents act at random
    known_partner: str = ""

    @property
    def turns_played(self) -> int:
        """The number of turns played."""
        return len(self.actions)

    @property
    def observation(self) -> Array:
        """The latest observation, or the state if every agent sees it."""
        return self.observations[-1]

    @property
    def last_action_label(self) -> str:
        """The label of the seat's latest action; "" before the first."""
        if self.past_action_labels:
            return self.past_action_labels[-1]
        return self.problem.format_action(self.seat, self.actions[-1]) if self.actions else ""

    @property
    def action_labels(self) -> Labels:
        """The current labels of the seat's actions; empty if actions are real numbers."""
        if self.state_action_labels is None:
            return self.problem.actions[self.seat].labels
        return self.state_action_labels

    @property
    def belief(self) -> Reals:
        """The latest belief `[S]`; the caller must know that the seat has beliefs."""
        assert self.beliefs is not None
        return self.beliefs[-1]


def belief_size(problem: Problem) -> float:
    """Return the number of hidden states that a belief covers; infinity if there is no belief."""
    if not problem.partially_observable or isinstance(problem.state_count, ContinuousStates):
        return math.inf
    labelled = all(isinstance(space, Labels) for space in problem.observations)
    return problem.state_count if labelled else math.inf


def has_visible_beliefs(problem: Problem) -> bool:
    """Return whether views show beliefs: the states are hidden, finite and few enough."""
    if isinstance(problem, Tabular):
        return belief_size(problem) <= MAX_TABULAR_BELIEF_STATES
    has_fast_update = type(problem).joint_belief_update is not Problem.joint_belief_update
    return belief_size(problem) <= (
        MAX_FAST_BELIEF_STATES if has_fast_update else MAX_LISTED_STATES
    )


def list_action_labels(problem: Problem, seat: int, state: Array) -> Labels:
    """Return the labels of a seat's actions in a state; empty if actions are real numbers."""
    state_labels = problem.action_labels(state)
    return state_labels[seat] if state_labels else problem.actions[seat].labels


def make_view(  # noqa: PLR0913 - a view has these parts
    problem: Problem,
    seat: int,
    history: SeatHistory,
    legal_actions_mask: Bools | None,
    *,
    turns: int | None = None,
    turn_limit: int | None,
    rewards_visible: bool,
    shows_belief: bool,
    end_reason: str | None = None,
    current_labels: Labels | None = None,
    player_label: str = View.player_label,
) -> View[Problem]:
    """Return the view of a seat from its history, up to a turn or with all turns.

    `current_labels` are the current labels of its actions, if they may depend on the state.
    """
    count = len(history.actions) if turns is None else turns
    joint_actions = None
    if not problem.partially_observable:
        joint_actions = HistorySnapshot(history.joint_actions, count)
    has_labels = bool(history.action_labels)
    # Labels are passed only if this seat's differ, not if those of another seat do.
    has_state_labels = current_labels not in (None, problem.actions[seat].labels)
    return View(
        problem=problem,
        seat=seat,
        observations=HistorySnapshot(history.observations, count + 1),
        actions=HistorySnapshot(history.actions, count),
        joint_actions=joint_actions,
        rewards=HistorySnapshot(history.rewards, count) if rewards_visible else None,
        legal_actions_mask=legal_actions_mask,
        beliefs=BeliefHistory(problem, seat, history, count + 1) if shows_belief else None,
        end_reason=end_reason,
        turn_limit=turn_limit,
        state_action_labels=current_labels if has_state_labels else None,
        past_action_labels=HistorySnapshot(history.action_labels, count * has_labels),
        player_label=player_label,
    )


class _CurrentFacts(NamedTuple):
    """The facts about the current state, cached because front ends read them often."""

    last_turn: Turn | Array  # or the initial state
    legal_actions_mask: Bools | None  # [n, A]; None for all
    inactive_agents: Bools  # [n], agents that only wait
    natural_end_reason: str | None  # the natural end of the game, if reached


class Session(NotebookDisplay):
    """One game; a seat without a policy is played from outside, through `advance`.

    It has at most `turns` turns (or `turn_limit`, the same), by default the problem's horizon.
    Raise BadPolicy unless there is a policy, or None, for each seat.
    """

    def __init__(  # noqa: PLR0913 - the turn limit has two names
        self,
        problem: Problem,
        uniform_source: EpisodeUniforms,
        policies: Sequence[Policy | None] = (),
        *,
        turns: int | None = None,
        turn_limit: int | None = None,
        initial_uniforms: Reals | None = None,
    ) -> None:
        turn_limit = choose_turn_limit(turns, turn_limit)
        check_problem(problem, turn_limit)
        _check_uniform_source(uniform_source)
        _check_policies(policies, problem)
        self.problem = problem
        self.uniform_source = uniform_source
        self.turn_limit = problem.horizon if turn_limit is None else turn_limit
        if initial_uniforms is None:
            count = problem.uniform_counts.start
            initial_uniforms = uniform_source.generate_uniforms(NATURE_STREAM, 0, 0, count)[0]
        self.initial_uniforms = readonly_copy(initial_uniforms)
        states = problem.sample_initial_states(self.initial_uniforms[None])
        self.initial_state = readonly_copy(states[0])
        self.turns: list[Turn] = []
        self.reroll_counts: dict[int, int] = {}  # turn -> number of rerolls
        self.hint_counts: Counter[str] = Counter()  # agent -> number of hints given to its player
        self._forced_end_reason: str | None = None
        self._cached_facts: _CurrentFacts | None = None
        # after each turn: next discount weight, returns [n], total rewards [n]
        self._running_sums: list[tuple[float, ...]] = []
        self._histories: dict[int, SeatHistory] = {}  # seat -> history, for its views
        self.seated_policies = [
            None if policy is None else SeatedPolicy(self, seat, policy)
            for seat, policy in enumerate(policies or [None] * len(problem.agents))
        ]

    def copy_at_start(self, policies: Sequence[Policy | None] = ()) -> "Session":
        """Return the same game before its first turn, with these policies in its seats, if any."""
        limit, uniforms = self.turn_limit, self.initial_uniforms
        return Session(
            self.problem, self.uniform_source, policies, turn_limit=limit, initial_uniforms=uniforms
        )

    @property
    def state(self) -> Array:
        """The current state, without the batch axis."""
        return self.turns[-1].state if self.turns else self.initial_state

    @property
    def end_reason(self) -> str | None:
        """The reason of the end: terminal, horizon, turn limit, or that of `end`; else None."""
        return self._forced_end_reason or self._current_state_facts().natural_end_reason

    def _current_state_facts(self) -> _CurrentFacts:
        """Return the facts about the current state, computed once a turn."""
        last_turn = self.turns[-1] if self.turns else self.initial_state
        if self._cached_facts is None or self._cached_facts.last_turn is not last_turn:
            s = self.state[None]
            mask = self.problem.legal_actions_mask(s)
            legal, inactive = None, np.zeros(len(self.problem.agents), bool)
            if mask is not None:
                legal, inactive = mask[0], mark_inactive_agents(self.problem, s)[0]
            reason = self._natural_end_reason()
            self._cached_facts = _CurrentFacts(last_turn, legal, inactive, reason)
        return self._cached_facts

    def _natural_end_reason(self) -> str | None:
        """Return the reason for the natural end of the game, or None if it is not reached."""
        if self.problem.terminal(self.state[None])[0]:
            return "terminal"
        if self.turn_limit is not None and len(self.turns) >= self.turn_limit:
            return "horizon" if self.turn_limit == self.problem.horizon else "turn limit"
        return None

    @property
    def over(self) -> bool:
        """True if no more turns can be played."""
        return self.end_reason is not None

    def end(self, reason: str) -> None:
        """End the game with this reason, unless it is over already."""
        if not self.over:
            self._forced_end_reason = reason

    def legal_actions_mask(self, seat: int) -> Bools | None:
        """Return the mask `[A]` of the legal actions of a seat; None if all are legal."""
        legal = self._current_state_facts().legal_actions_mask
        return None if legal is None else readonly_copy(legal[seat])

    def action_labels(self, seat: int) -> Labels:
        """Return the current action labels of a seat; empty if actions are real numbers."""
        return list_action_labels(self.problem, seat, self.state)

    def format_action(self, seat: int, action: float) -> str:
        """Return the current label of an action, or its number as text."""
        labels = self.action_labels(seat)
        return labels[int(action)] if labels else self.problem.format_action(seat, action)

    def is_inactive(self, seat: int) -> bool:
        """Return whether a seat is inactive, because it is another's turn."""
        return bool(self._current_state_facts().inactive_agents[seat])

    def choose_policy_actions(self) -> list[float | None]:
        """Return each policy's action; None for a seat played from outside, or inactive."""
        return [
            None if seated_policy is None or self.is_inactive(seat) else seated_policy.choose()
            for seat, seated_policy in enumerate(self.seated_policies)
        ]

    def fill_in_actions(self, actions: Sequence[float | None] = ()) -> list[float | None]:
        """Return the given actions, with missing ones chosen by the policies.

        Inactive seats get their wait action, and their policies are not called. The action of a
        seat without a policy stays None. Raise IllegalAction for too few or too many actions.
        """
        agents = self.problem.agents
        filled = list(actions) or [None] * len(agents)
        if len(filled) != len(agents):
            count_text, names = format_count(len(filled), "action"), ", ".join(agents)
            raise IllegalAction(f"got {count_text}, expected one for each of {names}")
        if None not in filled:
            return filled
        seats = enumerate(zip(filled, self.seated_policies, strict=True))
        return [
            action if action is not None else self._choose_for_seat(seat, seated_policy)
            for seat, (action, seated_policy) in seats
        ]

    def _choose_for_seat(self, seat: int, seated_policy: "SeatedPolicy | None") -> float | None:
        """Return a seat's wait action, or its policy's choice, or None if it has no policy."""
        if self.is_inactive(seat):
            return find_wait_action(self.problem, seat)
        return seated_policy.choose() if seated_policy else None

    def advance(
        self,
        actions: Sequence[float | None] = (),
        uniforms: Reals | None = None,
        *,
        stated_beliefs: Mapping[int, Reals] = NO_STATED_BELIEFS,
    ) -> Turn:
        """Play one turn with the given actions, and those of the policies for the other seats.

        `stated_beliefs` has the beliefs `[S]` that players from outside state, by seat. Policies
        with a method `stated_belief` state their own. Raise IllegalAction, and change nothing, if
        the state does not allow an action; EpisodeOver if the game is over.
        """
        if self.over:
            reason_text = describe_end_reason(self.end_reason)
            raise EpisodeOver(f"turn {len(self.turns) + 1}: the game is over ({reason_text})")
        filled_actions = enumerate(self.fill_in_actions(actions))
        joint = np.array([self.validate_action(seat, action) for seat, action in filled_actions])
        stated = self._collect_stated_beliefs(stated_beliefs)
        turn_number = len(self.turns) + 1
        if uniforms is None:
            reroll = self.reroll_counts.get(turn_number, 0)
            uniforms = self.uniform_source.generate_uniforms(
                NATURE_STREAM, turn_number, reroll, self.problem.uniform_counts.step
            )[0]
        outcome = self.problem.step(self.state[None], joint[None], uniforms[None])
        validate_outcome(self.problem, outcome)
        state = readonly_copy(outcome.state[0])
        is_hidden = self.problem.partially_observable
        observations = readonly_copy(outcome.observations[0]) if is_hidden else state
        rewards = make_readonly(outcome.rewards[0] + 0.0)
        turn = Turn(
            make_readonly(joint), readonly_copy(uniforms), state, observations, rewards, stated
        )
        self.turns.append(turn)
        return turn

    def _collect_stated_beliefs(self, outside_beliefs: Mapping[int, Reals]) -> Mapping[int, Reals]:
        """Return the beliefs from outside, and those that policies of active seats state now."""
        if outside_beliefs:
            check_has_belief(self)
        stated = {
            seat: readonly_copy(belief.round_stated_belief(values))
            for seat, values in outside_beliefs.items()
        }
        for seat, seated in enumerate(self.seated_policies if self.has_visible_beliefs else ()):
            if seated and seat not in stated and not self.is_inactive(seat):
                values = seated.stated_belief()
                stated |= {} if values is None else {seat: readonly_copy(values)}
        return stated or NO_STATED_BELIEFS

    def append_turns(self, turns: Iterable[Turn]) -> None:
        """Append turns that were computed before, from the current state on."""
        self.turns.extend(turns)

    def validate_action(self, seat: int, action: float | None) -> float:
        """Return the action as it is played; raise IllegalAction if the state does not allow it."""
        problem = self.problem
        error_prefix = f"turn {len(self.turns) + 1}, {problem.agents[seat]}"
        if action is None:
            raise IllegalAction(f"{error_prefix}: no action given")
        action_set = self.action_labels(seat) or problem.actions[seat]
        mask = self.legal_actions_mask(seat)
        return action_set.validate_action(action, error_prefix, mask, problem.illegal_reason)

    def undo(self, turns: int = 1) -> list[Turn]:
        """Undo the last turns and return them; the same actions give the same outcomes again."""
        if not 1 <= turns <= len(self.turns):
            counts = {0: "no turn was", 1: "only 1 turn was"}
            played_text = counts.get(len(self.turns), f"only {len(self.turns)} turns were")
            raise IllegalAction(f"undo: {played_text} played")
        self._forced_end_reason = None
        undone = self.turns[-turns:]
        del self.turns[-turns:]
        remaining_count = len(self.turns)  # Views that exist already do not change.
        del self._running_sums[remaining_count + 1 :]
        self._histories = {
            seat: history.copy_until_turn(remaining_count)
            for seat, history in self._histories.items()
        }
        for seated_policy in self.seated_policies:
            if seated_policy:
                seated_policy.forget_undone_turns()
        return undone

    def reroll(self, draws: Reals | None = None) -> Turn:
        """Play the last turn again, with the same actions and new uniforms or `draws`."""
        undone = self.undo()[0]
        turn_number = len(self.turns) + 1
        self.reroll_counts[turn_number] = self.reroll_counts.get(turn_number, 0) + 1
        return self.advance(list(undone.actions), draws, stated_beliefs=undone.stated_beliefs)

    def observation_after(self, seat: int, turn: int) -> Array:
        """Return the observation of a seat after a turn; after turn 0, the initial observation."""
        if turn == 0:
            s = self.initial_state[None]
            initial: Array = make_initial_observation(self.problem, s, seat)[0]
            return initial
        return self._seat_observation(seat, self.turns[turn - 1])

    def _seat_observation(self, seat: int, turn: Turn) -> Array:
        """Return the observation of a seat in a turn, or the state if agents see it."""
        if not self.problem.partially_observable:
            return turn.observations
        observation: Array = select_seat_observations(turn.observations[None], seat)[0]
        return observation

    def build_percept(
        self, seat: int, turn: int, field_names: Collection[str] = Percept._fields
    ) -> Percept:
        """Return the information that a turn (from 1) gave a seat, as a batch of one row.

        Fields that are not in `field_names` are empty.
        """
        actions, _, state, observations, rewards, _ = self.turns[turn - 1]
        outcome = Outcome(state[None], rewards[None], observations[None])
        return build_percept(self.problem, seat, actions[None], outcome, field_names)

    @cached_property
    def has_visible_beliefs(self) -> bool:
        """True if views show beliefs: the states are hidden, finite and few enough."""
        return has_visible_beliefs(self.problem)

    def current_beliefs(self) -> Reals:
        """Return the current belief of each seat `[n, S]`."""
        seats = range(len(self.seated_policies))
        return np.array(
            [BeliefHistory(self.problem, seat, self._update_history(seat))[-1] for seat in seats]
        )

    def _update_history(self, seat: int, *, rewards_visible: bool = False) -> SeatHistory:
        """Return the history of a seat up to the last turn; rewards only if they may be seen."""
        if seat not in self._histories:
            self._histories[seat] = SeatHistory(*([] for _ in SeatHistory._fields))
            first_observation = readonly_copy(self.observation_after(seat, 0))
            self._histories[seat].observations.append(first_observation)
        history = self._histories[seat]
        hidden = self.problem.partially_observable
        turn_count = len(history.actions)
        new_turns = self.turns[turn_count:]
        if type(self.problem).action_labels is not Problem.action_labels:
            previous = self.turns[turn_count - 1].state if turn_count else self.initial_state
            states = [previous, *(turn.state for turn in new_turns)]
            for turn, state in zip(new_turns, states, strict=False):
                labels = list_action_labels(self.problem, seat, state)
                if labels:  # Real actions have none.
                    history.action_labels.append(labels[int(turn.actions[seat])])
        for turn in new_turns:
            history.observations.append(readonly_copy(self._seat_observation(seat, turn)))
            history.actions.append(float(turn.actions[seat]))
            if not hidden:
                history.joint_actions.append(readonly_copy(turn.actions))
        if rewards_visible:
            for turn in self.turns[len(history.rewards) :]:
                history.rewards.append(turn.rewards.item(seat))
        return history

    def view(
        self,
        seat: int,
        *,
        rewards_visible: bool = False,
        shows_belief: bool = True,
        player_label: str = View.player_label,
    ) -> View[Problem]:
        """Return the view of a seat; `rewards_visible` adds rewards that it cannot observe."""
        problem, end_reason = self.problem, self.end_reason
        rewards_visible = rewards_visible or problem.rewards_observable or end_reason is not None
        history = self._update_history(seat, rewards_visible=rewards_visible)
        return make_view(
            problem,
            seat,
            history,
            self.legal_actions_mask(seat),
            turn_limit=self.turn_limit,
            rewards_visible=rewards_visible,
            shows_belief=shows_belief and self.has_visible_beliefs,
            end_reason=end_reason,
            current_labels=self.action_labels(seat),
            player_label=player_label,
        )

    def returns(self) -> Reals:
        """Return the discounted sum of rewards of each agent `[n]`."""
        return np.array(self._accumulate_returns()[1 : 1 + len(self.seated_policies)])

    def seat_return(self, seat: int) -> float:
        """Return the discounted sum of rewards of one agent."""
        return self._accumulate_returns()[1 + seat]

    def total_rewards(self) -> Reals:
        """Return the undiscounted sum of rewards of each agent `[n]`."""
        return np.array(self._accumulate_returns()[1 + len(self.seated_policies) :])

    def _accumulate_returns(self) -> tuple[float, ...]:
        """Return the next discount weight, returns and total rewards, adding each turn once."""
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


def check_has_belief(session: Session) -> None:
    """Raise BadParameter unless the states are hidden, finite and few enough for a belief."""
    if not session.has_visible_beliefs:
        raise BadParameter("this problem has no belief over hidden states that can be stated")


def list_active_seats(session: Session, seats: Sequence[int]) -> list[int]:
    """Return those of the given seats that are active this turn."""
    return [seat for seat in seats if not session.is_inactive(seat)]


def is_waiting_for_others(session: Session, seats: Sequence[int]) -> bool:
    """Return whether there is a turn to play in which none of the given seats is active."""
    return bool(seats) and not session.over and not list_active_seats(session, seats)


def can_reproduce_turns(session: Session, turns: Turn, source: SeededUniforms) -> bool:
    """Return whether the policies choose the recorded actions of the next turns `[T, ...]`.

    All policies are checked in one batch. The result is False if a seat is inactive in one of
    the turns, or if a policy raises an error.
    """
    seated_policies = [seated_policy for seated_policy in session.seated_policies if seated_policy]
    if not seated_policies:
        return True
    s = np.concatenate([session.state[None], turns.state[:-1]])
    with suppress(Exception):  # Policies that accept only one row raise errors.
        any_inactive = mark_inactive_agents(session.problem, s).any()
        return not any_inactive and all(
            seated_policy.can_reproduce_turns(s, turns, source) for seated_policy in seated_policies
        )
    return False


def number_next_turns(session: Session, count: int) -> range:
    """Return the numbers of the next `count` turns."""
    return range(len(session.turns) + 1, len(session.turns) + 1 + count)


def count_turns_to_undo(session: Session, seats: Sequence[int], choices: int) -> int:
    """Return the number of turns that contain the last `choices` choices of these seats.

    Without seats, every turn counts as a choice. Raise IllegalAction if the seats chose less
    often, in some turns only. If they chose in every turn, return `choices`, which `undo`
    refuses if too large.
    """
    states_after = [session.initial_state, *(turn.state for turn in session.turns)]
    choice_count = 0
    for turns, state in enumerate(reversed(states_after[:-1]), 1):
        choice_count += (
            not seats or not mark_inactive_agents(session.problem, state[None])[0, seats].all()
        )
        if choice_count == choices:
            return turns
    if choice_count < len(session.turns):
        count = format_count(choice_count, "turn")
        raise IllegalAction(f"undo {choices}: you chose an action in {count}")
    return choices


def _check_uniform_source(source: object) -> None:
    """Raise BadParameter if this does not generate uniforms, for example a seed or a class."""
    if isinstance(source, type) or not hasattr(source, "generate_uniforms"):
        expected = "expected a source of uniforms, such as dmplay.SeededUniforms(7)"
        raise BadParameter(f"got {source!r}, {expected}")


def _check_policies(policies: object, problem: Problem) -> None:
    """Raise BadPolicy unless this is empty, or a policy or None for each seat."""
    if is_policy_sequence(policies) and len(policies) in (0, len(problem.agents)):
        return
    got, agents = describe_policies(policies), ", ".join(problem.agents)
    raise BadPolicy(f"got {got}, expected a policy or None for each of {agents}")


class SeatedPolicy:
    """A policy in one seat of a session: to play the seat, or only to give hints."""

    def __init__(self, session: Session, seat: int, policy: Policy) -> None:
        check_policy(policy, seat)
        self.session, self.seat, self.policy = session, seat, policy
        self._memories: list[Memory] = []
        self._followed_turns: list[Turn | None] = []  # None for turns that were not yet played

    def __str__(self) -> str:
        """Return the turn and the agent for which the policy chooses next, as text."""
        return f"turn {len(self.session.turns) + 1}, {self.session.problem.agents[self.seat]}"

    def forget_undone_turns(self) -> None:
        """Delete the memories of turns that were undone, even if others were played since."""
        turns, followed = self.session.turns, self._followed_turns
        del followed[len(turns) :]
        while followed:
            last = followed[-1]
            if last is None or last is turns[len(followed) - 1]:
                break
            followed.pop()
        del self._memories[len(followed) + 1 :]

    def current_memory(self) -> Memory:
        """Return the policy's current memory, after every turn played."""
        self.forget_undone_turns()
        if not self._memories:
            observation = np.asarray(self.session.observation_after(self.seat, 0))[None]
            observation = readonly_copy(observation)
            memory = call_memory_method(self, self.policy.initial_memory, 1, observation)
            self._memories.append(memory)
        for turn in range(len(self._memories), len(self.session.turns) + 1):
            percept, latest = self.session.build_percept(self.seat, turn), self._memories[-1]
            memory = call_memory_method(self, self.policy.update_memory, 1, latest, percept)
            self._memories.append(memory)
            self._followed_turns.append(self.session.turns[turn - 1])
        return self._memories[-1]

    def choose(self) -> float:
        """Return the action that the policy chooses in the current state."""
        session, turn = self.session, len(self.session.turns) + 1
        count = self.policy.uniform_count
        # A reroll changes only nature's uniforms: the policies choose as before.
        u = session.uniform_source.generate_uniforms(1 + self.seat, turn, 0, count)
        legal = session.legal_actions_mask(self.seat)
        legal_row = None if legal is None else readonly_copy(legal[None])
        choice = forbid_writes(self, self.policy.choose, self.current_memory(), legal_row, u)
        return float(validate_policy_actions(self.policy, choice, 1, self)[0])

    def stated_belief(self) -> Reals | None:
        """Return the belief `[S]` that the policy states in the current state; None if none.

        It is the row that an optional method of the policy, `stated_belief(memory)`, returns for
        its memory; NaN stands for no statement. Raise BadPolicy unless it is a belief.
        """
        state_belief: Callable[[Memory], object] | None = getattr(
            self.policy, "stated_belief", None
        )
        if state_belief is None:
            return None
        rows = forbid_writes(self, state_belief, self.current_memory())
        size = len(self.session.problem.enumerate_states())
        values = None if rows is None else np.asarray(rows)
        if values is None or (values.dtype.kind == "f" and np.isnan(values).all()):
            return None
        name = f"{self}: {type(self.policy).__name__}.stated_belief"
        if values.shape != (1, size) or values.dtype.kind not in "biuf":
            raise BadPolicy(f"{name}: got shape {values.shape}, expected (1, {size})")
        try:
            return belief.round_stated_belief(belief.normalize_belief(values[0].astype(float)))
        except BadParameter as error:
            raise BadPolicy(f"{name}: {error}") from None

    def can_reproduce_turns(self, s: Array, turns: Turn, source: SeededUniforms) -> bool:
        """Return whether the policy chooses the recorded actions of the next turns `[T, ...]`.

        The turns start in the states `s`. The memory after each turn is first computed as if the
        current memory came before every turn, and then again from the results for the previous
        turns. If both agree, these are the memories. If not, they are computed turn by turn, and
        only the choices are made in one batch.
        """
        problem, seat, turn_count = self.session.problem, self.seat, len(s)
        outcome = Outcome(turns.state, turns.rewards, turns.observations)
        percept = build_percept(problem, seat, turns.actions, outcome)
        repeated_memory = tuple(
            make_readonly(array.repeat(turn_count, axis=0)) for array in self.current_memory()
        )
        memories_after = self.policy.update_memory(repeated_memory, percept)
        pairs = zip(repeated_memory, memories_after, strict=True)
        memories_before = tuple(
            make_readonly(np.concatenate([current[:1], updated[:-1]])) for current, updated in pairs
        )
        updated_memories = self.policy.update_memory(memories_before, percept)
        if not all(map(np.array_equal, memories_after, updated_memories)):
            memories_before, memories_after = self._memories_in_sequence(percept, turn_count)
        numbers = ((turn, 0) for turn in number_next_turns(self.session, turn_count))
        u = generate_uniforms_of_turns(source, 1 + seat, numbers, self.policy.uniform_count)
        legal = problem.legal_actions_mask(s)
        legal_mask = None if legal is None else readonly_copy(legal[:, seat])
        choices = self.policy.choose(memories_before, legal_mask, u)
        rows = zip(*(array[:, None] for array in memories_after), strict=True)
        self._memories += rows if memories_after else [()] * turn_count
        self._followed_turns += [None] * turn_count
        return np.array_equal(choices, turns.actions[:, seat])

    def _memories_in_sequence(self, percept: Percept, count: int) -> tuple[Memory, Memory]:
        """Return the memories before and after each of `count` turns, updated turn by turn."""
        memories = [self.current_memory()]
        for turn in range(count):
            row = (None if array is None else array[turn : turn + 1] for array in percept)
            memories.append(self.policy.update_memory(memories[-1], Percept._make(row)))
        stacked = [make_readonly(np.concatenate(parts)) for parts in zip(*memories, strict=True)]
        return tuple(array[:-1] for array in stacked), tuple(array[1:] for array in stacked)

    def action_values(self) -> Reals | None:
        """Return the current value of each action `[A]`, or None if the policy has none now."""
        values = forbid_writes(self, self.policy.action_values, self.current_memory())
        return None if values is None or np.isnan(values[0]).all() else values[0]


def validate_policy_actions(
    policy: Policy, choice: object, rows: int, error_prefix: object
) -> Array:
    """Return a policy's choice as an array with an action for each row; else raise BadPolicy."""
    actions = np.asarray(choice)
    if actions.shape != (rows,) or actions.dtype.kind not in "biuf":
        expected = "one action" if rows == 1 else f"{rows} actions"
        choice_text = " ".join(repr(choice).split())
        message = f"{type(policy).__name__} chose {choice_text}, expected an array of {expected}"
        message += "; a policy defines choose(memory, legal, u)" * (choice is None)
        raise BadPolicy(f"{error_prefix}: {message}")
    return actions


def call_memory_method(
    error_prefix: object, method: Callable[..., object], rows: int, *args: object
) -> Memory:
    """Return the memory from a policy's method as a tuple of arrays with a row for each game.

    Raise BadPolicy for anything else.
    """
    memory = forbid_writes(error_prefix, method, *args)
    if not isinstance(memory, tuple | list):
        got = repr(memory)
    elif all([isinstance(array, np.ndarray) and array.shape[:1] == (rows,) for array in memory]):
        return tuple(memory)
    else:
        got = f"({', '.join([str(np.asarray(array).shape) for array in memory])})"
    expected = f"expected a tuple of arrays with {format_count(rows, 'row')} each"
    message = f"{method.__qualname__} returned {got}, {expected}"
    raise BadPolicy(f"{error_prefix}: {message}")

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
    Continuous,
    Labels,
    Memory,
    Outcome,
    Percept,
    Policy,
    Problem,
    asked,
    check_policy,
    check_problem,
    lasting,
    locked,
    own,
)
from dmplay.describe import counted, ended
from dmplay.dice import NATURE
from dmplay.displayed import Displayed
from dmplay.errors import BadPolicy, EpisodeOver, IllegalAction
from dmplay.knowledge import Beliefs, SoFar, Telling, Told
from dmplay.rules import Place, rules
from dmplay.tabular import Tabular

MOST_TURNS = 10_000  # where nothing else ends a game
LARGEST_BELIEF = 4096  # states that a view shows a belief over, where it is quick to have
LARGEST_ROWS = 2**16  # of them where what can happen is listed
LONGEST_LIST = 64  # states; a longer belief, written as a list, is no use to a reader

P_co = TypeVar("P_co", bound=Problem, covariant=True)


class Source(Protocol):
    """Where the draws of a game come from: `dice.Dice`, or a script in a test."""

    def draw(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        """Uniforms `[1, count]`."""


class Turn(NamedTuple):
    """One finished turn, without the batch axis."""

    actions: Array  # [n]
    draws: Reals  # [d]
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
    joint: Sequence[Array] | None  # everybody's `[n]`, where every agent sees the state
    rewards: Sequence[float] | None  # its own, where observable or once the game is over
    legal: Bools | None  # [A]; None for all
    beliefs: Sequence[Reals] | None  # [S] each, where states are hidden and few enough
    ending: str | None
    limit: int | None
    called: Labels | None = None  # what its actions are called now, where that depends on the state
    said: Sequence[str] = ()  # and what its own were called, then
    you: str = "you"  # who has it, as told to who looks on: by name where agents alone play

    @property
    def turn(self) -> int:
        """How many turns were played."""
        return len(self.actions)

    @property
    def observation(self) -> Array:
        """The latest observation, or the state where every agent sees it."""
        return self.observations[-1]

    @property
    def last(self) -> str:
        """The name of its latest action; nothing before the first."""
        if self.said:
            return self.said[-1]
        return self.problem.action_name(self.seat, self.actions[-1]) if self.actions else ""

    @property
    def labels(self) -> Labels:
        """What its actions are called now; none of reals."""
        return self.problem.actions[self.seat].labels if self.called is None else self.called

    @property
    def belief(self) -> Reals:
        """The latest of its beliefs, for those who know that it has them."""
        assert self.beliefs is not None
        return self.beliefs[-1]


def believed(problem: Problem) -> float:
    """How many hidden states a belief is over; infinity where there is no belief."""
    if not problem.hidden or isinstance(problem.states, Continuous):
        return math.inf
    labelled = all(isinstance(known, Labels) for known in problem.observations)
    return problem.states if labelled else math.inf


class _Now(NamedTuple):
    """What was asked after the last turn: front ends ask often."""

    last: Turn | Array  # or the first state
    place: Place
    ending: str | None  # that the game has come to by itself


class Session(Displayed):
    """One game; a seat without a policy is played from outside, through `advance`.

    It has `limit` turns at most, by default the problem's horizon. Raises BadPolicy where there is
    not a policy, or None, for each seat.
    """

    def __init__(
        self,
        problem: Problem,
        source: Source,
        policies: Sequence[Policy | None] = (),
        *,
        limit: int | None = None,
        opening: Reals | None = None,
    ) -> None:
        check_problem(problem, limit)
        self.problem = problem
        self.source = source
        self.limit = problem.horizon if limit is None else limit
        count = problem.draws.start
        self.opening = own(source.draw(NATURE, 0, 0, count)[0] if opening is None else opening)
        self.first = own(problem.start(self.opening[None])[0])
        self.turns: list[Turn] = []
        self.rerolls: dict[int, int] = {}  # turn -> how often its dice were thrown anew
        self.help: Counter[str] = Counter()  # agent -> how often whoever plays it was given advice
        self._ended: str | None = None
        self._rules = rules(problem, self.first)
        self._known: _Now | None = None
        self._sums: list[tuple[float, ...]] = []  # the next weight, returns [n], totals [n]
        self._told: dict[int, Told] = {}  # by seat, for its views
        self.followers = [
            None if policy is None else Follower(self, seat, policy)
            for seat, policy in enumerate(policies or [None] * len(problem.agents))
        ]
        if len(self.followers) != len(problem.agents):
            told = f"{len(self.followers)} policies"
            raise BadPolicy(f"got {told}, expected one, or None, for each of {problem.agents}")

    def anew(self, policies: Sequence[Policy | None] = ()) -> "Session":
        """The same game before its first turn, its seats played by these policies, if any."""
        source, limit, opening = self.source, self.limit, self.opening
        return Session(self.problem, source, policies, limit=limit, opening=opening)

    @property
    def state(self) -> Array:
        """The present state, without the batch axis."""
        return self.turns[-1].state if self.turns else self.first

    @property
    def ending(self) -> str | None:
        """Why the game is over: terminal, horizon, turn limit, or what `end` was told; or None."""
        return self._ended or self._now().ending

    def _now(self) -> _Now:
        """What is known now, asked once a turn."""
        last = self.turns[-1] if self.turns else self.first
        if self._known is None or self._known.last is not last:
            place = self._rules.place(self.state)
            self._known = _Now(last, place, self._natural(place))
        return self._known

    def _natural(self, place: Place) -> str | None:
        """The end that the game has come to by itself."""
        if place.terminal:
            return "terminal"
        if self.limit is not None and len(self.turns) >= self.limit:
            return "horizon" if self.limit == self.problem.horizon else "turn limit"
        return None

    @property
    def over(self) -> bool:
        """Whether no more turns can be played."""
        return self.ending is not None

    def end(self, reason: str) -> None:
        """Ends the game here, unless it is over already."""
        if not self.over:
            self._ended = reason

    def legal(self, seat: int) -> Bools | None:
        """The actions `[A]` open to a seat; None for all."""
        legal = self._now().place.legal
        return None if legal is None else own(legal[seat])

    def labels(self, seat: int) -> Labels:
        """What the actions of a seat are called now; none of reals."""
        called = self.problem.called(self.state)
        return called[seat] if called else self.problem.actions[seat].labels

    def action_name(self, seat: int, action: float) -> str:
        """What an action is called now, or its number."""
        labels = self.labels(seat)
        return labels[int(action)] if labels else self.problem.action_name(seat, action)

    def waits(self, seat: int) -> bool:
        """Whether a seat is not asked now, as it is another's turn."""
        return bool(self._now().place.waiting[seat])

    def asked(self, seats: Sequence[int]) -> list[int]:
        """Those of some seats whose turn it is."""
        return [seat for seat in seats if not self.waits(seat)]

    def idle(self, seats: Sequence[int]) -> bool:
        """Whether some seats play, and it is the turn of others alone."""
        going = bool(seats) and not self.over and not self.asked(seats)
        return going and bool(self.asked(range(len(self.problem.agents))))

    def choices(self) -> list[float | None]:
        """What each policy does now; None for a seat played from outside, or not asked."""
        return [
            None if follower is None or self.waits(seat) else follower.choose()
            for seat, follower in enumerate(self.followers)
        ]

    def agrees(self, turns: Turn) -> bool:
        """Whether each policy acts in the next turns `[T, ...]` as was done, and tells so at once:
        all of them are asked together, and none is a waiting seat's.
        """
        asked = [follower for follower in self.followers if follower]
        if not asked:
            return True
        s = np.concatenate([self.state[None], turns.state[:-1]])
        with suppress(Exception):  # of what is written for one row alone
            waiting = self.problem.waiting(s).any()
            return not waiting and all(follower.agrees(s, turns) for follower in asked)
        return False

    def decided(self, actions: Sequence[float | None] = ()) -> list[float | None]:
        """The given actions, and those that the policies choose now for the rest.

        Who only waits is not asked.
        """
        agents = self.problem.agents
        given = list(actions) or [None] * len(agents)
        if len(given) != len(agents):
            raise IllegalAction(f"got {len(given)} actions, expected one for each of {agents}")
        if None not in given:
            return given
        every = enumerate(zip(given, self.followers, strict=True))
        return [
            action if action is not None else self._decides(seat, follower)
            for seat, (action, follower) in every
        ]

    def _decides(self, seat: int, follower: "Follower | None") -> float | None:
        if self.waits(seat):
            return self.problem.waits(seat)
        return follower.choose() if follower else None

    def advance(self, actions: Sequence[float | None] = (), draws: Reals | None = None) -> Turn:
        """Plays one turn: the given actions, and those of the policies for the rest.

        Raises IllegalAction, and changes nothing, where the state does not allow an action.
        """
        if self.over:
            why = ended(self.ending)
            raise EpisodeOver(f"turn {len(self.turns) + 1}: the game is over ({why})")
        decided = enumerate(self.decided(actions))
        joint = np.array([self.check(seat, action) for seat, action in decided])
        number = len(self.turns) + 1
        if draws is None:
            reroll = self.rerolls.get(number, 0)
            draws = self.source.draw(NATURE, number, reroll, self.problem.draws.step)[0]
        did, state, seen, rewards = self._rules.turn(self.state, joint, draws)
        turn = Turn(did, own(draws), state, seen, rewards)
        self.turns.append(turn)
        return turn

    def numbers(self, many: int) -> range:
        """The numbers of the next so many turns."""
        return range(len(self.turns) + 1, len(self.turns) + 1 + many)

    def repeat(self, turns: Iterable[Turn]) -> None:
        """Plays turns as they were worked out before, from this state on."""
        self.turns.extend(turns)

    def check(self, seat: int, action: float | None) -> float:
        """The action as it will act; raises IllegalAction where the state does not allow it."""
        problem = self.problem
        where = f"turn {len(self.turns) + 1}, {problem.agents[seat]}"
        if action is None:
            raise IllegalAction(f"{where}: no action given")
        known = self.labels(seat) or problem.actions[seat]
        return known.check(action, where, self.legal(seat))

    def back(self, seats: Sequence[int], choices: int) -> int:
        """How many turns ago these seats, or of none everybody, made so many choices."""
        befores = [self.first, *(turn.state for turn in self.turns[:-1])][: len(self.turns)]
        many = 0
        for turns, state in enumerate(reversed(befores), 1):
            many += not seats or not self.problem.waiting(state[None])[0, seats].all()
            if many == choices:
                return turns
        if many < len(self.turns):
            raise IllegalAction(f"undo {choices}: you chose in {counted(many, 'turn')}")
        return choices

    def undo(self, turns: int = 1) -> list[Turn]:
        """Takes back the last turns and returns them; the same action gives the same outcome."""
        if not 1 <= turns <= len(self.turns):
            played = f"{len(self.turns)} turn{'s were' if len(self.turns) != 1 else ' was'} played"
            raise IllegalAction(f"undo {turns}: {played}")
        self._ended = None
        taken = self.turns[-turns:]
        del self.turns[-turns:]
        left = len(self.turns)  # a view stays what it was
        del self._sums[left + 1 :]
        self._told = {seat: told.until(left) for seat, told in self._told.items()}
        for follower in self.followers:
            if follower:
                follower.forget()
        return taken

    def reroll(self, draws: Reals | None = None) -> Turn:
        """Plays the last turn again, the same actions under other dice."""
        actions = self.undo()[0].actions
        number = len(self.turns) + 1
        self.rerolls[number] = self.rerolls.get(number, 0) + 1
        return self.advance(list(actions), draws)

    def observation(self, seat: int, turn: int) -> Array:
        """What a seat saw after a turn; before the first, the state or -1."""
        if turn == 0:
            first: Array = self.problem.first_sight(self.first[None], seat)[0]
            return first
        return self._seen(seat, self.turns[turn - 1])

    def _seen(self, seat: int, turn: Turn) -> Array:
        seen: Array = turn.observations[seat] if self.problem.hidden else turn.observations
        return seen

    def percept(self, seat: int, turn: int) -> Percept:
        """What a turn (from 1) taught a seat, as a batch of one row."""
        actions, _, state, observations, rewards = self.turns[turn - 1]
        outcome = Outcome(state[None], rewards[None], observations[None])
        return self._rules.percept(seat, actions[None], outcome)

    @cached_property
    def believes(self) -> bool:
        """Whether seats have a belief to show: hidden states, finite and few enough."""
        if isinstance(self.problem, Tabular):
            return believed(self.problem) <= LARGEST_ROWS
        quick = type(self.problem).carry is not Problem.carry
        return believed(self.problem) <= (LARGEST_BELIEF if quick else LONGEST_LIST)

    def beliefs(self) -> Reals:
        """What each seat believes now `[n, S]`."""
        seats = range(len(self.followers))
        return np.array([Beliefs(self.problem, seat, self._told_to(seat))[-1] for seat in seats])

    def _told_to(self, seat: int, *, paid: bool = False) -> Told:
        """What a seat was told, up to the last turn; rewards only where they may be known."""
        if seat not in self._told:
            self._told[seat] = Told(*(Telling() for _ in Told._fields))
            self._told[seat].observations.append(lasting(self.observation(seat, 0)))
        told = self._told[seat]
        hidden = self.problem.hidden
        many = told.actions.many
        new = self.turns[many:]
        before = self.turns[many - 1].state if many else self.first
        for turn, state in zip(new, [before, *(turn.state for turn in new)], strict=False):
            called = self.problem.called(state)
            if called:
                told.said.append(called[seat][int(turn.actions[seat])])
        told.observations.extend([lasting(self._seen(seat, turn)) for turn in new])
        told.actions.extend([float(turn.actions[seat]) for turn in new])
        if not hidden:
            told.joint.extend([lasting(turn.actions) for turn in new])
        if paid:
            unpaid = self.turns[told.rewards.many :]
            told.rewards.extend([float(turn.rewards[seat]) for turn in unpaid])
        return told

    def view(self, seat: int, *, paid: bool = False) -> View[Problem]:
        """What this seat may know; its rewards, though they are not observed, where it is paid."""
        ending = self.ending
        paid = paid or self.problem.rewards_observed or ending is not None
        problem, told = self.problem, self._told_to(seat, paid=paid)
        return View(
            problem=problem,
            seat=seat,
            observations=SoFar(told.observations),
            actions=SoFar(told.actions),
            joint=None if problem.hidden else SoFar(told.joint),
            rewards=SoFar(told.rewards) if paid else None,
            legal=self.legal(seat),
            beliefs=Beliefs(problem, seat, told) if self.believes else None,
            ending=ending,
            limit=self.limit,
            called=self.labels(seat) if problem.called(self.state) else None,
            said=SoFar(told.said),
        )

    def returns(self) -> Reals:
        """The discounted sum of rewards of each agent `[n]`."""
        return np.array(self._summed()[1 : 1 + len(self.followers)])

    def returned(self, seat: int) -> float:
        """The discounted sum of rewards of one agent."""
        return self._summed()[1 + seat]

    def totals(self) -> Reals:
        """The plain sum of rewards of each agent `[n]`."""
        return np.array(self._summed()[1 + len(self.followers) :])

    def _summed(self) -> tuple[float, ...]:
        """Both sums, each turn added once, in order."""
        if not self._sums:
            self._sums.append((1.0, *[0.0] * (2 * len(self.followers))))
        if len(self._sums) > len(self.turns):
            return self._sums[-1]
        for turn in self.turns[len(self._sums) - 1 :]:
            weight, *sums = self._sums[-1]
            rewards: list[float] = turn.rewards.tolist()
            added = [weight * reward for reward in rewards] + rewards
            self._sums.append((weight * self.problem.discount, *map(add, sums, added)))
        return self._sums[-1]


class Follower:
    """A policy that follows one seat of a session: to play it, or only to advise."""

    def __init__(self, session: Session, seat: int, policy: Policy) -> None:
        check_policy(policy, seat)
        self.session, self.seat, self.policy = session, seat, policy
        self._memories: list[Memory] = []

    def __str__(self) -> str:
        """The turn and the seat that it is to choose for."""
        return f"turn {len(self.session.turns) + 1}, {self.session.problem.agents[self.seat]}"

    def forget(self) -> None:
        """Drops what turns taken back had taught."""
        del self._memories[len(self.session.turns) + 1 :]

    def memory(self) -> Memory:
        """The policy's memory now, after every turn played."""
        self.forget()
        if not self._memories:
            seen = own(np.asarray(self.session.observation(self.seat, 0))[None])
            self._memories.append(remembered(self, self.policy.begin, 1, seen))
        for turn in range(len(self._memories), len(self.session.turns) + 1):
            percept = self.session.percept(self.seat, turn)
            known = self._memories[-1]
            self._memories.append(remembered(self, self.policy.update, 1, known, percept))
        return self._memories[-1]

    def choose(self) -> float:
        """The action the policy takes now."""
        session = self.session
        turn = len(session.turns) + 1
        # A reroll is nature's alone: the seats act again as they did.
        u = session.source.draw(1 + self.seat, turn, 0, self.policy.draws)
        legal = session.legal(self.seat)
        able = None if legal is None else own(legal[None])
        chosen = asked(self, self.policy.choose, self.memory(), able, u)
        return float(actions_chosen(self.policy, chosen, 1, self)[0])

    def agrees(self, s: Array, turns: Turn) -> bool:
        """Whether the policy acts in the next turns `[T, ...]`, from these states, as was done.

        What it remembers after each is found as if it had to forget all the others, and then
        from that found for the turn before: where both are the same, it is what it remembers. Else
        it is told of one turn after the other, and only asked at once.
        """
        problem, seat, many = self.session.problem, self.seat, len(s)
        outcome = Outcome(turns.state, turns.rewards, turns.observations)
        percept = problem.percept(seat, turns.actions, outcome)
        first = tuple(locked(part.repeat(many, axis=0)) for part in self.memory())
        after = self.policy.update(first, percept)
        pairs = zip(first, after, strict=True)
        before = tuple(locked(np.concatenate([now[:1], then[:-1]])) for now, then in pairs)
        if not all(map(np.array_equal, after, self.policy.update(before, percept))):
            before, after = self._in_turn(percept, many)
        draw, numbers = self.session.source.draw, self.session.numbers(many)
        us = [draw(1 + seat, turn, 0, self.policy.draws) for turn in numbers]
        legal = problem.legal(s)
        able = None if legal is None else own(legal[:, seat])
        chosen = self.policy.choose(before, able, np.concatenate(us))
        rows = zip(*(part[:, None] for part in after), strict=True)
        self._memories += rows if after else [()] * many
        return np.array_equal(chosen, turns.actions[:, seat])

    def _in_turn(self, percept: Percept, many: int) -> tuple[Memory, Memory]:
        """What it remembers before and after each of so many turns."""
        kept = [self.memory()]
        for turn in range(many):
            told = (None if part is None else part[turn : turn + 1] for part in percept)
            kept.append(self.policy.update(kept[-1], Percept._make(told)))
        each = [locked(np.concatenate(parts)) for parts in zip(*kept, strict=True)]
        return tuple(part[:-1] for part in each), tuple(part[1:] for part in each)

    def values(self) -> Reals | None:
        """The value of each action `[A]` now, where the policy knows it."""
        values = asked(self, self.policy.values, self.memory())
        return None if values is None else values[0]


def actions_chosen(policy: Policy, chosen: object, rows: int, where: object) -> Array:
    """What a policy chose, an action for each row; raises BadPolicy for anything else."""
    answer = np.asarray(chosen)
    if answer.shape != (rows,) or answer.dtype.kind not in "biuf":
        wanted = "one action" if rows == 1 else f"{rows} actions"
        given = " ".join(repr(chosen).split())
        told = f"{type(policy).__name__} chose {given}, expected an array of {wanted}"
        raise BadPolicy(f"{where}: {told}")
    return answer


def remembered(where: object, answer: Callable[..., object], rows: int, *given: object) -> Memory:
    """The memory that a policy's method answers, arrays with a row for each game.

    Raises BadPolicy for anything else.
    """
    memory = asked(where, answer, *given)
    if not isinstance(memory, tuple | list):
        got = repr(memory)
    elif all([isinstance(one, np.ndarray) and one.shape[:1] == (rows,) for one in memory]):
        return tuple(memory)
    else:
        got = f"({', '.join([str(np.asarray(one).shape) for one in memory])})"
    told = f"{answer.__qualname__} gave {got}, expected a tuple of arrays of {counted(rows, 'row')}"
    raise BadPolicy(f"{where}: {told}")

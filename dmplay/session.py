"""One game as a state machine, without input or output: what was done, drawn, seen and paid."""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, NamedTuple, Protocol, TypeVar, overload

import numpy as np

from dmplay import belief as beliefs
from dmplay.chance import Array, Bools, Reals
from dmplay.core import Continuous, Memory, Outcome, Percept, Policy, Problem, asked, own
from dmplay.dice import NATURE
from dmplay.errors import BadPolicy, EpisodeOver, IllegalAction

LARGEST_BELIEF = 4096  # states that a view shows a belief over, where it is quick to have
LONGEST_LIST = 64  # states; a longer belief, written as a list, is no use to a reader

T = TypeVar("T")
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


class Past(Sequence[T]):
    """What a seat was told so far, of a list that may grow: as long as it is now."""

    def __init__(self, told: Sequence[T]) -> None:
        self._told = told
        self._places = range(len(told))

    def __len__(self) -> int:
        return len(self._places)

    @overload
    def __getitem__(self, place: int) -> T: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[T, ...]: ...
    def __getitem__(self, place: int | slice) -> T | tuple[T, ...]:
        if isinstance(place, slice):
            return tuple(self._told[at] for at in self._places[place])
        return self._told[self._places[place]]


class _Told(NamedTuple):
    """All that one seat was told, in lists of its own: nothing leads from them to the game."""

    observations: list[Array]  # one more than turns
    actions: list[float]
    joint: list[Array]
    rewards: list[float]
    beliefs: list[Reals]  # one more than turns, where there are any


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
        return self.problem.action_name(self.seat, self.actions[-1]) if self.actions else ""

    @property
    def belief(self) -> Reals:
        """The latest of its beliefs, for those who know that it has them."""
        assert self.beliefs is not None
        return self.beliefs[-1]


def believed(problem: Problem) -> float:
    """How many hidden states a belief is over; infinity where there is no belief."""
    if not problem.hidden or isinstance(problem.states, Continuous):
        return math.inf
    return problem.states


class Session:
    """One game; a seat without a policy is played from outside, through `advance`."""

    def __init__(
        self,
        problem: Problem,
        source: Source,
        policies: Sequence[Policy | None] = (),
        *,
        limit: int | None = None,
        opening: Reals | None = None,
    ) -> None:
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
        self._known: tuple[Array | None, bool] = (None, False)
        self._beliefs: list[Reals] = []  # [n, S] before each turn and after the last
        self._sums: list[tuple[Reals, float]] = []  # returns and totals [2, n], next weight
        self._told: dict[int, _Told] = {}  # by seat, for its views
        self.followers = [
            None if policy is None else Follower(self, seat, policy)
            for seat, policy in enumerate(policies or [None] * len(problem.agents))
        ]

    @property
    def state(self) -> Array:
        """The present state, without the batch axis."""
        return self.turns[-1].state if self.turns else self.first

    @property
    def ending(self) -> str | None:
        """Why the game is over: terminal, horizon, turn limit, or what `end` was told; or None."""
        if self._ended:
            return self._ended
        if self._terminal():
            return "terminal"
        if self.limit is not None and len(self.turns) >= self.limit:
            return "horizon" if self.limit == self.problem.horizon else "turn limit"
        return None

    def _terminal(self) -> bool:
        """Whether the present state is terminal, asked once a state: front ends ask often."""
        state, known = self._known
        if state is not self.state:
            known = bool(self.problem.terminal(self.state[None])[0])
            self._known = (self.state, known)
        return known

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
        legal = self.problem.legal(self.state[None])
        return None if legal is None else own(legal[0, seat])

    def choices(self) -> list[float | None]:
        """What each policy does now; None for a seat played from outside."""
        return [None if follower is None else follower.choose() for follower in self.followers]

    def decided(self, actions: Sequence[float | None] = ()) -> list[float | None]:
        """The given actions, and those that the policies choose now for the rest."""
        given = list(actions) or [None] * len(self.problem.agents)
        return [
            follower.choose() if action is None and follower else action
            for action, follower in zip(given, self.followers, strict=True)
        ]

    def advance(self, actions: Sequence[float | None] = (), draws: Reals | None = None) -> Turn:
        """Plays one turn: the given actions, and those of the policies for the rest.

        Raises IllegalAction, and changes nothing, where the state does not allow an action.
        """
        if self.over:
            raise EpisodeOver(f"turn {len(self.turns) + 1}: the game is over ({self.ending})")
        decided = enumerate(self.decided(actions))
        joint = np.array([self.check(seat, action) for seat, action in decided])
        number = len(self.turns) + 1
        if draws is None:
            reroll = self.rerolls.get(number, 0)
            draws = self.source.draw(NATURE, number, reroll, self.problem.draws.step)[0]
        outcome = self.problem.step(self.state[None], joint[None], draws[None])
        happened = outcome.state[0], outcome.observations[0], outcome.rewards[0] + 0.0
        turn = Turn(*map(own, (joint, draws, *happened)))
        self.turns.append(turn)
        return turn

    def check(self, seat: int, action: float | None) -> float:
        """The action as it will act; raises IllegalAction where the state does not allow it."""
        problem = self.problem
        where = f"turn {len(self.turns) + 1}, {problem.agents[seat]}"
        known = problem.actions[seat]
        if action is None:
            raise IllegalAction(f"{where}: no action given")
        done, legal = known.check(action, where), self.legal(seat)
        if legal is not None and known.labels and not legal[int(done)]:
            raise IllegalAction(
                f"{where}: {known.name(done)} changes nothing in "
                f"{'this state' if problem.hidden else problem.notation(self.state)}; "
                f"expected one of {known.words(legal)}"
            )
        return done

    def undo(self, turns: int = 1) -> list[Turn]:
        """Takes back the last turns and returns them; the same action gives the same outcome."""
        if not 1 <= turns <= len(self.turns):
            played = f"{len(self.turns)} turn{'s were' if len(self.turns) != 1 else ' was'} played"
            raise IllegalAction(f"undo {turns}: {played}")
        self._ended = None
        taken = self.turns[-turns:]
        del self.turns[-turns:]
        for known in (self._beliefs, self._sums):
            del known[len(self.turns) + 1 :]
        left = len(self.turns)
        self._told = {  # in other lists: a view stays what it was
            seat: _Told(
                told.observations[: left + 1],
                told.actions[:left],
                told.joint[:left],
                told.rewards[:left],
                told.beliefs[: left + 1],
            )
            for seat, told in self._told.items()
        }
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
            first: Array = self.problem.first_sight(self.first[None])[0]
            return first
        return self._seen(seat, self.turns[turn - 1])

    def _seen(self, seat: int, turn: Turn) -> Array:
        seen: Array = turn.observations[seat] if self.problem.hidden else turn.observations
        return seen

    def percept(self, seat: int, turn: int) -> Percept:
        """What a turn (from 1) taught a seat, as a batch of one row."""
        actions, _, state, observations, rewards = (part[None] for part in self.turns[turn - 1])
        return self.problem.percept(seat, actions, Outcome(state, rewards, observations))

    @property
    def believes(self) -> bool:
        """Whether seats have a belief to show: hidden states, finite and few enough."""
        quick = type(self.problem).carry is not Problem.carry
        return believed(self.problem) <= (LARGEST_BELIEF if quick else LONGEST_LIST)

    def beliefs(self) -> list[Reals]:
        """The belief of each seat `[n, S]` before the first turn and after each."""
        if not self._beliefs:
            prior = np.tile(beliefs.prior(self.problem), (len(self.followers), 1))
            self._beliefs.append(own(prior))
        for turn in self.turns[len(self._beliefs) - 1 :]:
            rows = []
            for seat, before in enumerate(self._beliefs[-1]):
                actions: list[int | None] = [None] * len(self.followers)
                seen = list(actions)
                actions[seat], seen[seat] = int(turn.actions[seat]), int(turn.observations[seat])
                rows.append(beliefs.update(self.problem, before, actions, seen).belief)
            self._beliefs.append(own(np.array(rows)))
        return self._beliefs

    def _told_to(self, seat: int) -> _Told:
        """What a seat was told, up to the last turn; rewards only where they may be known."""
        told = self._told.setdefault(seat, _Told([own(self.observation(seat, 0))], [], [], [], []))
        for turn in self.turns[len(told.actions) :]:
            told.observations.append(own(self._seen(seat, turn)))
            told.actions.append(float(turn.actions[seat].item()))
            if not self.problem.hidden:
                told.joint.append(turn.actions)
        if self.problem.rewards_observed or self.over:
            rewards = self.turns[len(told.rewards) :]
            told.rewards.extend(float(turn.rewards[seat].item()) for turn in rewards)
        if self.believes:
            told.beliefs.extend(own(each[seat]) for each in self.beliefs()[len(told.beliefs) :])
        return told

    def view(self, seat: int) -> View[Problem]:
        """What this seat may know."""
        problem, told = self.problem, self._told_to(seat)
        paid = problem.rewards_observed or self.over
        return View(
            problem=problem,
            seat=seat,
            observations=Past(told.observations),
            actions=Past(told.actions),
            joint=None if problem.hidden else Past(told.joint),
            rewards=Past(told.rewards) if paid else None,
            legal=self.legal(seat),
            beliefs=Past(told.beliefs) if self.believes else None,
            ending=self.ending,
            limit=self.limit,
        )

    def returns(self) -> Reals:
        """The discounted sum of rewards of each agent `[n]`."""
        returns: Reals = self._summed()[0]
        return returns

    def totals(self) -> Reals:
        """The plain sum of rewards of each agent `[n]`."""
        totals: Reals = self._summed()[1]
        return totals

    def _summed(self) -> Reals:
        """Both sums, each turn added once, in order."""
        if not self._sums:
            self._sums.append((np.zeros((2, len(self.problem.agents))), 1.0))
        for turn in self.turns[len(self._sums) - 1 :]:
            sums, weight = self._sums[-1]
            sums = sums + [[weight], [1.0]] * turn.rewards
            self._sums.append((sums, weight * self.problem.discount))
        return self._sums[-1][0]


class Follower:
    """A policy that follows one seat of a session: to play it, or only to advise."""

    def __init__(self, session: Session, seat: int, policy: Policy) -> None:
        self.session, self.seat, self.policy = session, seat, policy
        self._memories: list[Memory] = []

    def forget(self) -> None:
        """Drops what turns taken back had taught."""
        del self._memories[len(self.session.turns) + 1 :]

    def memory(self) -> Memory:
        """The policy's memory now, after every turn played."""
        self.forget()
        if not self._memories:
            seen = own(self.session.observation(self.seat, 0)[None])
            self._memories.append(self._ask(self.policy.begin, seen))
        for turn in range(len(self._memories), len(self.session.turns) + 1):
            percept = self.session.percept(self.seat, turn)
            self._memories.append(self._ask(self.policy.update, self._memories[-1], percept))
        return self._memories[-1]

    def choose(self) -> float:
        """The action the policy takes now."""
        session = self.session
        turn = len(session.turns) + 1
        # A reroll is nature's alone: the seats act again as they did.
        u = session.source.draw(1 + self.seat, turn, 0, self.policy.draws)
        legal = session.legal(self.seat)
        able = None if legal is None else own(legal[None])
        chosen = self._ask(self.policy.choose, self.memory(), able, u)
        if np.shape(chosen) != (1,):
            name = type(self.policy).__name__
            raise BadPolicy(
                f"{self._where}: {name} chose {chosen!r}, expected an array of one action"
            )
        return float(chosen[0])

    def values(self) -> Reals | None:
        """The value of each action `[A]` now, where the policy knows it."""
        values = self._ask(self.policy.values, self.memory())
        return None if values is None else values[0]

    @property
    def _where(self) -> str:
        return f"turn {len(self.session.turns) + 1}, {self.session.problem.agents[self.seat]}"

    def _ask(self, answer: Callable[..., T], *given: object) -> T:
        return asked(self._where, answer, *given)

"""Hints: what a good player would do in a seat, and what that player knows of values."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import ceil, floor, isfinite, isnan, log10
from typing import TypeVar

import numpy as np

from dmplay.advice.forecast import forecast, told
from dmplay.budget import within
from dmplay.chance import Reals
from dmplay.core import Interval, Policy
from dmplay.errors import BadParameter, BadPolicy, TooMuch
from dmplay.finding import agents
from dmplay.session import Follower, Session, Turn
from dmplay.views.style import ALIKE, Outlook, Overlay

T = TypeVar("T")
MOST = 10  # actions whose values are told
WORK = 1.5e9  # operations of an answer: as much as takes about a second
SEARCH = "search"  # asks for no more than it may have
LEAST, FINEST = 2, 6  # decimals of values
FAR = 100.0  # values that are so far apart have none
FINE = 1e-4  # the share of an interval to which an action is told


def decimals(values: Sequence[float]) -> int:
    """The decimals, two to six, that tell these values from one another, or from nothing."""
    apart = _apart(values)
    return min(max(1 - floor(log10(apart)), LEAST), FINEST) if apart else LEAST


def fewest(values: Sequence[float]) -> int:
    """As many decimals; none of whole numbers, nor where they are hundreds apart."""
    whole = all(abs(value - round(value)) < ALIKE for value in values if isfinite(value))
    return 0 if whole or _apart(values) >= FAR else decimals(values)


def _apart(values: Sequence[float]) -> float:
    """How far these values are from one another; where they are the same, from nothing."""
    known = [value for value in values if isfinite(value)] or [0.0]
    spread = max(known) - min(known)
    return spread if spread > ALIKE else abs(known[0])


def fixed(value: float, places: int) -> str:
    """A value with so many decimals; no zero is negative."""
    return f"{round(value, places) + 0.0:.{places}f}"


@dataclass(frozen=True, eq=False)
class Advice:
    """What the adviser would do before a turn, and its values, where it knows any."""

    best: str
    labels: Sequence[str]
    values: Reals | None  # [A], nan where not legal
    action: float | None = None  # what is advised; None where several are as good
    called: str = ""  # the same by name, to the last digit

    def __str__(self) -> str:
        """In a line."""
        return ". ".join(filter(None, (self.short, self.told)))

    @property
    def named(self) -> str:
        """What is best, without who says so."""
        return self.best.rpartition(": ")[2]

    @property
    def short(self) -> str:
        """The same without its values, for who sees them marked."""
        return f"hint {self.best}"

    @cached_property
    def told(self) -> str:
        """Its values alone; '' where it knows none."""
        each = ", ".join(f"{label} {number}" for label, number in self._known(ordered=False))
        return each and f"values: {each}"

    @property
    def facts(self) -> dict[str, object]:
        """By whom, what and the values that are known, as data."""
        by, _, _ = self.best.rpartition(": ")
        told = [] if self.values is None else self.values.tolist()
        known = {name: one for name, one in zip(self.labels, told, strict=False) if isfinite(one)}
        return {"by": by.strip("()"), "action": self.called, "values": known}

    @cached_property
    def regret(self) -> Reals | None:
        """What each action `[A]` loses against the best; nan where not legal, or not known."""
        if self.values is None or not np.isfinite(self.values).any():
            return None
        finite = np.where(np.isfinite(self.values), self.values, np.nan)
        lost: Reals = np.nanmax(finite) - finite
        return lost

    @cached_property
    def ranked(self) -> list[tuple[int, float]]:
        """The legal actions with what each loses, the best first; of equals the advised one."""
        lost = [] if self.regret is None else self.regret.tolist()
        known = [(action, 0.0 if loss <= ALIKE else loss) for action, loss in enumerate(lost)]
        able = [one for one in known if not isnan(one[1])]
        return sorted(able, key=lambda one: (one[1], one[0] != self.action))

    @cached_property
    def worth(self) -> list[tuple[str, str]]:
        """The values of the best actions, the best first."""
        return self._known(ordered=True)

    def _known(self, *, ordered: bool) -> list[tuple[str, str]]:
        """Actions and their values in as many decimals as tell them apart; of many the best."""
        best = [action for action, _ in self.ranked]
        if self.values is None or not best:
            return []
        order = best[:MOST] if ordered or len(best) > MOST else sorted(best)
        known = [(self.labels[action], float(self.values[action])) for action in order]
        places = (fewest if ordered else decimals)([value for _, value in known])
        return [(label, fixed(value, places)) for label, value in known]


class Adviser:
    """The problem's own adviser beside a seat of a session; it only looks on."""

    def __init__(self, session: Session, seat: int, seats: Sequence[str] = ()) -> None:
        self.session = session
        self.seat = seat
        self.seats = seats  # who plays, by name
        self._given: tuple[int, Turn | None, Advice] | None = None  # last, and after which turn
        self._foreseen: tuple[int, Turn | None, Outlook] | None = None

    @cached_property
    def _found(self) -> tuple[str, Policy] | None:
        """The agent, if there is one; found out late, as a first frame does not need it."""
        return agents.adviser(self.session.problem, self.seat, self.session.limit, self.seats)

    @property
    def name(self) -> str | None:
        """The agent's name."""
        return self._found and self._found[0]

    @cached_property
    def _follower(self) -> Follower | None:
        return Follower(self.session, self.seat, self._found[1]) if self._found else None

    def silent(self) -> str:
        """Why nobody gives advice here; '' where somebody does."""
        if self.session.over:
            return "the game is over"
        return "" if self._follower else "no agent here knows values; dmplay info lists the agents"

    def _asked(self, ask: Callable[[Follower], T]) -> T:
        """An answer of the agent; of a search, where there is too much for the agent to plan."""
        assert self._follower
        if self.name != SEARCH:
            try:
                with within(WORK):
                    return ask(self._follower)
            except (BadPolicy, TooMuch):
                search = agents.agent(self.session.problem, self.seat, SEARCH)
                self._found = SEARCH, search
                self._follower = Follower(self.session, self.seat, search)
        return ask(self._follower)

    def hint(self) -> str:
        """What the adviser would do here, with the value of each legal action."""
        why = self.silent()
        if why:
            return f"no hint: {why}"
        action = self._choice()
        labels, called = self.session.labels(self.seat), self.session.action_name(self.seat, action)
        advice = Advice(self._told(action), labels, self._values(), action, called)
        self._given = (*self._now, advice)
        return str(advice)

    @property
    def given(self) -> Advice | None:
        """The hint that was given before this turn, if one was."""
        return self._still(self._given)

    def foresee(self, action: float) -> str:
        """What an action may bring, in a line; kept for the board."""
        if self.session.over:
            raise BadParameter("whatif: the game is over")
        outlook = forecast(self.session, self.seat, action)
        self._foreseen = (*self._now, outlook)
        return told(self.session, self.seat, outlook)

    def look_away(self) -> None:
        """Forgets what an action may bring."""
        self._foreseen = None

    @property
    def foreseen(self) -> Outlook | None:
        """What the action may bring that was asked about before this turn, if one was."""
        return self._still(self._foreseen)

    def _still(self, kept: tuple[int, Turn | None, T] | None) -> T | None:
        """What was kept, as long as its turn is not played."""
        if kept is None or self.session.over:
            return None
        turns, last, what = kept
        now = self._now
        return what if turns == now[0] and last is now[1] else None

    @property
    def _now(self) -> tuple[int, Turn | None]:
        turns = self.session.turns
        return len(turns), turns[-1] if turns else None

    def choice(self) -> str:
        """The adviser's name, and what it would do here."""
        return self._told(self._choice())

    def _choice(self) -> float:
        return self._asked(Follower.choose)

    def _told(self, action: float) -> str:
        """The adviser's name, and an action; a real number in as many decimals as matter."""
        kind = self.session.problem.actions[self.seat]
        with within(WORK):
            basis = getattr(self._found and self._found[1], "basis", "")
        told = self.session.action_name(self.seat, action)
        if isinstance(kind, Interval) and kind.high > kind.low:
            told = fixed(action, max(ceil(-log10((kind.high - kind.low) * FINE)), 0))
        return f"({basis or self.name}): {told}"

    def values(self) -> str:
        """The adviser's value of each legal action; '' where it knows none."""
        labels = self.session.labels(self.seat)
        return Advice("", labels, self._values()).told

    def _values(self) -> Reals | None:
        """The value of each action `[A]`, nan where not legal; None where no values are known."""
        values = self._asked(Follower.values) if self._follower else None
        if values is None or not self.session.problem.actions[self.seat].labels:
            return None
        legal = self.session.legal(self.seat)
        return values if legal is None else np.where(legal, values, np.nan)

    def overlay(self, kind: str) -> Overlay | None:
        """Values, policy or states of every state, where the adviser knows them."""
        values = self._everywhere if kind else None
        return None if values is None else Overlay(kind, values)

    @property
    def ready(self) -> bool:
        """Whether overlays cost nothing any more."""
        return "_everywhere" in vars(self)

    def prepare(self) -> None:
        """Values every state, for overlays."""
        _ = self._everywhere

    @cached_property
    def _everywhere(self) -> Reals | None:
        """The value of every action in every state."""
        problem = self.session.problem
        finite = isinstance(problem.states, int) and problem.states > 1
        if not finite or problem.observations or self._follower is None:
            return None
        policy = self._follower.policy
        return policy.values(policy.begin(problem.enumerated()))

"""Hints: what a good player would do in a seat, and what that player knows of values."""

from collections.abc import Callable, Sequence
from functools import cached_property
from math import floor, isfinite, log10
from typing import TypeVar

from dmplay.chance import Reals
from dmplay.core import Policy
from dmplay.errors import BadPolicy, TooMuch
from dmplay.finding import agents
from dmplay.session import Follower, Session
from dmplay.views.style import Overlay

T = TypeVar("T")
MOST = 10  # actions whose values are told
LEAST, FINEST = 2, 6  # decimals of values


def decimals(values: Sequence[float]) -> int:
    """The decimals, two to six, that tell these values from one another, or from nothing."""
    known = [value for value in values if isfinite(value)] or [0.0]
    apart = max(known) - min(known) or abs(known[0])
    return min(max(1 - floor(log10(apart)), LEAST), FINEST) if apart else LEAST


def fixed(value: float, places: int) -> str:
    """A value with so many decimals; no zero is negative."""
    return f"{round(value, places) + 0.0:.{places}f}"


class Adviser:
    """The problem's own adviser beside a seat of a session; it only looks on."""

    def __init__(self, session: Session, seat: int, seats: Sequence[str] = ()) -> None:
        self.session = session
        self.seat = seat
        self.seats = seats  # who plays, by name

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
        try:
            return ask(self._follower)
        except (BadPolicy, TooMuch):
            problem = self.session.problem
            search = agents.agent(problem, self.seat, "search")
            self._found = "search", search
            self._follower = Follower(self.session, self.seat, search)
            return ask(self._follower)

    def hint(self) -> str:
        """What the adviser would do here, with the value of each legal action."""
        why = self.silent()
        if why:
            return f"no hint: {why}"
        return ". ".join(filter(None, (f"hint {self.choice()}", self.values())))

    def choice(self) -> str:
        """The adviser's name, and what it would do here."""
        best = self.session.problem.action_name(self.seat, self._asked(Follower.choose))
        return f"({self.name}): {best}"

    def values(self) -> str:
        """The adviser's value of each legal action; '' where it knows none."""
        values = self._asked(Follower.values) if self._follower else None
        labels = self.session.problem.actions[self.seat].labels
        if values is None or not labels:
            return ""
        legal = self.session.legal(self.seat)
        able = [True] * len(labels) if legal is None else legal
        each = zip(labels, values, able, strict=True)
        known = [(label, float(value)) for label, value, open_ in each if open_]
        if len(known) > MOST:
            known = sorted(known, key=lambda pair: -pair[1])[:MOST]
        places = decimals([value for _, value in known])
        return "values: " + ", ".join(f"{label} {fixed(value, places)}" for label, value in known)

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

"""What a view makes of a game, kept by what it looked at: a game comes to few places, often."""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from functools import cached_property
from operator import attrgetter
from types import ModuleType
from typing import Any, Generic, TypeVar, cast, overload

import numpy as np
from rich.text import Text

from dmplay.core import Problem, raw
from dmplay.finding.problems import stem
from dmplay.session import Session, View
from dmplay.views.style import Look, fit, style_of

MOST = 512  # answers that are kept to one question
STANDS, FAR = "stands", "far"  # what every answer goes by; what is more than the last turn
PLAIN = (
    "width", "height", "ascii", "keys", "advised", "around", "large", "passed", "panel",
)  # fmt: skip
ARRAYS = ("state", "ghost", "regret", "overlay", "outlook")
plain, arrays = attrgetter(*PLAIN), attrgetter(*ARRAYS)

T = TypeVar("T")


class Moment:
    """What a seat may know now: the last turn at hand; a view is made where more is looked at."""

    def __init__(
        self, session: Session, seat: int, *, paid: bool = False, watched: bool = False
    ) -> None:
        self.watched = watched  # whether agents alone play
        self.session, self.seat, self.turn = session, seat, len(session.turns)
        self.last = session.turns[-1] if session.turns else None
        self.ending = session.ending
        self.paid = paid or self.ending is not None or session.problem.rewards_observed
        last, legal = self.last, session.legal(seat)
        able = None if legal is None else legal.tobytes()
        # What is no list of what was told turn by turn, and whether there was a turn.
        self.stands = seat, self.ending, session.limit, able, self.turn > 0, self.paid
        self.seen = raw(session.observation(seat, self.turn))
        self.before = last and raw(session.observation(seat, self.turn - 1))
        self.action = last and last.actions.item(seat)
        self.reward = last and last.rewards.item(seat)

    def lasts(self, seat: int) -> bool:
        """Whether it is still what that seat may know."""
        turns = self.session.turns
        same = seat == self.seat and (turns[-1] if turns else None) is self.last
        return same and self.session.ending == self.ending

    @cached_property
    def view(self) -> View[Problem]:
        """All that the seat may know."""
        view = self.session.view(self.seat, paid=self.paid)
        return replace(view, you=view.problem.agents[self.seat]) if self.watched else view

    @property
    def joint(self) -> Hashable:
        """What everybody did."""
        return self.last and raw(self.last.actions)

    @property
    def belief(self) -> bytes:
        """What the seat believes."""
        return raw(self.view.belief)

    def facts(self, known: "Question") -> Hashable:
        """What was looked at to answer a question, as what can be compared."""
        return known.facts(self)


class Noting(Moment):
    """A moment that notes which facts of it are looked at."""

    def __init__(self, now: Moment, looked: set[str]) -> None:
        super().__init__(now.session, now.seat, paid=now.paid)
        self._now, self._looked = now, looked

    @cached_property
    def view(self) -> View[Problem]:
        """All that the seat may know."""
        view, looked = self._now.view, self._looked
        return replace(
            view,
            observations=Near(view.observations, looked, "seen", "before"),
            actions=Near(view.actions, looked, "action"),
            joint=view.joint and Near(view.joint, looked, "joint"),
            rewards=view.rewards and Near(view.rewards, looked, "reward"),
            beliefs=view.beliefs and Near(view.beliefs, looked, "belief"),
        )

    def facts(self, known: "Question") -> Hashable:
        """What was looked at to answer a question, as what can be compared."""
        self._looked.update(known.looked)
        return self._now.facts(known)


class Near(Sequence[T]):
    """What a seat was told, noting by which names the last of it was looked at."""

    def __init__(self, told: Sequence[T], looked: set[str], *names: str) -> None:
        self._told, self._looked, self._names = told, looked, names

    def __bool__(self) -> bool:
        return bool(self._told)

    def __len__(self) -> int:
        self._looked.add(FAR)
        return len(self._told)

    @overload
    def __getitem__(self, place: int) -> T: ...
    @overload
    def __getitem__(self, place: slice) -> Sequence[T]: ...
    def __getitem__(self, place: int | slice) -> T | Sequence[T]:
        known = isinstance(place, int) and -len(self._names) <= place < 0
        self._looked.add(self._names[-1 - place] if known else FAR)  # type: ignore[operator]
        return self._told[place]


class Question:
    """The facts that were looked at so far to answer it, and the answers by these."""

    def __init__(self, *looked: str) -> None:
        self.looked = looked
        self.facts: Callable[[Moment], Hashable] = attrgetter(*looked)
        self.far = FAR in looked
        self.answers: dict[Hashable, object] = {}


NOTHING_YET = Question(STANDS)


class Kept:
    """The view of one problem, asked once for each place of a game that differs.

    Views are pure functions of what they are shown. One that looks at the last turn alone answers
    as it did wherever all that it looked at is the same; one that looks further back is asked anew.
    """

    def __init__(self, problem: Problem) -> None:
        self._style = style_of(problem)
        own = isinstance(self._style, ModuleType) and bool(stem(problem))
        self._pure = own and type(problem).called is Problem.called
        self._asked: dict[str, Question] = {}

    def fit(self, now: Moment, look: Look) -> Text:
        """The largest drawing that the room holds; nobody writes into it, as it comes again."""
        wanted = (*plain(look), *look.names.items(), *map(_hashable, arrays(look)))
        return self.answer("boards", now, lambda now: fit(self._style, now.view, look), wanted)

    def goal(self, now: Moment) -> list[str]:
        """What to aim for and what it costs."""
        return self.answer("goal", now, lambda now: self._style.goal(now.view))

    def panel(self, now: Moment) -> list[tuple[str, str]]:
        """Facts for the side panel."""
        return self.answer("panel", now, lambda now: self._style.panel(now.view))

    def told(self, now: Moment) -> str:
        """What the last turn did."""
        return self.answer("told", now, lambda now: self._style.told(now.view))

    def situation(self, now: Moment) -> str:
        """Where the game stands."""
        return self.answer("situation", now, lambda now: self._style.situation(now.view))

    def answer(
        self,
        what: str,
        now: Moment,
        ask: Callable[[Moment], T],
        wanted: tuple[Hashable, ...] = (),
    ) -> T:
        """The answer to a question about a moment, and to what more is wanted of it."""
        known = self._asked.get(what, NOTHING_YET)
        if not self._pure or known.far:
            return ask(now)
        found = known.answers.get((wanted, now.facts(known)))
        return self._new(what, now, ask, wanted) if found is None else cast(T, found)

    def _new(
        self,
        what: str,
        now: Moment,
        ask: Callable[[Moment], T],
        wanted: tuple[Hashable, ...],
    ) -> T:
        """An answer that was not given before; older ones are no use where it took a new look."""
        looked, known = set[str](), self._asked.get(what, NOTHING_YET)
        answer = ask(Noting(now, looked))
        if known is NOTHING_YET or not looked <= {*known.looked} or len(known.answers) == MOST:
            known = Question(*known.looked, *looked.difference(known.looked))
            self._asked[what] = known
        if not known.far:
            known.answers[wanted, now.facts(known)] = answer
        return answer


class Once(Generic[T]):
    """What is made of objects that come again, once of each; so many are remembered."""

    def __init__(self, make: Callable[[T], str], most: int) -> None:
        self._make, self._most = make, most
        self._known: dict[int, tuple[T, str]] = {}  # by the object itself, which lasts so long

    def of(self, one: T) -> str:
        """What is made of this object."""
        found = self._known.get(id(one))
        if found is None:
            if len(self._known) == self._most:
                self._known.clear()
            self._known[id(one)] = found = one, self._make(one)
        return found[1]


def _hashable(one: Any) -> Hashable:
    """What a look wants, as what can be compared."""
    if isinstance(one, np.ndarray):
        return one.tobytes()
    return tuple(map(_hashable, one)) if isinstance(one, tuple) else cast(Hashable, one)

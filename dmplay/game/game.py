"""A game that people play: a session, who sits where, its transcript, and its words."""

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import cast

from rich.text import Text

from dmplay.core import Interval, Problem
from dmplay.dice import Dice
from dmplay.errors import BadParameter
from dmplay.game import facts
from dmplay.game.adviser import Adviser
from dmplay.game.keymap import AS_DRAWN, hands, names
from dmplay.game.request import Request
from dmplay.game.seats import DIGITS, HUMAN, action_by_key, action_of
from dmplay.policies.script import EndOfScript
from dmplay.session import Session, View
from dmplay.signals import whole
from dmplay.transcript.format import number, turn_facts
from dmplay.transcript.recorder import Recorder
from dmplay.views.style import Look, fit, style_of

FRAME = Look(width=80, height=24)
PAIR = 2


def frame(session: Session) -> str:
    """What the first seat's screen shows, as the transcript's plain-text frame."""
    drawn = fit(style_of(session.problem), session.view(0), FRAME)
    return "\n".join(row.rstrip() for row in drawn.plain.split("\n"))


class Game:
    """A session with people, agents and a transcript; what a front end drives."""

    def __init__(
        self,
        name: str,
        session: Session,
        seats: Sequence[str],
        recorder: Recorder | None = None,
        asked: Request | None = None,
    ) -> None:
        self.name = name
        self.session = session
        self.seats = tuple(seats)
        self.recorder = recorder
        self.asked = asked  # None for a recording
        self.style = style_of(session.problem)
        self.hands = hands(session.problem, AS_DRAWN)
        self.people = [seat for seat, who in enumerate(seats) if who == HUMAN]
        self.tells_seed = True  # whether the player gave it
        self.notes = ""  # for the end of the transcript
        self.again = ""  # the command that plays this game once more
        self.strict = asked is not None and asked.strict
        self.reveal = asked is not None and asked.reveal
        self._chosen: dict[int, float] = {}
        self._told: tuple[object, list[dict[str, object]]] = (None, [])
        self._undone: list[list[float]] = []
        self._advisers: dict[int, Adviser] = {}
        self._sum: tuple[View[Problem], float] | None = None
        self._seen: tuple[tuple[object, ...], View[Problem]] | None = None

    @property
    def problem(self) -> Problem:
        """The problem played."""
        return self.session.problem

    @property
    def source(self) -> Path | None:
        """The file that holds the game."""
        return self.recorder.path if self.recorder else None

    @property
    def shows_seed(self) -> bool:
        """Whether the player knows the seed: a fresh one is told after the game."""
        return self.tells_seed or self.session.over

    @property
    def seed(self) -> int:
        """The seed of the dice."""
        return cast(Dice, self.session.source).seed

    @property
    def private(self) -> bool:
        """Whether several people play of whom each may know something else."""
        return len(self.people) > 1 and self.problem.observations is not None

    @property
    def watcher(self) -> int:
        """The seat whose view is shown: the person to choose, else the first."""
        waiting = self.waiting
        return waiting if waiting is not None else (self.people or [0])[0]

    @property
    def waiting(self) -> int | None:
        """The person who chooses next."""
        left = [seat for seat in self.people if seat not in self._chosen]
        return left[0] if left and not self.session.over else None

    def view(self) -> View[Problem]:
        """What the watcher may know; made anew only when a turn, the seat or the end is new."""
        session, seat = self.session, self.watcher
        last = session.turns[-1] if session.turns else None
        now = (session, seat, last, session.ending)
        if self._seen is None or any(a is not b for a, b in zip(self._seen[0], now, strict=True)):
            self._seen = now, session.view(seat)
        return self._seen[1]

    def draw(self, look: Look) -> Text:
        """The board in the room there is; the state too where it is revealed."""
        if self.reveal or (self.session.over and self.problem.observations is not None):
            look = look._replace(state=self.session.state)
        labels = self.problem.actions[self.watcher]
        if not isinstance(labels, Interval):
            known = names(self.keys_of(self.watcher), labels)
            look = look._replace(names={**known, **look.names})
        return fit(self.style, self.view(), look)

    # What is done

    def choose(self, action: float, seat: int | None = None) -> bool:
        """Takes a person's choice, the next one's to choose unless `seat` says whose.

        Plays the turn once everybody's is in.
        """
        waiting = self.waiting if seat is None else seat
        if self.session.over:
            raise BadParameter(f"the game is over ({self.session.ending})")
        if waiting is None:
            raise BadParameter("no person plays here")
        self.session.check(waiting, action)
        self._chosen[waiting] = action
        return self.waiting is None and self.play()

    def play(self) -> bool:
        """Plays a turn with the choices that are in."""
        chosen, self._chosen = self._chosen, {}
        actions = [chosen.get(seat) for seat in range(len(self.seats))]
        with whole():
            try:
                self.session.advance(actions)
            except EndOfScript:
                self.session.end("quit")
                return False
            self._undone.clear()
            self._record()
        return True

    def unattended(self) -> bool:
        """Plays a turn of a game without people; False once it is over."""
        return not self.session.over and self.play()

    def undo(self, turns: int = 1) -> None:
        """Takes back turns; the transcript keeps that it was done."""
        self._may("undo")
        if self._chosen:  # a first choice of two is taken back before any turn is
            self._chosen.clear()
            return
        with whole():
            taken = self.session.undo(turns)
            self._undone += [list(turn.actions) for turn in reversed(taken)]
            if self.recorder:
                self.recorder.event("undo", turns)

    def redo(self) -> None:
        """Plays the turn last taken back again."""
        if not self._undone:
            raise BadParameter("redo: nothing was taken back")
        self._chosen.clear()
        with whole():
            self.session.advance(self._undone[-1])
            self._undone.pop()
            self._record()

    def reroll(self) -> None:
        """Plays the last turn again under other dice; the transcript says so."""
        self._may("reroll")
        if not self.session.turns:
            raise BadParameter("reroll: no turn was played yet")
        self._chosen.clear()
        self._undone.clear()
        with whole():
            self.session.reroll()
            if self.recorder:
                self.recorder.event("reroll", self.session.rerolls[len(self.session.turns)])
            self._record()

    def _may(self, command: str) -> None:
        """Refuses to take back where that is not fair."""
        if self.strict:
            raise BadParameter(f"{command}: this game is strict")
        shown = self.session.over and self.problem.observations is not None
        if shown and self.people and not self.reveal:
            raise BadParameter(f"{command}: the game is over and what was hidden is shown")

    def _record(self) -> None:
        if self.recorder:
            self.recorder.turn()

    def finish(self, reason: str = "quit") -> None:
        """Ends the game and its transcript."""
        with whole():
            self.session.end(reason)
            if self.recorder:
                self.recorder.end(self.notes)

    # What is said

    def read(self, word: str) -> float:
        """The action that a person typed: its name, an alias, its number or a key."""
        return action_of(self.problem, self.watcher, word, self.keys_of(self.watcher))

    def key(self, key: str) -> tuple[int, float] | None:
        """Whose action a key plays, and which: of who is to choose, or each with keys of its own
        where two people share a keyboard.
        """
        seat, keys = self.watcher, self.keys_of(self.watcher)
        if len(self.people) == PAIR and self.hands.other and not self.private:
            second = key in self.hands.other
            seat, keys = self.people[second], self.hands.other if second else self.hands.keys
        action = action_by_key(self.problem, seat, key, keys)
        return None if action is None else (seat, action)

    def keys_of(self, seat: int) -> Mapping[str, str]:
        """The keys of a seat's person, first those of the hand that is the second's of two."""
        second = len(self.people) == PAIR and seat == self.people[1]
        return {**self.hands.other, **self.hands.keys} if second else self.hands.keys

    @property
    def nudges(self) -> Mapping[str, float]:
        """Keys that move a typed number up or down; none where actions have keys."""
        return getattr(self.style, "NUDGES", {})

    @property
    def types_numbers(self) -> bool:
        """Whether actions are typed as numbers, not pressed as keys."""
        actions = self.problem.actions[self.watcher]
        return isinstance(actions, Interval) or (len(actions) > DIGITS and actions[0].isdigit())

    def legal(self, seat: int) -> list[tuple[str, str, bool]]:
        """Key, label and legality of each action; '' where numbers are typed, [] for reals."""
        labels = self.problem.actions[seat]
        if isinstance(labels, Interval):
            return []
        keys: dict[str, str] = {}
        for key, label in self.keys_of(seat).items():
            keys.setdefault(label, key)
        able = self.session.legal(seat)
        digits = [str(n % DIGITS) for n in range(1, DIGITS + 1)] if len(labels) <= DIGITS else []
        return [
            (keys.get(label, digit), label, able is None or bool(able[index]))
            for index, (label, digit) in enumerate(
                zip_longest(labels, digits[: len(labels)], fillvalue="")
            )
        ]

    def said(self, seat: int | None = None) -> str:
        """The last turn in one line: number, what happened, reward and return where seen.

        As the watcher may know it, unless `seat` says who.
        """
        view = self.view() if seat is None else self.session.view(seat)
        rerolled = ", under other dice" if view.turn in self.session.rerolls else ""
        parts = [f"turn {view.turn}{rerolled}.", self.style.told(view)]
        if view.rewards is not None:
            parts.append(f"reward {view.rewards[-1]:.6g}. return {self.returned(view):.6g}.")
        return " ".join(parts)

    def change(self, before: int) -> str:
        """What happened since there were so many turns: how far back the game is, or a turn."""
        now = len(self.session.turns)
        return f"undone. turn {now}." if now < before else self.said()

    def returned(self, view: View[Problem]) -> float:
        """The discounted sum of the rewards that a view shows; a frame asks twice."""
        if self._sum is None or self._sum[0] is not view:
            discount = self.problem.discount
            each = (discount**t * reward for t, reward in enumerate(view.rewards or ()))
            self._sum = view, sum(each, 0.0)
        return self._sum[1]

    def situation(self) -> str:
        """Where the game stands, in sentences."""
        words = self.style.situation(self.view())
        if self.reveal and self.problem.observations is not None:
            words += f" truly {self.problem.notation(self.session.state)}."
        return words

    @property
    def adviser(self) -> Adviser:
        """Who gives hints to the watcher."""
        seat = self.watcher
        if seat not in self._advisers:
            self._advisers[seat] = Adviser(self.session, seat, self.seats)
        return self._advisers[seat]

    def result(self) -> str:
        """How it ended: reason, turns, return and total of each seat."""
        session = self.session
        sums = zip(self.problem.agents, session.returns(), session.totals(), strict=True)
        each = "; ".join(f"{who} return {number(r):g}, total {number(t):g}" for who, r, t in sums)
        turns = len(session.turns)
        return f"{session.ending or 'unfinished'} after {turns} turn{'s' * (turns != 1)}. {each}."

    def closing(self) -> list[str]:
        """How it ended and, turn by turn, what was hidden, a line each."""
        return [f"over: {self.result()}", *map(facts.sentence, self.debrief())]

    def debrief(self) -> list[dict[str, object]]:
        """Turn by turn what was hidden, once it is over: state, observation, belief and reward."""
        session = self.session
        if self.problem.observations is None or not session.over:
            return []
        key = (len(session.turns), session.ending)
        if self._told[0] != key:
            self._told = key, facts.debrief(session)
        return self._told[1]

    def public(self, seat: int | None = None) -> dict[str, object]:
        """The last turn as data: everything if no person sits here or all is revealed,
        else what the watcher, or another seat, may know.
        """
        if not self.people or self.reveal:
            return turn_facts(self.session)
        view = self.view() if seat is None else self.session.view(seat)
        return facts.public(self.session, view)

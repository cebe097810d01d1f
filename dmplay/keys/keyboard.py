"""Which action a typed word or a key is, in the hands of those who play."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress

from dmplay.core import WAIT, Interval, Labels, Problem
from dmplay.errors import BadParameter, UnknownName
from dmplay.keys import keymap
from dmplay.keys.keymap import DIGITS, Keys
from dmplay.session import View
from dmplay.views.style import style_of

PAIR = 2
FINE, COARSE = 40, 5  # parts of an interval that a nudge adds, and how many a larger one
NUMERIC = re.compile(r"\s*[-+]?\.?\d")


class Keyboard:
    """The keys of a problem's people, who sit in these seats."""

    def __init__(self, problem: Problem, people: Sequence[int], wanted: Keys) -> None:
        self.problem = problem
        self.people = people
        self.hands = keymap.hands(problem, wanted)
        self._names: dict[int, Mapping[str, str]] = {}  # by seat
        own: Mapping[str, float] | None = getattr(style_of(problem), "NUDGES", None)
        self.nudges = _nudges(problem.actions[0]) if own is None else own

    def read(self, view: View[Problem], word: str) -> float:
        """The action that a person typed: its name here, or anywhere, an alias, number or key."""
        if view.called is not None:
            with suppress(UnknownName):
                return view.called.read(word)
        return action_of(self.problem, view.seat, word, self.of(view.seat))

    def pressed(self, seat: int, key: str) -> tuple[int, float] | None:
        """Whose action a key plays, and which: of this seat, or each with keys of its own where
        two people share a keyboard and see the same.
        """
        hands, keys = self.hands, self.of(seat)
        if len(self.people) == PAIR and hands.other and not self.problem.hidden:
            second = key in hands.other
            seat, keys = self.people[second], hands.other if second else hands.keys
        action = action_by_key(self.problem, seat, key, keys)
        return None if action is None else (seat, action)

    def of(self, seat: int) -> Mapping[str, str]:
        """The keys of a seat's person, first those of the hand that is the second's of two."""
        second = len(self.people) == PAIR and seat == self.people[1]
        return {**self.hands.other, **self.hands.keys} if second else self.hands.keys

    def names(self, seat: int) -> Mapping[str, str]:
        """The key of each action of a seat, as a board shows it; none for reals."""
        if seat not in self._names:
            self._names[seat] = keymap.names(self.of(seat), self.problem.actions[seat].labels)
        return self._names[seat]

    def types_numbers(self, seat: int) -> bool:
        """Whether actions are typed as numbers, not pressed as keys."""
        labels = self.problem.actions[seat].labels
        written = len(labels) > len(DIGITS) or bool(self.nudges)
        return not labels or (written and labels[0].isdigit())

    def legal(self, view: View[Problem]) -> list[tuple[str, str, bool]]:
        """Key, label and legality of each action; '' where numbers are typed, [] for reals."""
        labels = self.problem.actions[view.seat].labels
        digits = "" if self.types_numbers(view.seat) else _digits(labels)
        keys = dict(zip(labels, digits, strict=False))
        keys |= {label: key for key, label in reversed([*self.of(view.seat).items()])}  # the first
        several = len(self.problem.agents) > 1
        able = [view.legal is None or bool(view.legal[index]) for index in range(len(labels))]
        return [
            (keys.get(label, ""), name, may)
            for label, name, may in zip(labels, view.labels, able, strict=True)
            if may or not (view.called or (several and label == WAIT))
        ]


def _digits(labels: Labels) -> str:
    """The digit that plays each action; none of more than ten."""
    digits = "".join(sorted(DIGITS)) if labels[:1] == ("0",) else DIGITS
    return digits if len(labels) <= len(DIGITS) else ""


def _nudges(actions: Labels | Interval) -> dict[str, float]:
    """Keys that add a small or a larger part of an interval; none to names."""
    if isinstance(actions, Labels):
        return {}
    small = (actions.high - actions.low) / FINE
    return {"left": -small, "right": small, "down": -small * COARSE, "up": small * COARSE}


def action_of(
    problem: Problem, seat: int, word: str, keys: Mapping[str, str] | None = None
) -> float:
    """The action that a person wrote: its name, an alias, its number or a key."""
    try:
        return problem.action(seat, word)
    except UnknownName:
        by_key = action_by_key(problem, seat, word, keys)
        if by_key is None:
            _check_bounds(problem, seat, word)
            raise
        return by_key


def _check_bounds(problem: Problem, seat: int, word: str) -> None:
    """Refuses a number where actions are other whole numbers, and tells which."""
    labels = problem.actions[seat].labels
    if labels and all(label.isdigit() for label in labels) and NUMERIC.match(word):
        raise BadParameter(f"action: got {word!r}, expected {numbers(labels)}") from None


def numbers(labels: Sequence[str]) -> str:
    """Which numbers are actions: how far they reach where they are evenly spaced, else all."""
    each = [int(label) for label in labels if label.isdigit()]
    step = each[1] - each[0] if len(each) == len(labels) > 1 else 0
    if step < 1 or each != [*range(each[0], each[-1] + 1, step)]:
        return ", ".join(labels)
    tens = f" in steps of {step}" if step > 1 else ""
    return f"a whole number from {labels[0]} to {labels[-1]}{tens}"


def action_by_key(
    problem: Problem, seat: int, key: str, keys: Mapping[str, str] | None = None
) -> float | None:
    """The action that a key plays, of a view's keys if no others are in force.

    A digit is the action's number, 0 the tenth, unless actions are called 0, 1 and so on.
    """
    labels = problem.actions[seat].labels
    in_force = style_of(problem).KEYS if keys is None else keys
    if in_force.get(key) in labels:
        return labels.index(in_force[key])
    number = _digits(labels).find(key) if len(key) == 1 else -1
    return number if 0 <= number < len(labels) else None

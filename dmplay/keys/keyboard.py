"""Which action a typed word or a key is, in the hands of those who play."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress

from dmplay.core import WAIT_LABEL, Interval, Labels, Problem
from dmplay.errors import BadParameter, UnknownName
from dmplay.keys import keymap
from dmplay.keys.keymap import DIGIT_KEYS, KeyPreferences
from dmplay.session import View
from dmplay.views.style import load_view_module

PLAYERS_SHARING_KEYBOARD = 2
STEPS_PER_INTERVAL, LARGE_STEP_FACTOR = (
    40,
    5,
)  # parts of an interval that a nudge adds, and how many a larger one
NUMBER_START_PATTERN = re.compile(r"\s*[-+]?\.?\d")


class Keyboard:
    """The keys of a problem's people, who sit in these seats."""

    def __init__(
        self, problem: Problem, human_seats: Sequence[int], preferences: KeyPreferences
    ) -> None:
        self.problem = problem
        self.human_seats = human_seats
        self.key_maps = keymap.resolve_key_maps(problem, preferences)
        self._keys_by_action: dict[int, Mapping[str, str]] = {}  # by seat
        own: Mapping[str, float] | None = getattr(load_view_module(problem), "NUMBER_STEPS", None)
        self.number_steps = _make_number_steps(problem.actions[0]) if own is None else own

    def parse_action(self, view: View[Problem], text: str) -> float:
        """The action that a person typed: its name here, or anywhere, an alias, number or key."""
        if view.state_action_labels is not None:
            with suppress(UnknownName):
                return view.state_action_labels.parse_action(text)
        return parse_action_text(self.problem, view.seat, text, self.get_seat_keys(view.seat))

    def find_key_action(self, seat: int, key: str) -> tuple[int, float] | None:
        """Whose action a key plays, and which: of this seat, or each with keys of its own where
        two people share a keyboard and see the same.
        """
        hands, keys = self.key_maps, self.get_seat_keys(seat)
        if (
            len(self.human_seats) == PLAYERS_SHARING_KEYBOARD
            and hands.second_player_keys
            and not self.problem.partially_observable
        ):
            second = key in hands.second_player_keys
            seat, keys = (
                self.human_seats[second],
                hands.second_player_keys if second else hands.first_player_keys,
            )
        action = find_action_by_key(self.problem, seat, key, keys)
        return None if action is None else (seat, action)

    def get_seat_keys(self, seat: int) -> Mapping[str, str]:
        """The keys of a seat's person, first those of the hand that is the second's of two."""
        second = len(self.human_seats) == PLAYERS_SHARING_KEYBOARD and seat == self.human_seats[1]
        return (
            {**self.key_maps.second_player_keys, **self.key_maps.first_player_keys}
            if second
            else self.key_maps.first_player_keys
        )

    def get_keys_by_action(self, seat: int) -> Mapping[str, str]:
        """The key of each action of a seat, as a board shows it; none for reals."""
        if seat not in self._keys_by_action:
            self._keys_by_action[seat] = keymap.map_actions_to_keys(
                self.get_seat_keys(seat), self.problem.actions[seat].labels
            )
        return self._keys_by_action[seat]

    def is_number_entry(self, seat: int) -> bool:
        """Whether actions are typed as numbers, not pressed as keys."""
        labels = self.problem.actions[seat].labels
        written = len(labels) > len(DIGIT_KEYS) or bool(self.number_steps)
        return not labels or (written and labels[0].isdigit())

    def list_actions_with_keys(self, view: View[Problem]) -> list[tuple[str, str, bool]]:
        """Key, label and legality of each action; '' where numbers are typed, [] for reals."""
        labels = self.problem.actions[view.seat].labels
        digits = "" if self.is_number_entry(view.seat) else _assign_digit_keys(labels)
        keys = dict(zip(labels, digits, strict=False))
        keys |= {
            label: key for key, label in reversed([*self.get_seat_keys(view.seat).items()])
        }  # the first
        several = len(self.problem.agents) > 1
        able = [
            view.legal_actions_mask is None or bool(view.legal_actions_mask[index])
            for index in range(len(labels))
        ]
        return [
            (keys.get(label, ""), name, may)
            for label, name, may in zip(labels, view.action_labels, able, strict=True)
            if may or not (view.state_action_labels or (several and label == WAIT_LABEL))
        ]


def _assign_digit_keys(labels: Labels) -> str:
    """The digit that plays each action; none of more than ten."""
    digits = "".join(sorted(DIGIT_KEYS)) if labels[:1] == ("0",) else DIGIT_KEYS
    return digits if len(labels) <= len(DIGIT_KEYS) else ""


def _make_number_steps(actions: Labels | Interval) -> dict[str, float]:
    """Keys that add a small or a larger part of an interval; none to names."""
    if isinstance(actions, Labels):
        return {}
    small = (actions.high - actions.low) / STEPS_PER_INTERVAL
    return {
        "left": -small,
        "right": small,
        "down": -small * LARGE_STEP_FACTOR,
        "up": small * LARGE_STEP_FACTOR,
    }


def parse_action_text(
    problem: Problem, seat: int, text: str, keys: Mapping[str, str] | None = None
) -> float:
    """The action that a person wrote: its name, an alias, its number or a key."""
    try:
        return problem.parse_action(seat, text)
    except UnknownName:
        by_key = find_action_by_key(problem, seat, text, keys)
        if by_key is None:
            _reject_out_of_range_number(problem, seat, text)
            raise
        return by_key


def _reject_out_of_range_number(problem: Problem, seat: int, text: str) -> None:
    """Refuses a number where actions are other whole numbers, and tells which."""
    labels = problem.actions[seat].labels
    if labels and all(label.isdigit() for label in labels) and NUMBER_START_PATTERN.match(text):
        raise BadParameter(
            f"action: got {text!r}, expected {describe_number_range(labels)}"
        ) from None


def describe_number_range(labels: Sequence[str]) -> str:
    """Which numbers are actions: how far they reach where they are evenly spaced, else all."""
    each = [int(label) for label in labels if label.isdigit()]
    step = each[1] - each[0] if len(each) == len(labels) > 1 else 0
    if step < 1 or each != [*range(each[0], each[-1] + 1, step)]:
        return ", ".join(labels)
    tens = f" in steps of {step}" if step > 1 else ""
    return f"a whole number from {labels[0]} to {labels[-1]}{tens}"


def find_action_by_key(
    problem: Problem, seat: int, key: str, keys: Mapping[str, str] | None = None
) -> float | None:
    """The action that a key plays, of a view's keys if no others are in force.

    A digit is the action's number, 0 the tenth, unless actions are called 0, 1 and so on.
    """
    labels = problem.actions[seat].labels
    in_force = load_view_module(problem).KEYS if keys is None else keys
    if in_force.get(key) in labels:
        return labels.index(in_force[key])
    number = _assign_digit_keys(labels).find(key) if len(key) == 1 else -1
    return number if 0 <= number < len(labels) else None

"""Translate typed words and pressed keys into actions of the human players."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress

from dmplay.core.problem import WAIT_LABEL, Problem
from dmplay.core.session import View
from dmplay.core.spaces import Interval, Labels
from dmplay.errors import BadParameter, UnknownName
from dmplay.game import key_bindings
from dmplay.game.key_preferences import DIGIT_KEYS, KeyPreferences
from dmplay.views.protocol import load_view_module

PLAYERS_SHARING_KEYBOARD = 2
# parts into which a small step divides an interval; small steps in a large one
STEPS_PER_INTERVAL, LARGE_STEP_FACTOR = 40, 5
NUMBER_START_PATTERN = re.compile(r"\s*[-+]?\.?\d")


class Keyboard:
    """The keys of a problem for the seats that people play."""

    def __init__(
        self, problem: Problem, human_seats: Sequence[int], preferences: KeyPreferences
    ) -> None:
        self.problem = problem
        self.human_seats = human_seats
        self.key_maps = key_bindings.resolve_key_maps(problem, preferences)
        self._keys_by_action: dict[int, Mapping[str, str]] = {}  # by seat
        view_steps: Mapping[str, float] | None = getattr(
            load_view_module(problem), "NUMBER_STEPS", None
        )
        self.number_steps = (
            _make_number_steps(problem.actions[0]) if view_steps is None else view_steps
        )

    def parse_action(self, view: View[Problem], text: str) -> float:
        """Return the action that a player typed as its name, an alias, its number or a key.

        A name that the current state gives to an action comes first. Raise UnknownName or
        BadParameter if the text is no action.
        """
        if view.state_action_labels is not None:
            with suppress(UnknownName):
                return view.state_action_labels.parse_action(text)
        return parse_action_text(self.problem, view.seat, text, self.get_seat_keys(view.seat))

    def find_key_action(self, seat: int, key: str) -> tuple[int, float] | None:
        """Return (seat, action) for a pressed key, or None if it plays nothing.

        The action is for `seat`, unless two people with the same information share the keyboard:
        then a key of the second player's set plays for the second player, any other key for the
        first.
        """
        key_maps, keys = self.key_maps, self.get_seat_keys(seat)
        if (
            len(self.human_seats) == PLAYERS_SHARING_KEYBOARD
            and key_maps.second_player_keys
            and not self.problem.partially_observable
        ):
            is_second = key in key_maps.second_player_keys
            seat = self.human_seats[is_second]
            keys = key_maps.second_player_keys if is_second else key_maps.first_player_keys
        action = find_action_by_key(self.problem, seat, key, keys)
        return None if action is None else (seat, action)

    def get_seat_keys(self, seat: int) -> Mapping[str, str]:
        """Return the keys of a seat as key -> action.

        The second of two players has both sets of keys, and the first set wins.
        """
        is_second = (
            len(self.human_seats) == PLAYERS_SHARING_KEYBOARD and seat == self.human_seats[1]
        )
        if is_second:
            return {**self.key_maps.second_player_keys, **self.key_maps.first_player_keys}
        return self.key_maps.first_player_keys

    def get_keys_by_action(self, seat: int) -> Mapping[str, str]:
        """Return the key of each action of a seat, as shown; empty for real-valued actions."""
        if seat not in self._keys_by_action:
            self._keys_by_action[seat] = key_bindings.map_actions_to_keys(
                self.get_seat_keys(seat), self.problem.actions[seat].labels
            )
        return self._keys_by_action[seat]

    def is_number_entry(self, seat: int) -> bool:
        """Return whether actions are typed as numbers and not pressed as keys."""
        labels = self.problem.actions[seat].labels
        needs_typing = len(labels) > len(DIGIT_KEYS) or bool(self.number_steps)
        return not labels or (needs_typing and labels[0].isdigit())

    def describe_numbers(self, seat: int) -> str:
        """Return the numbers that a player may type, as a range if they have one.

        One of the digits that stand for a number is named with that number.
        """
        action_set = self.problem.actions[seat]
        text = describe_number_range(action_set.labels) or action_set.describe_actions()
        text = text.removeprefix("a whole number from ").removeprefix("a number from ")
        text = text.replace(" in steps of ", " by ")
        labels = action_set.labels
        digits = zip(_assign_digit_keys(labels), labels, strict=False)
        short = [f"; {digit} = {label}" for digit, label in digits if digit != label]
        return text + "".join(short[len(short) // 2 :][:1])

    def describe_number_steps(self) -> str:
        """Return the keys that change a typed number, with their steps, such as `↑ ↓ by 1`."""
        keys_by_step: dict[float, list[str]] = {}
        for key, step in self.number_steps.items():
            keys_by_step.setdefault(abs(step), []).append(key_bindings.KEY_SYMBOLS.get(key, key))
        return "  ".join(f"{' '.join(keys)} by {step:g}" for step, keys in keys_by_step.items())

    def list_actions_with_keys(self, view: View[Problem]) -> list[tuple[str, str, bool]]:
        """Return (key, label, is_legal) for each action; [] for real-valued actions.

        The key is '' if actions are typed as numbers. Illegal actions without a name in the current
        state, and an illegal wait action in a game of several agents, are left out.
        """
        labels = self.problem.actions[view.seat].labels
        digits = "" if self.is_number_entry(view.seat) else _assign_digit_keys(labels)
        keys = dict(zip(labels, digits, strict=False))
        # The first key of each action wins.
        keys |= {label: key for key, label in reversed([*self.get_seat_keys(view.seat).items()])}
        has_several_agents = len(self.problem.agents) > 1
        legal = [
            view.legal_actions_mask is None or bool(view.legal_actions_mask[index])
            for index in range(len(labels))
        ]
        return [
            (keys.get(label, ""), name, is_legal)
            for label, name, is_legal in zip(labels, view.action_labels, legal, strict=True)
            if is_legal
            or not (view.state_action_labels or (has_several_agents and label == WAIT_LABEL))
        ]


def _assign_digit_keys(labels: Labels) -> str:
    """Return the digit key of each action in order, or '' if there are more than ten actions."""
    digits = "".join(sorted(DIGIT_KEYS)) if labels[:1] == ("0",) else DIGIT_KEYS
    return digits if len(labels) <= len(DIGIT_KEYS) else ""


def _make_number_steps(actions: Labels | Interval) -> dict[str, float]:
    """Return the arrow keys that change a number, with their steps; none for named actions."""
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
    """Return the action that a player wrote as its name, an alias, its number or a key.

    Raise BadParameter for a number that is not among whole-number actions, else UnknownName.
    """
    try:
        return problem.parse_action(seat, text)
    except UnknownName:
        by_key = find_action_by_key(problem, seat, text, keys)
        if by_key is None:
            _check_number_in_range(problem, seat, text)
            raise
        return by_key


def _check_number_in_range(problem: Problem, seat: int, text: str) -> None:
    """Raise BadParameter for a number that is not an action, if all actions are whole numbers."""
    labels = problem.actions[seat].labels
    if labels and all(label.isdigit() for label in labels) and NUMBER_START_PATTERN.match(text):
        raise BadParameter(
            f"action: got {text!r}, expected {describe_number_range(labels)}"
        ) from None


def describe_number_range(labels: Sequence[str]) -> str:
    """Describe the numbers that are actions: as a range if evenly spaced, else as a list."""
    values = [int(label) for label in labels if label.isdigit()]
    step = values[1] - values[0] if len(values) == len(labels) > 1 else 0
    if step < 1 or values != [*range(values[0], values[-1] + 1, step)]:
        return ", ".join(labels)
    step_text = f" in steps of {step}" if step > 1 else ""
    return f"a whole number from {labels[0]} to {labels[-1]}{step_text}"


def find_action_by_key(
    problem: Problem, seat: int, key: str, keys: Mapping[str, str] | None = None
) -> float | None:
    """Return the action that a key plays, or None; `keys` defaults to the keys of the view.

    A digit is the action's number, 0 the tenth, unless actions are named 0, 1 and so on.
    """
    labels = problem.actions[seat].labels
    active_keys = load_view_module(problem).KEYS if keys is None else keys
    if active_keys.get(key) in labels:
        return labels.index(active_keys[key])
    number = _assign_digit_keys(labels).find(key) if len(key) == 1 else -1
    return number if 0 <= number < len(labels) else None

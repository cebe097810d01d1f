"""Sets of actions and of observations: labels, intervals, real vectors and lines of text."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.chance import sample_uniform_index
from dmplay.errors import BadParameter, IllegalAction, UnknownName

ACTION_DECIMALS = 9  # decimals of a real-valued action, so that its text is exactly the number
INTERVAL_GRID_SIZE = 21  # actions that represent an interval in a search
NO_OBSERVATION_TEXT = "nothing yet"


class Labels(tuple[str, ...]):
    """A finite set of labels, like Gymnasium's Discrete; a value is the index of a label."""

    __slots__ = ()
    json_types: tuple[type, ...] = (str,)  # the types of an action in JSON

    @property
    def labels(self) -> "Labels":
        """The labels to choose from: all of them."""
        return self

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one observation: (), because it is an index."""
        return ()

    def null_observation(self, rows: int) -> Ints:
        """Return the null observations `[B]` used before the first turn: -1."""
        return np.full(rows, -1)

    def format_observation(self, observation: Array) -> str:
        """Return an observation as text: its label, or "nothing yet" for a null observation."""
        return NO_OBSERVATION_TEXT if observation < 0 else self[int(observation)]

    def parse_action(self, text: str) -> int:
        """Return the index of the action that a text names; raise UnknownName if there is none."""
        word = normalize_label(text)
        labels: Sequence[str] = self if word in self else [normalize_label(label) for label in self]
        if word not in labels:
            raise UnknownName("action", text.strip(), self)
        return labels.index(word)

    def format_action(self, action: float) -> str:
        """Return the label of an action."""
        return str(self[int(action)])

    to_json_value = format_action  # the value that a transcript records

    def validate_action(
        self,
        action: float,
        error_prefix: str,
        legal: Bools | None = None,
        illegal_reason: str = "is not legal now",
    ) -> int:
        """Return the action as an int; raise IllegalAction if it is not an index, or not legal."""
        if action not in range(len(self)):
            expected = f"expected 0 to {len(self) - 1}"
            raise IllegalAction(f"{error_prefix}: got action {action}, {expected}")
        if legal is not None and not legal[int(action)]:
            expected = f"expected one of {self.describe_actions(legal)}"
            message = f"{self[int(action)]} {illegal_reason}; {expected}"
            raise IllegalAction(f"{error_prefix}: {message}")
        return int(action)

    def sample_actions(self, u: Reals, legal: Bools | None) -> Ints:
        """Return actions `[B]` by uniforms `[B]`; the legal ones `[B, A]` are equally likely."""
        return sample_uniform_index(len(self), u, legal)

    def candidate_actions(self) -> Ints:
        """Return the actions `[A]` that a search tries: all indices."""
        return np.arange(len(self))

    def describe_actions(self, legal: Bools | None = None) -> str:
        """Return the legal labels as comma-separated text; "" if there are none."""
        return ", ".join(self if legal is None else (self[a] for a in np.flatnonzero(legal)))


@dataclass(frozen=True)
class Interval:
    """A continuous action set with inclusive bounds, like Gymnasium's Box of one number.

    Raise ValueError unless the bounds are finite and the lower one is first.
    """

    low: float
    high: float
    json_types: ClassVar[tuple[type, ...]] = (int, float)  # the types of an action in JSON

    def __post_init__(self) -> None:
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise ValueError(f"got {self}, expected two finite numbers, the lower first")

    @property
    def labels(self) -> Labels:
        """The labels to choose from: none, because an action is a number."""
        return Labels()

    def parse_action(self, text: str) -> float:
        """Return the rounded action that a text writes; raise BadParameter beyond the bounds."""
        try:
            value = math.nan
            if text.isascii() and "_" not in text:
                value = round(float(text), ACTION_DECIMALS)
        except ValueError:
            value = math.nan
        if not self.low <= value <= self.high:
            raise BadParameter(f"action: got {text.strip()!r}, expected {self.describe_actions()}")
        return value + 0.0

    def format_action(self, action: float) -> str:
        """Return the number with up to nine significant digits."""
        return f"{action:.9g}"

    def to_json_value(self, action: float) -> float:
        """Return the number as a transcript records it."""
        return float(action)

    def validate_action(
        self, action: float, error_prefix: str, legal: Bools | None = None, illegal_reason: str = ""
    ) -> float:
        """Return the action rounded to ACTION_DECIMALS; raise IllegalAction beyond the bounds."""
        if not self.low <= action <= self.high:
            expected = self.describe_actions()
            raise IllegalAction(f"{error_prefix}: got {action:g}, expected {expected}")
        return round(float(action), ACTION_DECIMALS) + 0.0

    def sample_actions(self, u: Reals, legal: Bools | None) -> Reals:
        """Return uniformly distributed actions `[B]` by uniforms `[B]`."""
        return np.round(self.low + (self.high - self.low) * u, ACTION_DECIMALS)

    def candidate_actions(self) -> Reals:
        """Return the actions `[A]` that a search tries: an evenly spaced grid."""
        grid = np.linspace(self.low, self.high, INTERVAL_GRID_SIZE)
        return np.asarray(np.round(grid, ACTION_DECIMALS) + 0.0)

    def clip_actions(self, numbers: Reals) -> Reals:
        """Return the actions `[B]` closest to these numbers."""
        clipped = np.minimum(np.maximum(numbers, self.low), self.high)
        return np.asarray(clipped.round(ACTION_DECIMALS) + 0.0)

    def describe_actions(self, legal: Bools | None = None) -> str:
        """Return the interval as text."""
        return f"a number from {self.low:g} to {self.high:g}"


def normalize_label(text: str) -> str:
    """Return a typed name as labels are written: stripped, lower case, with hyphens."""
    return text.strip().lower().replace("_", "-")


@dataclass(frozen=True)
class RealVector:
    """The observation space of one real number, or of a vector of `size` real numbers."""

    size: int = 1

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one observation."""
        return (self.size,) if self.size > 1 else ()

    def null_observation(self, rows: int) -> Reals:
        """Return the null observations `[B, ...]` used before the first turn: NaN."""
        return np.full((rows, *self.shape), np.nan)

    def format_observation(self, observation: Array) -> str:
        """Return an observation as text, or "nothing yet" for a null observation."""
        if np.isnan(observation).any():
            return NO_OBSERVATION_TEXT
        return ", ".join(f"{number:.6g}" for number in np.atleast_1d(observation))

    def to_json_value(self, observation: Array) -> float | list[float]:
        """Return an observation as a transcript records it."""
        value: float | list[float] = observation.tolist()
        return value


@dataclass(frozen=True)
class TextLine:
    """The observation space of a line of text."""

    shape: ClassVar[tuple[int, ...]] = ()

    def null_observation(self, rows: int) -> Array:
        """Return the null observations `[B]` used before the first turn: empty texts."""
        return np.full(rows, "")

    def format_observation(self, observation: Array) -> str:
        """Return an observation as text, or "nothing yet" for a null observation."""
        return str(observation) or NO_OBSERVATION_TEXT

    def to_json_value(self, observation: Array) -> str:
        """Return an observation as a transcript records it."""
        return str(observation)


ObservationSpace = Labels | RealVector | TextLine  # the observation space of one agent

"""Violations of an invariant by a problem: the source line that is at fault, and a sentence."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from dmplay.core import user_code_locations
from dmplay.core.tabular import Tables

MAX_MESSAGE_CHARACTERS = 300  # maximum characters of a message


class Violation(NamedTuple):
    """A violation of an invariant: the source line, '' if it is unknown, and a sentence."""

    where: str
    what: str

    def __str__(self) -> str:
        """Return both in one line."""
        return f"{self.where} {self.what}".strip()

    def format_with_name(self, name: str) -> str:
        """Return the violation in a line, with the problem's name if the source line is unknown."""
        return str(self) if self.where or self.what[:1] in "./" else f"{name}: {self.what}"


class CheckResult(NamedTuple):
    """The result of a check, the attribute it is about, and the message if the check fails."""

    ok: bool
    attribute: str  # NAME, or NAME.ARGUMENT
    # or a function that makes it, if arrays in it would take long to print
    message: str | Callable[[], str]
    independent: bool = False  # whether later checks can run although this one fails


CheckResults = Iterator[CheckResult]
Findings = Iterator[CheckResult | Violation]


def make_violation(owner: type, attribute: str, message: str | Callable[[], str]) -> Violation:
    """Return the violation for an attribute of a class, with the source line that defines it.

    A message of more than MAX_MESSAGE_CHARACTERS characters is cut in the middle.
    """
    name, _, argument = attribute.partition(".")
    sentence = " ".join((message if isinstance(message, str) else message()).split())
    if len(sentence) > MAX_MESSAGE_CHARACTERS:
        half = MAX_MESSAGE_CHARACTERS // 2
        sentence = f"{sentence[:half]} ... {sentence[-half:]}"
    location = user_code_locations.locate_definition(owner, name, argument, Tables._fields)
    return Violation(location, sentence)


def expect(
    holds: object, attribute: str, value: object, expected: str, *, independent: bool = False
) -> CheckResult:
    """Return the result of a check of a value; the message is made only if the check fails."""
    message = partial("{}: got {!r}, expected {}".format, attribute, value, expected)
    return CheckResult(bool(holds), attribute, message, independent)


def require(holds: object, message: str) -> CheckResult:
    """Return the result of a check, whose message begins with the attribute and a colon."""
    return CheckResult(bool(holds), message.partition(":")[0], message)


def has_shape(value: object, shape: tuple[int, ...]) -> bool:
    """Return whether a value is an array of this shape."""
    return isinstance(value, np.ndarray) and value.shape == shape


def check_real_array(
    label: str, attribute: str, value: object, shape: tuple[int, ...]
) -> CheckResults:
    """Yield checks that a value is an array of finite real numbers of this shape."""
    got = f"shape {value.shape}" if isinstance(value, np.ndarray) else repr(value)
    message = f"{label}: got {got}, expected an array of shape {shape}"
    yield CheckResult(has_shape(value, shape), attribute, message)
    array = np.asarray(value)
    is_finite = array.dtype.kind in "fiu" and bool(np.isfinite(array).all())
    got = "" if array.dtype.kind in "fiu" else f"got the type {array.dtype}, "
    yield CheckResult(is_finite, attribute, f"{label}: {got}expected finite numbers")

"""How a problem breaks a law: the line that does, and a sentence."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from dmplay import places
from dmplay.tabular import Tables

MAX_MESSAGE_CHARACTERS = 300  # characters of a sentence


class Violation(NamedTuple):
    """How a problem breaks a law: the line that does, '' where none is known, and a sentence."""

    where: str
    what: str

    def __str__(self) -> str:
        """Both in one line."""
        return f"{self.where} {self.what}".strip()

    def format_with_name(self, name: str) -> str:
        """The same in one line, with the name of the problem where no line is known."""
        return str(self) if self.where or self.what[:1] in "./" else f"{name}: {self.what}"


class CheckResult(NamedTuple):
    """Whether something holds, the attribute that says it, and what is told where it does not."""

    ok: bool
    attribute: str  # NAME, or NAME.ARGUMENT
    message: str | Callable[[], str]  # as it is made, where arrays in it would take long to write
    independent: bool = False  # whether what follows can be looked at though it does not hold


CheckResults = Iterator[CheckResult]


def make_violation(owner: type, attribute: str, message: str | Callable[[], str]) -> Violation:
    """What is wrong with an attribute of a class, and the line that says it."""
    name, _, argument = attribute.partition(".")
    what = " ".join((message if isinstance(message, str) else message()).split())
    what = (
        what
        if len(what) <= MAX_MESSAGE_CHARACTERS
        else f"{what[: MAX_MESSAGE_CHARACTERS // 2]} ... {what[-MAX_MESSAGE_CHARACTERS // 2 :]}"
    )
    return Violation(places.locate_definition(owner, name, argument, Tables._fields), what)


def has_shape(value: object, shape: tuple[int, ...]) -> bool:
    """Whether this is an array of a shape."""
    return isinstance(value, np.ndarray) and value.shape == shape


def check_real_array(
    label: str, attribute: str, value: object, shape: tuple[int, ...]
) -> CheckResults:
    """An array of real numbers of a shape."""
    got = f"shape {value.shape}" if isinstance(value, np.ndarray) else repr(value)
    yield CheckResult(
        has_shape(value, shape),
        attribute,
        f"{label}: got {got}, expected an array of shape {shape}",
    )
    array = np.asarray(value)
    holds = array.dtype.kind in "fiu" and bool(np.isfinite(array).all())
    yield CheckResult(
        holds, attribute, f"{label}: expected numbers, none infinite and none missing"
    )

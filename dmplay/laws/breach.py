"""How a problem breaks a law: the line that does, and a sentence."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from dmplay import places
from dmplay.tabular import Tables

SHOWN = 300  # characters of a sentence


class Breach(NamedTuple):
    """How a problem breaks a law: the line that does, '' where none is known, and a sentence."""

    where: str
    what: str

    def __str__(self) -> str:
        """Both in one line."""
        return f"{self.where} {self.what}".strip()

    def of(self, name: str) -> str:
        """The same in one line, with the name of the problem where no line is known."""
        return str(self) if self.where or self.what[:1] in "./" else f"{name}: {self.what}"


class Fact(NamedTuple):
    """Whether something holds, the attribute that says it, and what is told where it does not."""

    holds: bool
    said: str  # NAME, or NAME.ARGUMENT
    told: str | Callable[[], str]  # as it is made, where arrays in it would take long to write
    alone: bool = False  # whether what follows can be looked at though it does not hold


Facts = Iterator[Fact]


def breach(owner: type, said: str, told: str | Callable[[], str]) -> Breach:
    """What is wrong with an attribute of a class, and the line that says it."""
    name, _, argument = said.partition(".")
    what = " ".join((told if isinstance(told, str) else told()).split())
    what = what if len(what) <= SHOWN else f"{what[: SHOWN // 2]} ... {what[-SHOWN // 2 :]}"
    return Breach(places.place(owner, name, argument, Tables._fields), what)


def shaped(told: object, shape: tuple[int, ...]) -> bool:
    """Whether this is an array of a shape."""
    return isinstance(told, np.ndarray) and told.shape == shape


def reals(what: str, said: str, told: object, shape: tuple[int, ...]) -> Facts:
    """An array of real numbers of a shape."""
    got = f"shape {told.shape}" if isinstance(told, np.ndarray) else repr(told)
    yield Fact(shaped(told, shape), said, f"{what}: got {got}, expected an array of shape {shape}")
    array = np.asarray(told)
    holds = array.dtype.kind in "fiu" and bool(np.isfinite(array).all())
    yield Fact(holds, said, f"{what}: expected numbers, none infinite and none missing")

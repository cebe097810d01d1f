"""A case: what stands in a folder, what is said to the program there, and what came of it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

GAME = "game.dmt"  # the transcript that most cases are about


@dataclass(frozen=True)
class Case:
    """Everything that is drawn: files and words, typed lines or keys, variables."""

    words: tuple[str, ...] = ()
    files: Mapping[str, bytes] = field(default_factory=dict)
    typed: str = ""
    terminal: bool = False  # whether a person types at a terminal that cannot be drawn on
    keys: tuple[str, ...] = ()  # of the full screen; `:` begins a typed line
    size: tuple[int, int] = (80, 24)
    variables: Mapping[str, str] = field(default_factory=dict)
    changed: str = ""  # the fact that was changed, so that the transcript must not hold


class Told(NamedTuple):
    """What came of a case."""

    ending: str  # the exit code, or how it ended otherwise
    shown: str = ""  # all that was printed or drawn
    files: Mapping[str, bytes] = MappingProxyType({})  # that were written
    trace: str = ""  # of an exception that nobody caught


Program = Callable[[Case], Told]

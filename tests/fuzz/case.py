"""A fuzz case: the files in its folder, the input of the program, and the outcome."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

GAME_FILE = "game.dmt"  # the transcript that most cases are about


@dataclass(frozen=True)
class Case:
    """Everything that is drawn for a case: files, arguments, typed lines or keys, and variables."""

    words: tuple[str, ...] = ()
    files: Mapping[str, bytes] = field(default_factory=dict)
    typed: str = ""
    terminal: bool = False  # whether input comes from a terminal that cannot show the full screen
    keys: tuple[str, ...] = ()  # keys of the full screen; `:` begins a typed line
    # pieces of terminal input, each with the seconds before it
    pieces: tuple[tuple[float, bytes], ...] = ()
    size: tuple[int, int] = (80, 24)
    variables: Mapping[str, str] = field(default_factory=dict)
    changed: str = ""  # the fact that was changed, so that the transcript must not verify


class CaseOutcome(NamedTuple):
    """The outcome of a case."""

    ending: str  # the exit code, or another kind of ending
    output: str = ""  # everything that was printed or drawn
    files: Mapping[str, bytes] = MappingProxyType({})  # the files that were written
    trace: str = ""  # the traceback of an uncaught exception


Program = Callable[[Case], CaseOutcome]

"""The header of a transcript: what a line of it is called, may hold and means where it is absent.

A new line is a new field of `Header`, and one of the same name of `game.request.Request`.
"""

from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from typing import Annotated, Any, NamedTuple, get_args

from dmplay.dice import Dice

VERSION = 1


class Kind(NamedTuple):
    """What may stand on a line."""

    expected: str
    holds: Callable[[object], bool]


class Line(NamedTuple):
    """One line: its key, the field it is, what may stand there, and what is meant without it."""

    key: str
    field: str
    kind: Kind
    default: object  # MISSING where it must stand


def _named(value: object) -> bool:
    return isinstance(value, dict) and all(isinstance(name, str) for name in value.values())


FORMAT = Kind(f"format {VERSION}", lambda value: type(value) is int and value == VERSION)
NAME = Kind('a name, such as "hexworld"', lambda value: isinstance(value, str))
NAMES = Kind('names, such as {"agent": "human"}', _named)
ORIGIN = Kind("what its problem came from", lambda value: isinstance(value, str))
VALUES = Kind('values, such as {"slip": 0.2}', lambda value: isinstance(value, dict))
WHOLE = Kind("a whole number, such as 7", lambda value: type(value) is int and value >= 0)
PLAYER = Kind('who plays, such as "Ada"', lambda value: isinstance(value, str))
FLAG = Kind("true or false", lambda value: type(value) is bool)
STRICT = Kind('true or false, or "hints"', lambda value: value == "hints" or FLAG.holds(value))


@dataclass(frozen=True, kw_only=True)
class Header:
    """What game it is and who sat there: a line a field, in this order, unless it is as usual."""

    problem: Annotated[str, NAME]  # a path in it told from the transcript's folder
    origin: Annotated[str, ORIGIN] = ""  # of a file its hash, of another library its version
    parameters: Annotated[Mapping[str, object], VALUES, "set"] = field(default_factory=dict)
    seats: Annotated[Mapping[str, str], NAMES]
    seed: Annotated[int, WHOLE]
    episode: Annotated[int, WHOLE] = 0
    turns: Annotated[int | None, WHOLE] = None  # a turn limit other than the problem's horizon
    strict: Annotated[bool | str, STRICT] = False  # nothing is taken back; "hints": no help either
    reveal: Annotated[bool, FLAG] = False  # the players saw what is hidden
    branched: Annotated[int | None, WHOLE] = None  # the turn from which another game was gone on
    peeked: Annotated[bool, FLAG] = False  # what is hidden was shown, and the game gone on with
    player: Annotated[str, PLAYER] = ""  # who says to be the person

    @property
    def dice(self) -> Dice:
        """The dice of its seed."""
        return Dice(self.seed, self.episode)


def _line(one: Field[Any]) -> Line:
    _, kind, *key = get_args(one.type)
    default = one.default if one.default_factory is MISSING else one.default_factory()
    return Line(key[0] if key else one.name, one.name, kind, default)


LINES = tuple(_line(one) for one in fields(Header))


def header_facts(header: Header) -> dict[str, object]:
    """The header's lines, without those that say what is meant anyhow."""
    every = [(line, getattr(header, line.field)) for line in LINES]
    return {"dmplay": VERSION} | {line.key: told for line, told in every if told != line.default}

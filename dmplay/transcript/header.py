"""The header of a transcript: what a line of it is called, may hold and means where it is absent.

A new line is a new field of `Header`, and one of the same name of `game.request.Request`.
"""

from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from typing import Annotated, Any, NamedTuple, get_args

from dmplay.dice import SeededUniforms

FORMAT_VERSION = 1


class ValueType(NamedTuple):
    """What may stand on a line."""

    expected: str
    accepts: Callable[[object], bool]


class HeaderLine(NamedTuple):
    """One line: its key, the field it is, what may stand there, and what is meant without it."""

    key: str
    field: str
    value_type: ValueType
    default: object  # MISSING where it must stand


def _is_name_map(value: object) -> bool:
    return isinstance(value, dict) and all(isinstance(name, str) for name in value.values())


VERSION_TYPE = ValueType(
    f"format {FORMAT_VERSION}", lambda value: type(value) is int and value == FORMAT_VERSION
)
NAME_TYPE = ValueType('a name, such as "hexworld"', lambda value: isinstance(value, str))
NAME_MAP_TYPE = ValueType('names, such as {"agent": "human"}', _is_name_map)
ORIGIN_TYPE = ValueType("what its problem came from", lambda value: isinstance(value, str))
VALUE_MAP_TYPE = ValueType('values, such as {"slip": 0.2}', lambda value: isinstance(value, dict))
WHOLE_NUMBER_TYPE = ValueType(
    "a whole number, such as 7", lambda value: type(value) is int and value >= 0
)
PLAYER_NAME_TYPE = ValueType('who plays, such as "Ada"', lambda value: isinstance(value, str))
FLAG_TYPE = ValueType("true or false", lambda value: type(value) is bool)
STRICT_TYPE = ValueType(
    'true or false, or "hints"', lambda value: value == "hints" or FLAG_TYPE.accepts(value)
)


@dataclass(frozen=True, kw_only=True)
class Header:
    """What game it is and who sat there: a line a field, in this order, unless it is as usual."""

    problem: Annotated[str, NAME_TYPE]  # a path in it told from the transcript's folder
    origin: Annotated[str, ORIGIN_TYPE] = ""  # of a file its hash, of another library its version
    parameters: Annotated[Mapping[str, object], VALUE_MAP_TYPE, "set"] = field(default_factory=dict)
    seats: Annotated[Mapping[str, str], NAME_MAP_TYPE]
    seed: Annotated[int, WHOLE_NUMBER_TYPE]
    episode: Annotated[int, WHOLE_NUMBER_TYPE] = 0
    turns: Annotated[int | None, WHOLE_NUMBER_TYPE] = (
        None  # a turn limit other than the problem's horizon
    )
    strict: Annotated[bool | str, STRICT_TYPE] = (
        False  # nothing is taken back; "hints": no help either
    )
    reveal: Annotated[bool, FLAG_TYPE] = False  # the players saw what is hidden
    branched: Annotated[int | None, WHOLE_NUMBER_TYPE] = (
        None  # the turn from which another game was gone on
    )
    peeked: Annotated[bool, FLAG_TYPE] = (
        False  # what is hidden was shown, and the game gone on with
    )
    player: Annotated[str, PLAYER_NAME_TYPE] = ""  # who says to be the person

    @property
    def uniform_source(self) -> SeededUniforms:
        """The dice of its seed."""
        return SeededUniforms(self.seed, self.episode)


def _make_header_line(header_field: Field[Any]) -> HeaderLine:
    _, kind, *key = get_args(header_field.type)
    default = (
        header_field.default
        if header_field.default_factory is MISSING
        else header_field.default_factory()
    )
    return HeaderLine(key[0] if key else header_field.name, header_field.name, kind, default)


HEADER_LINES = tuple(_make_header_line(one) for one in fields(Header))


def collect_header_facts(header: Header) -> dict[str, object]:
    """The header's lines, without those that say what is meant anyhow."""
    every = [(line, getattr(header, line.field)) for line in HEADER_LINES]
    return {"dmplay": FORMAT_VERSION} | {
        line.key: told for line, told in every if told != line.default
    }

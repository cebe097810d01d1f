"""The header of a transcript: the key, the type and the default of each line.

A new line requires a new field of `Header`. If it is an option of a game, a field of `GameRequest`
has the same name, which `RECORDED_OPTIONS` of `game/launch_requests.py` lists.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields
from typing import Annotated, Any, NamedTuple, get_args

from dmplay.core.uniforms import SeededUniforms

FORMAT_VERSION = 1


class ValueType(NamedTuple):
    """The type of a header value: its description in error messages, and a test of values."""

    expected: str
    accepts: Callable[[object], bool]


class HeaderLine(NamedTuple):
    """A line of the header: its key, field name, value type and default."""

    key: str
    field: str
    value_type: ValueType
    default: object  # MISSING if the line is required


def _is_name_map(value: object) -> bool:
    """Return whether a value is a dict whose values are strings."""
    return isinstance(value, dict) and all(isinstance(name, str) for name in value.values())


VERSION_TYPE = ValueType(
    f"format {FORMAT_VERSION}", lambda value: type(value) is int and value == FORMAT_VERSION
)
NAME_TYPE = ValueType('a name, such as "hexworld"', lambda value: isinstance(value, str))
NAME_MAP_TYPE = ValueType('names, such as {"agent": "human"}', _is_name_map)
ORIGIN_TYPE = ValueType("the origin of the problem as text", lambda value: isinstance(value, str))
VALUE_MAP_TYPE = ValueType('values, such as {"slip": 0.2}', lambda value: isinstance(value, dict))
WHOLE_NUMBER_TYPE = ValueType(
    "a whole number, such as 7", lambda value: type(value) is int and value >= 0
)
PLAYER_NAME_TYPE = ValueType('a name, such as "Ada"', lambda value: isinstance(value, str))
FLAG_TYPE = ValueType("true or false", lambda value: type(value) is bool)
STRICT_TYPE = ValueType(
    'true or false, or "hints"', lambda value: value == "hints" or FLAG_TYPE.accepts(value)
)


def _is_list_of_earlier_players(value: object) -> bool:
    """Return whether a value is a list of `{"turns": N, "seats": {NAME: PLAYER}}`."""
    return isinstance(value, list | tuple) and all(
        isinstance(entry, dict)
        and entry.keys() == {"turns", "seats"}
        and WHOLE_NUMBER_TYPE.accepts(entry["turns"])
        and _is_name_map(entry["seats"])
        for entry in value
    )


EARLIER_PLAYERS_TYPE = ValueType(
    'earlier players, such as [{"turns": 4, "seats": {"agent": "human"}}]',
    _is_list_of_earlier_players,
)


@dataclass(frozen=True, kw_only=True)
class Header:
    """The game and players of a transcript: one line per field, in this order, except defaults."""

    problem: Annotated[str, NAME_TYPE]  # a path in it is relative to the transcript's folder
    origin: Annotated[str, ORIGIN_TYPE] = ""  # hash of a file, or version of another library
    parameters: Annotated[Mapping[str, object], VALUE_MAP_TYPE, "set"] = field(default_factory=dict)
    seats: Annotated[Mapping[str, str], NAME_MAP_TYPE]
    seed: Annotated[int, WHOLE_NUMBER_TYPE]
    episode: Annotated[int, WHOLE_NUMBER_TYPE] = 0
    # turn limit, if it differs from the problem's horizon
    turns: Annotated[int | None, WHOLE_NUMBER_TYPE] = None
    strict: Annotated[bool | str, STRICT_TYPE] = False  # undo is forbidden; "hints": hints are, too
    reveal: Annotated[bool, FLAG_TYPE] = False  # the players saw hidden information
    # turn from which another game was continued
    branched: Annotated[int | None, WHOLE_NUMBER_TYPE] = None
    # the players of the first turns, one entry per change; the others are those of `seats`
    earlier: Annotated[Sequence[Mapping[str, Any]], EARLIER_PLAYERS_TYPE] = ()
    # hidden information was shown, and the game continued
    peeked: Annotated[bool, FLAG_TYPE] = False
    player: Annotated[str, PLAYER_NAME_TYPE] = ""  # name that the person stated

    @property
    def uniform_source(self) -> SeededUniforms:
        """The uniforms that follow from the seed and the episode."""
        return SeededUniforms(self.seed, self.episode)

    def count_turns_of_earlier_players(self) -> list[int]:
        """Return, for each seat, the number of first turns that its player did not play."""
        return [
            max(
                (
                    entry["turns"]
                    for entry in self.earlier
                    if entry["seats"].get(seat, player) != player
                ),
                default=0,
            )
            for seat, player in self.seats.items()
        ]

    @property
    def turns_before_these_players(self) -> int:
        """The number of first turns in which the players were not yet those of the seats."""
        return max(self.count_turns_of_earlier_players())

    def describe_earlier_players(self) -> str:
        """Return the earlier player of each seat that changed, or "" if none did."""
        return "; ".join(
            f"{seat}: {player} until turn {entry['turns']}"
            for entry in self.earlier
            for seat, player in entry["seats"].items()
        )


def _make_header_line(header_field: Field[Any]) -> HeaderLine:
    """Return the header line of a field of `Header`."""
    _, value_type, *key = get_args(header_field.type)
    default = (
        header_field.default
        if header_field.default_factory is MISSING
        else header_field.default_factory()
    )
    return HeaderLine(key[0] if key else header_field.name, header_field.name, value_type, default)


HEADER_LINES = tuple(_make_header_line(header_field) for header_field in fields(Header))


def collect_header_facts(header: Header) -> dict[str, object]:
    """Return the values of the header lines by key, without those equal to their defaults."""
    pairs = [(line, getattr(header, line.field)) for line in HEADER_LINES]
    return {"dmplay": FORMAT_VERSION} | {
        line.key: value for line, value in pairs if value != line.default
    }

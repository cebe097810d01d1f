"""Transcripts in which one fact is replaced and everything else is made consistent with it."""

import json
from collections.abc import Iterator, Mapping
from copy import deepcopy
from functools import cache
from random import Random
from typing import NamedTuple

from dmplay.transcript.format import EVENT_KEYS, TURN_KEYS
from tests.fuzz.case import GAME_FILE, Case
from tests.fuzz.corpus import list_transcripts
from tests.fuzz.mutations import update_checksum
from tests.fuzz.program import run_dmplay

RELATIVE_TOLERANCE = 1e-6  # within which real numbers are the same fact
UNVERIFIABLE_AGENTS = ("human", "script")  # agents whose actions are recorded only in the file
# end reasons that are recorded only in the file
UNVERIFIABLE_REASONS = ("quit", "interrupted", "illegal", "forfeit")
FACT_KEYS = (*TURN_KEYS, *EVENT_KEYS, "end")
MIN_DRAWS_LINES = 2  # in a game that draws uniforms during its turns, not only before them
ValuePath = tuple[str | int, ...]


class FactLocation(NamedTuple):
    """The location of a value inside a line, which may be replaced."""

    line: int
    path: ValuePath


@cache
def list_valid_transcripts() -> tuple[bytes, ...]:
    """Return the transcripts that verify."""
    words = ("verify", GAME_FILE)
    return tuple(
        raw
        for raw in list_transcripts()
        if run_dmplay(Case(words, {GAME_FILE: raw})).ending == "exit 0"
    )


def draw_changed_fact_case(random: Random) -> Case:
    """Draw a valid transcript in which one fact is replaced."""
    raw = random.choice(list_valid_transcripts())
    rows = raw.decode().split("\n")
    location = random.choice(list(_iter_locations(rows)))
    key, _, value_text = rows[location.line].partition(": ")
    before = json.loads(value_text)
    after = _replace_value_at(
        before, location.path, _draw_other_value(random, _value_at(before, location.path))
    )
    rows[location.line] = f"{key}: {json.dumps(after, ensure_ascii=False)}"
    line = f"line {location.line + 1}, {key}: {value_text} is now {rows[location.line]}"
    words = ("verify", GAME_FILE)
    files = {GAME_FILE: update_checksum("\n".join(rows).encode())}
    return Case(words, files, changed="" if is_same_fact(before, after) else line)


def is_same_fact(first: object, second: object) -> bool:
    """Return whether two values are the same fact."""
    if isinstance(first, bool) or isinstance(second, bool):
        return first is second
    if isinstance(first, int | float) and isinstance(second, int | float):
        return abs(first - second) <= RELATIVE_TOLERANCE * max(1.0, abs(first), abs(second))
    if isinstance(first, list) and isinstance(second, list):
        return len(first) == len(second) and all(map(is_same_fact, first, second))
    if isinstance(first, dict) and isinstance(second, dict):
        return first.keys() == second.keys() and all(
            is_same_fact(first[key], second[key]) for key in first
        )
    return first == second


def _iter_locations(rows: list[str]) -> Iterator[FactLocation]:
    """Yield the location of each fact, and of each input that the seed and the agents determine."""
    seats = next(json.loads(row[7:]) for row in rows if row.startswith("seats: "))
    draws = sum(row.startswith("draws: ") for row in rows)
    for line, row in enumerate(rows):
        key, _, value_text = row.partition(": ")
        if draws and key == "seed":  # without draws, every other seed gives the same game
            yield FactLocation(line, ())
        if key not in FACT_KEYS or (key == "reroll" and draws < MIN_DRAWS_LINES):
            continue
        for path in _iter_paths(json.loads(value_text)):
            is_unverifiable = key == "actions" and path and seats[path[0]] in UNVERIFIABLE_AGENTS
            if not is_unverifiable and (key != "end" or path not in ((), ("sha256",))):
                yield FactLocation(line, path)


def _iter_paths(value: object) -> Iterator[ValuePath]:
    """Yield the path to a value, and to all values inside it."""
    yield ()
    inside: Mapping[str | int, object] = {}
    if isinstance(value, dict | list):
        inside = value if isinstance(value, dict) else dict(enumerate(value))
    for key, item in inside.items():
        yield from ((key, *path) for path in _iter_paths(item))


def _value_at(value: object, path: ValuePath) -> object:
    for key in path:
        value = value[key]  # type: ignore[index] # a path that exists in the value
    return value


def _replace_value_at(value: object, path: ValuePath, new: object) -> object:
    """Return a copy of the value in which the value at this path is replaced."""
    if not path:
        return new
    copied = deepcopy(value)
    _value_at(copied, path[:-1])[path[-1]] = new  # type: ignore[index]
    return copied


def _draw_other_value(random: Random, value: object) -> object:
    """Draw another value, usually of the same type."""
    if random.random() < 0.1:
        return random.choice((None, 0, "", [], {}, True, -1, 1e300))
    if isinstance(value, bool | int | float):
        scale = max(1.0, abs(value))
        return value + random.choice((-1, 1, 2, 1e-4 * scale, -1e-5 * scale, 3e-6 * scale))
    if isinstance(value, str):
        return _change_text(random, value)
    if isinstance(value, list):
        return random.choice(([*value, 0], value[1:], value[::-1], [*value[1:], *value[:1]]))
    assert isinstance(value, dict)
    names = [*value]
    rotated = dict(zip([*names[1:], *names[:1]], value.values(), strict=True))
    return random.choice(({key: value[key] for key in names[1:]}, rotated, {**value, "x": 0}))


def _change_text(random: Random, text: str) -> str:
    if text in UNVERIFIABLE_REASONS:
        return "terminal"
    digits = [at for at, c in enumerate(text) if c.isdigit()]
    if digits and random.random() < 0.7:
        at = random.choice(digits)
        return f"{text[:at]}{(int(text[at]) + random.randint(1, 9)) % 10}{text[at + 1 :]}"
    return random.choice((text.upper(), f"{text} ", text[1:], f"{text}x", text.replace("e", "а")))

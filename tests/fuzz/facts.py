"""Transcripts in which one fact was changed for another value, and all else was made to fit it."""

import json
from collections.abc import Iterator, Mapping
from copy import deepcopy
from functools import cache
from random import Random
from typing import NamedTuple

from dmplay.transcript.format import EVENT_KEYS, TURN_KEYS
from tests.fuzz.case import GAME, Case
from tests.fuzz.corpus import transcripts
from tests.fuzz.mutations import summed
from tests.fuzz.program import dmplay

TOLERANCE = 1e-6  # of the scale, within which real numbers are the same fact
ONLY_TOLD = ("human", "script")  # whose actions only the file can tell
FREE = ("quit", "interrupted", "illegal", "forfeit")  # reasons that only the file can tell
FACTS = (*TURN_KEYS, *EVENT_KEYS, "end")
SOME = 2  # draws of a game in whose turns, and not only before them, something is drawn
Path = tuple[str | int, ...]


class Place(NamedTuple):
    """A value inside a line, which may be changed for another."""

    line: int
    path: Path


@cache
def honest() -> tuple[bytes, ...]:
    """The transcripts that hold."""
    words = ("verify", GAME)
    return tuple(
        raw for raw in transcripts() if dmplay(Case(words, {GAME: raw})).ending == "exit 0"
    )


def changed(random: Random) -> Case:
    """A transcript that held, until one fact was changed."""
    raw = random.choice(honest())
    rows = raw.decode().split("\n")
    where = random.choice(list(_places(rows)))
    key, _, told = rows[where.line].partition(": ")
    before = json.loads(told)
    after = _put(before, where.path, _other(random, _at(before, where.path)))
    rows[where.line] = f"{key}: {json.dumps(after, ensure_ascii=False)}"
    line = f"line {where.line + 1}, {key}: {told} is now {rows[where.line]}"
    words = ("verify", GAME)
    files = {GAME: summed("\n".join(rows).encode())}
    return Case(words, files, changed="" if same(before, after) else line)


def same(one: object, other: object) -> bool:
    """Whether two values are the same fact."""
    if isinstance(one, bool) or isinstance(other, bool):
        return one is other
    if isinstance(one, int | float) and isinstance(other, int | float):
        return abs(one - other) <= TOLERANCE * max(1.0, abs(one), abs(other))
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    return one == other


def _places(rows: list[str]) -> Iterator[Place]:
    """Every value that is a fact, or an input that seed and agents can tell."""
    seats = next(json.loads(row[7:]) for row in rows if row.startswith("seats: "))
    draws = sum(row.startswith("draws: ") for row in rows)
    for line, row in enumerate(rows):
        key, _, told = row.partition(": ")
        if draws and key == "seed":  # where nobody draws, any other is as good
            yield Place(line, ())
        if key not in FACTS or (key == "reroll" and draws < SOME):
            continue
        for path in _paths(json.loads(told)):
            free = key == "actions" and path and seats[path[0]] in ONLY_TOLD
            if not free and (key != "end" or path not in ((), ("sha256",))):
                yield Place(line, path)


def _paths(value: object) -> Iterator[Path]:
    """The way to a value and to all that are inside of it."""
    yield ()
    inside: Mapping[str | int, object] = {}
    if isinstance(value, dict | list):
        inside = value if isinstance(value, dict) else dict(enumerate(value))
    for key, one in inside.items():
        yield from ((key, *path) for path in _paths(one))


def _at(value: object, path: Path) -> object:
    for key in path:
        value = value[key]  # type: ignore[index] # a way that was found in it
    return value


def _put(value: object, path: Path, new: object) -> object:
    """The value with another inside of it."""
    if not path:
        return new
    copied = deepcopy(value)
    _at(copied, path[:-1])[path[-1]] = new  # type: ignore[index]
    return copied


def _other(random: Random, value: object) -> object:
    """Another value of the same kind, or of another."""
    if random.random() < 0.1:
        return random.choice((None, 0, "", [], {}, True, -1, 1e300))
    if isinstance(value, bool | int | float):
        scale = max(1.0, abs(value))
        return value + random.choice((-1, 1, 2, 1e-4 * scale, -1e-5 * scale, 3e-6 * scale))
    if isinstance(value, str):
        return _reworded(random, value)
    if isinstance(value, list):
        return random.choice(([*value, 0], value[1:], value[::-1], [*value[1:], *value[:1]]))
    assert isinstance(value, dict)
    names = [*value]
    moved = dict(zip([*names[1:], *names[:1]], value.values(), strict=True))
    return random.choice(({key: value[key] for key in names[1:]}, moved, {**value, "x": 0}))


def _reworded(random: Random, text: str) -> str:
    if text in FREE:
        return "terminal"
    digits = [at for at, c in enumerate(text) if c.isdigit()]
    if digits and random.random() < 0.7:
        at = random.choice(digits)
        return f"{text[:at]}{(int(text[at]) + random.randint(1, 9)) % 10}{text[at + 1 :]}"
    return random.choice((text.upper(), f"{text} ", text[1:], f"{text}x", text.replace("e", "а")))

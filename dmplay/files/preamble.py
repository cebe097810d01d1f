"""The first lines of a file of Cassandra's format, or of MADP's: what there is, and the start."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmplay.chance import Reals
from dmplay.describe import counted
from dmplay.errors import UnknownName
from dmplay.files.names import Axis, Joint
from dmplay.files.words import Part, Text, is_number, whole

KEYS = ("agents", "discount", "values", "states", "actions", "observations", "start")
ENDS = "E"  # of zmdp's files: states that end a game, which their T: lines say too
LISTS = ("include", "exclude")
VALUES = ("reward", "cost", "rewards", "costs")
SUMS = 1e-3 + 1e-9  # how far from 1 probabilities may sum, as 0.333 0.333 0.333 do
EXACT = 1e-9  # how far they may without being scaled


@dataclass(frozen=True)
class Preamble:
    """What a file says before its arrays."""

    agents: tuple[str, ...]
    discount: float
    cost: bool  # whether its rewards are costs
    states: Axis
    actions: Joint
    observations: Joint | None  # None where states are seen
    start: Reals


@dataclass(frozen=True)
class _Lines:
    """The words after each key, and where the arrays begin."""

    text: Text
    parts: dict[str, Part]
    end: int

    def part(self, key: str, otherwise: str) -> Part:
        """The words after a key; what it would say if it stood there, in the error if not."""
        if key not in self.parts:
            raise self.text.fault(self.end, f"no {key}: {otherwise}")
        return self.parts[key]


def preamble(text: Text, end: int, *, team: bool) -> Preamble:
    """What a file says before its arrays, which begin at `end`; of several agents if a team's."""
    lines = _Lines(text, dict(_parts(text, end)), end)
    agents: tuple[str, ...] = ("agent",)
    if team:
        agents = _agents(lines.part("agents", "line; a .dpomdp names its agents, or how many"))
    elif "agents" in lines.parts:
        raise lines.parts["agents"].fault(0, "agents: are for a .dpomdp; expected one agent")
    states = Axis.told("state", lines.part("states", "line; a file names its states"))
    actions = _each("action", lines.part("actions", "line; a file names its actions"), len(agents))
    seen = lines.parts.get("observations")
    if team and seen is None:
        lines.part("observations", "line; a .dpomdp names what each agent observes")
    observations = _each("observation", seen, len(agents)) if seen else None
    if ENDS in lines.parts:
        states.marked(lines.parts[ENDS])
    discount = lines.part("discount", "line; expected a number from 0 to 1")
    return Preamble(
        agents,
        float(discount.probabilities(1)[0]),
        _cost(lines),
        states,
        actions,
        observations,
        _start(lines, states),
    )


def _parts(text: Text, end: int) -> Iterator[tuple[str, Part]]:
    """The words after each key before the arrays; raises BadFile for what is no key."""
    part = Part.between(text, 0, end)
    words = part.words
    colons = [number for number, word in enumerate(words) if word == ":"]
    keys = [n - 1 - (n > 1 and words[n - 1] in LISTS) for n in colons]
    if not words:
        return
    if keys[:1] != [0]:
        raise part.fault(0, UnknownName("word", words[0], KEYS))
    known: set[str] = set()
    for first, colon, last in zip(keys, colons, [*keys[1:], len(words)], strict=True):
        if words[first] not in (*KEYS, ENDS) or (colon - first > 1 and words[first] != "start"):
            raise part.fault(first, UnknownName("word", words[first], KEYS))
        if words[first] in known:
            raise part.fault(first, f"{words[first]}: stands here twice")
        known.add(words[first])
        yield words[first], part.slice(colon + 1, last)
        if colon - first > 1:
            yield words[first + 1], part.slice(colon + 1, last)


def _agents(part: Part) -> tuple[str, ...]:
    """The names of the agents."""
    names = Axis.told("agent", part).names
    return tuple(f"agent{n + 1}" for n in range(len(names))) if whole(names[0]) == 0 else names


def _each(what: str, part: Part, agents: int) -> Joint:
    """The sets of all agents, a line each where there are several."""
    lines = [part] if agents == 1 else part.lines()
    if len(lines) != agents:
        told = f"got {counted(len(lines), 'line')} of {what}s"
        raise part.fault(0, f"{told}, expected one for each agent: {agents}")
    return Joint([Axis.told(what, line) for line in lines])


def _cost(lines: _Lines) -> bool:
    """Whether rewards are costs."""
    told = lines.parts.get("values")
    return told is not None and told.one_of("kind of values", VALUES).startswith("cost")


def _start(lines: _Lines, states: Axis) -> Reals:
    """The distribution of the first state `[S]`: uniform unless told."""
    part, many = lines.parts.get("start"), len(states)
    if part is None or list(part.words) == ["uniform"]:
        return np.full(many, 1.0 / many)
    listed = [key for key in LISTS if key in lines.parts]
    named = bool(part.words) and not is_number(part.words[0])
    if not (listed or named) and (len(part.words) != 1 or many == 1):
        return _scaled(part, part.probabilities(many))
    chosen = states.marked(part)
    chosen ^= listed == ["exclude"]
    if not chosen.any():
        raise part.fault(0, "got every state, expected one at least that is left")
    return np.asarray(chosen / chosen.sum())


def _scaled(part: Part, p: Reals) -> Reals:
    if abs(p.sum() - 1) > SUMS:
        raise part.fault(0, f"got probabilities that sum to {p.sum():g}, not 1")
    return p if abs(p.sum() - 1) <= EXACT else np.asarray(p / p.sum())

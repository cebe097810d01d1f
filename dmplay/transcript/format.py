"""The golden format: a game as text that people read and programs check to the last number.

    dmplay: 1                                       a header,
    problem: "hexworld"
    seats: {"agent": "human"}
    seed: 7

    turn: 0                                         a block a turn: the inputs,
    draws: [0.625095466]
    state: "(7,2)"                                  then the facts that follow from them

    turn: 1
    actions: {"agent": "e"}
    draws: [0.897213801]
    state: "(8,1)"
    rewards: {"agent": 0}
    | a frame, if wanted                            and what the screen showed

    end: {"reason": "quit", "turns": 1, "return": {"agent": 0}, "total": {"agent": 0}, ...}

Lines that begin with `# ` are notes: anybody may add them, nothing checks them.
"""

import hashlib
import json
import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from typing import NamedTuple

from dmplay.chance import Array
from dmplay.core import NOTHING_YET, Problem, raw
from dmplay.session import LONGEST_LIST, MOST_TURNS, Session, Turn, believed

PERSON, MODEL = "human", "mcp"  # who plays from outside: a language model is one
PLAYERS = (PERSON, MODEL)
DIGITS = 10  # significant, of a fact that is a real number
NATURAL = ("terminal", "horizon", "turn limit")  # ends that the game itself comes to
NOTE = re.compile(r"^#.*\n", re.MULTILINE)
CHOSEN = ("quit", "interrupted", "illegal", "forfeit")
JSON = json.JSONEncoder(ensure_ascii=False)
BACK = ("undo", "reroll")  # what takes turns back
EVENTS = (*BACK, "help")
MOST_KNOWN = 4096  # lines that are remembered, to be read or written again

Frame = Callable[[Session], str]
Numbers = float | list[float] | list["Numbers"]


def turn_limit(problem: Problem, seats: Collection[str], turns: int | None) -> int | None:
    """The limit of a game: what was asked for; 10,000 where nothing and nobody else ends it."""
    if turns is None and problem.horizon is None and problem.endless and PERSON not in seats:
        return MOST_TURNS
    return turns


def number(value: float) -> float:
    """A real number as a fact: whole if it is, else cut to ten significant digits."""
    if value % 1 == 0 and abs(value) < 10**DIGITS:
        return int(value)
    short = float(f"{value:.{DIGITS}g}")
    return int(short) if short.is_integer() and abs(short) < 10**DIGITS else short


def _numbers(values: Numbers) -> object:
    return [*map(_numbers, values)] if isinstance(values, list) else number(values)


def _by_seat(problem: Problem, values: Array) -> dict[str, object]:
    told = zip(problem.agents, values.tolist(), strict=True)
    return {agent: _numbers(value) for agent, value in told}


class Fact(NamedTuple):
    """A line of a turn: what it tells of, where there is anything to tell, and how it tells it."""

    of: Callable[[Session], Array | None]
    told: Callable[[Problem, Array], object]


def _actions(problem: Problem, done: Array) -> object:
    did = zip(problem.agents, problem.actions, done.tolist(), strict=True)
    return {agent: known.fact(action) for agent, known, action in did}


def _draws(session: Session) -> Array | None:
    draws = session.turns[-1].draws if session.turns else session.opening
    return draws if len(draws) else None


def _stated(session: Session) -> Array | None:
    """The state, where there is anything to tell of it."""
    state = session.state
    quiet = session.problem.states == 1 or (state.dtype == object and not _line(session))
    return None if quiet else state


def _line(session: Session) -> str:
    return session.problem.line(session.state)


def _state(problem: Problem, state: Array) -> object:
    return _numbers(state.tolist()) if state.dtype.kind == "f" else problem.line(state)


def _observations(problem: Problem, observed: Array) -> object:
    seen = zip(problem.agents, problem.observations, observed, strict=True)
    told = ((agent, kind.fact(o)) for agent, kind, o in seen if kind.told(o) != NOTHING_YET)
    return {agent: fact if isinstance(fact, str) else _numbers(fact) for agent, fact in told}


def _observed(session: Session) -> Array | None:
    """What was seen in the last turn, or before the first, where anything was."""
    problem = session.problem
    if session.turns or not problem.hidden:
        return session.turns[-1].observations if problem.hidden else None
    first: Array = problem.first(session.first[None])[0]
    return first if _observations(problem, first) else None


def _belief(session: Session) -> Array | None:
    return session.beliefs() if believed(session.problem) <= LONGEST_LIST else None


FACTS: Mapping[str, Fact] = {  # the lines of a turn after its number, in order
    "actions": Fact(lambda game: game.turns[-1].actions if game.turns else None, _actions),
    "draws": Fact(_draws, lambda _, draws: draws.tolist()),
    "state": Fact(_stated, _state),
    "observations": Fact(_observed, _observations),
    "rewards": Fact(lambda game: game.turns[-1].rewards if game.turns else None, _by_seat),
    "belief": Fact(_belief, _by_seat),
}
TURN = ("turn", *FACTS)


def turn_facts(session: Session) -> dict[str, object]:
    """The lines of the last turn, or of the opening."""
    every = [(key, fact.told, fact.of(session)) for key, fact in FACTS.items()]
    problem = session.problem
    facts = {key: told(problem, array) for key, told, array in every if array is not None}
    return {"turn": len(session.turns), **facts}


class Writer:
    """Writes the turns of a session; most facts come again, and are not put into words anew."""

    def __init__(self, session: Session) -> None:
        self._session, problem = session, session.problem
        self.plain = believed(problem) > LONGEST_LIST  # a turn alone says all that is told of it
        silent = {
            "draws": not problem.draws.step,
            "state": problem.states == 1,
            "observations": not problem.hidden,
        }
        self._told = [key for key in Turn._fields if not silent.get(key)]
        self._known: dict[str, dict[tuple[str, bytes], str]] = {key: {} for key in TURN}

    def turn(self) -> list[str]:
        """The lines of the last turn, or of the opening, as `turn_facts` has them."""
        session = self._session
        if not session.turns:
            return lines(turn_facts(session))
        last, rows = session.turns[-1], [f"turn: {len(session.turns)}"]
        for key in self._told:
            array = getattr(last, key)
            if array.dtype.kind != "O" or key != "state" or session.problem.line(array):
                rows.append(self._row(key, array, raw(array)))
        if not self.plain:
            beliefs = session.beliefs()
            rows.append(self._row("belief", beliefs, raw(beliefs)))
        return rows

    def turns(self, turns: Turn) -> str:
        """The blocks of the next turns `[T, ...]`, where each alone says all that is told of it."""
        columns = [self._rows(key, getattr(turns, key)) for key in self._told]
        every = zip(self._session.numbers(len(turns.state)), *columns, strict=True)
        return "".join([text([f"turn: {turn}", *rows]) for turn, *rows in every])

    def _rows(self, key: str, values: Array) -> Iterator[str]:
        """The line of each of some values `[T, ...]` of a fact."""
        every, size = raw(values), values.nbytes // len(values)
        for place, value in enumerate(values):
            yield self._row(key, value, every[place * size : (place + 1) * size])

    def _row(self, key: str, value: Array, told: bytes) -> str:
        """The line of a fact, by its bytes."""
        if key == "draws":  # which hardly come again
            return f"draws: {value.tolist()}"
        known, fact = self._known[key], (value.dtype.char, told)
        row = known.get(fact)
        if row is None:
            row = f"{key}: {written(FACTS[key].told(self._session.problem, value))}"
            if len(known) < MOST_KNOWN and value.dtype.kind != "O":  # of which these are places
                known[fact] = row
        return row


def end_facts(session: Session) -> dict[str, object]:
    """The end line without its checksum."""
    told: dict[str, object] = {
        "reason": session.ending,
        "turns": len(session.turns),
        "return": _by_seat(session.problem, session.returns()),
        "total": _by_seat(session.problem, session.totals()),
    }
    return told | ({"help": dict(session.help)} if session.help else {})


def closing(session: Session, digest: str) -> list[str]:
    """The end line, with the checksum of what stands above it."""
    return lines({"end": end_facts(session) | {"sha256": digest}})


def lines(facts: Mapping[str, object]) -> list[str]:
    """The lines of a block, without the empty one that ends it."""
    return [f"{key}: {written(value)}" for key, value in facts.items()]


def framed(rows: list[str], frame: str) -> list[str]:
    """The lines of a block with its frame under them."""
    return rows + [f"| {line}".rstrip() for line in frame.split("\n") if frame]


def written(value: object) -> str:
    """A fact as JSON writes it; most are so short that to set up an encoder would cost more."""
    if isinstance(value, dict):
        return "{" + ", ".join([f"{JSON.encode(k)}: {written(v)}" for k, v in value.items()]) + "}"
    if isinstance(value, list):
        return "[" + ", ".join([*map(written, value)]) + "]"
    if type(value) is int or (type(value) is float and math.isfinite(value)):
        return repr(value)
    return JSON.encode(value)


def text(block: list[str]) -> str:
    """A block as it is written: its lines and an empty one."""
    return "\n".join([*block, "", ""])


def checksum(content: str) -> str:
    """SHA-256 of every line but the notes, in short."""
    return short(hashlib.sha256(without_notes(content).encode()))


def short(digest: "hashlib._Hash") -> str:
    """A checksum as the end line has it: the first 16 hexadecimal digits."""
    return digest.hexdigest()[:16]


def without_notes(content: str) -> str:
    """The lines that a checksum covers."""
    return NOTE.sub("", content)

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
import re
from collections.abc import Callable, Collection, Mapping

import numpy as np

from dmplay.chance import Array
from dmplay.core import Problem
from dmplay.rollouts import MOST_TURNS
from dmplay.session import LONGEST_LIST, Session, believed

PERSON = "human"
DIGITS = 10  # significant, of a fact that is a real number
NATURAL = ("terminal", "horizon", "turn limit")  # ends that the game itself comes to
NOTE = re.compile(r"^#.*\n", re.MULTILINE)
CHOSEN = ("quit", "interrupted", "illegal", "forfeit")
JSON = json.JSONEncoder(ensure_ascii=False)
BACK = ("undo", "reroll")  # what takes turns back
EVENTS = (*BACK, "help")

Frame = Callable[[Session], str]


def turn_limit(problem: Problem, seats: Collection[str], turns: int | None) -> int | None:
    """The limit of a game: what was asked for; without it 10,000 where no person sits."""
    if turns is not None or problem.horizon is not None or PERSON in seats:
        return turns
    return MOST_TURNS


def number(value: float) -> float:
    """A real number as a fact: whole if it is, else cut to ten significant digits."""
    short = float(f"{value:.{DIGITS}g}")
    return int(short) if short.is_integer() and abs(short) < 10**DIGITS else short


def _numbers(values: Array) -> object:
    if values.ndim == 0:
        return number(values.item())
    return [_numbers(value) for value in values]


def _by_seat(problem: Problem, values: Array) -> dict[str, object]:
    return {name: _numbers(value) for name, value in zip(problem.agents, values, strict=True)}


def _actions(session: Session) -> object:
    if not session.turns:
        return None
    problem = session.problem
    did = zip(problem.agents, problem.actions, session.turns[-1].actions, strict=True)
    return {agent: known.fact(action) for agent, known, action in did}


def _draws(session: Session) -> object:
    draws = session.turns[-1].draws if session.turns else session.opening
    return draws.tolist() or None


def _state(session: Session) -> object:
    if session.problem.states == 1:
        return None
    real = np.issubdtype(session.state.dtype, np.floating)
    return _numbers(session.state) if real else session.problem.notation(session.state)


def _observations(session: Session) -> object:
    problem = session.problem
    if not session.turns or not problem.hidden:
        return None
    seen = zip(problem.agents, problem.observations, session.turns[-1].observations, strict=True)
    return {agent: labels[o] for agent, labels, o in seen}


def _rewards(session: Session) -> object:
    return _by_seat(session.problem, session.turns[-1].rewards) if session.turns else None


def _belief(session: Session) -> object:
    short = believed(session.problem) <= LONGEST_LIST
    return _by_seat(session.problem, session.beliefs()[-1]) if short else None


TURN: Mapping[str, Callable[[Session], object]] = {  # the lines of a turn, in order
    "turn": lambda session: len(session.turns),
    "actions": _actions,
    "draws": _draws,
    "state": _state,
    "observations": _observations,
    "rewards": _rewards,
    "belief": _belief,
}


def turn_facts(session: Session) -> dict[str, object]:
    """The lines of the last turn, or of the opening."""
    facts = {key: told(session) for key, told in TURN.items()}
    return {key: value for key, value in facts.items() if value is not None}


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


def lines(facts: Mapping[str, object], frame: str = "") -> list[str]:
    """The lines of a block, without the empty one that ends it."""
    keyed = [f"{key}: {JSON.encode(value)}" for key, value in facts.items()]
    return keyed + [f"| {line}".rstrip() for line in frame.split("\n") if frame]


def text(block: list[str]) -> str:
    """A block as it is written: its lines and an empty one."""
    return "\n".join([*block, "", ""])


def checksum(content: str) -> str:
    """SHA-256 of every line but the notes, the first 16 hexadecimal digits."""
    return hashlib.sha256(without_notes(content).encode()).hexdigest()[:16]


def without_notes(content: str) -> str:
    """The lines that a checksum covers."""
    return NOTE.sub("", content)

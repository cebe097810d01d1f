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
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from dmplay.chance import Array
from dmplay.core import Problem
from dmplay.rollouts import MOST_TURNS
from dmplay.session import LONGEST_LIST, Session, believed

VERSION = 1
PERSON = "human"
DIGITS = 10  # significant, of a fact that is a real number
TOLERANCE = 1e-6  # of its scale
NATURAL = ("terminal", "horizon", "turn limit")  # ends that the game itself comes to
CHOSEN = ("quit", "interrupted", "illegal", "forfeit")

Frame = Callable[[Session], str]


@dataclass(frozen=True)
class Header:
    """What game it is and who sat there."""

    problem: str
    seats: Mapping[str, str]
    seed: int
    parameters: Mapping[str, object] = field(default_factory=dict)  # that differ from the default
    episode: int = 0
    turns: int | None = None  # a turn limit other than the problem's horizon
    strict: bool = False  # nothing is taken back
    reveal: bool = False  # the players saw what is hidden


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


def header_facts(header: Header) -> dict[str, object]:
    """The header's lines."""
    facts: dict[str, object] = {"dmplay": VERSION, "problem": header.problem}
    if header.parameters:
        facts["set"] = dict(header.parameters)
    facts |= {"seats": dict(header.seats), "seed": header.seed}
    if header.episode:
        facts["episode"] = header.episode
    if header.turns is not None:
        facts["turns"] = header.turns
    rules = {"strict": header.strict, "reveal": header.reveal}
    return facts | {rule: True for rule, holds in rules.items() if holds}


def turn_facts(session: Session) -> dict[str, object]:
    """The lines of the last turn, or of the opening."""
    problem = session.problem
    turns = session.turns
    facts: dict[str, object] = {"turn": len(turns)}
    if turns:
        did = zip(problem.agents, problem.actions, turns[-1].actions, strict=True)
        facts["actions"] = {agent: known.fact(action) for agent, known, action in did}
    draws = turns[-1].draws if turns else session.opening
    if len(draws):
        facts["draws"] = draws.tolist()
    if problem.states != 1:
        state = session.state
        real = np.issubdtype(state.dtype, np.floating)
        facts["state"] = _numbers(state) if real else problem.notation(state)
    if turns and problem.hidden:
        seen = zip(problem.agents, problem.observations, turns[-1].observations, strict=True)
        facts["observations"] = {agent: labels[o] for agent, labels, o in seen}
    if turns:
        facts["rewards"] = _by_seat(problem, turns[-1].rewards)
    if believed(problem) <= LONGEST_LIST:
        facts["belief"] = _by_seat(problem, session.beliefs()[-1])
    return facts


def end_facts(session: Session) -> dict[str, object]:
    """The end line without its checksum."""
    return {
        "reason": session.ending,
        "turns": len(session.turns),
        "return": _by_seat(session.problem, session.returns()),
        "total": _by_seat(session.problem, session.totals()),
    }


def lines(facts: Mapping[str, object], frame: str = "") -> list[str]:
    """The lines of a block, without the empty one that ends it."""
    keyed = [f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in facts.items()]
    return keyed + [f"| {line}".rstrip() for line in frame.split("\n") if frame]


def text(block: list[str]) -> str:
    """A block as it is written: its lines and an empty one."""
    return "\n".join([*block, "", ""])


def checksum(content: str) -> str:
    """SHA-256 of every line but the notes, the first 16 hexadecimal digits."""
    return hashlib.sha256(without_notes(content).encode()).hexdigest()[:16]


def without_notes(content: str) -> str:
    """The lines that a checksum covers."""
    return "\n".join(line for line in content.split("\n") if not line.startswith("#"))

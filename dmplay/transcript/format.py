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
from dmplay.core import NO_OBSERVATION_TEXT, Problem, array_bytes
from dmplay.session import DEFAULT_TURN_LIMIT, MAX_LISTED_STATES, Session, Turn, belief_size

HUMAN_PLAYER, MODEL_PLAYER = "human", "mcp"  # who plays from outside: a language model is one
EXTERNAL_PLAYERS = (HUMAN_PLAYER, MODEL_PLAYER)
SIGNIFICANT_DIGITS = 10  # significant, of a fact that is a real number
NATURAL_END_REASONS = ("terminal", "horizon", "turn limit")  # ends that the game itself comes to
NOTE_PATTERN = re.compile(r"^#.*\n", re.MULTILINE)
PLAYER_END_REASONS = ("quit", "interrupted", "illegal", "forfeit")
JSON_ENCODER = json.JSONEncoder(ensure_ascii=False)
TAKE_BACK_EVENTS = ("undo", "reroll")  # what takes turns back
EVENT_KEYS = (*TAKE_BACK_EVENTS, "help")
MAX_CACHED_LINES = 4096  # lines that are remembered, to be read or written again

FrameRenderer = Callable[[Session], str]
NestedNumbers = float | list[float] | list["NestedNumbers"]


def resolve_turn_limit(
    problem: Problem, seats: Collection[str], requested_turns: int | None
) -> int | None:
    """The limit of a game: what was asked for; 10,000 where nothing and nobody else ends it."""
    if (
        requested_turns is None
        and problem.horizon is None
        and problem.can_run_forever
        and HUMAN_PLAYER not in seats
    ):
        return DEFAULT_TURN_LIMIT
    return requested_turns


def round_number(value: float) -> float:
    """A real number as a fact: whole if it is, else cut to ten significant digits."""
    if value % 1 == 0 and abs(value) < 10**SIGNIFICANT_DIGITS:
        return int(value)
    short = float(f"{value:.{SIGNIFICANT_DIGITS}g}")
    return int(short) if short.is_integer() and abs(short) < 10**SIGNIFICANT_DIGITS else short


def _round_numbers(values: NestedNumbers) -> object:
    return [*map(_round_numbers, values)] if isinstance(values, list) else round_number(values)


def _round_by_agent(problem: Problem, values: Array) -> dict[str, object]:
    told = zip(problem.agents, values.tolist(), strict=True)
    return {agent: _round_numbers(value) for agent, value in told}


class TurnFact(NamedTuple):
    """A line of a turn: what it tells of, where there is anything to tell, and how it tells it."""

    extract: Callable[[Session], Array | None]
    to_json: Callable[[Problem, Array], object]


def _actions_to_json(problem: Problem, actions: Array) -> object:
    did = zip(problem.agents, problem.actions, actions.tolist(), strict=True)
    return {agent: known.to_json_value(action) for agent, known, action in did}


def _extract_uniforms(session: Session) -> Array | None:
    draws = session.turns[-1].uniforms if session.turns else session.initial_uniforms
    return draws if len(draws) else None


def _extract_state(session: Session) -> Array | None:
    """The state, where there is anything to tell of it."""
    state = session.state
    quiet = session.problem.state_count == 1 or (
        state.dtype == object and not _format_state_line(session)
    )
    return None if quiet else state


def _format_state_line(session: Session) -> str:
    return session.problem.format_transcript_state(session.state)


def _state_to_json(problem: Problem, state: Array) -> object:
    return (
        _round_numbers(state.tolist())
        if state.dtype.kind == "f"
        else problem.format_transcript_state(state)
    )


def _observations_to_json(problem: Problem, observations: Array) -> object:
    seen = zip(problem.agents, problem.observations, observations, strict=True)
    told = (
        (agent, kind.to_json_value(o))
        for agent, kind, o in seen
        if kind.format_observation(o) != NO_OBSERVATION_TEXT
    )
    return {agent: fact if isinstance(fact, str) else _round_numbers(fact) for agent, fact in told}


def _extract_observations(session: Session) -> Array | None:
    """What was seen in the last turn, or before the first, where anything was."""
    problem = session.problem
    if session.turns or not problem.partially_observable:
        return session.turns[-1].observations if problem.partially_observable else None
    first: Array = problem.initial_observations(session.initial_state[None])[0]
    return first if _observations_to_json(problem, first) else None


def _extract_belief(session: Session) -> Array | None:
    return session.current_beliefs() if belief_size(session.problem) <= MAX_LISTED_STATES else None


TURN_FACTS: Mapping[str, TurnFact] = {  # the lines of a turn after its number, in order
    "actions": TurnFact(
        lambda game: game.turns[-1].actions if game.turns else None, _actions_to_json
    ),
    "draws": TurnFact(_extract_uniforms, lambda _, draws: draws.tolist()),
    "state": TurnFact(_extract_state, _state_to_json),
    "observations": TurnFact(_extract_observations, _observations_to_json),
    "rewards": TurnFact(
        lambda game: game.turns[-1].rewards if game.turns else None, _round_by_agent
    ),
    "belief": TurnFact(_extract_belief, _round_by_agent),
}
TURN_KEYS = ("turn", *TURN_FACTS)
FIELDS_BY_FACT = {"draws" if name == "uniforms" else name: name for name in Turn._fields}


def collect_turn_facts(session: Session) -> dict[str, object]:
    """The lines of the last turn, or of the opening."""
    every = [(key, fact.to_json, fact.extract(session)) for key, fact in TURN_FACTS.items()]
    problem = session.problem
    facts = {key: told(problem, array) for key, told, array in every if array is not None}
    return {"turn": len(session.turns), **facts}


class TurnFormatter:
    """Writes the turns of a session; most facts come again, and are not put into words anew."""

    def __init__(self, session: Session) -> None:
        self._session, problem = session, session.problem
        self.omits_belief = (
            belief_size(problem) > MAX_LISTED_STATES
        )  # a turn alone says all that is told of it
        silent = {
            "draws": not problem.uniform_counts.step,
            "state": problem.state_count == 1,
            "observations": not problem.partially_observable,
        }
        self._fact_keys = [key for key in FIELDS_BY_FACT if not silent.get(key)]
        self._cached_lines: dict[str, dict[tuple[str, bytes], str]] = {key: {} for key in TURN_KEYS}

    def format_turn(self) -> list[str]:
        """The lines of the last turn, or of the opening, as `turn_facts` has them."""
        session = self._session
        if not session.turns:
            return format_lines(collect_turn_facts(session))
        last, rows = session.turns[-1], [f"turn: {len(session.turns)}"]
        for key in self._fact_keys:
            array = getattr(last, FIELDS_BY_FACT[key])
            if (
                array.dtype.kind != "O"
                or key != "state"
                or session.problem.format_transcript_state(array)
            ):
                rows.append(self._format_value_line(key, array, array_bytes(array)))
        if not self.omits_belief:
            beliefs = session.current_beliefs()
            rows.append(self._format_value_line("belief", beliefs, array_bytes(beliefs)))
        return rows

    def format_turns(self, turns: Turn) -> str:
        """The blocks of the next turns `[T, ...]`, where each alone says all that is told of it."""
        columns = [
            self._iter_value_lines(key, getattr(turns, FIELDS_BY_FACT[key]))
            for key in self._fact_keys
        ]
        every = zip(self._session.next_turn_numbers(len(turns.state)), *columns, strict=True)
        return "".join([join_block([f"turn: {turn}", *rows]) for turn, *rows in every])

    def _iter_value_lines(self, key: str, values: Array) -> Iterator[str]:
        """The line of each of some values `[T, ...]` of a fact."""
        every, size = array_bytes(values), values.nbytes // len(values)
        for place, value in enumerate(values):
            yield self._format_value_line(key, value, every[place * size : (place + 1) * size])

    def _format_value_line(self, key: str, value: Array, raw_bytes: bytes) -> str:
        """The line of a fact, by its bytes."""
        if key == "draws":  # which hardly come again
            return f"draws: {value.tolist()}"
        known, fact = self._cached_lines[key], (value.dtype.char, raw_bytes)
        row = known.get(fact)
        if row is None:
            row = f"{key}: {encode_json(TURN_FACTS[key].to_json(self._session.problem, value))}"
            if (
                len(known) < MAX_CACHED_LINES and value.dtype.kind != "O"
            ):  # of which these are places
                known[fact] = row
        return row


def collect_end_facts(session: Session) -> dict[str, object]:
    """The end line without its checksum."""
    told: dict[str, object] = {
        "reason": session.end_reason,
        "turns": len(session.turns),
        "return": _round_by_agent(session.problem, session.returns()),
        "total": _round_by_agent(session.problem, session.total_rewards()),
    }
    return told | ({"help": dict(session.hint_counts)} if session.hint_counts else {})


def format_end_block(session: Session, digest: str) -> list[str]:
    """The end line, with the checksum of what stands above it."""
    return format_lines({"end": collect_end_facts(session) | {"sha256": digest}})


def format_lines(facts: Mapping[str, object]) -> list[str]:
    """The lines of a block, without the empty one that ends it."""
    return [f"{key}: {encode_json(value)}" for key, value in facts.items()]


def append_frame(rows: list[str], frame: str) -> list[str]:
    """The lines of a block with its frame under them."""
    return rows + [f"| {line}".rstrip() for line in frame.split("\n") if frame]


def encode_json(value: object) -> str:
    """A fact as JSON writes it; most are so short that to set up an encoder would cost more."""
    if isinstance(value, dict):
        return (
            "{"
            + ", ".join([f"{JSON_ENCODER.encode(k)}: {encode_json(v)}" for k, v in value.items()])
            + "}"
        )
    if isinstance(value, list):
        return "[" + ", ".join([*map(encode_json, value)]) + "]"
    if type(value) is int or (type(value) is float and math.isfinite(value)):
        return repr(value)
    return JSON_ENCODER.encode(value)


def join_block(block: list[str]) -> str:
    """A block as it is written: its lines and an empty one."""
    return "\n".join([*block, "", ""])


def compute_checksum(content: str) -> str:
    """SHA-256 of every line but the notes, in short."""
    return shorten_digest(hashlib.sha256(strip_notes(content).encode()))


def shorten_digest(digest: "hashlib._Hash") -> str:
    """A checksum as the end line has it: the first 16 hexadecimal digits."""
    return digest.hexdigest()[:16]


def strip_notes(content: str) -> str:
    """The lines that a checksum covers."""
    return NOTE_PATTERN.sub("", content)

"""The transcript format: a game as text that people read and programs verify exactly.

    dmplay: 1                                       a header,
    problem: "hexworld"
    seats: {"agent": "human"}
    seed: 7

    turn: 0                                         a block for each turn: the inputs,
    draws: [0.625095466]
    state: "(7,2)"                                  then the facts that follow from them

    turn: 1
    actions: {"agent": "e"}                         (and `stated`: beliefs that players stated)
    draws: [0.897213801]
    state: "(8,1)"
    rewards: {"agent": 0}
    | a frame, if frames are recorded               and the contents of the screen

    end: {"reason": "quit", "turns": 1, "return": {"agent": 0}, "total": {"agent": 0}, ...}

Lines that begin with `# ` are notes: anyone may add them, and nothing checks them.
"""

import hashlib
import json
import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, array_bytes
from dmplay.core.problem import Problem
from dmplay.core.session import (
    DEFAULT_TURN_LIMIT,
    MAX_LISTED_STATES,
    Session,
    Turn,
    belief_size,
    number_next_turns,
)
from dmplay.core.spaces import NO_OBSERVATION_TEXT
from dmplay.transcript.external_players import HUMAN_PLAYER

SIGNIFICANT_DIGITS = 10  # of a fact that is a real number
NATURAL_END_REASONS = ("terminal", "horizon", "turn limit")  # a game reaches these ends by itself
NOTE_PATTERN = re.compile(r"^#.*\n", re.MULTILINE)
PLAYER_END_REASONS = ("quit", "interrupted", "illegal", "forfeit")
JSON_ENCODER = json.JSONEncoder(ensure_ascii=False)
REPEATED_UNIFORMS_PREFIX = "# again: "  # of a note; older versions wrote another text after it
TAKE_BACK_EVENTS = ("undo", "reroll")  # events that take back turns
EVENT_KEYS = (*TAKE_BACK_EVENTS, "help")
MAX_CACHED_LINES = 4096  # lines that are cached when they are read or written

FrameRenderer = Callable[[Session], str]
NestedNumbers = float | list[float] | list["NestedNumbers"]


def resolve_turn_limit(
    problem: Problem, seats: Collection[str], requested_turns: int | None
) -> int | None:
    """Return the turn limit of a game: the requested one, or 10,000 if nothing else ends it.

    The default applies if the problem has no horizon and can run forever, and no human plays.
    """
    if (
        requested_turns is None
        and problem.horizon is None
        and problem.can_run_forever
        and HUMAN_PLAYER not in seats
    ):
        return DEFAULT_TURN_LIMIT
    return requested_turns


def round_number(value: float) -> float:
    """Return a real number as a fact: whole if it is, else with ten significant digits."""
    if value % 1 == 0 and abs(value) < 10**SIGNIFICANT_DIGITS:
        return int(value)
    rounded = float(f"{value:.{SIGNIFICANT_DIGITS}g}")
    return (
        int(rounded) if rounded.is_integer() and abs(rounded) < 10**SIGNIFICANT_DIGITS else rounded
    )


def _round_numbers(values: NestedNumbers) -> object:
    """Return nested lists of numbers with every number rounded."""
    return [*map(_round_numbers, values)] if isinstance(values, list) else round_number(values)


def _round_by_agent(problem: Problem, values: Array) -> dict[str, object]:
    """Return a rounded value for each agent, by the agents' names."""
    pairs = zip(problem.agents, values.tolist(), strict=True)
    return {agent: _round_numbers(value) for agent, value in pairs}


class TurnFact(NamedTuple):
    """A line of a turn, as two functions: from session to array or None, and from array to JSON."""

    extract: Callable[[Session], Array | None]
    to_json: Callable[[Problem, Array], object]


def _actions_to_json(problem: Problem, actions: Array) -> object:
    """Return a joint action as JSON values, by the agents' names."""
    joint_action = zip(problem.agents, problem.actions, actions.tolist(), strict=True)
    return {agent: space.to_json_value(action) for agent, space, action in joint_action}


def _extract_stated_beliefs(session: Session) -> Array | None:
    """Return the beliefs `[n, S]` stated in the last turn, NaN for none; None if all are."""
    stated = session.turns[-1].stated_beliefs if session.turns else {}
    if not stated:
        return None
    size = len(next(iter(stated.values())))
    seats = range(len(session.problem.agents))
    return np.array([stated.get(seat, np.full(size, np.nan)) for seat in seats])


def _stated_beliefs_to_json(problem: Problem, beliefs: Array) -> object:
    """Return the beliefs that were stated as lists, by the agents' names."""
    pairs = zip(problem.agents, beliefs.tolist(), strict=True)
    return {agent: _round_numbers(row) for agent, row in pairs if not math.isnan(row[0])}


def _extract_uniforms(session: Session) -> Array | None:
    """Return the uniforms of the last turn or of the start; None if there are none."""
    uniforms = session.turns[-1].uniforms if session.turns else session.initial_uniforms
    return uniforms if len(uniforms) else None


def _extract_state(session: Session) -> Array | None:
    """Return the current state; None if a transcript writes nothing about it."""
    state = session.state
    is_omitted = session.problem.state_count == 1 or (
        state.dtype == object and not session.problem.format_transcript_state(session.state)
    )
    return None if is_omitted else state


def _state_to_json(problem: Problem, state: Array) -> object:
    """Return a state as a JSON value: rounded numbers, or text."""
    if state.dtype.kind == "f":
        return _round_numbers(state.tolist())
    return problem.format_transcript_state(state)


def _observations_to_json(problem: Problem, observations: Array) -> object:
    """Return the observations that have a text as JSON values, by the agents' names."""
    observed_rows = zip(problem.agents, problem.observations, observations, strict=True)
    facts = (
        (agent, space.to_json_value(o))
        for agent, space, o in observed_rows
        if space.format_observation(o) != NO_OBSERVATION_TEXT
    )
    return {agent: fact if isinstance(fact, str) else _round_numbers(fact) for agent, fact in facts}


def _extract_observations(session: Session) -> Array | None:
    """Return the observations of the last turn or of the start; None if there are none."""
    problem = session.problem
    if session.turns or not problem.partially_observable:
        return session.turns[-1].observations if problem.partially_observable else None
    initial_observations: Array = problem.initial_observations(session.initial_state[None])[0]
    return initial_observations if _observations_to_json(problem, initial_observations) else None


def _extract_belief(session: Session) -> Array | None:
    """Return the current beliefs; None if there are none, or too many states to list."""
    return session.current_beliefs() if belief_size(session.problem) <= MAX_LISTED_STATES else None


TURN_FACTS: Mapping[str, TurnFact] = {  # the lines of a turn after its number, in order
    "actions": TurnFact(
        lambda game: game.turns[-1].actions if game.turns else None, _actions_to_json
    ),
    "stated": TurnFact(_extract_stated_beliefs, _stated_beliefs_to_json),
    "draws": TurnFact(_extract_uniforms, lambda _, draws: draws.tolist()),
    "state": TurnFact(_extract_state, _state_to_json),
    "observations": TurnFact(_extract_observations, _observations_to_json),
    "rewards": TurnFact(
        lambda game: game.turns[-1].rewards if game.turns else None, _round_by_agent
    ),
    "belief": TurnFact(_extract_belief, _round_by_agent),
}
TURN_KEYS = ("turn", *TURN_FACTS)
FIELDS_BY_FACT = {
    "draws" if name == "uniforms" else name: name
    for name in Turn._fields
    if name != "stated_beliefs"
}


def collect_turn_facts(session: Session) -> dict[str, object]:
    """Return the facts of the last turn, or of the start, by their keys."""
    entries = [(key, fact.to_json, fact.extract(session)) for key, fact in TURN_FACTS.items()]
    problem = session.problem
    facts = {key: to_json(problem, array) for key, to_json, array in entries if array is not None}
    return {"turn": len(session.turns), **facts}


class TurnFormatter:
    """A formatter of the turns of a session, which caches lines because most facts recur."""

    def __init__(self, session: Session) -> None:
        self._session, problem = session, session.problem
        # then a turn's block depends on nothing but the turn
        self.omits_belief = belief_size(problem) > MAX_LISTED_STATES
        is_absent = {
            "draws": not problem.uniform_counts.step,
            "state": problem.state_count == 1,
            "observations": not problem.partially_observable,
        }
        self._fact_keys = [key for key in FIELDS_BY_FACT if not is_absent.get(key)]
        self._cached_lines: dict[str, dict[tuple[str, bytes], str]] = {key: {} for key in TURN_KEYS}

    def format_turn(self) -> list[str]:
        """Return the lines of the last turn or the start, equal to `collect_turn_facts`."""
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
                rows += self._iter_value_lines(key, array[None])
            if key == "actions" and last.stated_beliefs:
                stated = TURN_FACTS["stated"]
                beliefs = stated.extract(session)
                assert beliefs is not None
                rows.append(f"stated: {encode_json(stated.to_json(session.problem, beliefs))}")
        if not self.omits_belief:
            rows += self._iter_value_lines("belief", session.current_beliefs()[None])
        return rows

    def format_turns(self, turns: Turn) -> str:
        """Return the blocks of the next turns `[T, ...]`; the session must omit beliefs."""
        columns = [
            self._iter_value_lines(key, getattr(turns, FIELDS_BY_FACT[key]))
            for key in self._fact_keys
        ]
        lines_by_turn = zip(
            number_next_turns(self._session, len(turns.state)), *columns, strict=True
        )
        return "".join([join_block([f"turn: {turn}", *rows]) for turn, *rows in lines_by_turn])

    def _iter_value_lines(self, key: str, values: Array) -> Iterator[str]:
        """Yield the line of each of a fact's values `[T, ...]`, cached by the value's bytes."""
        if key == "draws":  # Uniforms hardly ever recur.
            yield from [f"draws: {draws}" for draws in values.tolist()]
            return
        problem, to_json, cache = (
            self._session.problem, TURN_FACTS[key].to_json, self._cached_lines[key]
        )  # fmt: skip
        type_char, value_bytes, size = (
            values.dtype.char, array_bytes(values), values.nbytes // len(values)
        )  # fmt: skip
        for index, value in enumerate(values):
            cache_key = type_char, value_bytes[index * size : (index + 1) * size]
            row = cache.get(cache_key)
            if row is None:
                row = f"{key}: {encode_json(to_json(problem, value))}"
                # the bytes of objects are addresses
                if len(cache) < MAX_CACHED_LINES and type_char != "O":
                    cache[cache_key] = row
            yield row


def collect_end_facts(session: Session, reason: str | None = None) -> dict[str, object]:
    """Return the facts of the end line, without its checksum.

    `reason` is given for a game that is paused and not over.
    """
    facts: dict[str, object] = {
        "reason": reason or session.end_reason,
        "turns": len(session.turns),
        "return": _round_by_agent(session.problem, session.returns()),
        "total": _round_by_agent(session.problem, session.total_rewards()),
    }
    return facts | ({"help": dict(session.hint_counts)} if session.hint_counts else {})


def format_end_block(session: Session, digest: str, reason: str | None = None) -> list[str]:
    """Return the end line, with the checksum of the lines above it.

    `reason` is given for a game that is paused and not over.
    """
    return format_lines({"end": collect_end_facts(session, reason) | {"sha256": digest}})


def format_lines(facts: Mapping[str, object]) -> list[str]:
    """Return the lines of a block, without the empty line that ends it."""
    return [f"{key}: {encode_json(value)}" for key, value in facts.items()]


def format_with_frame(rows: list[str], frame: str) -> list[str]:
    """Return the lines of a block, followed by the lines of its frame."""
    return rows + [f"| {line}".rstrip() for line in frame.split("\n") if frame]


def encode_json(value: object) -> str:
    """Return a value as JSON text.

    Most values are so short that setting up an encoder would take longer.
    """
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
    """Return the text of a block: its lines and an empty one."""
    return "\n".join([*block, "", ""])


def compute_checksum(content: str) -> str:
    """Return the first 16 hexadecimal digits of the SHA-256 of all lines except notes."""
    return shorten_digest(hashlib.sha256(strip_notes(content).encode()))


def shorten_digest(digest: "hashlib._Hash") -> str:
    """Return the first 16 hexadecimal digits of a digest, as in the end line."""
    return digest.hexdigest()[:16]


def strip_notes(content: str) -> str:
    """Return the content without notes, which the checksum does not cover."""
    return NOTE_PATTERN.sub("", content)

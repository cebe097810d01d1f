"""The first lines of a file of Cassandra's format, or of MADP's: what there is, and the start."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmplay.chance import Reals
from dmplay.describe import format_count
from dmplay.errors import UnknownName
from dmplay.files.names import Declaration, JointDeclaration
from dmplay.files.words import SourceText, TokenSpan, is_number, parse_integer

DECLARATION_KEYS = ("agents", "discount", "values", "states", "actions", "observations", "start")
END_STATES_KEY = "E"  # of zmdp's files: states that end a game, which their T: lines say too
START_LIST_KEYS = ("include", "exclude")
VALUE_KINDS = ("reward", "cost", "rewards", "costs")
SUM_TOLERANCE = 1e-3 + 1e-9  # how far from 1 probabilities may sum, as 0.333 0.333 0.333 do
EXACT_SUM_TOLERANCE = 1e-9  # how far they may without being scaled


@dataclass(frozen=True)
class Preamble:
    """What a file says before its arrays."""

    agents: tuple[str, ...]
    discount: float
    rewards_are_costs: bool  # whether its rewards are costs
    states: Declaration
    actions: JointDeclaration
    observations: JointDeclaration | None  # None where states are seen
    initial_belief: Reals


@dataclass(frozen=True)
class _DeclarationLines:
    """The words after each key, and where the arrays begin."""

    source: SourceText
    spans_by_key: dict[str, TokenSpan]
    end: int

    def require_span(self, key: str, expected: str) -> TokenSpan:
        """The words after a key; what it would say if it stood there, in the error if not."""
        if key not in self.spans_by_key:
            raise self.source.error_at(self.end, f"no {key}: {expected}")
        return self.spans_by_key[key]


def parse_preamble(source: SourceText, end: int, *, team: bool) -> Preamble:
    """What a file says before its arrays, which begin at `end`; of several agents if a team's."""
    lines = _DeclarationLines(source, dict(_iter_declarations(source, end)), end)
    agents: tuple[str, ...] = ("agent",)
    if team:
        agents = _parse_agents(
            lines.require_span("agents", "line; a .dpomdp names its agents, or how many")
        )
    elif "agents" in lines.spans_by_key:
        raise lines.spans_by_key["agents"].error_at(
            0, "agents: are for a .dpomdp; expected one agent"
        )
    states = Declaration.parse(
        "state", lines.require_span("states", "line; a file names its states")
    )
    actions = _parse_joint_declaration(
        "action", lines.require_span("actions", "line; a file names its actions"), len(agents)
    )
    seen = lines.spans_by_key.get("observations")
    if team and seen is None:
        lines.require_span("observations", "line; a .dpomdp names what each agent observes")
    observations = _parse_joint_declaration("observation", seen, len(agents)) if seen else None
    if END_STATES_KEY in lines.spans_by_key:
        states.parse_mask(lines.spans_by_key[END_STATES_KEY])
    discount = lines.require_span("discount", "line; expected a number from 0 to 1")
    return Preamble(
        agents,
        float(discount.parse_probabilities(1)[0]),
        _parse_cost_flag(lines),
        states,
        actions,
        observations,
        _parse_start(lines, states),
    )


def _iter_declarations(source: SourceText, end: int) -> Iterator[tuple[str, TokenSpan]]:
    """The words after each key before the arrays; raises BadFile for what is no key."""
    part = TokenSpan.from_range(source, 0, end)
    words = part.tokens
    colons = [number for number, word in enumerate(words) if word == ":"]
    keys = [n - 1 - (n > 1 and words[n - 1] in START_LIST_KEYS) for n in colons]
    if not words:
        return
    if keys[:1] != [0]:
        raise part.error_at(0, UnknownName("word", words[0], DECLARATION_KEYS))
    known: set[str] = set()
    for first, colon, last in zip(keys, colons, [*keys[1:], len(words)], strict=True):
        if words[first] not in (*DECLARATION_KEYS, END_STATES_KEY) or (
            colon - first > 1 and words[first] != "start"
        ):
            raise part.error_at(first, UnknownName("word", words[first], DECLARATION_KEYS))
        if words[first] in known:
            raise part.error_at(first, f"{words[first]}: stands here twice")
        known.add(words[first])
        yield words[first], part.slice(colon + 1, last)
        if colon - first > 1:
            yield words[first + 1], part.slice(colon + 1, last)


def _parse_agents(span: TokenSpan) -> tuple[str, ...]:
    """The names of the agents."""
    names = Declaration.parse("agent", span).names
    return (
        tuple(f"agent{n + 1}" for n in range(len(names))) if parse_integer(names[0]) == 0 else names
    )


def _parse_joint_declaration(kind: str, span: TokenSpan, agent_count: int) -> JointDeclaration:
    """The sets of all agents, a line each where there are several."""
    lines = [span] if agent_count == 1 else span.split_lines()
    if len(lines) != agent_count:
        told = f"got {format_count(len(lines), 'line')} of {kind}s"
        raise span.error_at(0, f"{told}, expected one for each agent: {agent_count}")
    return JointDeclaration([Declaration.parse(kind, line) for line in lines])


def _parse_cost_flag(lines: _DeclarationLines) -> bool:
    """Whether rewards are costs."""
    told = lines.spans_by_key.get("values")
    return told is not None and told.parse_choice("kind of values", VALUE_KINDS).startswith("cost")


def _parse_start(lines: _DeclarationLines, states: Declaration) -> Reals:
    """The distribution of the first state `[S]`: uniform unless told."""
    part, many = lines.spans_by_key.get("start"), len(states)
    if part is None or list(part.tokens) == ["uniform"]:
        return np.full(many, 1.0 / many)
    listed = [key for key in START_LIST_KEYS if key in lines.spans_by_key]
    named = bool(part.tokens) and not is_number(part.tokens[0])
    if not (listed or named) and (len(part.tokens) != 1 or many == 1):
        return _normalize_probabilities(part, part.parse_probabilities(many))
    chosen = states.parse_mask(part)
    chosen ^= listed == ["exclude"]
    if not chosen.any():
        raise part.error_at(0, "got every state, expected one at least that is left")
    return np.asarray(chosen / chosen.sum())


def _normalize_probabilities(span: TokenSpan, p: Reals) -> Reals:
    if abs(p.sum() - 1) > SUM_TOLERANCE:
        raise span.error_at(0, f"got probabilities that sum to {p.sum():g}, not 1")
    return p if abs(p.sum() - 1) <= EXACT_SUM_TOLERANCE else np.asarray(p / p.sum())

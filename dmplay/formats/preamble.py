"""Read the declarations that precede the arrays in a file of Cassandra's or MADP's format."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.text import format_count
from dmplay.errors import UnknownName
from dmplay.formats.declarations import Declaration, JointDeclaration
from dmplay.formats.lexer import SourceText, TokenSpan, is_number, parse_integer
from dmplay.formats.statements import VALUE_KEYWORDS

DECLARATION_KEYS = ("agents", "discount", "values", "states", "actions", "observations", "start")
# key of zmdp's files for the states that end a game, which their T: lines imply too
END_STATES_KEY = "E"
HORIZON_KEYS = ("horizon", "turns")  # of other formats
START_LIST_KEYS = ("include", "exclude")
# words that are not names, because a line or a value begins with them
KEYWORDS = {*DECLARATION_KEYS, *START_LIST_KEYS, *chain.from_iterable(VALUE_KEYWORDS.values())}
UNIFORM_START = ("start", "uniform")  # the only keyword after a declaration key
VALUE_KINDS = ("reward", "cost", "rewards", "costs")
# largest difference from 1 of a sum of probabilities, as in 0.333 0.333 0.333
SUM_TOLERANCE = 1e-3 + 1e-9
EXACT_SUM_TOLERANCE = 1e-9  # largest difference from 1 that is not removed by scaling


@dataclass(frozen=True)
class Preamble:
    """The declarations that precede the arrays of a file."""

    agents: tuple[str, ...]
    discount: float
    rewards_are_costs: bool
    states: Declaration
    actions: JointDeclaration
    observations: JointDeclaration | None  # None if the states are observed
    initial_belief: Reals


@dataclass(frozen=True)
class _DeclarationLines:
    """The tokens after each declaration key, and the offset of the first array."""

    source: SourceText
    spans_by_key: dict[str, TokenSpan]
    end: int

    def require_span(self, key: str, expected: str) -> TokenSpan:
        """Return the tokens after a key; raise BadFile with what is expected if it is missing."""
        if key not in self.spans_by_key:
            raise self.source.error_at(self.end, f"no {key}: {expected}")
        return self.spans_by_key[key]


def parse_preamble(source: SourceText, end: int, *, team: bool) -> Preamble:
    """Return the declarations before the arrays, which start at offset `end`.

    In the file of a team (`.dpomdp`), several agents and their observations are declared.
    Raises BadFile if a declaration is missing or malformed.
    """
    lines = _DeclarationLines(source, dict(_iter_declarations(source, end)), end)
    agents: tuple[str, ...] = ("agent",)
    if team:
        agents = _parse_agents(
            lines.require_span("agents", "line; expected the names of the agents, or their number")
        )
    elif "agents" in lines.spans_by_key:
        raise lines.spans_by_key["agents"].error_at(
            0, "got an agents: line, expected none; only .dpomdp files have one"
        )
    expected = "line; expected the names of the states, or their number"
    states = Declaration.parse("state", lines.require_span("states", expected))
    expected = "line; expected the names of the actions, or their number"
    action_span = lines.require_span("actions", expected)
    actions = _parse_joint_declaration("action", action_span, len(agents))
    observation_span = lines.spans_by_key.get("observations")
    if team and observation_span is None:
        lines.require_span("observations", "line; expected the observations of each agent")
    observations = None
    if observation_span:
        observations = _parse_joint_declaration("observation", observation_span, len(agents))
    if END_STATES_KEY in lines.spans_by_key:
        states.parse_mask(lines.spans_by_key[END_STATES_KEY])
    discount = lines.require_span("discount", "line; expected a number from 0 to 1")
    return Preamble(
        agents,
        float(discount.parse_probabilities(1, "a number from 0 to 1")[0]),
        _parse_cost_flag(lines),
        states,
        actions,
        observations,
        _parse_start(lines, states),
    )


def _iter_declarations(source: SourceText, end: int) -> Iterator[tuple[str, TokenSpan]]:
    """Yield each declaration key with the tokens after it; raise BadFile for an unknown key."""
    span = TokenSpan.from_range(source, 0, end)
    tokens = span.tokens
    colons = [index for index, token in enumerate(tokens) if token == ":"]
    key_indices = [n - 1 - (n > 1 and tokens[n - 1] in START_LIST_KEYS) for n in colons]
    if not tokens:
        return
    if key_indices[:1] != [0]:
        raise span.error_at(0, UnknownName("word", tokens[0], DECLARATION_KEYS))
    declared: set[str] = set()
    for first, colon, last in zip(
        key_indices, colons, [*key_indices[1:], len(tokens)], strict=True
    ):
        if tokens[first] in HORIZON_KEYS:
            message = f"got {tokens[first]}:, which the format lacks; set --turns instead"
            raise span.error_at(first, message)
        if tokens[first] not in (*DECLARATION_KEYS, END_STATES_KEY) or (
            colon - first > 1 and tokens[first] != "start"
        ):
            raise span.error_at(first, UnknownName("word", tokens[first], DECLARATION_KEYS))
        if tokens[first] in declared:
            raise span.error_at(first, f"got {tokens[first]}: twice, expected it once")
        declared.add(tokens[first])
        for index in range(colon + 1, last):
            if tokens[index] in KEYWORDS and (tokens[first], tokens[index]) != UNIFORM_START:
                got = f"got {tokens[index]!r} after {tokens[first]}:, which is a keyword"
                raise span.error_at(index, f"{got}; {_keyword_advice(tokens[index])}")
        yield tokens[first], span.slice(colon + 1, last)
        if colon - first > 1:
            yield tokens[first + 1], span.slice(colon + 1, last)


def _keyword_advice(keyword: str) -> str:
    """Return the advice for a keyword where a declaration has its names or numbers."""
    if keyword in DECLARATION_KEYS:
        return f"expected {keyword}: with a colon, or another name"
    if keyword in START_LIST_KEYS:
        return f"expected start {keyword}: with a colon, or another name"
    return "expected another name"


def _parse_agents(span: TokenSpan) -> tuple[str, ...]:
    """Return the agents' names, which are agent1, agent2, ... if only their number is declared."""
    names = Declaration.parse("agent", span).names
    return (
        tuple(f"agent{n + 1}" for n in range(len(names))) if parse_integer(names[0]) == 0 else names
    )


def _parse_joint_declaration(kind: str, span: TokenSpan, agent_count: int) -> JointDeclaration:
    """Return the declared sets of all agents, one line for each agent if there are several."""
    lines = [span] if agent_count == 1 else span.split_lines()
    if len(lines) != agent_count:
        count_text = f"got {format_count(len(lines), 'line')} of {kind}s"
        raise span.error_at(0, f"{count_text}, expected {agent_count}, one for each agent")
    return JointDeclaration([Declaration.parse(kind, line) for line in lines])


def _parse_cost_flag(lines: _DeclarationLines) -> bool:
    """Return whether the file declares its rewards as costs."""
    span = lines.spans_by_key.get("values")
    return span is not None and span.parse_choice("kind of values", VALUE_KINDS).startswith("cost")


def _parse_start(lines: _DeclarationLines, states: Declaration) -> Reals:
    """Return the initial state distribution `[S]`, uniform if none is declared."""
    span, state_count = lines.spans_by_key.get("start"), len(states)
    if span is None or list(span.tokens) == ["uniform"]:
        return np.full(state_count, 1.0 / state_count)
    list_keys = [key for key in START_LIST_KEYS if key in lines.spans_by_key]
    lists_names = bool(span.tokens) and not is_number(span.tokens[0])
    if not (list_keys or lists_names) and (len(span.tokens) != 1 or state_count == 1):
        return _normalize_probabilities(span, span.parse_probabilities(state_count))
    mask = states.parse_mask(span)
    mask ^= list_keys == ["exclude"]
    if not mask.any():
        raise span.error_at(0, "got every state, expected at least one state to remain")
    return np.asarray(mask / mask.sum())


def _normalize_probabilities(span: TokenSpan, p: Reals) -> Reals:
    """Return probabilities scaled to sum to 1; raise BadFile if their sum differs too much.

    Sums within EXACT_SUM_TOLERANCE of 1 are not scaled.
    """
    if abs(p.sum() - 1) > SUM_TOLERANCE:
        raise span.error_at(0, f"got probabilities that sum to {p.sum():g}, not 1")
    return p if abs(p.sum() - 1) <= EXACT_SUM_TOLERANCE else np.asarray(p / p.sum())

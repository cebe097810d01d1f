"""Functions that collect the facts of a turn, visible or complete, and format them as text."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.core.text import align_columns, format_number
from dmplay.game.seat_snapshot import SeatSnapshot
from dmplay.transcript.format import collect_turn_facts

if TYPE_CHECKING:
    from dmplay.game.hints.review import ReviewedAction

BELIEF_KEYS = ("stated", "belief")  # before the action, and after the turn
MAX_NAMED_STATES = 4  # states whose names label a belief
DEBRIEF_COLUMNS = ("turn", "actions", "stated", "state", "observations", "rewards", "belief")
# keys that a player may see
PUBLIC_FACT_KEYS = ("turn", "actions", "stated", "state", "observations", "rewards", "belief")

Row = dict[str, object]  # the value of each column


def flatten_turn_facts(facts: Mapping[str, object]) -> Row:
    """Return the facts of a turn as one row, with a column for each fact of each agent."""
    return {
        f"{key} {name}".strip(): item
        for key, value in facts.items()
        for name, item in (value.items() if isinstance(value, dict) else [("", value)])
    }


def join_review(rows: Sequence[Row], reviewed_actions: Sequence["ReviewedAction"]) -> list[Row]:
    """Return the rows with the values, the best actions and the regret of each reviewed choice.

    Of several rows of one turn, these stand in the last, whose actions were not undone.
    """
    joined = [dict(row) for row in rows]
    rows_by_turn = {row["turn"]: row for row in joined if row.get("event") != "undo"}
    for choice in reviewed_actions:
        facts = {"values": choice.values, "best": [*choice.best], "regret": choice.regret}
        rows_by_turn[choice.turn] |= {f"{key} {choice.seat}": fact for key, fact in facts.items()}
    return joined


def visible_turn_facts(session: Session, snapshot: SeatSnapshot) -> dict[str, object]:
    """Return the facts of the last turn that the snapshot's seat may see.

    In a partially observable problem these are the seat's own facts only, without the state.
    Rewards are omitted if the snapshot does not show them.
    """
    problem = session.problem
    hidden_keys = ("state",) * problem.partially_observable + ("rewards",) * (
        not snapshot.rewards_visible
    )
    facts = collect_turn_facts(session).items()
    visible = {
        key: value for key, value in facts if key in PUBLIC_FACT_KEYS and key not in hidden_keys
    }
    agent = problem.agents[snapshot.seat]
    if problem.partially_observable:
        return {key: _select_agent_entry(value, agent) for key, value in visible.items()}
    return visible


def _select_agent_entry(value: object, agent: str) -> object:
    """Return a fact reduced to one agent's entry if it is a dictionary by agent."""
    if not isinstance(value, dict):
        return value
    return {name: entry for name, entry in value.items() if name == agent}


def build_debrief(session: Session) -> list[dict[str, object]]:
    """Return the facts of the start and of every turn, including hidden ones, without uniforms.

    The turns are replayed in a copy of the session.
    """
    return [
        {key: value for key, value in collect_turn_facts(replayed).items() if key != "draws"}
        for replayed in _iter_positions(session)
    ]


def list_session_rows(session: Session, seat: int | None = None) -> list[Row]:
    """Return a row for the start and for each turn; with a seat, only with what it may know."""
    return [
        flatten_turn_facts(
            collect_turn_facts(replayed)
            if seat is None
            else visible_turn_facts(replayed, SeatSnapshot(replayed, seat))
        )
        for replayed in _iter_positions(session)
    ]


def _iter_positions(session: Session) -> Iterator[Session]:
    """Yield a copy of a session at the start and after each turn."""
    replayed = session.copy_at_start()
    yield replayed
    for turn in session.turns:
        replayed.append_turns([turn])
        yield replayed


def list_few_state_names(problem: Problem) -> list[str]:
    """Return the names of all states if there are at most MAX_NAMED_STATES; else []."""
    is_small = isinstance(problem.state_count, int) and problem.state_count <= MAX_NAMED_STATES
    return [*map(problem.format_state, problem.enumerate_states())] if is_small else []


def format_debrief_table(problem: Problem, rows: Sequence[Mapping[str, object]]) -> list[str]:
    """Return the facts of the start and of every turn as an aligned table.

    Facts of several agents are in the order of the agents, with slashes between; equal ones once.
    """
    state_names = [
        problem.format_state(state)
        for state in (problem.enumerate_states() if any("belief" in row for row in rows) else ())
    ]
    keys = [*dict.fromkeys(key for row in rows for key in row)]
    order = [key for key in DEBRIEF_COLUMNS if key in keys]
    headings = [key.removesuffix("s") for key in order]
    if "state" in order:
        headings[order.index("state")] = "state after"
    if "belief" in order:
        has_few_states = len(state_names) <= MAX_NAMED_STATES
        names = f"belief: {', '.join(state_names)}" if has_few_states else "likeliest state"
        headings[order.index("belief")] = names
    lines = align_columns(
        [
            headings,
            *([_format_cell(row.get(key, ""), state_names) for key in order] for row in rows),
        ]
    )
    names = " / ".join(problem.agents)
    model = "; beliefs as if the others acted at random" * ("belief" in order)
    caption = [f"{names}; one value alone is for all{model}"] if len(problem.agents) > 1 else []
    return [*caption, *lines]


def _format_cell(value: object, state_names: Sequence[str]) -> str:
    """Return a fact as a cell of the table; of a belief over many states, the likeliest one."""
    if isinstance(value, dict):
        cells = [_format_cell(entry, state_names) for entry in value.values()]
        return " / ".join(dict.fromkeys(cells) if len({*cells}) == 1 else cells)
    if not isinstance(value, list):
        return _format_value(value)
    if len(value) != len(state_names) or len(value) <= MAX_NAMED_STATES:
        return ", ".join(_format_belief(entry) for entry in value)
    likeliest = max(range(len(value)), key=value.__getitem__)
    return f"{state_names[likeliest]} {_format_belief(value[likeliest])}"


def _format_belief(entry: object) -> str:
    """Return a probability with three decimals, or any other entry as text."""
    return f"{entry:.3f}" if isinstance(entry, int | float) else str(entry)


def format_facts(facts: Mapping[str, object], state_names: Sequence[str] = ()) -> str:
    """Return the facts of a turn as one line of text; a belief is labelled by the state names."""
    return " ".join(
        _format_fact(key, _label_beliefs(value, state_names) if key in BELIEF_KEYS else value)
        for key, value in facts.items()
    )


def _label_beliefs(beliefs: object, state_names: Sequence[str]) -> object:
    """Return a belief, or beliefs by agent, as text: `sated 0.5, hungry 0.5`.

    Return it unchanged if the states have no names.
    """
    if isinstance(beliefs, dict):
        return {agent: _label_beliefs(belief, state_names) for agent, belief in beliefs.items()}
    if not isinstance(beliefs, list) or len(beliefs) != len(state_names):
        return beliefs
    pairs = zip(state_names, beliefs, strict=True)
    separator = ": " if any(name[-1:].isdigit() for name in state_names) else " "
    return ", ".join(f"{name}{separator}{_format_value(p)}" for name, p in pairs)


def _format_fact(key: str, value: object) -> str:
    """Return one fact as text.

    A dictionary is listed by agent; the agent's name is omitted if there is only one entry.
    """
    if isinstance(value, dict):
        is_single = len(value) == 1
        entries = ", ".join(
            _format_value(v) if is_single else f"{k} {_format_value(v)}" for k, v in value.items()
        )
        return f"{key.removesuffix('s')} {entries}."
    return f"{key} {_format_value(value)}."


def _format_value(value: object) -> str:
    """Return a value as text: floats with four significant digits, lists in brackets."""
    if isinstance(value, list):
        return f"[{', '.join(map(_format_value, value))}]"
    return format_number(value, 4) if isinstance(value, float) else str(value)

"""Facts of a turn as data: what a seat may know of it, what the end brings out; and in words."""

from collections.abc import Mapping

from dmplay.session import Session
from dmplay.transcript.format import collect_turn_facts
from dmplay.views.kept import SeatSnapshot

PUBLIC_FACT_KEYS = (
    "turn",
    "actions",
    "state",
    "observations",
    "rewards",
    "belief",
)  # which a seat may know


def visible_turn_facts(session: Session, snapshot: SeatSnapshot) -> dict[str, object]:
    """What the seat may know of the last turn."""
    problem = session.problem
    secret = ("state",) * problem.partially_observable + ("rewards",) * (
        not snapshot.rewards_visible
    )
    facts = collect_turn_facts(session).items()
    known = {key: value for key, value in facts if key in PUBLIC_FACT_KEYS and key not in secret}
    agent = problem.agents[snapshot.seat]
    return (
        {key: _select_agent_facts(value, agent) for key, value in known.items()}
        if problem.partially_observable
        else known
    )


def _select_agent_facts(value: object, agent: str) -> object:
    """Of a fact that is told of each agent what is told of this one."""
    if not isinstance(value, dict):
        return value
    return {who: told for who, told in value.items() if who == agent}


def build_debrief(session: Session) -> list[dict[str, object]]:
    """The opening and every turn with all that was hidden: the game played once more."""
    past = session.copy_at_start()
    rows = [collect_turn_facts(past)]
    for turn in session.turns:
        past.append_turns([turn])
        rows.append(collect_turn_facts(past))
    return [{key: value for key, value in row.items() if key != "draws"} for row in rows]


def format_facts(facts: Mapping[str, object]) -> str:
    """Facts of a turn in one line."""
    return " ".join(_format_fact(key, value) for key, value in facts.items())


def _format_fact(key: str, value: object) -> str:
    if isinstance(value, dict):
        one = len(value) == 1
        each = ", ".join(
            _format_value(v) if one else f"{k} {_format_value(v)}" for k, v in value.items()
        )
        return f"{key.removesuffix('s')} {each}."
    return f"{key} {_format_value(value)}."


def _format_value(value: object) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_format_value, value))}]"
    return f"{value:.4g}" if isinstance(value, float) else str(value)

"""Facts of a turn as data: what a seat may know of it, what the end brings out; and in words."""

from collections.abc import Mapping

from dmplay.session import Session
from dmplay.transcript.format import turn_facts
from dmplay.views.kept import Moment

OPEN = ("turn", "actions", "state", "observations", "rewards", "belief")  # which a seat may know


def public(session: Session, now: Moment) -> dict[str, object]:
    """What the seat may know of the last turn."""
    problem = session.problem
    secret = ("state",) * problem.hidden + ("rewards",) * (not now.paid)
    facts = turn_facts(session).items()
    known = {key: value for key, value in facts if key in OPEN and key not in secret}
    agent = problem.agents[now.seat]
    return {key: _own(value, agent) for key, value in known.items()} if problem.hidden else known


def _own(value: object, agent: str) -> object:
    """Of a fact that is told of each agent what is told of this one."""
    if not isinstance(value, dict):
        return value
    return {who: told for who, told in value.items() if who == agent}


def debrief(session: Session) -> list[dict[str, object]]:
    """The opening and every turn with all that was hidden: the game played once more."""
    past = session.anew()
    rows = [turn_facts(past)]
    for turn in session.turns:
        past.repeat([turn])
        rows.append(turn_facts(past))
    return [{key: value for key, value in row.items() if key != "draws"} for row in rows]


def sentence(facts: Mapping[str, object]) -> str:
    """Facts of a turn in one line."""
    return " ".join(_plainly(key, value) for key, value in facts.items())


def _plainly(key: str, value: object) -> str:
    if isinstance(value, dict):
        one = len(value) == 1
        each = ", ".join(_short(v) if one else f"{k} {_short(v)}" for k, v in value.items())
        return f"{key.removesuffix('s')} {each}."
    return f"{key} {_short(value)}."


def _short(value: object) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_short, value))}]"
    return f"{value:.4g}" if isinstance(value, float) else str(value)

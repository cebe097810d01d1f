"""The situation of one seat as data for a program or a language model."""

import json
from collections.abc import Sequence
from typing import TypedDict

from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.external.bots.protocol import (
    JsonObject,
    describe_choices,
    encode_observation,
    encode_percept,
)
from dmplay.game.narration import Narrator
from dmplay.game.seat_snapshot import SeatSnapshot
from dmplay.registry.problems import parameter_meanings, problem_docstring


class SeatStatus(TypedDict):
    """The facts that a seat knows at its turn, and the turns since the last report."""

    seat: str
    turn: int  # number of turns played
    turns: list[JsonObject]  # turns not reported yet, with the keys of `encode_percept`
    observation: object  # a label, numbers or a state as text; null before the first observation
    legal: object  # names of actions, or the bounds of a number
    words: str  # the situation as text; '' if that would reveal a belief
    ending: str  # result of the game; '' until it is over


def describe_seat(
    narrator: Narrator, snapshot: SeatSnapshot, *, first_turn: int = 0, shows_belief: bool = False
) -> SeatStatus:
    """Return the status of a seat with all turns from `first_turn` on; turn 0 is the start.

    If states are hidden, the situation is put into words only with the belief.
    """
    session, seat = narrator.session, snapshot.seat
    problem, turn_count = session.problem, len(session.turns)
    shows_text = shows_belief or not problem.partially_observable
    observation = session.observation_after(seat, turn_count)
    legal, labels = session.legal_actions_mask(seat), session.action_labels(seat)
    return {
        "seat": problem.agents[seat],
        "turn": turn_count,
        "turns": [_encode_turn(session, seat, turn) for turn in range(first_turn, turn_count + 1)],
        "observation": encode_observation(problem, seat, observation),
        "legal": describe_choices(problem, seat, legal, labels),
        "words": narrator.describe_situation(snapshot) if shows_text else "",
        "ending": narrator.describe_result(names_seat=True) if session.over else "",
    }


def _encode_turn(session: Session, seat: int, turn: int) -> JsonObject:
    """Return the seat's percept of a turn as facts; of turn 0, the initial observation."""
    if turn:
        facts = encode_percept(session.problem, seat, session.build_percept(seat, turn), 0)
        return {"turn": turn} | facts
    observation = session.observation_after(seat, 0)
    return {"turn": 0, "observation": encode_observation(session.problem, seat, observation)}


def format_prompt(
    session: Session,
    seat: int,
    player_names: Sequence[str],
    *,
    shows_belief: bool,
    shows_rules: bool = False,
) -> str:
    """Return the status of a seat with all turns, as `dmplay mcp` sends it to a language model.

    With `shows_rules`, it begins with the rules that `dmplay_info` returns.
    """
    narrator = Narrator(session, [seat], reveal=False, player_names=player_names)
    status = describe_seat(narrator, SeatSnapshot(session, seat), shows_belief=shows_belief)
    facts = {"rules": describe_rules(session.problem), **status} if shows_rules else status
    return json.dumps(facts, indent=2, ensure_ascii=False)


def describe_rules(problem: Problem) -> JsonObject:
    """Return the kind of a problem, its description, and its parameters with their meanings."""
    parameters = dict[str, JsonObject]()
    for name, meaning in parameter_meanings(problem).items():
        value = getattr(problem, name)
        is_plain = isinstance(value, int | float | str | None)
        parameters[name] = {"value": value if is_plain else str(value), "meaning": meaning}
    about = problem_docstring(problem)
    return {"kind": problem.kind, "about": about, "parameters": parameters}

"""Playing a transcript again from its inputs: actions, draws, undos and rerolls."""

import json
from collections.abc import Collection, Sequence

import numpy as np

from dmplay.chance import Reals
from dmplay.core import Policy, Problem
from dmplay.errors import BadTranscript, DmplayError
from dmplay.session import MOST_TURNS, Session, Source
from dmplay.transcript.format import PERSON, turn_limit
from dmplay.transcript.reading import Block, Transcript


def start(
    transcript: Transcript, problem: Problem, source: Source, policies: Sequence[Policy | None] = ()
) -> Session:
    """The session of a transcript before its first turn, with the recorded opening."""
    header = transcript.header
    check_seats(transcript, problem)
    begun = transcript.blocks[:1]  # none where the file is torn before it
    opening = draws_of(transcript, begun[0], problem.draws.start) if begun else None
    limit = turn_limit(problem, header.seats.values(), header.turns)
    return Session(problem, source, policies, limit=limit, opening=opening)


def check_seats(transcript: Transcript, problem: Problem) -> None:
    """Refuses seats that are not those of the problem."""
    seats = transcript.header.seats
    if list(seats) != list(problem.agents):
        entry = transcript.header_block.entries["seats"]
        got, expected = ", ".join(seats), ", ".join(problem.agents)
        raise transcript.fault(entry.line, f"seats: got {got}, expected {expected}")


def feed(
    transcript: Transcript, block: Block, session: Session, actions: Sequence[float] = ()
) -> None:
    """Feeds one block's inputs to the session; raises BadTranscript where they cannot be.

    The actions of a turn are read from the block, unless that was done before.
    """
    try:
        if block.kind == "turn":
            expected = len(session.turns) + 1
            if block["turn"] != expected:
                raise transcript.fault(block.line, f"got turn {block['turn']}, expected {expected}")
            actions = actions or actions_of(transcript, block, session.problem)
            session.advance(actions, draws_of(transcript, block, session.problem.draws.step))
        elif block.kind == "help":
            session.help.update(_help(transcript, block, session.problem))
        elif block.kind == "undo":
            session.undo(_count(transcript, block, "undo"))
        else:
            session.undo()
            session.rerolls[len(session.turns) + 1] = _count(transcript, block, "reroll")
    except BadTranscript:
        raise
    except DmplayError as error:
        raise transcript.fault(block.line, str(error)) from None


def replay(
    transcript: Transcript, problem: Problem, policies: Sequence[Policy | None] = ()
) -> Session:
    """The session after every whole block of a transcript: to go on with, or to look at."""
    session = start(transcript, problem, transcript.header.dice, policies)
    for block in transcript.blocks[1:]:
        feed(transcript, block, session)
    return session


def unattended(transcript: Transcript, seats: Collection[str], asked: int | None = None) -> None:
    """Refuses more turns of agents alone than the file holds, unless so many are asked for."""
    turns = transcript.header.turns or 0
    if PERSON in seats or turns <= max(MOST_TURNS, len(transcript.blocks), asked or 0):
        return
    line = transcript.header_block.entries["turns"].line
    what = f"turns: got {turns}, expected at most {MOST_TURNS} where no person plays"
    raise transcript.fault(line, f"{what}; if you want them: dmplay resume FILE --turns {turns}")


def draws_of(transcript: Transcript, block: Block, count: int) -> Reals:
    """The draws `[count]` of a block."""
    values = block.get("draws", [])
    if not isinstance(values, list) or not all(
        type(u) in (int, float) and 0.0 <= u < 1.0 for u in values
    ):
        line = block.line_of("draws")
        raise transcript.fault(line, "draws: expected numbers from 0 to below 1")
    if len(values) != count:
        line = block.line_of("draws")
        raise transcript.fault(line, f"draws: got {len(values)}, expected {count}")
    return np.array(values, float)


def actions_of(transcript: Transcript, block: Block, problem: Problem) -> list[float]:
    """The action of each agent in a turn."""
    told = block.get("actions")
    if not isinstance(told, dict) or list(told) != list(problem.agents):
        expected = f"expected one for each of {', '.join(problem.agents)}"
        raise transcript.fault(block.line_of("actions"), f"actions: {expected}")
    actions = []
    for seat, (agent, value) in enumerate(told.items()):
        if type(value) not in problem.actions[seat].written:
            what = f"actions: {agent}: got {json.dumps(value)}"
            raise transcript.fault(block.line_of("actions"), what)
        try:
            actions.append(problem.action(seat, str(value)))
        except DmplayError as error:
            what = f"actions: {agent}: {error}"
            raise transcript.fault(block.line_of("actions"), what) from None
    return actions


def _help(transcript: Transcript, block: Block, problem: Problem) -> dict[str, int]:
    """How often each seat was helped at one time."""
    told = block["help"]
    if not isinstance(told, dict) or not told or not {*told} <= {*problem.agents}:
        raise transcript.fault(block.line, f"help: expected some of {', '.join(problem.agents)}")
    if not all(type(many) is int and many > 0 for many in told.values()):
        raise transcript.fault(block.line, "help: expected whole numbers, as 1")
    return told


def _count(transcript: Transcript, block: Block, key: str) -> int:
    value = block[key]
    if type(value) is not int or value < 1:
        raise transcript.fault(block.line, f"{key}: expected a whole number, as 1")
    return value

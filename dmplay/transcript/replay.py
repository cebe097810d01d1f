"""Playing a transcript again from its inputs: actions, draws, undos and rerolls."""

from collections.abc import Collection, Sequence

from dmplay.core import Policy, Problem
from dmplay.session import MOST_TURNS, Session, Source
from dmplay.transcript.feeding import Ahead
from dmplay.transcript.format import PERSON, turn_limit
from dmplay.transcript.inputs import draws_of
from dmplay.transcript.reading import Transcript


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


def replay(
    transcript: Transcript, problem: Problem, policies: Sequence[Policy | None] = ()
) -> Session:
    """The session after every whole block of a transcript: to go on with, or to look at."""
    session = start(transcript, problem, transcript.header.dice, policies)
    ahead = Ahead(transcript, transcript.blocks, session)
    for place in range(1, len(transcript.blocks)):
        ahead.feed(place)
    return session


def unattended(transcript: Transcript, seats: Collection[str], asked: int | None = None) -> None:
    """Refuses more turns of agents alone than the file holds, unless so many are asked for."""
    turns = transcript.header.turns or 0
    if PERSON in seats or turns <= max(MOST_TURNS, len(transcript.blocks), asked or 0):
        return
    line = transcript.header_block.entries["turns"].line
    what = f"turns: got {turns}, expected at most {MOST_TURNS} where no person plays"
    raise transcript.fault(line, f"{what}; if you want them: dmplay resume FILE --turns {turns}")

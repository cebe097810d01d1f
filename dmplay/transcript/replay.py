"""Playing a transcript again from its inputs: actions, draws, undos and rerolls."""

from collections.abc import Collection, Sequence

from dmplay.core import Policy, Problem
from dmplay.session import DEFAULT_TURN_LIMIT, EpisodeUniforms, Session
from dmplay.transcript.feeding import BatchReplayer
from dmplay.transcript.format import HUMAN_PLAYER, resolve_turn_limit
from dmplay.transcript.inputs import read_uniforms
from dmplay.transcript.reading import Transcript


def start_session(
    transcript: Transcript,
    problem: Problem,
    uniform_source: EpisodeUniforms,
    policies: Sequence[Policy | None] = (),
) -> Session:
    """The session of a transcript before its first turn, with the recorded opening."""
    header = transcript.header
    check_seats(transcript, problem)
    begun = transcript.blocks[:1]  # none where the file is torn before it
    opening = read_uniforms(transcript, begun[0], problem.uniform_counts.start) if begun else None
    limit = resolve_turn_limit(problem, header.seats.values(), header.turns)
    return Session(problem, uniform_source, policies, turn_limit=limit, initial_uniforms=opening)


def check_seats(transcript: Transcript, problem: Problem) -> None:
    """Refuses seats that are not those of the problem."""
    seats = transcript.header.seats
    if list(seats) != list(problem.agents):
        entry = transcript.header_block.entries["seats"]
        got, expected = ", ".join(seats), ", ".join(problem.agents)
        raise transcript.error_at(entry.line, f"seats: got {got}, expected {expected}")


def replay(
    transcript: Transcript, problem: Problem, policies: Sequence[Policy | None] = ()
) -> Session:
    """The session after every whole block of a transcript: to go on with, or to look at."""
    session = start_session(transcript, problem, transcript.header.uniform_source, policies)
    ahead = BatchReplayer(transcript, transcript.blocks, session)
    for place in range(1, len(transcript.blocks)):
        ahead.apply_block(place)
    return session


def check_unattended_turns(
    transcript: Transcript, seats: Collection[str], allowed_turns: int | None = None
) -> None:
    """Refuses more turns of agents alone than the file holds, unless so many are asked for."""
    turns = transcript.header.turns or 0
    if HUMAN_PLAYER in seats or turns <= max(
        DEFAULT_TURN_LIMIT, len(transcript.blocks), allowed_turns or 0
    ):
        return
    line = transcript.header_block.entries["turns"].line
    what = f"turns: got {turns}, expected at most {DEFAULT_TURN_LIMIT} where no person plays"
    raise transcript.error_at(line, f"{what}; if you want them: dmplay resume FILE --turns {turns}")

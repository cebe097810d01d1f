"""Replay of a transcript from its inputs: actions, uniforms, undos and rerolls."""

from collections.abc import Collection, Sequence

from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.session import DEFAULT_TURN_LIMIT, EpisodeUniforms, Session
from dmplay.transcript.draws_and_actions import read_uniforms
from dmplay.transcript.external_players import HUMAN_PLAYER
from dmplay.transcript.format import resolve_turn_limit
from dmplay.transcript.reader import Transcript
from dmplay.transcript.turn_batch_replay import BatchReplayer


def start_session(
    transcript: Transcript,
    problem: Problem,
    uniform_source: EpisodeUniforms,
    policies: Sequence[Policy | None] = (),
) -> Session:
    """Return the session of a transcript before its first turn, with the recorded start."""
    header = transcript.header
    check_seats(transcript, problem)
    start_blocks = transcript.blocks[:1]  # empty if the file ends before the start
    initial_uniforms = None
    if start_blocks:
        initial_uniforms = read_uniforms(transcript, start_blocks[0], problem.uniform_counts.start)
    limit = resolve_turn_limit(problem, header.seats.values(), header.turns)
    return Session(
        problem, uniform_source, policies, turn_limit=limit, initial_uniforms=initial_uniforms
    )


def check_seats(transcript: Transcript, problem: Problem) -> None:
    """Raise BadTranscript if the seats are not the agents of the problem."""
    seats = transcript.header.seats
    if list(seats) != list(problem.agents):
        entry = transcript.header_block.entries["seats"]
        got, expected = ", ".join(seats), ", ".join(problem.agents)
        raise transcript.error_at(entry.line, f"seats: got {got}, expected {expected}")


def replay(
    transcript: Transcript, problem: Problem, policies: Sequence[Policy | None] = ()
) -> Session:
    """Return the session after every complete block of a transcript."""
    session = start_session(transcript, problem, transcript.header.uniform_source, policies)
    replayer = BatchReplayer(transcript, transcript.blocks, session)
    for position in range(1, len(transcript.blocks)):
        replayer.apply_block(position)
    return session


def check_unattended_turns(
    transcript: Transcript, seats: Collection[str], allowed_turns: int | None = None
) -> None:
    """Raise BadTranscript if agents alone would play too many turns.

    The header's turn limit may be at most DEFAULT_TURN_LIMIT, the number of blocks in the file, or
    `allowed_turns`, whichever is greatest. With a human player it is not checked.
    """
    turns = transcript.header.turns or 0
    if HUMAN_PLAYER in seats or turns <= max(
        DEFAULT_TURN_LIMIT, len(transcript.blocks), allowed_turns or 0
    ):
        return
    line = transcript.header_block.entries["turns"].line
    explanation = f"turns: got {turns}, expected at most {DEFAULT_TURN_LIMIT} if only agents play"
    raise transcript.error_at(
        line, f"{explanation}; to play them all: dmplay resume FILE --turns {turns}"
    )

"""A transcript as it would be written today: the draws of its seed, its agents asked again."""

from collections.abc import Iterator, Sequence

from dmplay.core import Policy, Problem
from dmplay.session import Session
from dmplay.transcript.feeding import apply_block
from dmplay.transcript.format import (
    NATURAL_END_REASONS,
    FrameRenderer,
    append_frame,
    collect_turn_facts,
    compute_checksum,
    format_end_block,
    format_lines,
    join_block,
)
from dmplay.transcript.header import collect_header_facts
from dmplay.transcript.inputs import read_actions
from dmplay.transcript.reading import Block, Transcript
from dmplay.transcript.replay import check_unattended_turns, start_session


def rewrite_transcript(
    transcript: Transcript,
    problem: Problem,
    policies: Sequence[Policy | None] = (),
    frame: FrameRenderer | None = None,
) -> str:
    """The file as it would be written today.

    What people did stays as the file has it, as long as it can be done; notes stay in their block.
    """
    session = _start_seeded_session(transcript, problem, policies)
    opening, *blocks = transcript.blocks
    parts = [transcript.header_block.rewrite(format_lines(collect_header_facts(transcript.header)))]
    parts.append(_rewrite_turn(session, opening, frame))
    parts += [_rewrite_block(transcript, block, session, frame) for block in blocks]
    if transcript.end_block is None:
        return "".join(parts)
    parts += _play_remaining_turns(transcript, session, frame)
    session.end(transcript.player_end_reason or "quit")
    content = "".join(parts)
    return content + rewrite_end(transcript.end_block, session, compute_checksum(content))


def rewrite_end(end: Block, session: Session, digest: str) -> str:
    """The end line with this checksum, the notes of the old one in their places."""
    return "\n".join([*end.insert_notes(format_end_block(session, digest)), ""])


def _start_seeded_session(
    transcript: Transcript, problem: Problem, policies: Sequence[Policy | None]
) -> Session:
    """The session before its first turn, with the opening of its seed."""
    dice = transcript.header.uniform_source
    return Session(
        problem, dice, policies, turn_limit=start_session(transcript, problem, dice).turn_limit
    )


def _rewrite_block(
    transcript: Transcript, block: Block, session: Session, frame: FrameRenderer | None
) -> str:
    """Plays a block, people as it says and agents as they choose now; '' after the game's end."""
    if block.kind != "turn":
        apply_block(transcript, block, session)
        return block.rewrite(format_lines({block.kind: block[block.kind]}))
    if session.over:
        return ""
    told = read_actions(transcript, block, session.problem)
    people = zip(told, session.seated_policies, strict=True)
    session.advance([None if agent else action for action, agent in people])
    return _rewrite_turn(session, block, frame)


def _rewrite_turn(session: Session, block: Block, frame: FrameRenderer | None) -> str:
    """The session's last turn, or its opening, in place of this block."""
    drawn = frame(session) if frame and block.frame else ""
    return block.rewrite(append_frame(format_lines(collect_turn_facts(session)), drawn))


def _play_remaining_turns(
    transcript: Transcript, session: Session, frame: FrameRenderer | None
) -> Iterator[str]:
    """The turns that agents alone play on, where the game came to its end of itself."""
    if all(session.seated_policies) and transcript.end_reason in NATURAL_END_REASONS:
        check_unattended_turns(transcript, ())
    draw = frame if transcript.blocks[-1].frame else None
    while (
        transcript.end_reason in NATURAL_END_REASONS
        and all(session.seated_policies)
        and not session.over
    ):
        session.advance()
        yield join_block(
            append_frame(format_lines(collect_turn_facts(session)), draw(session) if draw else "")
        )

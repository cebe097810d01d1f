"""A transcript as it would be written today: the draws of its seed, its agents asked again."""

from collections.abc import Iterator, Sequence

from dmplay.core import Policy, Problem
from dmplay.session import Session
from dmplay.transcript.feeding import feed
from dmplay.transcript.format import (
    NATURAL,
    Frame,
    checksum,
    closing,
    framed,
    lines,
    text,
    turn_facts,
)
from dmplay.transcript.header import header_facts
from dmplay.transcript.inputs import actions_of
from dmplay.transcript.reading import Block, Transcript
from dmplay.transcript.replay import start, unattended


def rewritten(
    transcript: Transcript,
    problem: Problem,
    policies: Sequence[Policy | None] = (),
    frame: Frame | None = None,
) -> str:
    """The file as it would be written today.

    What people did stays as the file has it, as long as it can be done; notes stay in their block.
    """
    session = _anew(transcript, problem, policies)
    opening, *blocks = transcript.blocks
    parts = [transcript.header_block.anew(lines(header_facts(transcript.header)))]
    parts.append(_turn(session, opening, frame))
    parts += [_again(transcript, block, session, frame) for block in blocks]
    if transcript.end is None:
        return "".join(parts)
    parts += _further(transcript, session, frame)
    session.end(transcript.chosen or "quit")
    content = "".join(parts)
    return content + ended(transcript.end, session, checksum(content))


def ended(end: Block, session: Session, digest: str) -> str:
    """The end line with this checksum, the notes of the old one in their places."""
    return "\n".join([*end.noted(closing(session, digest)), ""])


def _anew(transcript: Transcript, problem: Problem, policies: Sequence[Policy | None]) -> Session:
    """The session before its first turn, with the opening of its seed."""
    dice = transcript.header.dice
    return Session(problem, dice, policies, limit=start(transcript, problem, dice).limit)


def _again(transcript: Transcript, block: Block, session: Session, frame: Frame | None) -> str:
    """Plays a block, people as it says and agents as they choose now; '' after the game's end."""
    if block.kind != "turn":
        feed(transcript, block, session)
        return block.anew(lines({block.kind: block[block.kind]}))
    if session.over:
        return ""
    told = actions_of(transcript, block, session.problem)
    people = zip(told, session.followers, strict=True)
    session.advance([None if agent else action for action, agent in people])
    return _turn(session, block, frame)


def _turn(session: Session, block: Block, frame: Frame | None) -> str:
    """The session's last turn, or its opening, in place of this block."""
    drawn = frame(session) if frame and block.frame else ""
    return block.anew(framed(lines(turn_facts(session)), drawn))


def _further(transcript: Transcript, session: Session, frame: Frame | None) -> Iterator[str]:
    """The turns that agents alone play on, where the game came to its end of itself."""
    if all(session.followers) and transcript.reason in NATURAL:
        unattended(transcript, ())
    draw = frame if transcript.blocks[-1].frame else None
    while transcript.reason in NATURAL and all(session.followers) and not session.over:
        session.advance()
        yield text(framed(lines(turn_facts(session)), draw(session) if draw else ""))

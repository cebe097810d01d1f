"""A transcript as it would be written today: the draws of its seed, its agents asked again."""

from collections.abc import Sequence

from dmplay.core import Policy, Problem
from dmplay.dice import Dice
from dmplay.session import Session
from dmplay.transcript.format import (
    CHOSEN,
    NATURAL,
    Frame,
    checksum,
    end_facts,
    header_facts,
    lines,
    text,
    turn_facts,
    turn_limit,
)
from dmplay.transcript.reading import Block, Transcript
from dmplay.transcript.replay import actions_of, play, start


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
    content = text(transcript.header_block.noted(lines(header_facts(transcript.header))))
    content += _turn(session, transcript.blocks[0], frame)
    for block in transcript.blocks[1:]:
        content += _again(transcript, block, session, frame)
    return content if transcript.end is None else _ended(transcript, content, session, frame)


def _anew(transcript: Transcript, problem: Problem, policies: Sequence[Policy | None]) -> Session:
    """The session before its first turn, with the opening of its seed."""
    header = transcript.header
    dice = Dice(header.seed, header.episode)
    start(transcript, problem, dice)  # the seats must be this problem's
    limit = turn_limit(problem, header.seats.values(), header.turns)
    return Session(problem, dice, policies, limit=limit)


def _again(transcript: Transcript, block: Block, session: Session, frame: Frame | None) -> str:
    """Plays a block, people as it says and agents as they choose now; '' after the game's end."""
    if block.kind != "turn":
        play(transcript, block, session)
        return text(block.noted(lines({block.kind: block[block.kind]})))
    if session.over:
        return ""
    told = actions_of(transcript, block, session.problem)
    people = zip(told, session.followers, strict=True)
    session.advance([None if agent else action for action, agent in people])
    return _turn(session, block, frame)


def _turn(session: Session, block: Block, frame: Frame | None) -> str:
    """The session's last turn, or its opening, in place of this block."""
    drawn = frame(session) if frame and block.frame else ""
    return text(block.noted(lines(turn_facts(session), drawn)))


def _ended(transcript: Transcript, content: str, session: Session, frame: Frame | None) -> str:
    """The content with its end; agents alone play on until there is one."""
    assert transcript.end
    framed = frame if transcript.blocks[-1].frame else None
    while transcript.reason in NATURAL and all(session.followers) and not session.over:
        session.advance()
        content += text(lines(turn_facts(session), framed(session) if framed else ""))
    session.end(transcript.reason if transcript.reason in CHOSEN else "quit")
    facts = end_facts(session) | {"sha256": checksum(content)}
    return content + "\n".join([*transcript.end.noted(lines({"end": facts})), ""])

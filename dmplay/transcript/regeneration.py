"""The text of a transcript: of a session, or of a file whose seed and agents are used again."""

from collections.abc import Iterator, Sequence

from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.transcript.draws_and_actions import read_actions, read_stated_beliefs
from dmplay.transcript.format import (
    NATURAL_END_REASONS,
    FrameRenderer,
    TurnFormatter,
    collect_turn_facts,
    compute_checksum,
    format_end_block,
    format_lines,
    format_with_frame,
    join_block,
)
from dmplay.transcript.header import Header, collect_header_facts
from dmplay.transcript.reader import Block, Transcript
from dmplay.transcript.replay import check_unattended_turns, start_session
from dmplay.transcript.turn_batch_replay import apply_block


def format_session(header: Header, session: Session) -> str:
    """Return the transcript of a session with this header; a running game is a paused one.

    Turns that were undone are not in it.
    """
    replayed = session.copy_at_start()
    formatter = TurnFormatter(replayed)
    rows = [format_lines(collect_header_facts(header)), formatter.format_turn()]
    if session.hint_counts:
        rows.append(format_lines({"help": dict(session.hint_counts)}))
    for number, turn in enumerate(session.turns, 1):
        if number in session.reroll_counts:  # The file also has the turn before its reroll.
            replayed.advance(turn.actions.tolist(), stated_beliefs=turn.stated_beliefs)
            rows += [formatter.format_turn()]
            replayed.undo()
            replayed.reroll_counts[number] = session.reroll_counts[number]
            rows.append(format_lines({"reroll": session.reroll_counts[number]}))
        replayed.append_turns([turn])
        rows.append(formatter.format_turn())
    content = "".join(map(join_block, rows))
    reason = None if session.over else "interrupted"
    return "\n".join(
        [content + format_end_block(session, compute_checksum(content), reason)[0], ""]
    )


def rewrite_transcript(
    transcript: Transcript,
    problem: Problem,
    policies: Sequence[Policy | None] = (),
    frame: FrameRenderer | None = None,
) -> str:
    """Return the file as the current code would write it.

    The actions of people stay as recorded while they are legal. Notes stay in their blocks.
    """
    session = _start_seeded_session(transcript, problem, policies)
    start_block, *blocks = transcript.blocks
    parts = [
        transcript.header_block.replace_lines(format_lines(collect_header_facts(transcript.header)))
    ]
    parts.append(_rewrite_turn(session, start_block, frame))
    parts += [_rewrite_block(transcript, block, session, frame) for block in blocks]
    if transcript.end_block is None:
        return "".join(parts)
    parts += _play_remaining_turns(transcript, session, frame)
    session.end(transcript.player_end_reason or "quit")
    content = "".join(parts)
    return content + rewrite_end(transcript.end_block, session, compute_checksum(content))


def rewrite_end(end: Block, session: Session, digest: str) -> str:
    """Return the end line with a new checksum and the notes of the old one at their positions."""
    return "\n".join([*end.insert_notes(format_end_block(session, digest)), ""])


def _start_seeded_session(
    transcript: Transcript, problem: Problem, policies: Sequence[Policy | None]
) -> Session:
    """Return the session before its first turn, with the start that follows from its seed."""
    uniform_source = transcript.header.uniform_source
    return Session(
        problem,
        uniform_source,
        policies,
        turn_limit=start_session(transcript, problem, uniform_source).turn_limit,
    )


def _rewrite_block(
    transcript: Transcript, block: Block, session: Session, frame: FrameRenderer | None
) -> str:
    """Replay a block and return its new text; '' for a turn after the end of the game.

    People act as recorded, and agents choose again.
    """
    if block.kind != "turn":
        apply_block(transcript, block, session)
        return block.replace_lines(format_lines({block.kind: block[block.kind]}))
    if session.over:
        return ""
    actions = read_actions(transcript, block, session.problem)
    earlier_turns = transcript.header.count_turns_of_earlier_players()
    triples = zip(actions, session.seated_policies, earlier_turns, strict=True)
    recorded_actions = [
        None if policy and len(session.turns) >= first else action
        for action, policy, first in triples
    ]
    stated = read_stated_beliefs(transcript, block, session.problem)
    session.advance(
        recorded_actions,
        stated_beliefs={
            seat: belief for seat, belief in stated.items() if recorded_actions[seat] is not None
        },
    )
    return _rewrite_turn(session, block, frame)


def _rewrite_turn(session: Session, block: Block, frame: FrameRenderer | None) -> str:
    """Return the session's last turn or its start, as the new text of a block."""
    frame_text = frame(session) if frame and block.frame else ""
    return block.replace_lines(
        format_with_frame(format_lines(collect_turn_facts(session)), frame_text)
    )


def _play_remaining_turns(
    transcript: Transcript, session: Session, frame: FrameRenderer | None
) -> Iterator[str]:
    """Yield the further turns that agents alone play, if the game ended by itself."""
    if all(session.seated_policies) and transcript.end_reason in NATURAL_END_REASONS:
        check_unattended_turns(transcript, ())
    renderer = frame if transcript.blocks[-1].frame else None
    while (
        transcript.end_reason in NATURAL_END_REASONS
        and all(session.seated_policies)
        and not session.over
    ):
        session.advance()
        yield join_block(
            format_with_frame(
                format_lines(collect_turn_facts(session)), renderer(session) if renderer else ""
            )
        )

"""The review of a transcript, printed or kept in it."""

from json import dumps

from dmplay.advice.review import REVIEW_NOTE_PREFIX, format_notes, format_table, review_actions
from dmplay.disk import write_file as write_file
from dmplay.errors import BadParameter
from dmplay.game.playback import Playback
from dmplay.game.request import ReplayRequest
from dmplay.game.seats import list_human_seats
from dmplay.transcript.report import describe_peeks_and_hints


def review_transcript(recording: ReplayRequest, *, write: bool = False, json: bool = False) -> str:
    """The review of a transcript; kept as notes after its end where asked to."""
    path = recording.path
    game = Playback(path, trusted=recording.trusted, peek=recording.peek)
    list(game.iter_agent_turns())
    who = list_human_seats(game.player_names)
    found = list(review_actions(game.session, who, game.player_names))
    if write and game.transcript.end_block is None:
        raise BadParameter(f"{path}: the game is unfinished; a review is kept after its end")
    if write:
        rows = path.read_text(encoding="utf-8").splitlines(keepends=True)
        kept = [row for row in rows if not row.startswith(REVIEW_NOTE_PREFIX)]
        write_file(path.resolve(), [*kept, *format_notes(found)], force=True)
    helped, peeked = dict(game.session.hint_counts), game.transcript.header.peeked
    told = [{"peeked": peeked, "help": helped}] if peeked or helped else []
    if json:
        return dumps([*(move._asdict() for move in found), *told])
    rows = format_table(found) if who else ["review: no person plays in this game"]
    return "\n".join([*rows, *describe_peeks_and_hints(helped, peeked=peeked)])

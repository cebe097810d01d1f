"""The review of a transcript, printed or saved as notes in the transcript."""

from dmplay.core.safe_files import write_file
from dmplay.core.text import escape_newlines, format_json_report
from dmplay.errors import BadParameter
from dmplay.game.hints.review import REVIEW_NOTE_PREFIX, format_notes, format_table
from dmplay.game.launch_requests import ReplayRequest
from dmplay.game.playback import Playback
from dmplay.terminal.progress import ProgressBar
from dmplay.transcript.verification_report import describe_peeks_and_hints


def report_review(
    recording: ReplayRequest, *, seat: str = "", write: bool = False, json: bool = False
) -> str:
    """Return the review of a transcript as text or JSON; if `write`, also save it in the file.

    Raise BadParameter if a review of an unfinished game is to be saved.
    """
    path = recording.path
    with ProgressBar(f"reviewing {escape_newlines(str(path))}", quiet=json):
        game = Playback(path, trusted=recording.trusted, peek=recording.peek)
        reviewed_actions = game.review_choices(seat)
    if write and game.transcript.end_block is None:
        raise BadParameter(f"{path}: the game is unfinished; a review is saved only after the end")
    if write:
        rows = path.read_text(encoding="utf-8").splitlines(keepends=True)
        other_rows = [row for row in rows if not row.startswith(REVIEW_NOTE_PREFIX)]
        write_file(path.resolve(), [*other_rows, *format_notes(reviewed_actions)], continues=True)
    hint_counts, peeked = dict(game.session.hint_counts), game.transcript.header.peeked
    if json:
        rows_by_action = [action.data for action in reviewed_actions]
        return format_json_report(
            {"actions": rows_by_action, "peeked": peeked, "help": hint_counts}
        )
    return "\n".join(
        [*format_table(reviewed_actions), *describe_peeks_and_hints(hint_counts, peeked=peeked)]
    )

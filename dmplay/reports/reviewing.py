"""The review of a transcript, printed or kept in it."""

from json import dumps

from dmplay.advice.review import MARK, moves, notes, table
from dmplay.disk import write as write_file
from dmplay.errors import BadParameter
from dmplay.game.playback import Playback
from dmplay.game.request import Recording
from dmplay.game.seats import people
from dmplay.transcript.report import marks


def reviewed(recording: Recording, *, write: bool = False, json: bool = False) -> str:
    """The review of a transcript; kept as notes after its end where asked to."""
    path = recording.path
    game = Playback(path, trusted=recording.trusted, peek=recording.peek)
    list(game.run())
    who = people(game.seats)
    found = list(moves(game.session, who, game.seats))
    if write and game.transcript.end is None:
        raise BadParameter(f"{path}: the game is unfinished; a review is kept after its end")
    if write:
        rows = path.read_text(encoding="utf-8").splitlines(keepends=True)
        kept = [row for row in rows if not row.startswith(MARK)]
        write_file(path.resolve(), [*kept, *notes(found)], force=True)
    helped, peeked = dict(game.session.help), game.transcript.header.peeked
    told = [{"peeked": peeked, "help": helped}] if peeked or helped else []
    if json:
        return dumps([*(move._asdict() for move in found), *told])
    rows = table(found) if who else ["review: no person plays in this game"]
    return "\n".join([*rows, *marks(helped, peeked=peeked)])

"""A recorded game as something else: pictures, a screen recording, text, a table, data."""

import csv
import io
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from rich.text import Text

from dmplay.describe import counted
from dmplay.disk import apart
from dmplay.errors import BadParameter
from dmplay.game.errand import Printout
from dmplay.game.formats import FORMATS
from dmplay.game.playback import Playback
from dmplay.reports.drawing import film as pictures
from dmplay.reports.drawing import kept, picture
from dmplay.reports.page import page
from dmplay.screen.frame import compose
from dmplay.screen.shown import Room, Shown
from dmplay.styles import ansi
from dmplay.transcript.format import end_facts
from dmplay.transcript.header import header_facts
from dmplay.views.style import Look, whole

ROOM = Room(80, 24)
SHORT_ROOM_ROWS = 18
AROUND = 8  # rows of title, goal, log, message and keys
DICE = ("seed", "episode")
CLEAR = "\x1b[H\x1b[2J"


def screens(game: Playback, room: Room) -> Iterator[Text]:
    """The screen before the first turn and after every turn or event."""
    return (compose(game, room, Shown(), log) for log in _told(game))


def _told(game: Playback) -> Iterator[list[str]]:
    """What was told before the first turn and after every turn or event."""
    log: list[str] = []
    yield log
    for before in game.run():
        log.append(game.account.change(game.view(), before))
        yield log


def _roomy(game: Playback, room: Room) -> Room:
    """The room, or a larger one where the picture that a problem brings would not be whole."""
    most = room.width, room.height - AROUND
    width, height = whole(game.style, game.view(), *most)
    return room._replace(width=width, height=height + AROUND)


def _short(game: Playback, room: Room) -> Room:
    """The same, of few rows."""
    return _roomy(game, room._replace(height=SHORT_ROOM_ROWS))


def _last(game: Playback, turn: int | None, room: Room) -> Text:
    """The screen after a turn, or after the last."""
    for log in _told(game):
        if len(game.session.turns) == turn or (turn is None and game.whole):
            return compose(game, _short(game, room), Shown(), log)
    turns = counted(len(game.session.turns), "turn")
    raise BadParameter(f"--at: got {turn}, the game has {turns}")


def svg(game: Playback, turn: int | None, room: Room) -> Iterator[str]:
    """A picture of the screen after a turn."""
    yield picture(_last(game, turn, room), f"dmplay {game.name}", width=room.width)


def film(game: Playback, turn: int | None, room: Room) -> Iterator[str]:
    """The screen turn by turn, as an animated picture."""
    shown = screens(game, _short(game, room))
    yield from pictures(shown, 1 + game.steps, f"dmplay {game.name}", room.width)


def html(game: Playback, turn: int | None, room: Room) -> Iterator[str]:
    """A page of its own with every turn, open at one."""
    yield page(game, turn, Look(room.width, room.height, room.ascii, large=True))


def cast(game: Playback, turn: int | None, room: Room) -> Iterator[str]:
    """A screen recording, asciicast version 2, a second a turn."""
    size = {"width": room.width, "height": room.height}
    yield _line({"version": 2, **size, "title": f"dmplay {game.name}"})
    for second, shown in enumerate(_written(game, room)):
        yield _line([float(second), "o", shown])


def cast3(game: Playback, turn: int | None, room: Room) -> Iterator[str]:
    """The same as asciicast version 3, where each screen tells how long after the last it comes."""
    term = {"cols": room.width, "rows": room.height}
    yield _line({"version": 3, "term": term, "title": f"dmplay {game.name}"})
    for number, shown in enumerate(_written(game, room)):
        yield _line([float(number > 0), "o", shown])


def _written(game: Playback, room: Room) -> Iterator[str]:
    """The screens as a terminal in raw mode is sent them."""
    drawn = (ansi(shown, "default") for shown in screens(game, room))
    return (CLEAR + one.replace("\n", "\r\n") for one in drawn)


def _line(value: object) -> str:
    return f"{json.dumps(value)}\n"


def text(game: Playback, turn: int | None, room: Room) -> Iterator[str]:
    """Every turn in words, with the board under it."""
    for shown in screens(game, _short(game, room)):
        rows = [row.rstrip() for row in shown.plain.split("\n")]
        yield "\n".join(rows).rstrip() + "\n\n"


def rows_of_turns(game: Playback, turn: int | None, room: Room) -> Iterator[str]:
    """A row a turn as comma-separated values, a column a fact and seat."""
    columns: dict[str, None] = {}
    rows: list[tuple[object, ...]] = []  # each as long as there were columns then
    for facts in _facts(game):
        row = dict(_columns(facts))
        columns |= dict.fromkeys(row)
        rows.append(tuple(map(row.get, columns)))
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    for told in [tuple(columns), *rows]:
        writer.writerow([*told, *[None] * (len(columns) - len(told))])
        yield out.getvalue()
        out.seek(0)
        out.truncate()


def _columns(facts: Mapping[str, object]) -> Iterator[tuple[str, object]]:
    """What a turn has in each column."""
    for key, value in facts.items():
        for name, one in value.items() if isinstance(value, dict) else [("", value)]:
            yield f"{key} {name}".strip(), json.dumps(one) if isinstance(one, list) else one


def data(game: Playback, turn: int | None, room: Room) -> Iterator[str]:
    """The whole game as one JSON object."""
    told = header_facts(game.transcript.header).items()
    facts = {key: value for key, value in told if game.shows_seed or key not in DICE}
    shell = json.dumps(facts | {"turns": []}, indent=1)  # the list, not the limit
    before, after = shell.removesuffix("\n}").split('\n "turns": []')
    yield f'{before}\n "turns": ['
    for number, one in enumerate(_facts(game)):
        yield ("," if number else "") + _deeper(f"\n{json.dumps(one, indent=1)}", 2)
    end = _deeper(json.dumps(end_facts(game.session), indent=1), 1)
    yield f'\n ]{after},\n "end": {end}\n}}\n'


def _deeper(told: str, by: int) -> str:
    """JSON as it stands inside of other JSON."""
    return told.replace("\n", "\n" + " " * by)


def _facts(game: Playback) -> Iterator[dict[str, object]]:
    yield game.account.turn()
    for before in game.run():
        more = len(game.session.turns) - before
        event = {1: {}, 0: {"event": "reroll"}}.get(more, {"event": "undo"})
        yield game.account.turn() | event


WRITERS: dict[str, Callable[[Playback, int | None, Room], Iterator[str]]] = {
    "svg": svg, "film": film, "html": html, "cast": cast, "cast3": cast3, "text": text,
    "csv": rows_of_turns, "json": data,
}  # fmt: skip


def exported(  # noqa: PLR0913 - a file, and what is wanted of it
    file: Path,
    chosen: Sequence[str],
    turn: int | None,
    output: Path | None,
    *,
    width: int | None = None,
    ascii_: bool = False,
    force: bool = False,
    trusted: bool = False,
    peek: bool = False,
) -> Printout:
    """A transcript in the one form chosen; nothing where it is written to a file."""
    if len(chosen) != 1:
        raise BadParameter(f"export: choose one of {', '.join(f'--{name}' for name in FORMATS)}")
    (form,) = chosen
    if turn is not None and not FORMATS[form].still:
        stills = " or ".join(f"--{name}" for name, one in FORMATS.items() if one.still)
        raise BadParameter(f"--at: a turn of {stills}, not of --{form}")
    game = Playback(file, trusted=trusted, peek=peek)
    if output:
        apart(output, game.transcript.path)
    room = _roomy(game, Room(width or ROOM.width, ROOM.height, ascii_))
    return kept(output, WRITERS[form](game, turn, room), force=force)

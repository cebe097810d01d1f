"""A recorded game as something else: pictures, a screen recording, text, a table, data."""

import csv
import io
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from json.encoder import encode_basestring_ascii
from pathlib import Path
from typing import Any, NamedTuple

from rich.text import Text

from dmplay.describe import counted
from dmplay.disk import apart
from dmplay.errors import BadParameter
from dmplay.game.errand import Printout
from dmplay.game.formats import FORMATS, fits
from dmplay.game.game import Game
from dmplay.game.playback import Playback
from dmplay.game.request import Recording, Request
from dmplay.game.seats import people
from dmplay.keys.keyboard import Keyboard
from dmplay.keys.keymap import AS_DRAWN
from dmplay.reports.drawing import film as pictures
from dmplay.reports.drawing import kept, picture
from dmplay.reports.page import page
from dmplay.screen.frame import Frame, Part, compose
from dmplay.screen.shown import NOTHING, Room, Shown, within
from dmplay.styles import Line, ansi, words
from dmplay.transcript.format import end_facts
from dmplay.transcript.header import header_facts
from dmplay.views.kept import Moment, Once
from dmplay.views.style import Look, Needed, whole

COLUMNS = 80  # of a screen
AROUND = 8  # rows of title, goal, log, message and keys
MOST_PARTS, MOST_ROWS = 2**10, 2**8  # that are remembered as they were drawn
DICE = ("seed", "episode")
CLEAR = r"\u001b[H\u001b[2J"  # the screen, as it stands in JSON


class Aspect(NamedTuple):
    """What is to be seen: the screen's room, the turn of a picture, and whether with a hint."""

    room: Room = Room(0, 0)  # 0 for as many columns, or rows, as is usual
    turn: int | None = None  # the last one
    hint: bool = False
    wishes: Sequence[str] = ()  # options of a screen that were typed


class Drawn:
    """Screens in another form, of which most parts and rows come again."""

    def __init__(self, room: Room, draw: Callable[[Line], str], end: str) -> None:
        self._room, self._end = room, end
        by_words: Callable[[Any], str] = lru_cache(MOST_ROWS)(lambda row: draw(within(row, room)))
        texts = Once[Any](lambda row: draw(within(row, room)), MOST_ROWS).of
        self._row = {str: by_words, tuple: by_words, Text: texts, Needed: texts}
        self._parts = Once[Part](lambda part: end.join(self._rows(part)), MOST_PARTS)

    def screen(self, game: Game, now: Moment, log: list[str]) -> str:
        """The rows of a screen, with the end of a row between them."""
        told: list[str] = []
        for part in Frame(game, self._room, NOTHING, log, now).parts():
            told += [self._parts.of(part)] if isinstance(part, tuple) else self._rows(part)
        return self._end.join(told)

    def _rows(self, part: Part) -> list[str]:
        drawn = self._row
        return [drawn[type(row)](row) for row in part]


def screens(game: Playback, room: Room) -> Iterator[Text]:
    """The screen before the first turn and after every turn or event."""
    return (compose(game, room, NOTHING, log) for _, log in _told(game))


def _told(game: Playback) -> Iterator[tuple[Moment, list[str]]]:
    """What is known and was told before the first turn and after every turn or event."""
    now, log = game.moment(), list[str]()
    yield now, log
    for before in game.run():
        now = game.moment()
        log.append(game.account.change(now, before))
        yield now, log


def _roomy(game: Playback, room: Room) -> Room:
    """The room, or a larger one where the picture that a problem brings would not be whole."""
    most = room.width, room.height - AROUND
    width, height = whole(game.style, game.view(), *most)
    return room._replace(width=width, height=height + AROUND)


def _last(game: Playback, aspect: Aspect) -> Text:
    """The screen after a turn, or after the last."""
    game.watched = game.paid = not aspect.hint  # else as a player sees it
    for _, log in _told(game):
        if len(game.session.turns) == aspect.turn or (aspect.turn is None and game.whole):
            if aspect.hint:
                return _advised(game, aspect.room, log)
            return compose(game, aspect.room, Shown(), log)
    turns = counted(len(game.session.turns), "turn")
    raise BadParameter(f"--at: got {aspect.turn}, the game has {turns}")


def _advised(game: Playback, room: Room, log: list[str]) -> Text:
    """The screen of who is to choose now, with a hint."""
    if game.session.over:
        raise BadParameter("--hint: nobody chooses after the end; --at shows an earlier turn")
    hands = Keyboard(game.problem, people(game.seats) or [0], AS_DRAWN)
    request = Request(game.name, seed_known=game.shows_seed)
    played = Game(game.name, game.session, game.seats, hands, request=request)
    told = played.adviser.hint()
    advice = played.adviser.given
    shown = Shown(message=advice.short if advice else told, advice=advice)
    return compose(played, room, shown, log)


def svg(game: Playback, aspect: Aspect) -> Iterator[str]:
    """A picture of the screen after a turn."""
    yield picture(_last(game, aspect), f"dmplay {game.name}", width=aspect.room.width)


def film(game: Playback, aspect: Aspect) -> Iterator[str]:
    """The screen turn by turn, as an animated picture."""
    shown, title = screens(game, aspect.room), f"dmplay {game.name}"
    yield from pictures(shown, 1 + game.steps, title, aspect.room.width)


def html(game: Playback, aspect: Aspect) -> Iterator[str]:
    """A page of its own with every turn, open at one."""
    return page(game, aspect.turn, Look(*aspect.room, large=True))


def cast(game: Playback, aspect: Aspect) -> Iterator[str]:
    """A screen recording, asciicast version 2, a second a turn."""
    size = {"width": aspect.room.width, "height": aspect.room.height}
    yield _line({"version": 2, **size, "title": f"dmplay {game.name}"})
    for second, shown in enumerate(_written(game, aspect.room)):
        yield f'[{second}.0, "o", "{CLEAR}{shown}"]\n'


def cast3(game: Playback, aspect: Aspect) -> Iterator[str]:
    """The same as asciicast version 3, where each screen tells how long after the last it comes."""
    term = {"cols": aspect.room.width, "rows": aspect.room.height}
    yield _line({"version": 3, "term": term, "title": f"dmplay {game.name}"})
    for number, shown in enumerate(_written(game, aspect.room)):
        yield f'[{float(number > 0)}, "o", "{CLEAR}{shown}"]\n'


def _written(game: Playback, room: Room) -> Iterator[str]:
    """The screens as a terminal in raw mode is sent them, as they stand in JSON."""
    drawn = Drawn(room, lambda row: _quoted(ansi(row, "default")), _quoted("\r\n"))
    return (drawn.screen(game, now, log) for now, log in _told(game))


def _quoted(told: str) -> str:
    """A text as it stands between the quotes of JSON."""
    return encode_basestring_ascii(told)[1:-1]


def _line(value: object) -> str:
    return f"{json.dumps(value)}\n"


def text(game: Playback, aspect: Aspect) -> Iterator[str]:
    """Every turn in words, with the board under it."""
    drawn = Drawn(aspect.room, lambda row: words(row).rstrip(), "\n")
    for now, log in _told(game):
        yield drawn.screen(game, now, log).rstrip() + "\n\n"


def rows_of_turns(game: Playback, aspect: Aspect) -> Iterator[str]:
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


def data(game: Playback, aspect: Aspect) -> Iterator[str]:
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


WRITERS: dict[str, Callable[[Playback, Aspect], Iterator[str]]] = {
    "svg": svg, "film": film, "html": html, "cast": cast, "cast3": cast3, "text": text,
    "csv": rows_of_turns, "json": data,
}  # fmt: skip


def exported(
    recording: Recording,
    chosen: Sequence[str],
    aspect: Aspect,
    output: Path | None = None,
    *,
    force: bool = False,
) -> Printout:
    """A transcript in the one form chosen; nothing where it is written to a file."""
    if len(chosen) != 1:
        raise BadParameter(f"export: choose one of {', '.join(f'--{name}' for name in FORMATS)}")
    (form,) = chosen
    if aspect.turn is not None and not FORMATS[form].still:
        stills = " or ".join(f"--{name}" for name, one in FORMATS.items() if one.still)
        raise BadParameter(f"--at: a turn of {stills}, not of --{form}")
    if aspect.hint and form != "svg":
        raise BadParameter(f"--hint: on a picture, --svg, not on --{form}")
    if aspect.wishes and not FORMATS[form].rows:
        raise BadParameter(f"--{aspect.wishes[0]}: of a screen, which --{form} does not have")
    fits(output, form)
    game = Playback(recording.path, trusted=recording.trusted, peek=recording.peek)
    if output:
        apart(output, game.transcript.path)
    width, height, ascii_ = aspect.room
    room = Room(width or COLUMNS, height or FORMATS[form].rows, ascii_)
    if room.height:
        room = _roomy(game, room)
    return kept(output, WRITERS[form](game, aspect._replace(room=room)), force=force)

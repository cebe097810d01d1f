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

from dmplay.describe import format_count
from dmplay.disk import check_not_source
from dmplay.errors import BadParameter
from dmplay.game.errand import Printout
from dmplay.game.formats import EXPORT_FORMATS, check_extension
from dmplay.game.game import Game
from dmplay.game.playback import Playback
from dmplay.game.request import GameRequest, ReplayRequest
from dmplay.game.seats import list_human_seats
from dmplay.keys.keyboard import Keyboard
from dmplay.keys.keymap import DEFAULT_KEY_PREFERENCES
from dmplay.reports.drawing import text_to_svg, write_or_print
from dmplay.reports.drawing import texts_to_animated_svg as pictures
from dmplay.reports.page import render_page
from dmplay.screen.frame import Frame, ScreenRows, compose_frame
from dmplay.screen.shown import EMPTY_FRAME_STATE, FrameState, Viewport, fit_line
from dmplay.styles import ScreenLine, to_ansi, to_plain_text
from dmplay.transcript.format import collect_end_facts
from dmplay.transcript.header import collect_header_facts
from dmplay.views.kept import IdentityCache, SeatSnapshot
from dmplay.views.style import DrawOptions, TooSmallNotice, expand_for_picture

DEFAULT_COLUMNS = 80  # of a screen
ROWS_AROUND_BOARD = 8  # rows of title, goal, log, message and keys
MAX_CACHED_PARTS, MAX_CACHED_ROWS = 2**10, 2**8  # that are remembered as they were drawn
SEED_KEYS = ("seed", "episode")
CLEAR_SCREEN_JSON = r"\u001b[H\u001b[2J"  # the screen, as it stands in JSON


class ExportOptions(NamedTuple):
    """What is to be seen: the screen's room, the turn of a picture, and whether with a hint."""

    viewport: Viewport = Viewport(0, 0)  # 0 for as many columns, or rows, as is usual
    turn: int | None = None  # the last one
    hint: bool = False
    typed_options: Sequence[str] = ()  # options of a screen that were typed


class ScreenRenderer:
    """Screens in another form, of which most parts and rows come again."""

    def __init__(self, viewport: Viewport, draw: Callable[[ScreenLine], str], row_end: str) -> None:
        self._viewport, self._row_end = viewport, row_end
        by_words: Callable[[Any], str] = lru_cache(MAX_CACHED_ROWS)(
            lambda row: draw(fit_line(row, viewport))
        )
        texts = IdentityCache[Any](lambda row: draw(fit_line(row, viewport)), MAX_CACHED_ROWS).get
        self._draw_by_type = {str: by_words, tuple: by_words, Text: texts, TooSmallNotice: texts}
        self._part_cache = IdentityCache[ScreenRows](
            lambda part: row_end.join(self._draw_rows(part)), MAX_CACHED_PARTS
        )

    def render_screen(self, game: Game, snapshot: SeatSnapshot, log: list[str]) -> str:
        """The rows of a screen, with the end of a row between them."""
        told: list[str] = []
        for part in Frame(game, self._viewport, EMPTY_FRAME_STATE, log, snapshot).compose_parts():
            told += (
                [self._part_cache.get(part)] if isinstance(part, tuple) else self._draw_rows(part)
            )
        return self._row_end.join(told)

    def _draw_rows(self, part: ScreenRows) -> list[str]:
        drawn = self._draw_by_type
        return [drawn[type(row)](row) for row in part]


def iter_screens(game: Playback, viewport: Viewport) -> Iterator[Text]:
    """The screen before the first turn and after every turn or event."""
    return (
        compose_frame(game, viewport, EMPTY_FRAME_STATE, log) for _, log in _iter_snapshots(game)
    )


def _iter_snapshots(game: Playback) -> Iterator[tuple[SeatSnapshot, list[str]]]:
    """What is known and was told before the first turn and after every turn or event."""
    now, log = game.snapshot(), list[str]()
    yield now, log
    for before in game.iter_agent_turns():
        now = game.snapshot()
        log.append(game.narrator.describe_change(now, before))
        yield now, log


def _fit_viewport(game: Playback, viewport: Viewport) -> Viewport:
    """The room, or a larger one where the picture that a problem brings would not be whole."""
    most = viewport.width, viewport.height - ROWS_AROUND_BOARD
    width, height = expand_for_picture(game.view_module, game.view(), *most)
    return viewport._replace(width=width, height=height + ROWS_AROUND_BOARD)


def _screen_at_turn(game: Playback, options: ExportOptions) -> Text:
    """The screen after a turn, or after the last."""
    game.agents_only = game.rewards_visible = not options.hint  # else as a player sees it
    for _, log in _iter_snapshots(game):
        if len(game.session.turns) == options.turn or (options.turn is None and game.is_at_end):
            if options.hint:
                return _screen_with_hint(game, options.viewport, log)
            return compose_frame(game, options.viewport, FrameState(), log)
    turns = format_count(len(game.session.turns), "turn")
    raise BadParameter(f"--at: got {options.turn}, the game has {turns}")


def _screen_with_hint(game: Playback, viewport: Viewport, log: list[str]) -> Text:
    """The screen of who is to choose now, with a hint."""
    if game.session.over:
        raise BadParameter("--hint: nobody chooses after the end; --at shows an earlier turn")
    hands = Keyboard(
        game.problem, list_human_seats(game.player_names) or [0], DEFAULT_KEY_PREFERENCES
    )
    request = GameRequest(game.problem_name, is_seed_visible=game.is_seed_visible)
    played = Game(game.problem_name, game.session, game.player_names, hands, request=request)
    told = played.hint_provider.create_hint()
    advice = played.hint_provider.current_hint
    shown = FrameState(message=advice.summary if advice else told, hint=advice)
    return compose_frame(played, viewport, shown, log)


def render_svg(game: Playback, options: ExportOptions) -> Iterator[str]:
    """A picture of the screen after a turn."""
    yield text_to_svg(
        _screen_at_turn(game, options), f"dmplay {game.problem_name}", width=options.viewport.width
    )


def render_film(game: Playback, options: ExportOptions) -> Iterator[str]:
    """The screen turn by turn, as an animated picture."""
    shown, title = iter_screens(game, options.viewport), f"dmplay {game.problem_name}"
    yield from pictures(shown, 1 + game.step_count, title, options.viewport.width)


def render_html(game: Playback, options: ExportOptions) -> Iterator[str]:
    """A page of its own with every turn, open at one."""
    return render_page(game, options.turn, DrawOptions(*options.viewport, allow_large=True))


def render_cast(game: Playback, options: ExportOptions) -> Iterator[str]:
    """A screen recording, asciicast version 2, a second a turn."""
    size = {"width": options.viewport.width, "height": options.viewport.height}
    yield _json_line({"version": 2, **size, "title": f"dmplay {game.problem_name}"})
    for second, shown in enumerate(_iter_json_screens(game, options.viewport)):
        yield f'[{second}.0, "o", "{CLEAR_SCREEN_JSON}{shown}"]\n'


def render_cast3(game: Playback, options: ExportOptions) -> Iterator[str]:
    """The same as asciicast version 3, where each screen tells how long after the last it comes."""
    term = {"cols": options.viewport.width, "rows": options.viewport.height}
    yield _json_line({"version": 3, "term": term, "title": f"dmplay {game.problem_name}"})
    for number, shown in enumerate(_iter_json_screens(game, options.viewport)):
        yield f'[{float(number > 0)}, "o", "{CLEAR_SCREEN_JSON}{shown}"]\n'


def _iter_json_screens(game: Playback, viewport: Viewport) -> Iterator[str]:
    """The screens as a terminal in raw mode is sent them, as they stand in JSON."""
    drawn = ScreenRenderer(
        viewport, lambda row: _quote_json(to_ansi(row, "default")), _quote_json("\r\n")
    )
    return (drawn.render_screen(game, now, log) for now, log in _iter_snapshots(game))


def _quote_json(text: str) -> str:
    """A text as it stands between the quotes of JSON."""
    return encode_basestring_ascii(text)[1:-1]


def _json_line(value: object) -> str:
    return f"{json.dumps(value)}\n"


def render_text(game: Playback, options: ExportOptions) -> Iterator[str]:
    """Every turn in words, with the board under it."""
    drawn = ScreenRenderer(options.viewport, lambda row: to_plain_text(row).rstrip(), "\n")
    for now, log in _iter_snapshots(game):
        yield drawn.render_screen(game, now, log).rstrip() + "\n\n"


def render_csv(game: Playback, options: ExportOptions) -> Iterator[str]:
    """A row a turn as comma-separated values, a column a fact and seat."""
    columns: dict[str, None] = {}
    rows: list[tuple[object, ...]] = []  # each as long as there were columns then
    for facts in _iter_turn_facts(game):
        row = dict(_turn_columns(facts))
        columns |= dict.fromkeys(row)
        rows.append(tuple(map(row.get, columns)))
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    for told in [tuple(columns), *rows]:
        writer.writerow([*told, *[None] * (len(columns) - len(told))])
        yield out.getvalue()
        out.seek(0)
        out.truncate()


def _turn_columns(facts: Mapping[str, object]) -> Iterator[tuple[str, object]]:
    """What a turn has in each column."""
    for key, value in facts.items():
        for name, one in value.items() if isinstance(value, dict) else [("", value)]:
            yield f"{key} {name}".strip(), json.dumps(one) if isinstance(one, list) else one


def render_json(game: Playback, options: ExportOptions) -> Iterator[str]:
    """The whole game as one JSON object."""
    told = collect_header_facts(game.transcript.header).items()
    facts = {key: value for key, value in told if game.is_seed_visible or key not in SEED_KEYS}
    shell = json.dumps(facts | {"turns": []}, indent=1)  # the list, not the limit
    before, after = shell.removesuffix("\n}").split('\n "turns": []')
    yield f'{before}\n "turns": ['
    for number, one in enumerate(_iter_turn_facts(game)):
        yield ("," if number else "") + _indent_json(f"\n{json.dumps(one, indent=1)}", 2)
    end = _indent_json(json.dumps(collect_end_facts(game.session), indent=1), 1)
    yield f'\n ]{after},\n "end": {end}\n}}\n'


def _indent_json(text: str, columns: int) -> str:
    """JSON as it stands inside of other JSON."""
    return text.replace("\n", "\n" + " " * columns)


def _iter_turn_facts(game: Playback) -> Iterator[dict[str, object]]:
    yield game.narrator.all_turn_facts()
    for before in game.iter_agent_turns():
        more = len(game.session.turns) - before
        event = {1: {}, 0: {"event": "reroll"}}.get(more, {"event": "undo"})
        yield game.narrator.all_turn_facts() | event


RENDERERS: dict[str, Callable[[Playback, ExportOptions], Iterator[str]]] = {
    "svg": render_svg, "film": render_film, "html": render_html, "cast": render_cast, "cast3": render_cast3, "text": render_text,
    "csv": render_csv, "json": render_json,
}  # fmt: skip


def export_transcript(
    recording: ReplayRequest,
    formats: Sequence[str],
    options: ExportOptions,
    output: Path | None = None,
    *,
    force: bool = False,
) -> Printout:
    """A transcript in the one form chosen; nothing where it is written to a file."""
    if len(formats) != 1:
        raise BadParameter(
            f"export: choose one of {', '.join(f'--{name}' for name in EXPORT_FORMATS)}"
        )
    (form,) = formats
    if options.turn is not None and not EXPORT_FORMATS[form].shows_one_turn:
        stills = " or ".join(
            f"--{name}" for name, one in EXPORT_FORMATS.items() if one.shows_one_turn
        )
        raise BadParameter(f"--at: a turn of {stills}, not of --{form}")
    if options.hint and form != "svg":
        raise BadParameter(f"--hint: on a picture, --svg, not on --{form}")
    if options.typed_options and not EXPORT_FORMATS[form].screen_rows:
        raise BadParameter(
            f"--{options.typed_options[0]}: of a screen, which --{form} does not have"
        )
    check_extension(output, form)
    game = Playback(recording.path, trusted=recording.trusted, peek=recording.peek)
    if output:
        check_not_source(output, game.transcript.path)
    width, height, ascii_ = options.viewport
    room = Viewport(width or DEFAULT_COLUMNS, height or EXPORT_FORMATS[form].screen_rows, ascii_)
    if room.height:
        room = _fit_viewport(game, room)
    return write_or_print(
        output, RENDERERS[form](game, options._replace(viewport=room)), force=force
    )

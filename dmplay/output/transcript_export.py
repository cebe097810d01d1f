"""Export of a recorded game as SVG, HTML, screen recording, text, CSV or JSON."""

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from json.encoder import encode_basestring_ascii
from pathlib import Path
from typing import NamedTuple

from rich.text import Text

from dmplay.core.text import format_count
from dmplay.draw.options import DrawOptions
from dmplay.errors import BadParameter
from dmplay.game.action_input import Keyboard
from dmplay.game.command_line_results import Printout
from dmplay.game.export_formats import EXPORT_FORMATS, check_extension_fits_format
from dmplay.game.game import Game
from dmplay.game.key_preferences import DEFAULT_KEY_PREFERENCES
from dmplay.game.launch_requests import GameRequest, ReplayRequest
from dmplay.game.playback import Playback
from dmplay.game.recorded_games import RecordedGame, iter_games, list_rows_with_file
from dmplay.game.seat_snapshot import SeatSnapshot
from dmplay.game.seats import list_human_seats
from dmplay.game.transcript_verification import iter_transcript_files
from dmplay.game.turn_facts import Row, flatten_turn_facts, join_review
from dmplay.output.film import texts_to_animated_svg
from dmplay.output.grading_report import FAILURE_EXIT_CODE
from dmplay.output.html_export import render_page
from dmplay.output.svg_export import choose_picture_path, text_to_svg, write_or_print
from dmplay.output.tables import format_csv_row
from dmplay.terminal.progress import ProgressBar
from dmplay.terminal.styles import ScreenLine, to_ansi, to_plain_text
from dmplay.transcript.format import collect_end_facts
from dmplay.ui.screen.frame import Frame, compose_frame
from dmplay.ui.screen.frame_state import PICTURE_FRAME_STATE, Viewport, fit_line
from dmplay.views.protocol import expand_for_picture

DEFAULT_COLUMNS = 80  # columns of a screen
ROWS_AROUND_BOARD = 8  # rows of title, goal, log, message and keys
MAX_CACHED_ROWS = 2**10  # drawn rows of screens that are kept
ROW_FORMATS = ("csv", "jsonl")  # formats with a row for each turn, also of several games
# escape sequences that clear the screen, quoted as in JSON
CLEAR_SCREEN_JSON = r"\u001b[H\u001b[2J"


class ExportOptions(NamedTuple):
    """Options of an export: the viewport, the turn of a picture, and whether to draw a hint."""

    viewport: Viewport = Viewport(0, 0)  # 0 for the default number of columns or rows
    turn: int | None = None  # None for the last turn
    hint: bool = False
    typed_options: Sequence[str] = ()  # typed options that apply to screens only
    review: bool = False  # whether rows have the values and the regret of choices


def _iter_screen_strings(
    game: Playback, viewport: Viewport, draw_row: Callable[[ScreenLine], str], row_end: str
) -> Iterator[str]:
    """Yield each screen as a string: its rows, drawn by `draw_row`, with `row_end` between them."""
    drawn_rows: dict[object, str] = {}  # Screens that follow each other share most rows.

    def draw_or_look_up(row: ScreenLine) -> str:
        """Return a row drawn by `draw_row`, from the rows drawn before if it is among them."""
        key = (row.plain, *row.spans, row.style) if isinstance(row, Text) else row
        drawn = drawn_rows.get(key)
        if drawn is None:
            if len(drawn_rows) >= MAX_CACHED_ROWS:
                drawn_rows.clear()
            drawn = drawn_rows[key] = draw_row(fit_line(row, viewport))
        return drawn

    for snapshot, log in _iter_snapshots(game):
        parts = Frame(game, viewport, PICTURE_FRAME_STATE, log, snapshot).compose_parts()
        yield row_end.join([draw_or_look_up(row) for part in parts for row in part])


def iter_screens(game: Playback, viewport: Viewport) -> Iterator[Text]:
    """Yield the screen before the first turn and after every turn or event."""
    return (
        compose_frame(game, viewport, PICTURE_FRAME_STATE, log) for _, log in _iter_snapshots(game)
    )


def _iter_snapshots(game: Playback) -> Iterator[tuple[SeatSnapshot, list[str]]]:
    """Yield the snapshot and the log before the first turn and after every turn or event."""
    snapshot, log = game.snapshot(), list[str]()
    yield snapshot, log
    for turns_before in game.iter_agent_turns():
        snapshot = game.snapshot()
        log.append(game.narrator.describe_change(snapshot, turns_before))
        yield snapshot, log


def _enlarge_viewport(game: Playback, viewport: Viewport) -> Viewport:
    """Return the viewport, enlarged if the problem's own picture would not fit."""
    board_size = viewport.width, viewport.height - ROWS_AROUND_BOARD
    width, height = expand_for_picture(game.view_module, game.view(), *board_size)
    return viewport._replace(width=width, height=height + ROWS_AROUND_BOARD)


def _draw_screen(game: Playback, options: ExportOptions) -> Text:
    """Return the screen after the chosen turn, or after the last turn.

    Raise BadParameter if there is no such turn.
    """
    # with a hint, show only the player's information
    game.agents_only = game.rewards_visible = not options.hint
    for _, log in _iter_snapshots(game):
        if len(game.session.turns) == options.turn or (options.turn is None and game.is_at_end):
            if options.hint:
                return _draw_screen_with_hint(game, options.viewport, log)
            return compose_frame(game, options.viewport, PICTURE_FRAME_STATE, log)
    turns = format_count(len(game.session.turns), "turn")
    raise BadParameter(f"--at: got {options.turn}, the game has {turns}")


def _draw_screen_with_hint(game: Playback, viewport: Viewport, log: list[str]) -> Text:
    """Return the screen of the player who chooses now, with a hint.

    Raise BadParameter if the game is over.
    """
    if game.session.over:
        raise BadParameter("--hint: the game is over; choose an earlier turn with --at")
    keyboard = Keyboard(
        game.problem, list_human_seats(game.player_names) or [0], DEFAULT_KEY_PREFERENCES
    )
    request = GameRequest(game.problem_name, is_seed_visible=game.is_seed_visible)
    playable = Game(game.problem_name, game.session, game.player_names, keyboard, request=request)
    message = playable.hint_provider.create_hint()
    hint = playable.hint_provider.current_hint
    summary = hint.summary if hint else message
    frame_state = PICTURE_FRAME_STATE._replace(message=summary, hint=hint)
    return compose_frame(playable, viewport, frame_state, log)


def render_svg(game: Playback, options: ExportOptions) -> Iterator[str]:
    """Yield an SVG picture of the screen after a turn."""
    yield text_to_svg(
        _draw_screen(game, options), f"dmplay {game.problem_name}", width=options.viewport.width
    )


def render_film(game: Playback, options: ExportOptions) -> Iterator[str]:
    """Yield the screen turn by turn as an animated SVG."""
    texts, title = iter_screens(game, options.viewport), f"dmplay {game.problem_name}"
    yield from texts_to_animated_svg(texts, 1 + game.step_count, title, options.viewport.width)


def render_html(game: Playback, options: ExportOptions) -> Iterator[str]:
    """Return the parts of a standalone HTML page with every turn, open at one of them."""
    return render_page(game, options.turn, DrawOptions(*options.viewport, allow_large=True))


def render_cast(game: Playback, options: ExportOptions) -> Iterator[str]:
    """Yield a screen recording in asciicast version 3, one second per turn.

    In this version, the time of a screen is relative to the previous one.
    """
    term = {"cols": options.viewport.width, "rows": options.viewport.height}
    title = f"dmplay {game.problem_name}"
    yield f"{json.dumps({'version': 3, 'term': term, 'title': title})}\n"
    for number, screen in enumerate(_iter_json_screens(game, options.viewport)):
        yield f'[{float(number > 0)}, "o", "{CLEAR_SCREEN_JSON}{screen}"]\n'


def _iter_json_screens(game: Playback, viewport: Viewport) -> Iterator[str]:
    """Yield the screens as a terminal in raw mode receives them, quoted as in JSON."""
    return _iter_screen_strings(
        game, viewport, lambda row: _quote_json(to_ansi(row, "default")), _quote_json("\r\n")
    )


def _quote_json(text: str) -> str:
    """Return a text quoted as in JSON, without the quotation marks."""
    return encode_basestring_ascii(text)[1:-1]


def render_text(game: Playback, options: ExportOptions) -> Iterator[str]:
    """Yield every screen as plain text."""
    for screen in _iter_screen_strings(
        game, options.viewport, lambda row: to_plain_text(row).rstrip(), "\n"
    ):
        yield screen.rstrip() + "\n\n"


def render_csv(game: Playback, options: ExportOptions) -> Iterator[str]:
    """Yield the turns as CSV, one row per turn and one column per fact and seat."""
    return format_rows_as_csv(_iter_rows(game, options))


def render_jsonl(game: Playback, options: ExportOptions) -> Iterator[str]:
    """Yield the turns as lines of JSON, with the columns of the CSV."""
    return map(_format_json_line, _iter_rows(game, options))


def _iter_rows(game: Playback, options: ExportOptions) -> Iterable[Row]:
    """Return a row for the initial position and for every turn, undo or reroll."""
    rows = map(flatten_turn_facts, game.iter_turn_facts())
    return join_review([*rows], game.review_choices()) if options.review else rows


def format_rows_as_csv(rows: Iterable[Row]) -> Iterator[str]:
    """Yield rows as CSV with a header of all their columns; lists and tables are JSON."""
    columns: dict[str, None] = {}
    cells: list[tuple[object, ...]] = []  # of each row, for the columns known at that row
    for row in rows:
        columns |= dict.fromkeys(row)
        cells.append(tuple(_to_cell(row.get(column)) for column in columns))
    for values in [tuple(columns), *cells]:
        yield format_csv_row([*values, *[None] * (len(columns) - len(values))])


def _to_cell(value: object) -> object:
    """Return a list or a table as JSON, and any other value unchanged."""
    return json.dumps(value) if isinstance(value, list | dict) else value


def _format_json_line(row: Row) -> str:
    """Return a row as a line of JSON."""
    return f"{json.dumps(row)}\n"


def render_json(game: Playback, options: ExportOptions) -> Iterator[str]:
    """Yield the whole game as one JSON object."""
    # the list of turns replaces the turn limit
    outline = json.dumps(game.header | {"turns": []}, indent=1)
    before, after = outline.removesuffix("\n}").split('\n "turns": []')
    yield f'{before}\n "turns": ['
    for number, turn_facts in enumerate(game.iter_turn_facts()):
        yield ("," if number else "") + _indent_json(f"\n{json.dumps(turn_facts, indent=1)}", 2)
    end = _indent_json(json.dumps(collect_end_facts(game.session), indent=1), 1)
    yield f'\n ]{after},\n "end": {end}\n}}\n'


def _indent_json(text: str, columns: int) -> str:
    """Return JSON text with all lines but the first indented."""
    return text.replace("\n", "\n" + " " * columns)


RENDERERS: dict[str, Callable[[Playback, ExportOptions], Iterator[str]]] = {
    "svg": render_svg,
    "film": render_film,
    "html": render_html,
    "cast": render_cast,
    "text": render_text,
    "csv": render_csv,
    "jsonl": render_jsonl,
    "json": render_json,
}


def _choose_format(formats: Sequence[str], options: ExportOptions) -> str:
    """Return the format; raise BadParameter unless it is the only one and the options suit it."""
    if len(formats) != 1:
        raise BadParameter(
            f"export: choose one of {', '.join(f'--{name}' for name in EXPORT_FORMATS)}"
        )
    (format_name,) = formats
    if options.turn is not None and not EXPORT_FORMATS[format_name].shows_one_turn:
        stills = " or ".join(
            f"--{name}"
            for name, export_format in EXPORT_FORMATS.items()
            if export_format.shows_one_turn
        )
        raise BadParameter(f"--at: only with {stills}, not with --{format_name}")
    if options.hint and format_name != "svg":
        raise BadParameter(f"--hint: only with --svg, not with --{format_name}")
    if options.review and format_name not in ROW_FORMATS:
        raise BadParameter(f"--review: only with --csv or --jsonl, not with --{format_name}")
    if options.typed_options and not EXPORT_FORMATS[format_name].screen_rows:
        raise BadParameter(
            f"--{options.typed_options[0]}: "
            f"only with formats that show the screen, not with --{format_name}"
        )
    return format_name


def export_rows(  # noqa: PLR0913 - the options of a command
    paths: Sequence[Path],
    formats: Sequence[str],
    options: ExportOptions,
    output: Path | None = None,
    *,
    force: bool = False,
    trusted: bool = False,
    peek: bool = False,
) -> Printout:
    """Export the rows of all games in files and folders as one table, to a file or a Printout.

    A file that is not a game is named on standard error, and the exit code is FAILURE_EXIT_CODE.
    """
    format_name = _choose_format(formats, options)
    if format_name not in ROW_FORMATS:
        expected = "expected --csv or --jsonl for a folder or several files"
        raise BadParameter(f"--{format_name}: {expected}")
    check_extension_fits_format(output, format_name)
    rows, errors = list[Row](), list[str]()
    files = [*iter_transcript_files(paths)]
    with ProgressBar(f"exporting {format_count(len(files), 'file')}") as bar:
        for number, game in enumerate(iter_games(files, trusted=trusted, peek=peek), 1):
            if isinstance(game, RecordedGame):
                rows += list_rows_with_file(game, review=options.review)
            else:
                errors.append(f"not exported: {game}")
            bar(number / len(files))
    lines = format_rows_as_csv(rows) if format_name == "csv" else map(_format_json_line, rows)
    return write_or_print(output, lines if rows else [], force=force)._replace(
        stderr_text="\n".join(errors), exit_code=FAILURE_EXIT_CODE if errors else 0
    )


def export_transcript(
    recording: ReplayRequest,
    formats: Sequence[str],
    options: ExportOptions,
    output: Path | None = None,
    *,
    force: bool = False,
) -> Printout:
    """Export a transcript in the chosen format, to a file or as a Printout.

    The Printout is empty if that file is written. Without a file, a picture is printed, or on a
    terminal written to a new file that the Printout names. Raise BadParameter unless exactly one
    format is chosen and the options suit it.
    """
    format_name = _choose_format(formats, options)
    check_extension_fits_format(output, format_name)
    game = Playback(recording.path, trusted=recording.trusted, peek=recording.peek)
    path = output
    if not EXPORT_FORMATS[format_name].is_text:
        stem, extension = Path(game.transcript.path).stem, EXPORT_FORMATS[format_name].extension
        path = choose_picture_path(output, stem, extension)
    width, height, ascii_ = options.viewport
    room = Viewport(
        width or DEFAULT_COLUMNS, height or EXPORT_FORMATS[format_name].screen_rows, ascii_
    )
    if room.height:
        room = _enlarge_viewport(game, room)
    printout = write_or_print(
        path, RENDERERS[format_name](game, options._replace(viewport=room)), force=force
    )
    return printout._replace(text=f"wrote {path}") if path is not output else printout

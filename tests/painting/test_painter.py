"""The painter: whatever stood on the screen before, a frame looks as if it were painted first."""

import io
from typing import Any

import pyte
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.text import Text

from dmplay import styles
from dmplay.painting.painter import Painter
from dmplay.painting.pen import encode_sgr_change, parse_sgr_codes
from dmplay.painting.writing import ScreenPosition
from tests.support.screens import Easel, Paper

COLUMNS, ROWS = 24, 6
STYLES = (
    "", "bold", "dim red", "reverse", "bold bright_cyan", "bold color(16) on color(255)",
    "on color(230) underline", "bold dim italic",
)  # fmt: skip


def painted(*frames: Text, cursor: ScreenPosition | None = None) -> Easel:
    """An easel on which these frames were painted one after the other."""
    easel = Easel(Paper(), COLUMNS, ROWS)
    easel.enter_screen()
    for frame in frames:
        easel.paint(frame, cursor)
    return easel


def sent(before: Text, now: Text) -> str:
    """What the terminal is sent to bring one frame where another stands."""
    easel = painted(before)
    start = easel.paper.tell()
    easel.paint(now)
    return easel.paper.getvalue()[start:]


def cells(easel: Easel) -> list[list[object]]:
    """Every cell of the screen, glyph and style; of a blank, what is seen of it."""
    screen = easel.paper.screen
    return [[_seen(screen.buffer[y][x]) for x in range(COLUMNS)] for y in range(ROWS)]


def _seen(cell: Any) -> object:
    shows = cell.data != " " or cell.reverse or cell.underscore
    return cell if shows else (cell.data, cell.bg)


@st.composite
def rows(draw: st.DrawFn) -> Text:
    """A row of a few pieces in some styles; some with characters that take two cells."""
    row = Text()
    for _ in range(draw(st.integers(0, 3))):
        glyphs = draw(st.sampled_from(("ab ", "◆│ ", "深 x")))
        size = draw(st.integers(1, 4))
        piece = draw(st.text(glyphs, max_size=size)) + " " * draw(st.sampled_from((0, 0, 3, 7)))
        row.append(piece, draw(st.sampled_from(STYLES)))
    return row


def frame(*lines: Text) -> Text:
    padded = [*lines, *[Text("")] * (ROWS - len(lines))]
    return Text("\n").join(padded)


frames = st.lists(rows(), min_size=ROWS, max_size=ROWS).map(lambda lines: frame(*lines))


@given(st.lists(frames, max_size=2), frames)
def test_a_frame_looks_the_same_whatever_stood_there_before(before: list[Text], now: Text) -> None:
    assert cells(painted(*before, now)) == cells(painted(now))


@given(st.lists(rows(), min_size=ROWS + 4, max_size=ROWS + 4), st.integers(1, 4))
def test_rows_that_move_up_look_as_if_written_anew(lines: list[Text], by: int) -> None:
    before, now = frame(*lines[:ROWS]), frame(*lines[by : by + ROWS])
    assert cells(painted(before, now)) == cells(painted(now))


def test_a_log_that_moves_up_is_scrolled_not_written() -> None:
    log = [Text(f"{'abcdefghi'[turn] * 12} {turn}.") for turn in range(9)]
    title = Text("dmplay")
    easel = painted(frame(title, *log[:5]))
    start = easel.paper.tell()
    easel.paint(frame(title, *log[1:6]))
    written = easel.paper.getvalue()[start:]
    assert easel.paper.text.split("\n")[1:] == [line.plain for line in log[1:6]]
    assert written == "\x1b[2H\x1b[M\x1b[6H\x1b[Lffffffffffff 5."


def test_rows_that_are_written_anew_in_fewer_bytes_are_not_moved() -> None:
    title, log = Text("dmplay"), [Text(f"turn {turn}. moved on to e.") for turn in range(3)]
    assert sent(frame(title, *log[:2]), frame(title, *log[1:])) == "\x1b[2;6H1\x1b[3;6H2"


def test_one_changed_cell_costs_one_jump_and_one_character() -> None:
    before, now = frame(Text("│  h  │  @  │")), frame(Text("│  h  │  o  │"))
    assert sent(before, now) == "\x1b[1;10Ho"


def test_a_filled_cell_becomes_an_empty_one_with_its_dot() -> None:
    before = frame(Text("│").append("    2    ", "bold color(16) on color(255)").append("│"))
    now = frame(Text("│").append("    ·    ", "dim").append("│"))
    assert cells(painted(before, now)) == cells(painted(now))


def test_many_blanks_are_erased_and_jumped_over() -> None:
    before, now = frame(Text("│ eight-cells │ e │")), frame(Text("│             │ o │"))
    assert sent(before, now) == "\x1b[1;3H\x1b[11X\x1b[14Co"


def test_the_pen_changes_in_few_codes() -> None:
    tile, other = parse_sgr_codes("1;38;5;16;48;5;255"), parse_sgr_codes("1;38;5;16;48;5;230")
    assert encode_sgr_change(tile, other) == "\x1b[48;5;230m"
    assert encode_sgr_change(tile, parse_sgr_codes("1")) == "\x1b[0;1m"
    assert encode_sgr_change(parse_sgr_codes("1;31"), parse_sgr_codes("1")) == "\x1b[39m"
    assert encode_sgr_change(parse_sgr_codes("1"), parse_sgr_codes("2")) == "\x1b[0;2m"
    assert encode_sgr_change(parse_sgr_codes("1;2;31"), parse_sgr_codes("1;31")) == "\x1b[22;1m"
    assert encode_sgr_change(tile, parse_sgr_codes("")) == "\x1b[m"
    assert encode_sgr_change(parse_sgr_codes(""), parse_sgr_codes("")) == ""


def test_a_frame_that_is_the_same_writes_nothing() -> None:
    easel = painted(frame(Text("still")), cursor=ScreenPosition(2, 0))
    start = easel.paper.tell()
    easel.paint(frame(Text("still")), ScreenPosition(2, 0))
    assert easel.paper.getvalue()[start:] == ""


@pytest.mark.parametrize("place", [ScreenPosition(0, 0), ScreenPosition(5, 3)])
def test_the_real_cursor_stands_where_it_is_told_and_hides_otherwise(place: ScreenPosition) -> None:
    easel = painted(frame(Text("some")), cursor=place)
    cursor = easel.paper.screen.cursor
    assert (cursor.x, cursor.y, cursor.hidden) == (*place, False)
    easel.paint(frame(Text("other")))
    assert easel.paper.screen.cursor.hidden


def test_another_size_is_painted_whole() -> None:
    easel = painted(frame(Text("before")))
    easel.resize(COLUMNS + 6, ROWS)
    easel.paint(frame(Text("before")))
    assert easel.paper.text.startswith("before")


@pytest.mark.parametrize(
    ("theme", "codes"),
    [
        ("default", ["1;34", "2", "96", ""]),
        ("mono", ["1", "2", "", ""]),
        ("high-contrast", ["1;94", "", "96", ""]),
    ],
)
def test_a_theme_says_which_weights_and_colours_are_written(theme: str, codes: list[str]) -> None:
    wanted = ("bold blue", "dim", "bright_cyan", "")
    found = [row[0][1] for row in styles.to_styled_rows(frame_of(wanted), theme)]
    assert found == codes


def frame_of(wanted: tuple[str, ...]) -> Text:
    return Text("\n").join(Text("goal", style) for style in wanted)


def test_what_leaves_the_screen_gives_it_back() -> None:
    paper = io.StringIO()
    painter = Painter(paper, "default")
    painter.enter_screen()
    painter.enable_input_reports()
    painter.leave_screen()
    stream = pyte.Stream(pyte.Screen(COLUMNS, ROWS))
    stream.feed(paper.getvalue())
    assert paper.getvalue().endswith("\x1b[?2004l\x1b[m\x1b[?1049l\x1b[?25h")

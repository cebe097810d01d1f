"""Tests of the painter: a frame looks the same whatever was on the screen before."""

import io
from typing import Any

import pyte
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.text import Text

from dmplay.terminal import styles
from dmplay.terminal.painter import Painter, ScreenPosition
from tests.support.screens import EmulatedPainter, EmulatedScreen

COLUMN_COUNT, ROW_COUNT = 24, 6
STYLES = (
    "", "bold", "dim red", "reverse", "bold bright_cyan", "bold color(16) on color(255)",
    "on color(230) underline", "bold dim italic",
)  # fmt: skip


def paint_frames(*frames: Text, cursor: ScreenPosition | None = None) -> EmulatedPainter:
    """Return an emulated painter after painting these frames in order."""
    painter = EmulatedPainter(EmulatedScreen(), COLUMN_COUNT, ROW_COUNT)
    painter.enter_screen()
    for frame in frames:
        painter.paint(frame, cursor)
    return painter


def capture_update(before: Text, after: Text) -> str:
    """Return the text sent to the terminal to change one frame into another."""
    painter = paint_frames(before)
    start = painter.paper.tell()
    painter.paint(after)
    return painter.paper.getvalue()[start:]


def read_cells(painter: EmulatedPainter) -> list[list[object]]:
    """Return the visible content of every cell: glyph and style, or the background."""
    screen = painter.paper.screen
    return [
        [_visible_cell(screen.buffer[y][x]) for x in range(COLUMN_COUNT)] for y in range(ROW_COUNT)
    ]


def _visible_cell(cell: Any) -> object:
    is_visible = cell.data != " " or cell.reverse or cell.underscore
    return cell if is_visible else (cell.data, cell.bg)


@st.composite
def styled_row(draw: st.DrawFn) -> Text:
    """Draw a row of a few styled pieces, some with characters two cells wide."""
    row = Text()
    for _ in range(draw(st.integers(0, 3))):
        glyphs = draw(st.sampled_from(("ab ", "◆│ ", "深 x")))
        size = draw(st.integers(1, 4))
        piece = draw(st.text(glyphs, max_size=size)) + " " * draw(st.sampled_from((0, 0, 3, 7)))
        row.append(piece, draw(st.sampled_from(STYLES)))
    return row


def build_frame(*lines: Text) -> Text:
    padded = [*lines, *[Text("")] * (ROW_COUNT - len(lines))]
    return Text("\n").join(padded)


screen_frames = st.lists(styled_row(), min_size=ROW_COUNT, max_size=ROW_COUNT).map(
    lambda lines: build_frame(*lines)
)


@given(st.lists(screen_frames, max_size=2), screen_frames)
def test_a_frame_looks_the_same_whatever_was_there_before(before: list[Text], frame: Text) -> None:
    assert read_cells(paint_frames(*before, frame)) == read_cells(paint_frames(frame))


@given(st.lists(styled_row(), min_size=ROW_COUNT + 4, max_size=ROW_COUNT + 4), st.integers(1, 4))
def test_rows_that_scroll_up_look_freshly_written(lines: list[Text], by: int) -> None:
    before, after = build_frame(*lines[:ROW_COUNT]), build_frame(*lines[by : by + ROW_COUNT])
    assert read_cells(paint_frames(before, after)) == read_cells(paint_frames(after))


def test_only_rows_that_changed_are_written() -> None:
    before = build_frame(Text("dmplay"), Text("│  h  │  @  │"), Text("turn 1"))
    after = build_frame(Text("dmplay"), Text("│  h  │").append("  o  │", "bold"), Text("turn 1"))
    assert capture_update(before, after) == "\x1b[2H\x1b[K│  h  │\x1b[1m  o  │\x1b[m"
    assert capture_update(after, build_frame(Text("dmplay"))) == "\x1b[2H\x1b[K\x1b[3H\x1b[K"


def test_a_filled_cell_becomes_an_empty_one_with_its_dot() -> None:
    before = build_frame(Text("│").append("    2    ", "bold color(16) on color(255)").append("│"))
    after = build_frame(Text("│").append("    ·    ", "dim").append("│"))
    assert read_cells(paint_frames(before, after)) == read_cells(paint_frames(after))


def test_an_unchanged_frame_writes_nothing() -> None:
    painter = paint_frames(build_frame(Text("still")), cursor=ScreenPosition(2, 0))
    start = painter.paper.tell()
    painter.paint(build_frame(Text("still")), ScreenPosition(2, 0))
    assert painter.paper.getvalue()[start:] == ""


@pytest.mark.parametrize("position", [ScreenPosition(0, 0), ScreenPosition(5, 3)])
def test_the_cursor_is_placed_as_requested_and_hidden_otherwise(position: ScreenPosition) -> None:
    painter = paint_frames(build_frame(Text("some")), cursor=position)
    cursor = painter.paper.screen.cursor
    assert (cursor.x, cursor.y, cursor.hidden) == (*position, False)
    painter.paint(build_frame(Text("other")))
    assert painter.paper.screen.cursor.hidden


def test_a_resized_screen_is_repainted_completely() -> None:
    painter = paint_frames(build_frame(Text("before")))
    painter.resize(COLUMN_COUNT + 6, ROW_COUNT)
    painter.paint(build_frame(Text("before")))
    assert painter.paper.text.startswith("before")


@pytest.mark.parametrize(
    ("theme", "codes"),
    [
        ("default", ["1;34", "2", "96", ""]),
        ("mono", ["1", "2", "", ""]),
        ("high-contrast", ["1;94", "", "96", ""]),
    ],
)
def test_a_theme_determines_weights_and_colours(theme: str, codes: list[str]) -> None:
    style_names = ("bold blue", "dim", "bright_cyan", "")
    encoded = [row[0][1] for row in styles.to_styled_rows(build_styled_frame(style_names), theme)]
    assert encoded == codes


def build_styled_frame(style_names: tuple[str, ...]) -> Text:
    return Text("\n").join(Text("goal", style) for style in style_names)


def test_leaving_the_screen_restores_the_terminal() -> None:
    paper = io.StringIO()
    painter = Painter(paper, "default")
    painter.enter_screen()
    painter.enable_input_reports()
    painter.leave_screen()
    stream = pyte.Stream(pyte.Screen(COLUMN_COUNT, ROW_COUNT))
    stream.feed(paper.getvalue())
    assert paper.getvalue().endswith("\x1b[?2004l\x1b[m\x1b[?1049l\x1b[?25h")

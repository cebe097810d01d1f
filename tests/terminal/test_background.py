"""Tests of the terminal's background: its reply, COLORFGBG, and the theme that follows."""

import io
import os
import time
from collections.abc import Iterator

import pytest
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.key_binding import KeyPress

from dmplay.terminal import background
from dmplay.terminal.background import (
    BACKGROUND_QUERY,
    can_ask_background,
    choose_theme,
    discard_late_reply,
    find_background_theme,
    parse_background_reply,
    remember_background_reply,
)
from dmplay.terminal.capabilities import TerminalOptions, choose_terminal_settings
from dmplay.terminal.input_sequences import InputSequences
from dmplay.terminal.painter import Painter
from dmplay.ui.screen import event_loop
from dmplay.ui.screen.key_reader import KeyReader
from tests.support.screens import EmulatedPainter, EmulatedScreen, ScriptedScreen, make_game

WHITE_REPLY = "\x1b]11;rgb:ffff/ffff/ffff\x1b\\"


@pytest.fixture(autouse=True)
def _forget_background() -> Iterator[None]:
    background._replied_backgrounds.clear()
    yield
    background._replied_backgrounds.clear()


class TerminalStream(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("reply", "expected"),
    [
        (WHITE_REPLY, "light"),
        ("\x1b]11;rgb:fdfd/f6f6/e3e3\x07", "light"),
        ("\x1b]11;rgb:ff/ff/ff\x07", "light"),
        ("\x1b]11;rgba:0000/0000/0000/ffff\x07", "dark"),
        ("\x1b]11;rgb:2828/2c2c/3434\x1b\\", "dark"),
        ("\x1b]10;rgb:ffff/ffff/ffff\x1b\\", ""),
        ("l", ""),
    ],
)
def test_a_reply_says_whether_the_background_is_dark(reply: str, expected: str) -> None:
    assert parse_background_reply(reply) == expected


@pytest.mark.parametrize(
    ("value", "expected"),
    [("15;0", "dark"), ("0;15", "light"), ("0;default;15", "light"), ("7;8", "dark"),
     ("0;7", "light"), ("15;default", ""), ("", ""), ("0;99", ""), ("0;²", "")],
)  # fmt: skip
def test_colorfgbg_names_the_background_of_a_terminal_that_does_not_reply(
    value: str, expected: str
) -> None:
    assert find_background_theme({"COLORFGBG": value}) == expected


def test_the_reply_of_the_terminal_wins_over_colorfgbg() -> None:
    remember_background_reply("light")
    assert find_background_theme({"COLORFGBG": "15;0"}) == "light"


@pytest.mark.parametrize(
    ("option", "on_dark", "on_light", "unknown"),
    [
        ("auto", "dark", "light", "default"),
        ("high-contrast", "high-contrast", "high-contrast-light", "high-contrast"),
        ("dark", "dark", "dark", "dark"),
        ("light", "light", "light", "light"),
        ("default", "default", "default", "default"),
        ("mono", "mono", "mono", "mono"),
    ],
)
def test_only_auto_and_high_contrast_depend_on_the_background(
    option: str, on_dark: str, on_light: str, unknown: str
) -> None:
    themes = [choose_theme(option, name) for name in ("dark", "light", "")]
    assert themes == [on_dark, on_light, unknown]


def test_a_terminal_without_colour_has_no_theme_to_ask_for() -> None:
    stream = TerminalStream()
    env = {"TERM": "xterm", "NO_COLOR": "1", "COLORFGBG": "0;15"}
    terminal = choose_terminal_settings(TerminalOptions(), env, stream, stream)
    assert (terminal.theme, terminal.theme_option) == ("mono", "mono")


@pytest.mark.parametrize(
    ("env", "reason"),
    [({"TERM": "dumb"}, "TERM=dumb"), ({"TERM": ""}, "TERM is empty"), ({}, "TERM is not set")],
)
def test_the_reason_for_plain_lines_names_the_terminal(env: dict[str, str], reason: str) -> None:
    stream = TerminalStream()
    assert choose_terminal_settings(TerminalOptions(), env, stream, stream).plain_reason == reason


def test_columns_does_not_limit_the_screen() -> None:
    stream = TerminalStream()
    env = {"TERM": "xterm", "COLUMNS": "60"}
    assert choose_terminal_settings(TerminalOptions(), env, stream, stream).width is None


@pytest.mark.parametrize("name", ["dumb", "linux", "eterm-color"])
def test_terminals_that_would_print_the_query_are_not_asked(name: str) -> None:
    assert not can_ask_background({"TERM": name})
    assert can_ask_background({"TERM": "xterm-256color"})


def test_the_painter_asks_with_osc_11() -> None:
    paper = io.StringIO()
    Painter(paper, "default").ask_background()
    assert paper.getvalue() == BACKGROUND_QUERY == "\x1b]11;?\x1b\\"


def parse_pieces(*pieces: str) -> tuple[list[str], list[str]]:
    """Return the keys and the backgrounds read from these pieces of input, then a pause."""
    keys: list[KeyPress] = []
    backgrounds: list[str] = []
    parser = KeyReader(keys.append)
    parser.on_background = backgrounds.append
    for piece in pieces:
        parser.feed(piece)
    return [key.data for key in keys], backgrounds


def test_keys_typed_around_a_reply_are_not_lost() -> None:
    assert parse_pieces(f"h{WHITE_REPLY}l") == (["h", "l"], ["light"])


@pytest.mark.parametrize("length", range(1, len(WHITE_REPLY)))
def test_a_reply_in_two_pieces_is_no_key(length: int) -> None:
    pieces = f"h{WHITE_REPLY[:length]}", f"{WHITE_REPLY[length:]}l"
    assert parse_pieces(*pieces) == (["h", "l"], ["light"])


def test_the_screen_changes_its_theme_when_the_terminal_replies() -> None:
    emulated = EmulatedScreen()
    painter = EmulatedPainter(emulated, 80, 24)
    with create_pipe_input() as pipe:
        screen = ScriptedScreen(make_game("hexworld"), [], pipe, emulated, motion=True)
        screen.terminal = screen.terminal._replace(theme_option="auto")
        pipe.send_text(WHITE_REPLY)
        event_loop.run_event_loop(screen, painter, pipe)
    assert screen.terminal.theme == painter.theme == "light"
    assert find_background_theme({}) == "light"


def ask_terminal() -> InputSequences:
    """Return the state of the input of a terminal that was asked just now."""
    sequences = InputSequences()
    sequences.expect_reply(time.monotonic())
    return sequences


def test_a_late_reply_is_read_before_the_screen_is_left() -> None:
    reader, writer = os.pipe()
    try:
        os.write(writer, WHITE_REPLY.encode())
        discard_late_reply(reader, ask_terminal())
        os.set_blocking(reader, False)
        with pytest.raises(BlockingIOError):
            os.read(reader, 1)
    finally:
        os.close(reader)
        os.close(writer)


def test_a_terminal_that_does_not_reply_delays_the_end_by_at_most_a_moment() -> None:
    reader, writer = os.pipe()
    try:
        started_at = time.monotonic()
        sequences = ask_terminal()
        discard_late_reply(reader, sequences)
        assert time.monotonic() - started_at < 5
        discard_late_reply(reader, sequences)  # does not wait again
    finally:
        os.close(reader)
        os.close(writer)

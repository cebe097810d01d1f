"""Tests of terminal input: sequences are known whole or dropped whole, also in pieces."""

import json
from pathlib import Path

import pytest
from prompt_toolkit.key_binding import KeyPress

from dmplay.terminal.input_sequences import (
    INTERMEDIATES,
    MAX_SEQUENCE_CHARS,
    PASTE_END,
    PASTE_START,
    InputSequences,
    remove_sequences,
)
from dmplay.ui.screen.key_reader import KeyReader

UNKNOWN_SEQUENCES = [  # from documentation: ECMA-48, and the control sequences of xterm and kitty
    "\x1b[?62;22;52c", "\x1b[>41;379;0c", "\x1bP!|00000000\x1b\\", "\x1bP>|XTerm(379)\x1b\\",
    "\x1b[13;2u", "\x1b[97;5u", "\x1b[27;5;9~", "\x1b[1;3S", "\x1b[8;24;80t", "\x1b[?997;1n",
    "\x1b[?2026;2$y", "\x1bP1$r0m\x1b\\", "\x1bP1+r544e=787465726d\x1b\\", "\x1b[I", "\x1b[O",
    "\x1b]4;1;rgb:cdcd/0000/0000\x1b\\", "\x1b]10;rgb:0/0/0\x07", "\x1b]11;rgb:q\x1b\\",
    "\x1b]52;c;aGxx\x1b\\", "\x1b]lhello\x1b\\", "\x1b]Lhello\x07", "\x1b_Gi=31;OK\x1b\\",
    "\x1b^hlq\x1b\\", "\x1bXhlq\x1b\\", "\x1bO5P", "\x1b[2;2:3u", "\x1b[ q", "\x1b\\",
    "\x9b?62;22;52c", "\x9d4;1;rgb:0/0/0\x9c", "\x90>|hlq\x9c", "\x9fGhlq\x9c", "\x9ehlq\x9c",
    "\x98hlq\x9c", "\x8fl", "\x84", "\x9c", "\udc9b13;2u", "\udc9d0;hlq\udc9c", "\udc90q\x1b\\",
    "\x1b[Mhlq", "\x1b[M \udcc3!", "\x1b[[l", "\x1b[[0",
    "\x1b(l", "\x1b#8", "\x1b %q", "\x1b$(h", "\x1b(\x18", "\x1b[1\x1b(l",
    "\x1b[12\x18", "\x1b]0;hlq\x1a", "\x1bPhlq\x18",
    "\x1b]0;hlq\x1bl", "\x1b[12\x1bq", "\x1b]0;hlq\x1b[13;2u", "\x1b[1;\x03l",
]  # fmt: skip


class TypedInput:
    """A reader of keys with a clock that only the test moves."""

    def __init__(self) -> None:
        self.time = 100.0
        self.presses: list[KeyPress] = []
        self.backgrounds: list[str] = []
        self.reader = KeyReader(self.presses.append, InputSequences(), lambda: self.time)
        self.reader.on_background = self.backgrounds.append

    def send(self, *pieces: str | float) -> str:
        """Send pieces of input and wait these seconds; return the data of all keys so far."""
        for piece in pieces:
            if isinstance(piece, str):
                self.reader.feed(piece)
            else:
                self.time += piece
                self.reader.flush()
        return "".join(press.data for press in self.presses)


@pytest.mark.parametrize("sequence", UNKNOWN_SEQUENCES, ids=ascii)
def test_a_sequence_that_is_no_known_key_is_dropped_whole(sequence: str) -> None:
    assert TypedInput().send("n", sequence, "b") == "nb"


@pytest.mark.parametrize("sequence", UNKNOWN_SEQUENCES, ids=ascii)
def test_an_unknown_sequence_is_dropped_in_any_two_pieces(sequence: str) -> None:
    introducer_chars = 2 if sequence[0] == "\x1b" else 1
    for length in range(introducer_chars, len(sequence)):
        pause = 0.04 if sequence[1] in INTERMEDIATES else 0.9
        pieces = (sequence[:length], pause, sequence[length:])
        assert TypedInput().send("n", *pieces, "b") == "nb"


@pytest.mark.parametrize(
    ("sent", "key"),
    [("\x1b[A", "up"), ("\x1bOA", "up"), ("\x9bA", "up"), ("\x8fP", "f1"), ("\x1b[[A", "f1"),
     ("\x1b[15~", "f5"), ("\x1b[1;5D", "c-left"), ("\x1b[Z", "s-tab"), ("\x1b", "escape"),
     ("\x1b[27;2;13~", "c-m"), ("\x1b[24;80R", "<cursor-position-response>"),
     ("\x1b[<64;3;4M", "<vt100-mouse-event>")],
)  # fmt: skip
def test_known_keys_and_reports_arrive_whole_and_in_pieces(sent: str, key: str) -> None:
    for pieces in ((sent,), tuple(sent), (sent[:2], 0.9, sent[2:])):
        typed = TypedInput()
        typed.send(*pieces, 0.06)
        assert [press.key for press in typed.presses] == [key]


def test_a_lone_escape_is_a_key_after_a_twentieth_of_a_second() -> None:
    assert TypedInput().send("\x1b", 0.04, "[C") == "\x1b[C"
    typed = TypedInput()
    assert typed.send("\x1b", 0.06) == "\x1b"
    typed.send("l")
    assert [press.key for press in typed.presses] == ["escape", "l"]


def test_alt_with_a_character_is_escape_and_the_character_after_a_twentieth_of_a_second() -> None:
    for character in "l.(/ ":
        typed = TypedInput()
        assert typed.send(f"\x1b{character}", 0.051, "h") == f"\x1b{character}h"
    assert TypedInput().send("\x1b]0;hl\x1b(", 1.1, "h") == "h"


def test_an_escape_waits_longer_for_a_reply_that_is_outstanding() -> None:
    typed = TypedInput()
    typed.reader.sequences.expect_reply(typed.time)
    assert typed.send("\x1b", 0.19, "]11;rgb:ff/ff/ff\x1b", 0.9, "\\") == ""
    assert typed.backgrounds == ["light"]
    assert typed.send("\x1b", 0.06) == "\x1b"  # the reply is here
    typed.reader.sequences.expect_reply(typed.time)
    assert typed.send(1.1, "\x1b", 0.06) == "\x1b\x1b"  # no reply came


def test_what_follows_a_second_of_silence_is_typed_again() -> None:
    for sequence in ("\x1b[12", "\x1bO", "\x1b]0;x", "\x1bPx", "\x1b[M ", "\x1b[[", "\x9d0;x\x1b",
                     PASTE_START + "x"):  # fmt: skip
        typed = TypedInput()
        assert typed.send(sequence, 0.99) == ""
        assert typed.send(0.02, "l") == "l"


def test_a_byte_that_completes_no_character_ends_the_silence() -> None:
    assert TypedInput().send("\x1b]0;x", 0.9, "", 0.9, "hlq\x07") == ""


def test_silence_is_noticed_without_a_timer() -> None:
    typed = TypedInput()
    typed.send("\x1b]0;x")
    typed.time += 1.1
    assert typed.send("l") == "l"


@pytest.mark.parametrize(
    ("start", "end"), [("\x1b[", "c"), ("\x1bP", "\x1b\\"), ("\x1b]", "\x07"), ("\x9f", "\x9c")]
)
def test_a_long_sequence_is_dropped_to_its_end_and_little_of_it_is_kept(
    start: str, end: str
) -> None:
    typed = TypedInput()
    typed.send(start)
    for _ in range(100):
        typed.send("1" * 1000)
        assert len(typed.reader.sequences._unfinished) <= MAX_SEQUENCE_CHARS + 1
    assert typed.send(end, "l") == "l"


def test_a_reply_that_is_too_long_is_no_reply() -> None:
    typed = TypedInput()
    typed.send("\x1b[0" + "0" * MAX_SEQUENCE_CHARS + "A")
    assert typed.presses == []


def test_a_paste_may_contain_sequences_and_its_markers_may_be_cut() -> None:
    text = "l\x1b[A\x1b]0;x\x07\x9b"
    for length in range(1, len(PASTE_END)):
        typed = TypedInput()
        typed.send(PASTE_START, text + PASTE_END[:length], 0.5, PASTE_END[length:], "n")
        assert [press.data for press in typed.presses] == [text, "n"]


@pytest.mark.parametrize(
    ("line", "typed"),
    [
        ("\x1b_Gi=31;OK\x1b\\feed\n", "feed\n"),
        ("0.\x1b[?997;1n5\n", "0.5\n"),
        ("\x9d52;c;ab\x9cn\x1b[I\n", "n\n"),
        ("\x1bPquit\n", "\n"),
        (f"{PASTE_START}e\x1b[A{PASTE_END}\n", "e\x1b[A\n"),
        ("", ""),
    ],
)
def test_a_line_has_no_sequences_and_ends_where_it_ended(line: str, typed: str) -> None:
    assert remove_sequences(line) == typed


RECORDED_STREAMS = [
    pytest.param(stream["received"][name].encode("latin-1"), id=f"{stream['program']}, {name}")
    for path in sorted((Path(__file__).parent / "recorded_streams").glob("*.json"))
    for stream in [json.loads(path.read_text())]
    for name in stream["received"]
]
# keys that were pressed and send a character, also with Alt or Ctrl, and the text of a paste
RECORDED_CHARACTERS = {"a", "l", "5", "ì"}


@pytest.mark.parametrize("received", RECORDED_STREAMS)
def test_of_a_recorded_stream_only_the_pressed_keys_are_characters(received: bytes) -> None:
    text = received.decode("utf-8", "surrogateescape")
    whole, pieces = TypedInput(), TypedInput()
    whole.send(text, 0.06)
    pieces.send(*text, 0.06)
    assert [press.key for press in whole.presses] == [press.key for press in pieces.presses]
    characters = {str(press.key) for press in whole.presses if type(press.key) is str}
    assert characters <= RECORDED_CHARACTERS

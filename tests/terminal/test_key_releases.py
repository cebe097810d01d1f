"""Tests of the events of keys in the keyboard protocol of kitty."""

import pytest

from dmplay.terminal.key_releases import KeyEvent, parse_key_event


@pytest.mark.parametrize(
    ("sequence", "event"),
    [
        ("\x1b[104;1:3u", KeyEvent("h", True, "h")),
        ("\x1b[104u", KeyEvent("h", False, "h")),
        ("\x1b[104;129:1u", KeyEvent("h", False, "h")),  # with num lock
        ("\x1b[104;2u", KeyEvent("H", False, "H")),
        ("\x1b[99;5u", KeyEvent("c", False, "\x03")),
        ("\x1b[104;3u", KeyEvent("h", False, "")),  # with Alt
        ("\x1b[27u", KeyEvent("escape", False, "\x1b")),
        ("\x1b[32;1:3u", KeyEvent("space", True, " ")),
        ("\x1b[1;1:2C", KeyEvent("right", False, "\x1b[C")),
        ("\x1b[1;1:3D", KeyEvent("left", True, "\x1b[D")),
        ("\x1b[5;1:2~", KeyEvent("pageup", False, "\x1b[5~")),
        ("\x1b[57441;1:3u", KeyEvent("\ue061", True, "")),  # a modifier key
        ("\x1b[?62;22c", None),
        ("\x1b[9999999u", None),
    ],
)
def test_a_key_event_has_a_name_and_the_characters_of_its_press(
    sequence: str, event: KeyEvent | None
) -> None:
    assert parse_key_event(sequence) == event

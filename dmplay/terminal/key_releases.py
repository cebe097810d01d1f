"""Releases of keys, which terminals with the keyboard protocol of kitty report on request.

Source: https://sw.kovidgoyal.net/kitty/keyboard-protocol. A terminal that replies to the query is
asked to report events. It then writes a key as CSI number ; modifiers : event and a letter. The
presses of most keys are unchanged.
"""

import re
from typing import NamedTuple

KEYBOARD_QUERY = "\x1b[?u"
REPORT_RELEASES, STOP_REPORTS = "\x1b[>2u", "\x1b[<u"  # push the flag of event types, and pop it
KEYBOARD_REPLY_PATTERN = re.compile(r"\x1b\[\?\d{1,5}u")
KEY_EVENT_PATTERN = re.compile(
    r"\x1b\[(\d{1,7})?(?::\d{0,7}){0,2}(?:;(\d{0,5})(?::([123]))?)?(?:;[\d:]{0,40})?([u~A-HPQS])"
)
LOCK_MODIFIERS, SHIFT, CONTROL = 64 + 128, 1, 4  # bits of the modifiers
RELEASE_EVENT = "3"
RELEASE_PREFIX = "release of "  # before the name of a key, as the data of an ignored key press
NAMES_BY_LETTER = {"A": "up", "B": "down", "C": "right", "D": "left", "F": "end", "H": "home"}
NAMES_BY_NUMBER = {("~", 5): "pageup", ("~", 6): "pagedown"} | {
    ("u", number): name
    for number, name in {
        9: "tab", 13: "enter", 27: "escape", 32: "space", 127: "backspace"
    }.items()
}  # fmt: skip


class KeyEvent(NamedTuple):
    """A key that was pressed or released: its name, and the characters of a press without events.

    The characters are "" if such a press is not known.
    """

    name: str
    is_release: bool
    characters: str


def parse_key_event(sequence: str) -> KeyEvent | None:
    """Return the event of a complete control sequence, or None if it is none."""
    match = KEY_EVENT_PATTERN.fullmatch(sequence)
    if not match:
        return None
    digits, modifier_digits, event, letter = match.groups()
    number, modifiers = int(digits or 1), (int(modifier_digits or 1) - 1) & ~LOCK_MODIFIERS
    is_release = event == RELEASE_EVENT
    if letter in NAMES_BY_LETTER and number == 1:
        press = f"\x1b[1;{modifiers + 1}{letter}" if modifiers else f"\x1b[{letter}"
        return KeyEvent(NAMES_BY_LETTER[letter], is_release, press)
    if letter == "~":
        press = f"\x1b[{number};{modifiers + 1}~" if modifiers else f"\x1b[{number}~"
        return KeyEvent(NAMES_BY_NUMBER.get((letter, number), ""), is_release, press)
    if letter != "u" or number > 0x10FFFF:
        return None
    character = chr(number)
    name = NAMES_BY_NUMBER.get((letter, number), character)
    if modifiers == SHIFT:
        character = name = character.upper() if character.isalpha() else ""
    elif modifiers == CONTROL and character.isascii() and character.isalpha():
        character = chr(number & 0x1F)
    elif modifiers or not (character.isprintable() or name != character):
        character = ""
    return KeyEvent(name, is_release, character)

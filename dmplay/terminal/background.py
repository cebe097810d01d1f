"""The background colour of the terminal: how it is asked for, and the theme that suits it."""

import os
import re
import select
import time
from collections.abc import Mapping

from dmplay.terminal.input_sequences import InputSequences

BACKGROUND_QUERY = "\x1b]11;?\x1b\\"  # OSC 11: many terminals reply with their background colour
REPLY_PATTERN = re.compile(
    r"\x1b\]11;rgba?:([0-9a-f]{1,4})/([0-9a-f]{1,4})/([0-9a-f]{1,4})(?:/[0-9a-f]{1,4})?"
    r"(?:\x07|\x1b\\)",
    re.IGNORECASE,
)
# Black and white text have the same contrast on a background of this relative luminance.
LIGHT_LUMINANCE = 0.179
LIGHT_COLOR_NUMBERS = (7, *range(9, 16))  # of the 16 named colours; 8 is dark grey
# terminals that print the query, or that have no background of their own
SILENT_TERMINALS = ("dumb", "linux", "eterm", "emacs")
THEMES_BY_BACKGROUND = {  # option -> background -> theme
    "auto": {"dark": "dark", "light": "light"},
    "high-contrast": {"dark": "high-contrast", "light": "high-contrast-light"},
}

_replied_backgrounds: list[str] = []  # the last reply of the terminal, if there was one


def relative_luminance(red: float, green: float, blue: float) -> float:
    """Return the relative luminance of a colour with parts from 0 to 1, as WCAG defines it."""
    linear = [
        part / 12.92 if part <= 0.03928 else ((part + 0.055) / 1.055) ** 2.4
        for part in (red, green, blue)
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def parse_background_reply(text: str) -> str:
    """Return "dark" or "light" by the first reply in the text, or "" if there is none."""
    reply = REPLY_PATTERN.search(text)
    if not reply:
        return ""
    parts = [int(digits, 16) / (16 ** len(digits) - 1) for digits in reply.groups()]
    return "light" if relative_luminance(*parts) > LIGHT_LUMINANCE else "dark"


def remember_background_reply(background: str) -> None:
    """Keep the reply of the terminal for the later screens of this process."""
    _replied_backgrounds[:] = [background]


def find_background_theme(env: Mapping[str, str]) -> str:
    """Return "dark" or "light" by the terminal's reply or COLORFGBG, or "" if neither is known."""
    if _replied_backgrounds:
        return _replied_backgrounds[0]
    number = env.get("COLORFGBG", "").rpartition(";")[2]
    if not (number.isascii() and number.isdecimal() and int(number) < 16):
        return ""
    return "light" if int(number) in LIGHT_COLOR_NUMBERS else "dark"


def choose_theme(option: str, background: str) -> str:
    """Return the theme that an option selects on a background, which may be "" (unknown)."""
    default = "default" if option == "auto" else option
    return THEMES_BY_BACKGROUND.get(option, {}).get(background, default)


def can_ask_background(env: Mapping[str, str]) -> bool:
    """Return whether the terminal may be asked for its background, and no reply is known yet."""
    return can_ask(env) and not _replied_backgrounds


def can_ask(env: Mapping[str, str]) -> bool:
    """Return whether the terminal may be asked anything."""
    return not env.get("TERM", "").startswith(SILENT_TERMINALS)


def discard_late_reply(fd: int, sequences: InputSequences) -> None:
    """Wait for a reply that is still on its way, so that the next program does not read it.

    A reply that has begun is read to its end.
    """
    while sequences.reply_until:
        seconds = max(sequences.reply_until, sequences.deadline or 0.0) - time.monotonic()
        if seconds <= 0 or not select.select([fd], [], [], seconds)[0]:
            return
        chunk = os.read(fd, 1024)
        if not chunk:
            return
        for token in sequences.feed(chunk.decode("utf-8", "surrogateescape"), time.monotonic()):
            if background := parse_background_reply(token.data):
                remember_background_reply(background)
                sequences.reply_until = 0.0

"""Divide the input of a terminal into typed text, keys, reports and pastes, without any I/O.

Two rules hold everywhere:

1. A control sequence is reported whole or dropped whole. No character of it is ever typed text.
2. Time is an argument. The caller passes the time of each piece of input, and calls `expire` when
   `deadline` has passed without input. A test can therefore use a clock of its own.

The grammar is that of ECMA-48, section 5. After ESC, a character introduces a sequence:

    [            CSI: parameters `0` to `?` and intermediates ` ` to `/`, to a final `@` to `~`
    O            SS3: one character; some terminals send parameters before it
    ]            OSC: a string to ST, which is ESC and a backslash, or to BEL
    P X ^ _      DCS, SOS, PM and APC: a string to ST
    backslash    ST itself, which is dropped if no string is open
    space to /   intermediates of ECMA-35, to a final `0` to `~`; without it, they are keys, too

U+0080 to U+009F are the same functions in one character (ESC and the character 0x40 lower). They
arrive encoded as UTF-8, or as single bytes, which Python decodes as U+DC80 to U+DC9F. Three forms
outside the grammar are known: CSI M and three bytes (mouse reports of X10), CSI [ and a character
(function keys of the Linux console), and text between CSI 200 ~ and CSI 201 ~ (a paste).

A sequence ends at its terminator. It ends without a report at CAN, SUB or ESC, and after a second
without input. Text follows only its terminator, CAN, SUB or that second: an ESC that cuts a
sequence off begins the next one, or is dropped with the character after it.
"""

import re
from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

ESC, CAN, SUB = "\x1b", "\x18", "\x1a"
ESCAPE_SECONDS = 0.05  # until an ESC, alone or with intermediates, is the key Esc
REPLY_ESCAPE_SECONDS = 0.2  # the same while a reply of the terminal is outstanding
SILENCE_SECONDS = 1.0  # without input, after which an unfinished sequence ends
REPLY_SECONDS = 1.0  # during which a reply is outstanding after its query
MAX_SEQUENCE_CHARS = 4096  # characters of a sequence that are kept; longer ones are dropped
MAX_PASTE_CHARS = 10_000
PASTE_START, PASTE_END = "\x1b[200~", "\x1b[201~"
MOUSE_BYTES = 3  # bytes after CSI M
INTERMEDIATES = " !\"#$%&'()*+,-./"

CONTROL_PATTERN = re.compile(r"[\x1b\x80-\x9f\udc80-\udc9f]")  # what typed text does not contain
FINAL_PATTERN = re.compile(r"[@-~\x18\x1a\x1b]")
ESCAPE_FINAL_PATTERN = re.compile(r"[0-~\x18\x1a\x1b]")  # after ESC and intermediates
BEL_OR_ST_PATTERN = re.compile(r"[\x07\x18\x1a\x1b\x9c\udc9c]")
ST_PATTERN = re.compile(r"[\x18\x1a\x1b\x9c\udc9c]")
ANY_PATTERN = re.compile(r"[\s\S]")  # what ends a function key of the Linux console
STRING_PATTERNS = (BEL_OR_ST_PATTERN, ST_PATTERN)


class InputKind(Enum):
    """The kinds of input."""

    TEXT = "typed text"
    SEQUENCE = "a complete control sequence in its 7-bit form, or a lone ESC"
    PASTE = "pasted text"


class InputToken(NamedTuple):
    """A piece of input that is complete."""

    kind: InputKind
    data: str


class InputSequences:
    """The state of a terminal's input, between two pieces of it."""

    def __init__(self) -> None:
        self.reply_until = 0.0  # time until which a reply of the terminal is outstanding; 0 if none
        # reads the next characters, by the current state
        self._read: Callable[[str, int], int] = self._read_text
        self._unfinished = ""  # the unfinished sequence or paste
        self._end_pattern = FINAL_PATTERN  # characters that end the unfinished sequence
        self._paste_chars = 0
        self._last_input_at = 0.0
        self._tokens: list[InputToken] = []

    def feed(self, data: str, timestamp: float) -> list[InputToken]:
        """Return the input that is complete with these characters, received at this time.

        Without characters, bytes arrived that do not complete one.
        """
        if timestamp - self._last_input_at >= SILENCE_SECONDS:
            self._end_silent_sequence()
        self._last_input_at = timestamp
        position = 0
        while position < len(data):
            position = self._read(data, position)
        return self._take_tokens()

    def end_overdue_input(self, timestamp: float) -> list[InputToken]:
        """Return the key Esc if its time has passed, and end a sequence after silence."""
        if self.deadline is not None and timestamp >= self.deadline:
            self._end_silent_sequence()
        return self._take_tokens()

    def expect_reply(self, timestamp: float) -> None:
        """Note that the terminal was asked something at this time."""
        self.reply_until = timestamp + REPLY_SECONDS

    @property
    def escape_seconds(self) -> float:
        """The seconds that an ESC received last waits for its introducer."""
        is_awaited = self._last_input_at < self.reply_until
        return REPLY_ESCAPE_SECONDS if is_awaited else ESCAPE_SECONDS

    @property
    def deadline(self) -> float | None:
        """The time at which `expire` changes the state, or None if nothing is unfinished."""
        if self._read == self._read_text:
            return None
        is_escape = self._read in (self._read_introducer, self._read_to_final_character)
        return self._last_input_at + (self.escape_seconds if is_escape else SILENCE_SECONDS)

    def _take_tokens(self) -> list[InputToken]:
        """Return the complete tokens, and forget them."""
        tokens, self._tokens = self._tokens, []
        return tokens

    def _end_silent_sequence(self) -> None:
        """Drop what is unfinished; an ESC alone was the key, as with Alt and a character."""
        if self._read in (self._read_introducer, self._read_to_final_character):
            self._tokens.append(InputToken(InputKind.SEQUENCE, ESC))
        if self._read == self._read_to_final_character:
            self._tokens.append(InputToken(InputKind.TEXT, self._unfinished[1:]))
        self._enter_state(self._read_text)

    def _enter_state(self, read: Callable[[str, int], int], beginning: str = "") -> None:
        """Enter a state with the beginning of what it reads."""
        self._read, self._unfinished = read, beginning

    def _keep_characters(self, data: str) -> None:
        """Keep more characters of a sequence, at most one more than are reported."""
        self._unfinished += data[: MAX_SEQUENCE_CHARS + 1 - len(self._unfinished)]

    def _report_sequence(self) -> None:
        """Report the sequence that is complete, unless it is too long."""
        if len(self._unfinished) <= MAX_SEQUENCE_CHARS:
            self._tokens.append(InputToken(InputKind.SEQUENCE, self._unfinished))
        self._enter_state(self._read_text)

    # The states: each method reads from a position and returns the position after it.

    def _read_text(self, data: str, start: int) -> int:
        """Read typed text up to the next control character."""
        control = CONTROL_PATTERN.search(data, start)
        end = control.start() if control else len(data)
        if end > start:
            self._tokens.append(InputToken(InputKind.TEXT, data[start:end]))
        if not control:
            return end
        if control.group() == ESC:
            self._enter_state(self._read_introducer)
        else:
            self._begin_sequence(chr((ord(control.group()) & 0xFF) - 0x40))
        return end + 1

    def _read_introducer(self, data: str, start: int) -> int:
        """Read the character after ESC; the ESC is a key if nothing begins."""
        if self._begin_sequence(data[start]):
            if data[start] in INTERMEDIATES:
                self._read = self._read_to_final_character
            return start + 1
        self._end_silent_sequence()
        return start

    def _read_after_cut(self, data: str, start: int) -> int:
        """Read the character after an ESC that cut a sequence off; it is never a key."""
        if data[start] != ESC and not self._begin_sequence(data[start]):
            self._enter_state(self._read_text)
        return start + 1

    def _begin_sequence(self, introducer: str) -> bool:
        """Begin the sequence of a character after ESC; return False if it begins none."""
        start = ESC + introducer
        if introducer in "[O":
            self._enter_state(self._read_csi if introducer == "[" else self._read_string, start)
            self._end_pattern = FINAL_PATTERN
        elif introducer in "]PX^_":
            self._enter_state(self._read_string, start)
            self._end_pattern = BEL_OR_ST_PATTERN if introducer == "]" else ST_PATTERN
        elif introducer == "\\":
            self._enter_state(self._read_text)
        elif introducer in INTERMEDIATES:
            self._enter_state(self._read_string, start)
            self._end_pattern = ESCAPE_FINAL_PATTERN
        else:
            return False
        return True

    def _read_string(self, data: str, start: int) -> int:
        """Read up to the character that ends the sequence."""
        ending = self._end_pattern.search(data, start)
        if not ending:
            self._keep_characters(data[start:])
            return len(data)
        self._keep_characters(data[start : ending.start()])
        match ending.group():
            case "\x1b":
                is_string = self._end_pattern in STRING_PATTERNS
                self._read = self._read_string_end if is_string else self._read_after_cut
            case "\x18" | "\x1a":
                self._enter_state(self._read_text)
            case final:
                self._keep_characters("\x07" if self._end_pattern in STRING_PATTERNS else final)
                self._report_sequence()
        return ending.end()

    def _read_to_final_character(self, data: str, start: int) -> int:
        """Read up to the final character of a sequence that begins with intermediates."""
        return self._read_string(data, start)

    def _read_string_end(self, data: str, start: int) -> int:
        """Read the character after an ESC in a string: a backslash completes the string."""
        if data[start] != "\\":
            self._read = self._read_after_cut
            return start
        self._keep_characters("\x07")
        self._report_sequence()
        return start + 1

    def _read_csi(self, data: str, start: int) -> int:
        """Read a sequence after CSI, and the forms that are longer than the grammar says."""
        if self._unfinished == "\x1b[" and data[start] == "M":
            self._enter_state(self._read_mouse_report)
            return start + 1
        # a function key of the Linux console
        if self._unfinished == "\x1b[" and data[start] == "[":
            self._enter_state(self._read_string, "\x1b[[")
            self._end_pattern = ANY_PATTERN
            return start + 1
        end = self._read_string(data, start)
        if self._tokens and self._tokens[-1] == (InputKind.SEQUENCE, PASTE_START):
            self._tokens.pop()
            self._paste_chars = 0
            self._enter_state(self._read_paste)
        return end

    def _read_mouse_report(self, data: str, start: int) -> int:
        """Read and drop the bytes of a mouse report of X10, counted as bytes of UTF-8."""
        self._unfinished += "." * len(data[start].encode("utf-8", "surrogateescape"))
        if data[start] == ESC:
            self._enter_state(self._read_after_cut)
        elif len(self._unfinished) >= MOUSE_BYTES or data[start] in (CAN, SUB):
            self._enter_state(self._read_text)
        return start + 1

    def _read_paste(self, data: str, start: int) -> int:
        """Read pasted text up to its end; of a long paste, keep only what may begin the end."""
        previous_chars = len(self._unfinished)
        text = self._unfinished + data[start:]
        end = text.find(PASTE_END)
        if end < 0:
            is_long = len(text) > MAX_PASTE_CHARS + len(PASTE_END)
            self._unfinished = text[1 - len(PASTE_END) :] if is_long else text
            self._paste_chars += len(text) - len(self._unfinished)
            return len(data)
        char_count = self._paste_chars + end
        if char_count > MAX_PASTE_CHARS:
            pasted = (
                f"# ignored a paste of {char_count} characters, expected at most {MAX_PASTE_CHARS}"
            )
        else:
            pasted = text[:end]
        self._tokens.append(InputToken(InputKind.PASTE, pasted))
        self._enter_state(self._read_text)
        return start + end + len(PASTE_END) - previous_chars


# the input of the terminal of this process, which all screens and prompts read in turn
TERMINAL_INPUT = InputSequences()


def remove_sequences(line: str) -> str:
    """Return a line of a terminal without control sequences, which its end cuts off."""
    text = line.removesuffix("\n")
    tokens = InputSequences().feed(text, 0.0)
    typed = "".join(token.data for token in tokens if token.kind is not InputKind.SEQUENCE)
    return typed + line[len(text) :]

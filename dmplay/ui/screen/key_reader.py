"""The reader of the keys of every full screen and of the shell's prompt."""

import re
import time
from collections.abc import Callable

from prompt_toolkit.input import Input
from prompt_toolkit.input.ansi_escape_sequences import ANSI_SEQUENCES
from prompt_toolkit.input.vt100_parser import Vt100Parser
from prompt_toolkit.key_binding import KeyPress
from prompt_toolkit.keys import Keys

from dmplay.terminal.background import parse_background_reply, remember_background_reply
from dmplay.terminal.input_sequences import InputKind, InputSequences, InputToken
from dmplay.terminal.key_releases import KEYBOARD_REPLY_PATTERN, RELEASE_PREFIX, parse_key_event

# reports of the cursor's position, and of the mouse in its SGR form
REPORT_PATTERN = re.compile(r"\x1b\[(?:\d{1,5};\d{1,5}R|<\d{1,5};\d{1,5};\d{1,5}[Mm])")


class KeyReader(Vt100Parser):
    """A parser of keys for prompt_toolkit that drops every sequence that is no known key.

    prompt_toolkit's own parser takes unknown sequences apart and reports their characters as keys.
    """

    def __init__(
        self,
        feed_key_callback: Callable[[KeyPress], None],
        sequences: InputSequences | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__(feed_key_callback)
        self.sequences = sequences or InputSequences()
        self.on_background: Callable[[str], None] | None = None  # receives "dark" or "light"
        # called if the terminal can report releases of keys
        self.on_keyboard: Callable[[], None] | None = None
        self.reads_releases = False  # whether releases are reported, and in which form keys are
        self._clock = clock

    def feed(self, data: str) -> None:
        """Parse these characters, and report the keys that are complete."""
        self._report_keys(self.sequences.feed(data, self._clock()))

    def flush(self) -> None:
        """Report a lone Esc as a key, unless it may still begin a sequence."""
        self._report_keys(self.sequences.end_overdue_input(self._clock()))

    def seconds_to_flush(self) -> float | None:
        """Return the seconds until `flush` may report a key, or None if it will report none."""
        deadline = self.sequences.deadline
        return None if deadline is None else max(deadline - self._clock(), 0.0)

    def _report_keys(self, tokens: list[InputToken]) -> None:
        """Report the keys in complete input, and take the terminal's replies."""
        for kind, data in tokens:
            if kind is InputKind.PASTE:
                self.feed_key_callback(KeyPress(Keys.BracketedPaste, data))
            elif kind is InputKind.TEXT or data in ANSI_SEQUENCES or REPORT_PATTERN.fullmatch(data):
                super().feed(data)
                super().flush()  # a key that begins a longer one is complete, too
            elif background := parse_background_reply(data):
                self.sequences.reply_until = 0.0
                remember_background_reply(background)
                if self.on_background:
                    self.on_background(background)
            elif self.on_keyboard and KEYBOARD_REPLY_PATTERN.fullmatch(data):
                self.on_keyboard()
            elif self.reads_releases and (event := parse_key_event(data)):
                if event.is_release:
                    self.feed_key_callback(KeyPress(Keys.Ignore, RELEASE_PREFIX + event.name))
                elif event.characters:
                    super().feed(event.characters)
                    super().flush()


def attach_key_reader(
    input_: Input,
    sequences: InputSequences | None = None,
    on_background: Callable[[str], None] | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> KeyReader:
    """Make an input read its keys with a KeyReader, and return the reader.

    `sequences` holds the state of the input, which outlives a screen. `on_background` receives
    "dark" or "light" when the terminal replies.
    """
    parser = getattr(input_, "vt100_parser", None)
    if not isinstance(parser, KeyReader):
        callback = parser.feed_key_callback if isinstance(parser, Vt100Parser) else lambda key: None
        parser = KeyReader(callback, sequences, clock)
        if hasattr(input_, "vt100_parser"):
            input_.vt100_parser = parser
    parser.on_background = on_background
    return parser

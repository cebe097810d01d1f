"""A limit on pasted text, so that a large paste neither freezes the terminal nor fills memory."""

from collections.abc import Callable

from prompt_toolkit.input import Input
from prompt_toolkit.input.vt100_parser import Vt100Parser
from prompt_toolkit.key_binding import KeyPress
from prompt_toolkit.keys import Keys

MAX_PASTE_CHARS = 10_000
PASTE_END = "\x1b[201~"  # the terminal sends it after a bracketed paste


def limit_pastes(input_: Input) -> Input:
    """Make an input drop the text of large pastes, and return the input."""
    parser = getattr(input_, "vt100_parser", None)
    if isinstance(parser, Vt100Parser) and not isinstance(parser, LimitedPasteParser):
        input_.vt100_parser = LimitedPasteParser(parser.feed_key_callback)  # type: ignore[attr-defined]
    return input_


class LimitedPasteParser(Vt100Parser):
    """A parser of keys that replaces the text of a large paste by a comment.

    prompt_toolkit's own parser collects the whole paste, and searches all of it for its end each
    time a few characters arrive.
    """

    def __init__(self, feed_key_callback: Callable[[KeyPress], None]) -> None:
        self._report_key_press = feed_key_callback
        self._dropped_chars = 0  # of the current paste
        super().__init__(self._limit_key_press)

    def feed(self, data: str) -> None:
        """Parse these characters; of a long unfinished paste, keep only what may begin its end."""
        super().feed(data)
        max_buffer_chars = MAX_PASTE_CHARS + len(PASTE_END)
        if self._in_bracketed_paste and len(self._paste_buffer) > max_buffer_chars:
            last_chars = self._paste_buffer[1 - len(PASTE_END) :]
            self._dropped_chars += len(self._paste_buffer) - len(last_chars)
            self._paste_buffer = last_chars

    def _limit_key_press(self, key_press: KeyPress) -> None:
        """Report a key, with a comment as the text of a large paste."""
        if key_press.key is Keys.BracketedPaste:
            char_count = self._dropped_chars + len(key_press.data)
            self._dropped_chars = 0
            if char_count > MAX_PASTE_CHARS:
                comment = (
                    f"# ignored a paste of {char_count} characters, "
                    f"expected at most {MAX_PASTE_CHARS}"
                )
                key_press = KeyPress(Keys.BracketedPaste, comment)
        self._report_key_press(key_press)

"""The parser of typed text: a limit on pastes, and the terminal's replies about its background.

Without the limit, a large paste would freeze the terminal or fill the memory.
"""

from collections.abc import Callable

from prompt_toolkit.input import Input
from prompt_toolkit.input.vt100_parser import Vt100Parser
from prompt_toolkit.key_binding import KeyPress
from prompt_toolkit.keys import Keys

from dmplay.terminal.background import (
    REPLY_PATTERN,
    UNFINISHED_REPLY_PATTERN,
    parse_background_reply,
)

MAX_PASTE_CHARS = 10_000
PASTE_END = "\x1b[201~"  # the terminal sends it after a bracketed paste


def limit_pastes(input_: Input, on_background: Callable[[str], None] | None = None) -> Input:
    """Make an input drop the text of large pastes, and return the input.

    `on_background` receives "dark" or "light" when the terminal replies; the reply is no key.
    """
    parser = getattr(input_, "vt100_parser", None)
    if isinstance(parser, Vt100Parser) and not isinstance(parser, LimitedPasteParser):
        input_.vt100_parser = LimitedPasteParser(parser.feed_key_callback)  # type: ignore[attr-defined]
    if isinstance(input_parser := getattr(input_, "vt100_parser", None), LimitedPasteParser):
        input_parser.on_background = on_background
    return input_


class LimitedPasteParser(Vt100Parser):
    """A parser of keys that replaces the text of a large paste by a comment.

    prompt_toolkit's own parser collects the whole paste, and searches all of it for its end each
    time a few characters arrive.
    """

    def __init__(self, feed_key_callback: Callable[[KeyPress], None]) -> None:
        self._report_key_press = feed_key_callback
        self._dropped_chars = 0  # of the current paste
        self.on_background: Callable[[str], None] | None = None
        self._unfinished_reply = ""
        super().__init__(self._limit_key_press)

    def feed(self, data: str) -> None:
        """Parse these characters; of a long unfinished paste, keep only what may begin its end."""
        super().feed(self._take_replies(data) if self.on_background else data)
        max_buffer_chars = MAX_PASTE_CHARS + len(PASTE_END)
        if self._in_bracketed_paste and len(self._paste_buffer) > max_buffer_chars:
            last_chars = self._paste_buffer[1 - len(PASTE_END) :]
            self._dropped_chars += len(self._paste_buffer) - len(last_chars)
            self._paste_buffer = last_chars

    def flush(self) -> None:
        """Parse characters that could have begun a reply or a key, such as a lone Esc."""
        data, self._unfinished_reply = self._unfinished_reply, ""
        super().feed(data)
        super().flush()

    def _take_replies(self, data: str) -> str:
        """Return these characters without the terminal's replies, complete or just begun."""
        data, self._unfinished_reply = self._unfinished_reply + data, ""
        background = parse_background_reply(data)
        if background and self.on_background:
            self.on_background(background)
        data = REPLY_PATTERN.sub("", data)
        unfinished = UNFINISHED_REPLY_PATTERN.search(data)
        if unfinished:
            self._unfinished_reply = unfinished.group()
            data = data[: unfinished.start()]
        return data

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

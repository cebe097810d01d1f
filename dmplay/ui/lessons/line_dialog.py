"""A dialog in lines: questions, answers, and the board of a position."""

import shutil
from collections.abc import Sequence
from textwrap import wrap
from typing import TextIO

from dmplay.core.text import escape_unprintable
from dmplay.draw.options import DrawOptions
from dmplay.errors import BadParameter, DmplayError
from dmplay.game.action_input import Keyboard
from dmplay.game.game import Game
from dmplay.game.key_preferences import DEFAULT_KEY_PREFERENCES
from dmplay.terminal.capabilities import Terminal, read_line
from dmplay.terminal.styles import to_ansi
from dmplay.tutor.lesson_run import TutorReply
from dmplay.tutor.positions import PositionInGame
from dmplay.views.protocol import TooSmallNotice

ROWS_OF_STEP = 9  # of the screen: the text of a step, the question and an answer
MAX_TEXT_COLUMNS = 80


class DialogLeft(Exception):
    """The exception raised when the player leaves, or a script ends."""


class CountedInput:
    """An input stream that counts the lines that were read."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.line_count = 0

    def readline(self) -> str:
        """Return the next line, "" at the end."""
        line = self._stream.readline()
        self.line_count += bool(line)
        return line

    def isatty(self) -> bool:
        """Return whether the stream is a terminal."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """Return the file descriptor of the stream."""
        return self._stream.fileno()


class LineDialog:
    """A dialog with a player who types lines, or with a script."""

    def __init__(self, terminal: Terminal, stdin: TextIO) -> None:
        self._terminal = terminal
        self._stdin = CountedInput(stdin)

    def _print_board(
        self, position: PositionInGame, situation: Sequence[str] | None = None
    ) -> bool:
        """Print the board at a position, or the situation in words, by default the narrator's.

        Return whether a board was printed.
        """
        players = position.question.players
        keyboard = Keyboard(position.problem, [position.seat], DEFAULT_KEY_PREFERENCES)
        game = Game(position.problem_name, position.session, players, keyboard)
        board = game.draw_board(self._board_options) if self._terminal.full_screen else None
        if board is None or isinstance(board, TooSmallNotice):
            if situation is None:
                situation = [game.narrator.describe_situation(game.snapshot())]
            self._print_lines(*game.picture_rows(), *situation)
            return False
        print(to_ansi(board, self._terminal.theme) if self._terminal.color else board.plain)
        return True

    @property
    def _board_options(self) -> DrawOptions:
        """The size of a board that leaves room for the text of the step."""
        columns, rows = shutil.get_terminal_size()
        return DrawOptions(
            min(columns, self._terminal.columns),
            max(rows - ROWS_OF_STEP, 1),
            ascii=self._terminal.ascii,
            show_coordinates=True,
        )

    def _read_line(self, prompt: str) -> str:
        """Return the next line without spaces and comments; raise DialogLeft at the end."""
        while True:
            line = read_line(prompt, self._stdin)  # type: ignore[arg-type]
            text = line.partition("#")[0].strip()
            if not self._terminal.is_interactive:
                print(escape_unprintable(text))
            if not line:
                if self._terminal.is_interactive:
                    print()  # after the prompt
                raise DialogLeft
            if text or not line.lstrip().startswith("#"):
                return text

    def _report_error(self, error: DmplayError) -> None:
        """Print an error; raise it with the number of its line if a script is read."""
        if not self._terminal.is_interactive:
            raise BadParameter(f"line {self._stdin.line_count}: {error}") from None
        self._print_lines(f"error: {error}")

    def _print_reply(self, reply: TutorReply) -> bool:
        """Print a reply; return whether the step is finished."""
        self._print_lines(*reply.lines)
        return reply.finishes_step

    def _print_heading(self, text: str) -> None:
        """Print a heading, in bold if the terminal has colours."""
        line = "\n".join(self._wrap_line(escape_unprintable(text)))
        print(to_ansi(((line, "bold"),), self._terminal.theme) if self._terminal.color else line)

    def _print_paragraph(self, lines: Sequence[str]) -> None:
        """Print the lines of a text; join them if a person's terminal is narrower."""
        is_joined = any(len(self._wrap_line(line)) > 1 for line in lines)
        self._print_lines(*([" ".join(lines)] if is_joined else lines))

    def _print_lines(self, *lines: str) -> None:
        """Print lines with unprintable characters escaped, wrapped if a person reads them."""
        for line in map(escape_unprintable, lines):
            print("\n".join(self._wrap_line(line)), flush=True)

    def _wrap_line(self, line: str) -> list[str]:
        """Return the rows of a line: several if it is wide and a person reads it."""
        width = min(self._terminal.columns, MAX_TEXT_COLUMNS)
        if not self._terminal.is_interactive or len(line) <= width:
            return [line]
        indent = "  " * (len(line) - len(line.lstrip()))  # of the rows below the first
        return wrap(line, width, subsequent_indent=indent, break_on_hyphens=False)

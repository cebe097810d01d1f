"""The shell: commands typed in a terminal, or a script of commands, and their output."""

import shutil
import sys
from collections.abc import Callable, Iterable
from textwrap import TextWrapper

from dmplay.core.text import escape_unprintable
from dmplay.draw.options import DrawOptions
from dmplay.errors import BadParameter, DmplayError
from dmplay.game.background_tasks import TaskCancelled
from dmplay.game.command_line_results import TutorCommand
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.terminal.capabilities import Terminal, clear_screen
from dmplay.terminal.styles import to_ansi
from dmplay.ui.shell.commands import (
    PlayerQuit,
    iter_commands_until_handover,
    list_commands,
    run_line,
    split_commands,
    take_prediction_report,
)
from dmplay.ui.shell.plain_mode import read_choice, wait_for_handover

ROWS_BELOW_BOARD = 6  # rows of the terminal reserved for text


class Shell:
    """A shell that runs lines with a game controller and prints the replies."""

    def __init__(self, controller: GameController, terminal: Terminal, speed: float = 2.0) -> None:
        self.controller = controller
        self.terminal = terminal
        self.speed = speed  # turns per second when agents play on the screen
        controller.is_interactive = terminal.is_interactive
        controller.on_intermediate_turn = self._print_turn
        # runs a lesson between two typed lines; None if none can be run
        self.run_lesson: Callable[[TutorCommand], object] | None = None
        self._reported_game: Game | None = None  # the game whose end was printed

    @property
    def game(self) -> Game | None:
        """The current game; None if there is none."""
        return self.controller.game if self.controller.has_game else None

    @property
    def prompt(self) -> str:
        """The prompt: problem and turn count, and the next agent if several people play."""
        game = self.game
        if game is None:
            return "dmplay> "
        end_mark = " over" if game.session.over else ""
        has_several_people = len(game.human_seats) > 1 and not end_mark
        agent_text = f" {game.problem.agents[game.viewing_seat]}" if has_several_people else ""
        return (
            f"dmplay [{escape_unprintable(game.problem_name)} "
            f"t{len(game.session.turns)}{agent_text}{end_mark}]> "
        )

    def run_line(self, line: str) -> None:
        """Run one line and print its effects.

        PlayerQuit and DmplayError are raised after the effects up to the error have been printed.
        """
        game, turn_count = self.game, self._turn_count()
        if self.controller.is_interactive:
            self.controller.open_lesson = self.run_lesson
        try:
            for part in (
                iter_commands_until_handover(self.controller, line)
                if self.controller.is_interactive
                else list_commands(self.controller, line)
            ):
                reply = run_line(self.controller, part)
                if not self.awaiting_handover or self._turn_count() == turn_count:
                    self._print_reply(reply)
                if self.controller.has_game:
                    self._print_reply(take_prediction_report(self.controller.game))
        finally:  # The effects before an error are printed as well.
            self._print_reply(self.controller.pop_medal_notice())
            self._print_reply(self.controller.take_write_notice())
            is_changed = self.game is not game or self._turn_count() != turn_count
            if is_changed and not self.awaiting_handover:
                self._print_board_or_situation(is_new_game=self.game is not game)
            sys.stdout.flush()

    @property
    def awaiting_handover(self) -> bool:
        """True if another person must take over the terminal before anything more is printed."""
        return self.controller.is_interactive and self.controller.awaiting_handover

    def hand_over(self, *, is_retry: bool) -> None:
        """Wait until the next person has taken over the terminal, and print that person's view.

        Unless it is a retry after Ctrl-C, the screen is cleared first.
        """
        if not is_retry:
            clear_screen()
        self._print_reply(wait_for_handover(self.controller))
        self._print_reply(self.controller.take_write_notice())
        if self.terminal.full_screen:
            self._print_board_or_situation(is_new_game=False)

    def _print_reply(self, reply: str) -> None:
        """Print a reply; on a terminal, wrap it between words."""
        rows = escape_unprintable(reply).split("\n") if reply else []
        if self.terminal.full_screen:
            wrapper = TextWrapper(
                self.terminal.columns,
                subsequent_indent="  ",
                break_long_words=False,
                break_on_hyphens=False,
            )
            rows = [part for row in rows for part in wrapper.wrap(row) or [""]]
        for row in rows:
            print(row)

    def _print_turn(self) -> None:
        """Print the last turn if another follows at once, unless people see different things."""
        game = self.controller.game
        if not game.has_private_views:
            self._print_reply(game.narrator.describe_turn(game.snapshot()))
        self._print_reply(self.controller.take_write_notice())

    def _turn_count(self) -> int:
        """Return the number of turns played; 0 without a game."""
        return len(self.game.session.turns) if self.game else 0

    def _print_board_or_situation(self, *, is_new_game: bool) -> None:
        """Print the board on a terminal, else the situation of a new game; the result once."""
        game = self.controller.game
        if self.terminal.full_screen:
            rows = shutil.get_terminal_size().lines
            options = DrawOptions(
                self.terminal.columns, max(rows - ROWS_BELOW_BOARD, 1), self.terminal.ascii
            )
            # Names are typed here, not keys.
            labels = game.keyboard.get_keys_by_action(game.viewing_seat)
            typed_labels = {label: label for label in labels if len(label) <= 2}
            shows_keys = game.choosing_seat is not None
            options = options._replace(show_keys=shows_keys, keys_by_action=typed_labels)
            board = game.draw_board(options)
            print(to_ansi(board, self.terminal.theme))
        elif is_new_game:
            print(game.narrator.describe_situation(game.snapshot()))
        if game.session.over and game is not self._reported_game:
            self._reported_game = game
            for row in game.closing_lines():
                self._print_reply(row)


def run_script(
    shell: Shell, lines: Iterable[str], line_label: str = "line", *, echo: bool = True
) -> bool:
    """Run a script, with each line echoed after its prompt; return whether a line was invalid.

    The first invalid line ends the game: raise BadParameter with the number of the line. In a game
    that is to be handed in it is reported, and the next one read.
    """
    has_invalid_line = False
    shell.controller.is_interactive = False
    for number, line in enumerate(lines, 1):
        try:
            if not split_commands(line):
                continue
            if echo:
                print(shell.prompt + escape_unprintable(line.strip()), flush=True)
            shell.run_line(line)
        except PlayerQuit:
            break
        except DmplayError as error:
            message = f"{line_label} {number}: {error}"
            if shell.game is None or not shell.game.pauses_when_left:
                shell.controller.end_game("illegal")
                raise BadParameter(message) from None
            print(f"error: {escape_unprintable(message)}", file=sys.stderr, flush=True)
            has_invalid_line = True
    return has_invalid_line


def run_prompt_loop(shell: Shell) -> None:
    """Read and run typed lines until the input ends or the player leaves.

    The first Ctrl-C in a row prints a warning; the second is raised.
    """
    is_warned = False
    while True:
        try:
            if shell.awaiting_handover:
                shell.hand_over(is_retry=is_warned)
            line, is_warned = read_choice(shell.controller, shell.prompt, sys.stdin), False
            if not line:
                print()
                return
            shell.run_line(line)
        except PlayerQuit:
            return
        except TaskCancelled:
            print("cancelled.", flush=True)
        except KeyboardInterrupt:
            if is_warned:
                raise
            is_warned = True
            print("\nto quit, press Ctrl-C again, press Ctrl-D or type quit.", flush=True)
        except DmplayError as error:
            print(f"error: {escape_unprintable(str(error))}", flush=True)

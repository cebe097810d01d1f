"""The shell in words: what a line does, what it prints, and a whole script of lines."""

import shutil
import sys
from collections.abc import Iterable
from textwrap import TextWrapper

from dmplay.errors import BadParameter, DmplayError
from dmplay.game.game import Game
from dmplay.game.table import GameController
from dmplay.styles import to_ansi
from dmplay.terminal import Terminal, clear_screen, escape_unprintable
from dmplay.thought import TaskCancelled
from dmplay.views.style import DrawOptions
from dmplay.words.commands import PlayerQuit, iter_commands_until_handover, run_line, split_commands
from dmplay.words.plain import read_choice, wait_for_handover

ROWS_BELOW_BOARD = 6  # rows that a board leaves to the words around it


class Shell:
    """A table with a typewriter."""

    def __init__(self, controller: GameController, terminal: Terminal, speed: float = 2.0) -> None:
        self.controller = controller
        self.terminal = terminal
        self.speed = speed  # turns a second when agents play on the screen
        controller.is_interactive = terminal.is_interactive
        controller.on_intermediate_turn = self._print_turn
        self._reported_game: Game | None = None  # the game whose end was told

    @property
    def game(self) -> Game | None:
        """The game that is played now."""
        return self.controller.game if self.controller.has_game else None

    @property
    def prompt(self) -> str:
        """Problem and turn, and who is to choose where several are."""
        game = self.game
        if game is None:
            return "dmplay> "
        over = " over" if game.session.over else ""
        several = len(game.human_seats) > 1 and not over
        who = f" {game.problem.agents[game.viewing_seat]}" if several else ""
        return f"dmplay [{escape_unprintable(game.problem_name)} t{len(game.session.turns)}{who}{over}]> "

    def run_line(self, line: str) -> None:
        """Does what a line says and prints what comes of it; raises Leave and DmplayError."""
        game, before = self.game, self._turn_count()
        try:
            for part in (
                iter_commands_until_handover(self.controller, line)
                if self.controller.is_interactive
                else split_commands(line)
            ):
                words = run_line(self.controller, part)
                if not self.awaiting_handover or self._turn_count() == before:
                    self._print_reply(words)
        finally:  # what was done before a fault is seen too
            changed = self.game is not game or self._turn_count() != before
            if changed and not self.awaiting_handover:
                self._print_board(is_new_game=self.game is not game)
            sys.stdout.flush()

    @property
    def awaiting_handover(self) -> bool:
        """Whether somebody else is to sit down before anything more is told."""
        return self.controller.is_interactive and self.controller.awaiting_handover

    def hand_over(self, *, is_retry: bool) -> None:
        """Waits for the one who is next to sit down, and shows what this one may see."""
        if not is_retry:
            clear_screen()
        self._print_reply(wait_for_handover(self.controller))
        if self.terminal.full_screen:
            self._print_board(is_new_game=False)

    def _print_reply(self, reply: str) -> None:
        """Prints an answer, on a terminal without a word cut in two."""
        rows = escape_unprintable(reply).split("\n") if reply else []
        if self.terminal.full_screen:
            cut = TextWrapper(
                self.terminal.columns,
                subsequent_indent="  ",
                break_long_words=False,
                break_on_hyphens=False,
            )
            rows = [part for row in rows for part in cut.wrap(row) or [""]]
        for row in rows:
            print(row)

    def _print_turn(self) -> None:
        """Tells a turn that another follows."""
        game = self.controller.game
        if not game.has_private_views:
            self._print_reply(game.narrator.describe_turn(game.snapshot()))

    def _turn_count(self) -> int:
        return len(self.game.session.turns) if self.game else 0

    def _print_board(self, *, is_new_game: bool) -> None:
        """The board, on a terminal; the situation of a game that begins; how it ended."""
        game = self.controller.game
        if self.terminal.full_screen:
            rows = shutil.get_terminal_size().lines
            room = DrawOptions(
                self.terminal.columns, max(rows - ROWS_BELOW_BOARD, 1), self.terminal.ascii
            )
            labels = game.keyboard.get_keys_by_action(
                game.viewing_seat
            )  # what is typed here are names, not keys
            short = {label: label for label in labels if len(label) <= 2}
            drawn = game.draw_board(
                room._replace(show_keys=game.choosing_seat is not None, keys_by_action=short)
            )
            print(to_ansi(drawn, self.terminal.theme))
        elif is_new_game:
            print(game.narrator.describe_situation(game.snapshot()))
        if game.session.over and game is not self._reported_game:
            self._reported_game = game
            for row in game.narrator.closing_lines():
                self._print_reply(row)


def run_script(
    shell: Shell, lines: Iterable[str], line_label: str = "line", *, echo: bool = True
) -> None:
    """Does a script, each line after its prompt; raises BadParameter that names a bad one."""
    shell.controller.is_interactive = False
    for number, line in enumerate(lines, 1):
        if not split_commands(line):
            continue
        if echo:
            print(shell.prompt + escape_unprintable(line.strip()), flush=True)
        try:
            shell.run_line(line)
        except PlayerQuit:
            return
        except DmplayError as error:
            shell.controller.end_game("illegal")
            raise BadParameter(f"{line_label} {number}: {error}") from None


def run_prompt_loop(shell: Shell) -> None:
    """Asks for lines where nothing can be drawn, until the input ends or the player leaves."""
    warned = False
    while True:
        try:
            if shell.awaiting_handover:
                shell.hand_over(is_retry=warned)
            line, warned = read_choice(shell.controller, shell.prompt, sys.stdin), False
            if not line:
                print()
                return
            shell.run_line(line)
        except PlayerQuit:
            return
        except TaskCancelled:
            print("cancelled.", flush=True)
        except KeyboardInterrupt:
            if warned:
                raise
            warned = True
            print("\nCtrl-C once more leaves; so do quit and Ctrl-D.", flush=True)
        except DmplayError as error:
            print(f"error: {escape_unprintable(str(error))}", flush=True)

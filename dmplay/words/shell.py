"""The shell in words: what a line does, what it prints, and a whole script of lines."""

import shutil
import sys
from collections.abc import Iterable
from textwrap import TextWrapper

from dmplay.errors import BadParameter, DmplayError
from dmplay.game.game import Game
from dmplay.game.table import Table
from dmplay.styles import ansi
from dmplay.terminal import Terminal, clean, wipe
from dmplay.thought import Cancelled
from dmplay.views.style import Look
from dmplay.words.commands import Leave, own_parts, parts, typed
from dmplay.words.plain import asked, handed_over

BELOW = 6  # rows that a board leaves to the words around it


class Shell:
    """A table with a typewriter."""

    def __init__(self, table: Table, terminal: Terminal, speed: float = 2.0) -> None:
        self.table = table
        self.terminal = terminal
        self.speed = speed  # turns a second when agents play on the screen
        table.typed = terminal.typed
        table.tells = self._passed
        self._over: Game | None = None  # the game whose end was told

    @property
    def game(self) -> Game | None:
        """The game that is played now."""
        return self.table.game if self.table.playing else None

    @property
    def prompt(self) -> str:
        """Problem and turn, and who is to choose where several are."""
        game = self.game
        if game is None:
            return "dmplay> "
        over = " over" if game.session.over else ""
        several = len(game.people) > 1 and not over
        who = f" {game.problem.agents[game.watcher]}" if several else ""
        return f"dmplay [{clean(game.name)} t{len(game.session.turns)}{who}{over}]> "

    def do(self, line: str) -> None:
        """Does what a line says and prints what comes of it; raises Leave and DmplayError."""
        game, before = self.game, self._turns()
        try:
            for part in own_parts(self.table, line) if self.table.typed else parts(line):
                words = typed(self.table, part)
                if not self.curtained or self._turns() == before:
                    self._say(words)
        finally:  # what was done before a fault is seen too
            changed = self.game is not game or self._turns() != before
            if changed and not self.curtained:
                self._show(fresh=self.game is not game)
            sys.stdout.flush()

    @property
    def curtained(self) -> bool:
        """Whether somebody else is to sit down before anything more is told."""
        return self.table.typed and self.table.curtained

    def change_places(self, *, again: bool) -> None:
        """Waits for the one who is next to sit down, and shows what this one may see."""
        if not again:
            wipe()
        self._say(handed_over(self.table))
        if self.terminal.screen:
            self._show(fresh=False)

    def _say(self, words: str) -> None:
        """Prints an answer, on a terminal without a word cut in two."""
        rows = clean(words).split("\n") if words else []
        if self.terminal.screen:
            cut = TextWrapper(
                self.terminal.columns,
                subsequent_indent="  ",
                break_long_words=False,
                break_on_hyphens=False,
            )
            rows = [part for row in rows for part in cut.wrap(row) or [""]]
        for row in rows:
            print(row)

    def _passed(self) -> None:
        """Tells a turn that another follows."""
        game = self.table.game
        if not game.private:
            self._say(game.account.said(game.moment()))

    def _turns(self) -> int:
        return len(self.game.session.turns) if self.game else 0

    def _show(self, *, fresh: bool) -> None:
        """The board, on a terminal; the situation of a game that begins; how it ended."""
        game = self.table.game
        if self.terminal.screen:
            rows = shutil.get_terminal_size().lines
            room = Look(self.terminal.columns, max(rows - BELOW, 1), self.terminal.ascii)
            labels = game.keyboard.names(game.watcher)  # what is typed here are names, not keys
            short = {label: label for label in labels if len(label) <= 2}
            drawn = game.draw(room._replace(keys=game.waiting is not None, names=short))
            print(ansi(drawn, self.terminal.theme))
        elif fresh:
            print(game.account.situation(game.moment()))
        if game.session.over and game is not self._over:
            self._over = game
            for row in game.account.closing():
                self._say(row)


def script(shell: Shell, lines: Iterable[str], what: str = "line", *, echo: bool = True) -> None:
    """Does a script, each line after its prompt; raises BadParameter that names a bad one."""
    shell.table.typed = False
    for number, line in enumerate(lines, 1):
        if not parts(line):
            continue
        if echo:
            print(shell.prompt + clean(line.strip()), flush=True)
        try:
            shell.do(line)
        except Leave:
            return
        except DmplayError as error:
            shell.table.end("illegal")
            raise BadParameter(f"{what} {number}: {error}") from None


def ask(shell: Shell) -> None:
    """Asks for lines where nothing can be drawn, until the input ends or the player leaves."""
    warned = False
    while True:
        try:
            if shell.curtained:
                shell.change_places(again=warned)
            line, warned = asked(shell.table, shell.prompt, sys.stdin), False
            if not line:
                print()
                return
            shell.do(line)
        except Leave:
            return
        except Cancelled:
            print("cancelled.", flush=True)
        except KeyboardInterrupt:
            if warned:
                raise
            warned = True
            print("\nCtrl-C once more leaves; so do quit and Ctrl-D.", flush=True)
        except DmplayError as error:
            print(f"error: {clean(str(error))}", flush=True)

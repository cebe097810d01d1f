"""Play by single keys on a full screen."""

import contextlib
import shutil
import signal
import sys
from collections.abc import Iterator
from types import FrameType

from rich.text import Text

from dmplay.errors import DmplayError
from dmplay.shell import frame
from dmplay.shell.commands import COMMANDS, typed
from dmplay.shell.frame import Room, Shown
from dmplay.shell.game import Game
from dmplay.shell.paint import ansi
from dmplay.shell.terminal import Terminal

ENTER_SCREEN, LEAVE_SCREEN = "\x1b[?1049h\x1b[H\x1b[2J", "\x1b[?1049l"
ENDS = {
    number: 128 + number for number in (signal.SIGTERM, getattr(signal, "SIGHUP", None)) if number
}
OVERLAYS = ("", "values", "policy", "states")


class Screen:
    """The state of the play screen beside the game's own."""

    def __init__(self, game: Game, terminal: Terminal, speed: float = 2.0) -> None:
        self.game = game
        self.terminal = terminal
        self.speed = speed  # turns a second in autoplay
        self.log: list[str] = []
        self.message = ""
        self.overlay = 0
        self.help = False
        self.prefix = ""  # the first arrow of a diagonal
        self.auto = False
        self.typing = False  # whether the command row is open

    def room(self) -> Room:
        """The terminal's present size."""
        columns, lines = shutil.get_terminal_size((80, 24))
        return Room(columns, lines, self.terminal.ascii)

    @property
    def shown(self) -> Shown:
        """What the screen adds to the game."""
        return Shown(self.message, OVERLAYS[self.overlay], self.help)

    def upper(self, room: Room) -> Text:
        """The screen above its command row."""
        return frame.upper(self.game, room, self.shown, self.log)

    # Keys

    def press(self, key: str) -> None:
        """Does what a key says; raises Leave."""
        self.message = ""
        if self.help:
            self.help = False
            return
        with self.told():
            combination = f"{self.prefix} {key}".strip()
            self.prefix = ""
            action = self.game.key(combination) if self.game.waiting is not None else None
            if action is not None:
                self.act(action)
            elif key in ("up", "down") and self._has_diagonals():
                self.prefix = key
                self.message = f"{key}, then left or right: a diagonal"
            else:
                self.command(key)

    def _has_diagonals(self) -> bool:
        return any(" " in key for key in self.game.style.KEYS)

    def act(self, action: float) -> None:
        """Plays an action."""
        before = len(self.game.session.turns)
        self.game.choose(action)
        self.note(before)
        if self.game.waiting is not None and len(self.game.people) > 1:
            name = self.game.problem.agents[self.game.waiting]
            self.message = f"{name} chooses; the other choice stays hidden until both are in"

    def command(self, key: str) -> None:
        """Does what a key of the shell says."""
        if key == "?":
            self.help = True
        elif key == "V":
            self.overlay = (self.overlay + 1) % len(OVERLAYS)
            self.message = f"overlay: {OVERLAYS[self.overlay] or 'none'}"
        elif key == "A" and not self.game.people:
            self.auto = not self.auto
        elif key in (" ", "right") and not self.game.people:
            self.step()
        else:
            command = next((c for c in COMMANDS if c.key == key), None)
            if command is None:
                self.message = f"{key}: no such key; ? shows them" if key.isprintable() else ""
                return
            before = len(self.game.session.turns)
            self.message = command.run(self.game, "")
            self.note(before)

    def step(self) -> None:
        """A turn of a game without people."""
        before = len(self.game.session.turns)
        self.game.unattended()
        self.note(before)

    def type(self, line: str) -> None:
        """Does what a line of the command row says; raises Leave."""
        with self.told():
            before = len(self.game.session.turns)
            self.message = typed(self.game, line)
            self.note(before)

    @contextlib.contextmanager
    def told(self) -> Iterator[None]:
        """Turns an error into a message."""
        try:
            yield
        except DmplayError as error:
            self.message = str(error)

    def note(self, before: int) -> None:
        """Logs what happened since there were `before` turns."""
        now = len(self.game.session.turns)
        if now > before:
            self.log.append(self.game.said())
            self.message = "" if self.message == self.log[-1] else self.message
        elif now < before:
            self.log.append(self.message)
            self.message = ""
        recorder = self.game.recorder
        if recorder and recorder.fault:
            self.message = f"cannot write {recorder.path}: {recorder.fault.strerror}"


def run(screen: Screen) -> int:
    """Shows the screen until the player leaves; returns the exit code."""
    previous = {number: signal.signal(number, _stop) for number in ENDS}
    try:
        first = frame.compose(screen.game, screen.room(), screen.shown, screen.log)
        # The first frame stands before the toolkit, a tenth of a second, is imported.
        sys.stdout.write(ENTER_SCREEN + ansi(first, screen.terminal.color))
        sys.stdout.flush()
        from dmplay.shell import toolkit

        return toolkit.run(screen)
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
        with contextlib.suppress(OSError):  # the terminal itself may be gone
            sys.stdout.write(LEAVE_SCREEN)
            sys.stdout.flush()


def _stop(number: int, where: FrameType | None) -> None:
    raise SystemExit(ENDS[signal.Signals(number)])

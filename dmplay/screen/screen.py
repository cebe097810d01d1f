"""The play screen: the game at a table as it is seen, and what is said beside it."""

import contextlib
from collections.abc import Iterator, Sequence

from rich.text import Text

from dmplay import records
from dmplay.budget import Stopped
from dmplay.core import Continuous
from dmplay.describe import brief
from dmplay.errors import DmplayError
from dmplay.game.answer import Page, Told
from dmplay.game.game import Game
from dmplay.game.log import Log
from dmplay.game.table import Table
from dmplay.painting.painter import Painter
from dmplay.screen import frame
from dmplay.screen.clock import STARTS, Clock
from dmplay.screen.modes import Event, Mode, Modes
from dmplay.screen.motion import Motion
from dmplay.screen.number import Number
from dmplay.screen.shown import KEYS_SHOWN, Room, Shown, player
from dmplay.terminal import Terminal
from dmplay.thought import About, think
from dmplay.timeline import Past, Verdict

OVERLAYS = ("", "values", "policy", "states")
ADVICE = ("values", "policy")  # of them
VALUING = About("valuing every state")


class Screen:
    """The state of the play screen beside the game's own, and how it is shown."""

    moment = 0.1  # seconds after which what the game does is shown as thinking

    def __init__(
        self, table: Table, terminal: Terminal, speed: float = 2.0, rate: float | None = None
    ) -> None:
        self.table = table
        table.typed = True
        table.tells = self.note
        self.terminal = terminal
        self.speed = speed  # turns a second in autoplay
        self.rate = rate  # turns a second in real time; None where each turn waits for a key
        self.modes = Modes()
        self.message = ""
        self.foretold = ""  # what an action may bring, in words
        self.thinking = ""  # what is computed now, in place of the message
        self.overlay = 0
        self._advised: tuple[object, ...] = ()  # where an overlay was counted last
        self.page: list[str] = []  # an answer of several lines
        self.part = 0  # of the page
        self._room = Room(80, 24)
        self._sit()
        if table.game.people and table.game.request and table.game.recorder is None:
            self.message = "this game is not kept: there is no place to write to"
        self.message = table.game.warning or self.message

    def _sit(self) -> None:
        """Forgets the game before this one."""
        game = self.game
        self._log = Log(game)
        self.number = Number()  # that is being typed
        self.prefix = ""  # the first arrow of a diagonal
        self.keys_until = KEYS_SHOWN  # the turn from which on the board names no keys
        self.clock = Clock(self.rate)
        self.verdict = Verdict()  # once it is over
        self.motion = Motion()
        self.back = 0  # rows that the log is scrolled back
        record = records.of(game)
        self._best = brief(record.best.returned) if record and record.best else ""
        self.modes.begins(clock=bool(self.rate and game.people))

    @property
    def game(self) -> Game:
        """The game that is played now."""
        return self.table.game

    def room(self, painter: Painter) -> Room:
        """The terminal, of the size that it has now."""
        self._room = Room(*painter.size(), self.terminal.ascii)
        return self._room

    def paint(self, painter: Painter) -> None:
        """Brings the screen as it is now onto the terminal."""
        self._count_overlay()
        room = self.room(painter)
        drawn = frame.compose(self.past or self.game, room, self.shown, self.log)
        painter.paint(drawn, player(drawn))

    def _count_overlay(self) -> None:
        """Counts the advice of an overlay once for each turn that it lies on."""
        game, shown = self.game, self.shown
        now = (shown.overlay, game, len(game.session.turns), game.watcher)
        lies = shown.overlay in ADVICE and not (shown.page or shown.curtain or game.session.over)
        if lies and now != self._advised and game.adviser.overlay(shown.overlay):
            self._advised = now
            game.helped()

    @property
    def shown(self) -> Shown:
        """What the screen adds to the game."""
        game, adviser, past = self.game, self.game.adviser, self.past
        drawn = adviser.ready and not game.unaided
        unstarted = self.modes.moves is Mode.CLOCK and not self.clock.started
        starts = STARTS if unstarted and game.waiting is not None else ""
        shown = Shown(
            self.thinking or self._answer or starts,
            OVERLAYS[self.overlay] if drawn else "",
            self.page if self.modes.shows is Mode.PAGE else (),
            self.part,
            self.back,
            curtain=game.problem.agents[game.watcher] if self.table.curtained else "",
            keys_until=self.keys_until,
            passed=self.motion.passed,
            best=self._best,
        )
        if past:
            return shown._replace(advice=past.advice, past=True)
        written = self.number.action(game) if self.number.text else None
        return shown._replace(advice=adviser.given, written=written, outlook=adviser.foreseen)

    @property
    def _answer(self) -> str:
        """The message; of what an action may bring, where the board has room for it, or no row has,
        how to go on.
        """
        if not self.foretold or self.message != self.foretold:
            return self.message
        numbers = isinstance(self.game.problem.states, Continuous)
        if len(self.message) < self._room.width and not (numbers or frame.aimed(self._room)):
            return self.message
        return f"{self.message.partition(': ')[0]}: Enter plays it, Esc leaves"

    @property
    def past(self) -> Past | None:
        """The game at the turn that is looked back at."""
        return self.verdict.past if self.modes.shows is Mode.BACK else None

    @property
    def log(self) -> list[str]:
        """What happened, as the one before the screen may know it."""
        return self.past.rows(self._room.width) if self.past else self._log.rows

    def _frame(self, room: Room) -> frame.Frame:
        """What is seen now, in a room."""
        return frame.Frame(self.past or self.game, room, self.shown, self.log)

    def upper(self, room: Room) -> Text:
        """The screen above its command row."""
        return self._frame(room).upper()

    def scroll(self, rows: float) -> None:
        """Goes so many rows back in the log, or on."""
        if not self.table.curtained:
            most = self._frame(self._room).most_back()
            self.back = int(min(max(self.back + rows, 0), most))

    def turn_page(self, parts: float) -> bool:
        """Goes so many parts on in the page, or back; whether it went on."""
        before, last = self.part, len(frame.pages(self._room, self.shown)) - 1
        self.part = int(min(max(before + parts, 0), last))
        return self.part > before

    def next_overlay(self) -> None:
        """Goes on to what else the board can show, at last nothing; says so if it never can."""
        self.game.may_help("overlay")
        think(VALUING, self.game.adviser.prepare)
        before, self.overlay = self.overlay, 0
        bare = self.upper(self._room).plain
        for number in range(before + 1, len(OVERLAYS)):
            self.overlay = number
            if self.upper(self._room).plain != bare:
                self.message = f"overlay: {OVERLAYS[number]}"
                return
        self.overlay = 0
        self.message = "overlay: none" if before else "this board has no overlays"

    @contextlib.contextmanager
    def caught(self) -> Iterator[None]:
        """Turns an error into a message, and logs what happened before it; readies the overlay."""
        try:
            yield
            if self.overlay:
                think(VALUING, self.game.adviser.prepare)
        except (DmplayError, Stopped) as error:
            self.note()
            self.overlay = self.overlay if self.game.adviser.ready else 0
            self.message = str(error) or "cancelled"

    def say(self, words: str) -> None:
        """Shows an answer: in its row, or as a page that any key closes; logs what it tells of."""
        rows = words.split("\n") if isinstance(words, Page) else []
        advice = self.game.adviser.given
        if rows and not isinstance(words, Told):
            self.open(rows)
        else:
            self.modes.happens(Event.CLOSED)
            self.message = "" if rows else words
            if advice and words == str(advice):  # its values are marked
                cost = "" if advice.action is None else self.game.price(advice.action)
                self.message = f"{advice.short}{cost}"
        self.note(rows)

    def open(self, rows: list[str]) -> None:
        """Shows rows in place of the board."""
        self.message, self.page, self.part = "", rows, 0
        self.modes.happens(Event.OPENED)

    def note(self, told: Sequence[str] = ()) -> None:
        """Logs what happened since the last time; `told` are the turns of an answer."""
        if self._log.game is not self.game:
            self._sit()
        elif self._log.catch_up(told):
            self.back = 0
            self.message = "" if self.message == self.log[-1] else self.message
        self.verdict.judge(self.game)
        recorder = self.game.recorder
        if recorder and recorder.fault:
            self.message = f"cannot write {recorder.path}: {recorder.fault.strerror}"

    def ponder(self, about: About, far: str) -> None:
        """Tells what is thought of, and how far it is where things may move."""
        told = f"{about.told} ... {far if self.terminal.motion else ''}"
        cure = "Ctrl-C cancels"
        self.thinking = f"{told}{cure}" if len(told + cure) < self._room.width else told

    def leave_alone(self) -> None:
        """Goes on without what was cancelled and does not stop."""
        self.game.leave_alone()
        self.message = "cancelled, but it does not stop: it slows dmplay down until you leave"

"""Play by single keys on a full screen."""

import contextlib
from collections.abc import Iterator

from rich.text import Text

from dmplay.errors import DmplayError
from dmplay.game.game import Game
from dmplay.game.log import Log
from dmplay.game.number import Number
from dmplay.game.table import Table
from dmplay.screen import frame
from dmplay.screen.frame import KEYS_SHOWN, Room, Shown
from dmplay.screen.painter import Painter, Place
from dmplay.terminal import Terminal
from dmplay.words.commands import COMMANDS, parts, typed

REVIEW_TIME = 0.3  # seconds that a review may take before the last frame
FASTER = {"+": 1.5, "-": 1 / 1.5}  # the speed times this
SLOWEST, FASTEST = 0.1, 50.0  # turns a second
MORE = ("space", "down", "pagedown", "enter")
MANY = 20  # turns that nobody wants to lose by one key
PONDERED = ("tab", "V")  # keys whose answer is an agent's
OVERLAYS = ("", "values", "policy", "states")


class Screen:
    """The state of the play screen beside the game's own."""

    def __init__(
        self, table: Table, terminal: Terminal, speed: float = 2.0, rate: float | None = None
    ) -> None:
        self.table = table
        self._log = Log(table.game)
        self.terminal = terminal
        self.speed = speed  # turns a second in autoplay
        self.rate = rate  # turns a second in real time; None where each turn waits for a key
        self.held: float | None = None  # the action that repeats in real time
        self.number = Number()  # that is being typed
        self.message = ""
        self.overlay = 0
        self.help = False
        self.keys_until = KEYS_SHOWN  # the turn from which on the board names no keys
        self.page: list[str] = []  # an answer of several lines
        self.part = 0  # of the help or the page
        self.before = table.game.watcher  # who sits before the screen
        self.prefix = ""  # the first arrow of a diagonal
        self.reviewed = False
        self.auto = False
        self.leaving = False  # whether q was warned of
        self.paused = False  # whether the clock of real time stands
        self._room = Room(80, 24)
        if table.game.people and table.game.asked and table.game.recorder is None:
            self.message = "this game is not kept: there is no place to write to"

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
        drawn = frame.compose(self.game, self.room(painter), self.shown, self.log)
        painter.paint(drawn, _player(drawn.plain))

    @property
    def shown(self) -> Shown:
        """What the screen adds to the game."""
        curtain = self.game.problem.agents[self.game.watcher] if self.curtained else ""
        kind = OVERLAYS[self.overlay]
        part = self.part
        return Shown(self.message, kind, self.help, self.page, part, curtain, self.keys_until)

    @property
    def log(self) -> list[str]:
        """What happened, as the one before the screen may know it."""
        return self._log.rows

    @property
    def curtained(self) -> bool:
        """Whether somebody else is to choose, who alone may see what comes."""
        game = self.game
        return game.private and game.waiting is not None and game.watcher != self.before

    def upper(self, room: Room) -> Text:
        """The screen above its command row."""
        return frame.upper(self.game, room, self.shown, self.log)

    # Keys

    def ponders(self, key: str) -> bool:
        """Whether a key asks for what takes longer than a moment; its message says so."""
        told = key in PONDERED and not self.curtained and self.game.adviser.slow
        self.message = "one moment ..." if told else self.message
        return told

    def press(self, key: str) -> None:
        """Does what a key says; raises Leave."""
        self.message = ""
        self.leaving = self.leaving and key == "q"
        if self.curtained and key != "q":
            if key in ("enter", "space"):
                self.before = self.game.watcher
            return
        if self.help or self.page:
            self._turn_page(key)
            return
        with self.told():
            waiting = self.game.waiting is not None
            if waiting and (self._number(key) or self._action(key)):
                return
            self.command(key)

    def _turn_page(self, key: str) -> None:
        parts = frame.pages(self.game, self._room, self.shown)
        if key in MORE and self.part + 1 < len(parts):
            self.part += 1
        else:
            self.help, self.page, self.part = False, [], 0

    def _action(self, key: str) -> bool:
        """Plays the action of a key, or of two arrows for a diagonal."""
        combination = f"{self.prefix} {key}".strip()
        self.prefix = ""
        found = self.game.key(combination)
        if found is not None:
            seat, action = found
            self.act(action, seat)
        elif key in ("up", "down") and any(" " in one for one in self.game.hands.keys):
            self.prefix = key
            self.message = f"{key}, then left or right: a diagonal"
        else:
            return False
        return True

    def _number(self, key: str) -> bool:
        """Writes or nudges a number, and plays it on Enter."""
        if key == "enter" and self.number.text:
            self.act(self.game.read(self.number.taken()))
            return True
        if not self.number.press(self.game, key):
            return False
        self.message = self.number.shown(self.game)
        return True

    def act(self, action: float, seat: int | None = None) -> None:
        """Plays an action; in real time, keeps it for the clock."""
        if self.rate:
            self.held = action
            return
        before = len(self.game.session.turns)
        self.game.choose(action, seat)
        self.note(before)
        several = len(self.game.people) > 1 and not self.game.private  # whom a curtain tells
        if self.game.waiting is not None and several:
            name = self.game.problem.agents[self.game.waiting]
            if len(self.game.session.turns) == before:
                self.message = f"{name} chooses; the other choice stays hidden until both are in"

    def tick(self) -> None:
        """A beat of the clock in real time: the last push repeats, from the first key on."""
        if self.held is None or self.paused or self.game.waiting is None:
            return
        before = len(self.game.session.turns)
        with self.told():
            self.game.choose(self.held)
            self.note(before)

    def command(self, key: str) -> None:
        """Does what a key of the shell says."""
        if key == "?":
            self.help = True
            self.keys_until = len(self.game.session.turns) + KEYS_SHOWN
        elif key == "V":
            self.next_overlay()
        elif key in ("P", "A"):
            self.pause()
        elif key in ("space", "right") and not self.game.people:
            self.step()
        elif key in FASTER:
            self.speed = min(max(self.speed * FASTER[key], SLOWEST), FASTEST)
            self.message = f"{self.speed:.3g} turns a second"
        elif key == "q" and self.unsaved > MANY and not self.leaving:
            self.leaving = True
            self.message = f"{self.unsaved} turns are not kept; q once more leaves"
        else:
            command = next((c for c in COMMANDS if c.key == key), None)
            if command is None:
                self.message = f"{key}: no such key; ? shows them" if key.isprintable() else ""
                return
            before = len(self.game.session.turns)
            self.say(command.run(self.table, ""))
            self.note(before)

    def next_overlay(self) -> None:
        """Goes on to what else the board can show, at last nothing; says so if it never can."""
        before, self.overlay = self.overlay, 0
        bare = self.upper(self._room).plain
        for number in range(before + 1, len(OVERLAYS)):
            self.overlay = number
            if self.upper(self._room).plain != bare:
                self.message = f"overlay: {OVERLAYS[number]}"
                return
        self.overlay = 0
        self.message = "overlay: none" if before else "this board has no overlays"

    def pause(self) -> None:
        """Lets agents play or stops them; stops the clock of real time or lets it go on."""
        if not self.game.people and not self.terminal.motion:
            self.message = "nothing moves by itself; Space steps on, :auto plays to the end"
        elif not self.game.people:
            self.auto = not self.auto
            self.message = "" if self.auto else "paused; P goes on"
        elif self.rate:
            self.paused = not self.paused
            self.message = "paused; P goes on" if self.paused else ""
        else:
            self.message = "the game waits for you; there is nothing to pause"

    @property
    def unsaved(self) -> int:
        """The turns that no transcript holds."""
        recorder = self.game.recorder
        return 0 if recorder and not recorder.fault else len(self.game.session.turns)

    def step(self) -> None:
        """A turn of a game without people."""
        before = len(self.game.session.turns)
        self.game.unattended()
        if len(self.game.session.turns) < before:  # a recording may take turns back
            self.message = self.game.change(before)
        self.note(before)

    def autoplay(self) -> None:
        """A turn of a game that plays by itself; an error stops it."""
        self.auto = False
        with self.told():
            self.step()
            self.auto = True

    def type(self, line: str) -> None:
        """Does what a line of the command row says; raises Leave."""
        self.help, self.page, self.part = False, [], 0
        with self.told():
            for part in parts(line):
                if self.curtained:  # the rest of the line is not for the one who comes next
                    return
                before = len(self.game.session.turns)
                self.say(typed(self.table, part))
                self.note(before)

    @contextlib.contextmanager
    def told(self) -> Iterator[None]:
        """Turns an error into a message."""
        try:
            yield
        except DmplayError as error:
            self.message = str(error)

    def say(self, words: str) -> None:
        """Shows an answer: in its row, or on a page that any key closes where it has several."""
        self.message, self.page = ("", words.split("\n")) if "\n" in words else (words, [])

    def fresh(self) -> None:
        """Forgets the game before this one."""
        self._log, self.before = Log(self.game), self.game.watcher
        self.number, self.prefix, self.keys_until = Number(), "", KEYS_SHOWN
        self.held, self.auto, self.paused, self.reviewed = None, False, False, False

    def note(self, before: int) -> None:
        """Logs what happened since there were `before` turns."""
        now = len(self.game.session.turns)
        if self._log.game is not self.game:
            self.fresh()
        elif now > before or (now == before and self._log.outdated):
            self._log.turns(self.page)
            self.message = "" if self.message == self.log[-1] else self.message
        elif now < before:
            undone = self.message
            self._log.tell(lambda seat: undone)
            self.message = ""
        if self.game.session.over and self.game.people and not self.reviewed:
            from dmplay.game import review  # not needed before

            self.reviewed = True
            game = self.game
            found = review.in_time(game.session, game.people, game.seats, REVIEW_TIME)
            if found:
                self.log.append(review.summary(found))
        recorder = self.game.recorder
        if recorder and recorder.fault:
            self.message = f"cannot write {recorder.path}: {recorder.fault.strerror}"


def _player(plain: str) -> Place | None:
    """Where the player stands: screen readers and magnifiers follow the real cursor."""
    _, *below = plain.split("\n")
    rows = ((number, row.find("@")) for number, row in enumerate(below, 1))
    return next((Place(column, number) for number, column in rows if column >= 0), None)

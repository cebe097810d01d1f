"""Play by single keys on a full screen."""

from collections.abc import Callable
from math import copysign, inf, isinf
from typing import NamedTuple

from dmplay.describe import counted
from dmplay.game.game import Game
from dmplay.screen import frame
from dmplay.screen.modes import Event, Mode
from dmplay.screen.motion import LASTS
from dmplay.screen.scene import Scene
from dmplay.screen.shown import KEYS_SHOWN, MORE
from dmplay.words.commands import COMMANDS, Leave, help_page, named, own_parts, typed, veiled
from dmplay.words.game_commands import foresee

FASTER = 1.5  # the speed times this
SLOWEST, FASTEST = 0.1, 50.0  # turns a second
ENDED = "the game is over"
MANY = 20  # turns that nobody wants to lose by one key
SCROLLS = {  # rows back, by keys that scroll the log, where they play nothing, and pages
    "pageup": 8, "pagedown": -8, "home": inf, "end": -inf, "wheel up": 3, "wheel down": -3,
}  # fmt: skip
SCROLLING = ("PgUp", "scroll", "the log back; PgDn Home End; Shift where they play")


class Screen(Scene):
    """A scene that keys and clocks change."""

    def press(self, key: str) -> None:
        """Does what a key says; raises Leave."""
        self.message = ""
        self.motion.cut()
        if key != "q":
            self.modes.happens(Event.PRESSED)
        if self.table.curtained and key != "q":
            if key in ("enter", "space"):
                self.table.change_places()
            return
        if self.modes.shows is Mode.PAGE:
            self._turn_page(key)
            return
        with self.caught():
            waiting = self.game.waiting is not None
            if waiting and (self._number(key) or self._action(key)):
                return
            if self.modes.shows is Mode.AHEAD and self._looked(key):
                return
            if self._look_back(key):
                return
            self.command(key)

    def _look_back(self, key: str) -> bool:
        """Steps through the turns of a game that is over; plays on from one."""
        past = self._past
        if past and key == "enter":
            self.say(named("branch").run(self.table, str(past.turn)))
            return True
        if past and key == "escape":
            self.modes.happens(Event.CLOSED)
            return True
        if not past and self._plays(key):  # whoever plays fast presses it after the end too
            return False
        turn = self._verdict.led(key, past.turn if past else None)
        if turn is None or self._verdict.past is None:
            return False
        self.back = 0
        if turn == self._verdict.past.many:
            self.modes.happens(Event.CLOSED)
        else:
            self._verdict.past.go(turn)
            self.modes.happens(Event.LOOKED_BACK)
        return True

    def _plays(self, key: str) -> bool:
        """Whether a key is one of the game's own."""
        keyboard = self.game.keyboard
        return key in keyboard.nudges or bool(keyboard.pressed(self.game.watcher, key))

    def look_ahead(self) -> None:
        """Asks for an action, to show what it may bring."""
        self.game.may_help("whatif")
        if self.game.waiting is None or self.rate:
            alone = ENDED if self.game.session.over else "nobody chooses here"
            self.message = f"what if: {alone if self.game.waiting is None else 'the clock runs'}"
            return
        self.modes.happens(Event.ASKED)
        self.message = "what if: press an action, Enter then plays it, Esc leaves"

    def _looked(self, key: str) -> bool:
        """Looks ahead no more: Enter plays what was shown, other keys do what they always do."""
        game, foreseen = self.game, self.game.adviser.foreseen
        self.modes.happens(Event.CLOSED)
        game.adviser.look_away()
        if key == "enter" and foreseen:
            self.act(foreseen.action)
        return key in ("enter", "escape", "W")

    def _turn_page(self, key: str) -> None:
        last = len(frame.pages(self._room, self.shown)) - 1
        rows = _scrolled(key)
        if rows:
            step = rows if isinf(rows) else copysign(1, rows)
            self.part = int(min(max(self.part - step, 0), last))
        elif key in MORE and self.part < last:
            self.part += 1
        else:
            self.modes.happens(Event.CLOSED)

    def scroll(self, rows: float) -> None:
        """Goes so many rows back in the log, or on."""
        if not self.table.curtained:
            most = self._frame(self._room).most_back()
            self.back = int(min(max(self.back + rows, 0), most))

    def _action(self, key: str) -> bool:
        """Plays the action of a key, or of two arrows for a diagonal."""
        combination = f"{self.prefix} {key}".strip()
        self.prefix = ""
        found = self.game.keyboard.pressed(self.game.watcher, combination)
        if found is not None:
            seat, action = found
            self.act(action, seat)
        elif key in ("up", "down") and any(" " in one for one in self.game.keyboard.hands.keys):
            self.prefix = key
            self.message = f"{key}, then left or right: a diagonal"
        else:
            return False
        return True

    def _number(self, key: str) -> bool:
        """Writes or nudges a number, and plays it on Enter."""
        if key == "enter" and self.number.text:
            with veiled(self.table):
                self.act(self.game.keyboard.read(self.game.view(), self.number.taken()))
            return True
        ahead = key == "enter" and self.modes.shows is Mode.AHEAD  # plays what was looked at
        if ahead or not self.number.press(self.game, key):
            return False
        self.message = self.number.shown(self.game)
        return True

    def act(self, action: float, seat: int | None = None) -> None:
        """Plays an action, or shows what it may bring; in real time, keeps it for the clock."""
        if self.modes.shows is Mode.AHEAD:
            mine = seat in (None, self.game.watcher)
            self.message = foresee(self.game, action) if mine else "another's key"
            self._foretold = self.message if mine else ""
            return
        if self.rate:
            self.clock.held = action
            self.start_clock()
            return
        game = self.game
        played = game.choose(action, seat)
        self.note()
        if played:
            self._move()
        if not (played or game.private or game.waiting is None):  # a curtain tells it in private
            name = game.problem.agents[game.waiting]
            self.message = f"{name} chooses; the other choice stays hidden until both are in"

    def start_clock(self) -> None:
        """Lets real time begin, once."""
        self.message = self.clock.start(len(self.game.session.turns)) or self.message

    @property
    def pace(self) -> float:
        """Beats of the clock a second."""
        return self.clock.pace(len(self.game.session.turns))

    def tick(self) -> None:
        """A beat of the clock in real time: it counts down, then the last push repeats."""
        if self.modes.moves is not Mode.CLOCK or self.game.waiting is None:
            return
        told = self.clock.counted()
        if told is not None:
            self.message = told
        elif self.clock.held is not None:
            with self.caught():
                self.game.choose(self.clock.held)
                self.note()

    def command(self, key: str) -> None:
        """Does what a key of the screen or of the shell says."""
        own = next((one for one in KEYS if one.acts(key, self.game)), None)
        command = next((c for c in COMMANDS if c.key == key), None)
        if own:
            own.run(self)
        elif _scrolled(key):
            self.scroll(_scrolled(key))
        elif command:
            self.say(command.run(self.table, ""))
        elif self.rate and self.game.waiting is not None and not self.clock.started:
            self.start_clock()
        elif key.isprintable():
            late = self.game.session.over and self._plays(key)
            self.message = f"{key}: {ENDED if late else 'no such key; ? shows them'}"

    def show_help(self) -> None:
        """The keys of the game, of the screen and of the commands; commands without one."""
        own = [(key.shown, key.name, key.help) for key in KEYS if key.help]
        self.open(help_page(self.game, [*own, SCROLLING]))
        self.keys_until = len(self.game.session.turns) + KEYS_SHOWN

    def quicken(self, times: float) -> None:
        """Lets agents play so many times as fast."""
        self.speed = min(max(self.speed * times, SLOWEST), FASTEST)
        self.message = f"{counted(self.speed, 'turn', '.3g')} a second"

    def leave(self) -> None:
        """Leaves the game; where it is not kept, only when asked twice."""
        if self.unsaved > MANY and self.modes.shows is not Mode.WARNED:
            self.modes.happens(Event.WARNED)
            self.message = f"{self.unsaved} turns are not kept; q once more leaves"
        else:
            raise Leave

    def pause(self) -> None:
        """Lets agents play or stops them; stops the clock of real time or lets it go on."""
        if self.game.session.over:
            self.message = ENDED
        elif not self.game.people and not self.terminal.motion:
            self.message = "nothing moves by itself; Space steps on, :auto plays to the end"
        elif self.game.people and not self.rate:
            self.message = "the game waits for you; there is nothing to pause"
        else:
            moving = self.modes.moves in (Mode.AUTO, Mode.CLOCK)
            self.modes.happens(Event.HALTED if moving else Event.LET_GO)
            self.message = "paused; P goes on" if moving else ""

    @property
    def unsaved(self) -> int:
        """The turns that no transcript holds."""
        recorder = self.game.recorder
        return 0 if recorder and not recorder.fault else len(self.game.session.turns)

    def step(self) -> None:
        """A turn of a game without people."""
        if self.game.session.over:
            self.message = ENDED
            return
        before = len(self.game.session.turns)
        self.game.unattended()
        self.note()
        if len(self.game.session.turns) > before and self.speed * LASTS < 1:
            self._move()

    def _move(self) -> None:
        """Has the last turn seen to happen, where its view can draw that and things may move."""
        if self.terminal.motion and getattr(self.game.style, "MOVES", False):
            self.motion.begin()

    def autoplay(self) -> None:
        """A turn of a game that plays by itself; an error stops it."""
        self.modes.happens(Event.HALTED)
        with self.caught():
            self.step()
            self.modes.happens(Event.LET_GO)

    def type(self, line: str) -> None:
        """Does what a line of the command row says; raises Leave."""
        self.modes.happens(Event.CLOSED)
        with self.caught():
            for part in own_parts(self.table, line):
                self.say(typed(self.table, part))


def _scrolled(key: str) -> float:
    """How many rows back a key scrolls, with Shift or Ctrl or without; 0 where it does not."""
    return SCROLLS.get(key.removeprefix("s-").removeprefix("c-"), 0)


class Key(NamedTuple):
    """A key that only the screen has: which, how it is shown, its name, what it does."""

    keys: tuple[str, ...]
    shown: str
    name: str
    help: str  # '' where the shell's command of this key tells
    run: Callable[[Screen], None]
    watched: bool = False  # only where nobody plays

    def acts(self, key: str, game: Game) -> bool:
        """Whether this is the key, and it does something in this game."""
        return key in self.keys and not (self.watched and game.people)


KEYS = (
    Key(
        ("V",), "V", "overlay", "values, policy or states on the board, where it has them",
        Screen.next_overlay,
    ),
    Key(("W",), "W", "what if", "what an action may bring, before you play it", Screen.look_ahead),
    Key(("P", "A"), "P", "pause", "let agents or the clock play, or stop them", Screen.pause),
    Key(("space", "right"), "Space", "step", "one turn of agents", Screen.step, watched=True),
    Key(("+",), "+", "faster", "agents play faster", lambda screen: screen.quicken(FASTER)),
    Key(("-",), "-", "slower", "agents play slower", lambda screen: screen.quicken(1 / FASTER)),
    Key(("?",), "?", "help", "", Screen.show_help),
    Key(("q",), "q", "quit", "", Screen.leave),
)  # fmt: skip

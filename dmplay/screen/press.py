"""What each key does on the play screen."""

from collections.abc import Callable
from math import copysign, inf, isinf
from typing import NamedTuple

from dmplay.game.game import Game
from dmplay.screen.acts import ENDED, act, leave, look_ahead, pause, quicken, start_clock, step
from dmplay.screen.modes import Event, Mode
from dmplay.screen.screen import Screen
from dmplay.screen.shown import KEYS_SHOWN, MORE
from dmplay.words.commands import COMMANDS, help_page, named, veiled

FASTER = 1.5  # the speed times this
SCROLLS = {  # rows back, by keys that scroll the log, where they play nothing, and pages
    "pageup": 8, "pagedown": -8, "home": inf, "end": -inf, "wheel up": 3, "wheel down": -3,
}  # fmt: skip
SCROLLING = ("PgUp", "scroll", "the log back; PgDn Home End; Shift where they play")


def press(screen: Screen, key: str) -> None:
    """Does what a key says; raises Leave."""
    screen.message = ""
    screen.motion.cut()
    if key != "q":
        screen.modes.happens(Event.PRESSED)
    if screen.table.curtained and key != "q":
        if key in ("enter", "space"):
            screen.table.change_places()
    elif screen.modes.shows is Mode.PAGE:
        _turn_page(screen, key)
    else:
        with screen.caught():
            _does(screen, key)


def _does(screen: Screen, key: str) -> None:
    """Plays, looks ahead or back, or does what the shell does."""
    if screen.game.waiting is not None and (_number(screen, key) or _action(screen, key)):
        return
    if screen.modes.shows is Mode.AHEAD and _looked_ahead(screen, key):
        return
    if not _looked_back(screen, key):
        _command(screen, key)


def _turn_page(screen: Screen, key: str) -> None:
    rows = _scrolled(key)
    if rows:
        screen.turn_page(-rows if isinf(rows) else -copysign(1, rows))
    elif not (key in MORE and screen.turn_page(1)):
        screen.modes.happens(Event.CLOSED)


def _number(screen: Screen, key: str) -> bool:
    """Writes or nudges a number, and plays it on Enter."""
    if key == "enter" and screen.number.text:
        with veiled(screen.table):
            act(screen, screen.game.keyboard.read(screen.game.view(), screen.number.taken()))
        return True
    ahead = key == "enter" and screen.modes.shows is Mode.AHEAD  # plays what was looked at
    if ahead or not screen.number.press(screen.game, key):
        return False
    screen.message = screen.number.shown(screen.game)
    return True


def _action(screen: Screen, key: str) -> bool:
    """Plays the action of a key, or of two arrows for a diagonal."""
    keyboard, combination = screen.game.keyboard, f"{screen.prefix} {key}".strip()
    screen.prefix = ""
    found = keyboard.pressed(screen.game.watcher, combination)
    if found is not None:
        seat, action = found
        act(screen, action, seat)
    elif key in ("up", "down") and any(" " in one for one in keyboard.hands.keys):
        screen.prefix = key
        screen.message = f"{key}, then left or right: a diagonal"
    else:
        return False
    return True


def _looked_ahead(screen: Screen, key: str) -> bool:
    """Looks ahead no more: Enter plays what was shown, other keys do what they always do."""
    adviser = screen.game.adviser
    foreseen = adviser.foreseen
    screen.modes.happens(Event.CLOSED)
    adviser.look_away()
    if key == "enter" and foreseen:
        act(screen, foreseen.action)
    return key in ("enter", "escape", "W")


def _looked_back(screen: Screen, key: str) -> bool:
    """Steps through the turns of a game that is over; plays on from one."""
    past, whole = screen.past, screen.verdict.past
    if past and key == "enter":
        screen.say(named("branch").run(screen.table, str(past.turn)))
        return True
    if past and key == "escape":
        screen.modes.happens(Event.CLOSED)
        return True
    if not past and _plays(screen.game, key):  # whoever plays fast presses it after the end too
        return False
    turn = screen.verdict.led(key, past.turn if past else None)
    if turn is None or whole is None:
        return False
    screen.back = 0
    if turn == whole.many:
        screen.modes.happens(Event.CLOSED)
    else:
        whole.go(turn)
        screen.modes.happens(Event.LOOKED_BACK)
    return True


def _plays(game: Game, key: str) -> bool:
    """Whether a key is one of the game's own."""
    return key in game.keyboard.nudges or bool(game.keyboard.pressed(game.watcher, key))


def _command(screen: Screen, key: str) -> None:
    """Does what a key of the screen or of the shell says."""
    game = screen.game
    own = next((one for one in KEYS if one.acts(key, game)), None)
    command = next((one for one in COMMANDS if one.key == key), None)
    if own:
        own.run(screen)
    elif _scrolled(key):
        screen.scroll(_scrolled(key))
    elif command:
        screen.say(command.run(screen.table, ""))
    elif screen.rate and game.waiting is not None and not screen.clock.started:
        start_clock(screen)
    elif key.isprintable():
        late = game.session.over and _plays(game, key)
        screen.message = f"{key}: {ENDED if late else 'no such key; ? shows them'}"


def _scrolled(key: str) -> float:
    """How many rows back a key scrolls, with Shift or Ctrl or without; 0 where it does not."""
    return SCROLLS.get(key.removeprefix("s-").removeprefix("c-"), 0)


def _help(screen: Screen) -> None:
    """The keys of the game, of the screen and of the commands; commands without one."""
    own = [(key.shown, key.name, key.help) for key in KEYS if key.help]
    screen.open(help_page(screen.game, [*own, SCROLLING]))
    screen.keys_until = len(screen.game.session.turns) + KEYS_SHOWN


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
    Key(("W",), "W", "what if", "what an action may bring, before you play it", look_ahead),
    Key(("P", "A"), "P", "pause", "let agents or the clock play, or stop them", pause),
    Key(("space", "right"), "Space", "step", "one turn of agents", step, watched=True),
    Key(("+",), "+", "faster", "agents play faster", lambda screen: quicken(screen, FASTER)),
    Key(("-",), "-", "slower", "agents play slower", lambda screen: quicken(screen, 1 / FASTER)),
    Key(("?",), "?", "help", "", _help),
    Key(("q",), "q", "quit", "", leave),
)  # fmt: skip

"""What the screen is doing: what it shows, and what moves without a key."""

from enum import Enum, auto


class Mode(Enum):
    """A state of either kind."""

    BOARD = auto()  # the game
    PAGE = auto()  # help, or an answer of several rows, in its place
    WARNED = auto()  # the game, and that leaving it loses turns
    AHEAD = auto()  # the game, and what an action may bring
    BACK = auto()  # an earlier turn of a game that is over
    WAITING = auto()  # every turn waits for a key
    AUTO = auto()  # agents play turn after turn
    CLOCK = auto()  # the action pressed last repeats with the clock
    PAUSED = auto()  # the clock stands


class Event(Enum):
    """What takes the screen from one state to another."""

    OPENED = auto()  # a page
    CLOSED = auto()  # its last part, or a look ahead or back
    LOOKED_BACK = auto()  # at a turn of a game that is over
    ASKED = auto()  # what an action may bring
    WARNED = auto()  # that leaving loses turns
    PRESSED = auto()  # a key
    LET_GO = auto()  # what can move does
    HALTED = auto()  # what moves stops


TRANSITIONS = {  # of what it shows, and of what moves
    Mode.BOARD: {
        Event.OPENED: Mode.PAGE, Event.WARNED: Mode.WARNED, Event.ASKED: Mode.AHEAD,
        Event.LOOKED_BACK: Mode.BACK,
    },
    Mode.AHEAD: {Event.CLOSED: Mode.BOARD, Event.OPENED: Mode.PAGE},
    Mode.BACK: {Event.CLOSED: Mode.BOARD, Event.OPENED: Mode.PAGE, Event.WARNED: Mode.WARNED},
    Mode.PAGE: {Event.OPENED: Mode.PAGE, Event.CLOSED: Mode.BOARD},
    Mode.WARNED: {Event.PRESSED: Mode.BOARD, Event.OPENED: Mode.PAGE},
    Mode.WAITING: {Event.LET_GO: Mode.AUTO},
    Mode.AUTO: {Event.HALTED: Mode.WAITING},
    Mode.CLOCK: {Event.HALTED: Mode.PAUSED},
    Mode.PAUSED: {Event.LET_GO: Mode.CLOCK},
}  # fmt: skip


class Modes:
    """What is shown, and what moves."""

    def __init__(self) -> None:
        self.shows = Mode.BOARD
        self.moves = Mode.WAITING

    def happens(self, event: Event) -> None:
        """Goes on to where an event leads; stays where it leads nowhere."""
        self.shows = TRANSITIONS[self.shows].get(event, self.shows)
        self.moves = TRANSITIONS[self.moves].get(event, self.moves)

    def begins(self, *, clock: bool) -> None:
        """Another game moves with the clock, or waits."""
        self.moves = Mode.CLOCK if clock else Mode.WAITING

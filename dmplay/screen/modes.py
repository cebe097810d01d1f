"""What the screen is doing: what it shows, and what moves without a key."""

from enum import Enum, auto


class Mode(Enum):
    """A state of either kind."""

    BOARD = auto()  # the game
    PAGE = auto()  # help, or an answer of several rows, in its place
    QUIT_WARNING = auto()  # the game, and that leaving it loses turns
    LOOKAHEAD = auto()  # the game, and what an action may bring
    LOOKBACK = auto()  # an earlier turn of a game that is over
    WAIT_FOR_KEY = auto()  # every turn waits for a key
    AUTOPLAY = auto()  # agents play turn after turn
    REALTIME = auto()  # the action pressed last repeats with the clock
    PAUSED = auto()  # the clock stands


class ModeEvent(Enum):
    """What takes the screen from one state to another."""

    PAGE_OPENED = auto()  # a page
    CLOSED = auto()  # its last part, or a look ahead or back
    LOOKBACK_STARTED = auto()  # at a turn of a game that is over
    LOOKAHEAD_STARTED = auto()  # what an action may bring
    QUIT_WARNED = auto()  # that leaving loses turns
    KEY_PRESSED = auto()  # a key
    STARTED = auto()  # what can move does
    STOPPED = auto()  # what moves stops


MODE_TRANSITIONS = {  # of what it shows, and of what moves
    Mode.BOARD: {
        ModeEvent.PAGE_OPENED: Mode.PAGE, ModeEvent.QUIT_WARNED: Mode.QUIT_WARNING, ModeEvent.LOOKAHEAD_STARTED: Mode.LOOKAHEAD,
        ModeEvent.LOOKBACK_STARTED: Mode.LOOKBACK,
    },
    Mode.LOOKAHEAD: {ModeEvent.CLOSED: Mode.BOARD, ModeEvent.PAGE_OPENED: Mode.PAGE},
    Mode.LOOKBACK: {ModeEvent.CLOSED: Mode.BOARD, ModeEvent.PAGE_OPENED: Mode.PAGE, ModeEvent.QUIT_WARNED: Mode.QUIT_WARNING},
    Mode.PAGE: {ModeEvent.PAGE_OPENED: Mode.PAGE, ModeEvent.CLOSED: Mode.BOARD},
    Mode.QUIT_WARNING: {ModeEvent.KEY_PRESSED: Mode.BOARD, ModeEvent.PAGE_OPENED: Mode.PAGE},
    Mode.WAIT_FOR_KEY: {ModeEvent.STARTED: Mode.AUTOPLAY},
    Mode.AUTOPLAY: {ModeEvent.STOPPED: Mode.WAIT_FOR_KEY},
    Mode.REALTIME: {ModeEvent.STOPPED: Mode.PAUSED},
    Mode.PAUSED: {ModeEvent.STARTED: Mode.REALTIME},
}  # fmt: skip


class ScreenModes:
    """What is shown, and what moves."""

    def __init__(self) -> None:
        self.display_mode = Mode.BOARD
        self.play_mode = Mode.WAIT_FOR_KEY

    def handle_event(self, event: ModeEvent) -> None:
        """Goes on to where an event leads; stays where it leads nowhere."""
        self.display_mode = MODE_TRANSITIONS[self.display_mode].get(event, self.display_mode)
        self.play_mode = MODE_TRANSITIONS[self.play_mode].get(event, self.play_mode)

    def start_game(self, *, is_realtime: bool) -> None:
        """Another game moves with the clock, or waits."""
        self.play_mode = Mode.REALTIME if is_realtime else Mode.WAIT_FOR_KEY

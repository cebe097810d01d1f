"""The modes of the play screen: a display mode, and a play mode for what runs without a key."""

from enum import Enum, auto


class Mode(Enum):
    """A display mode or a play mode of the screen."""

    BOARD = auto()  # display: the game
    PAGE = auto()  # display: help, or a message of several rows, in place of the game
    QUIT_WARNING = auto()  # display: the game, and a warning that quitting loses turns
    LOOKAHEAD = auto()  # display: the game, and a preview of an action
    LOOKBACK = auto()  # display: an earlier turn of a finished game
    WAIT_FOR_KEY = auto()  # play: every turn waits for a key
    AUTOPLAY = auto()  # play: agents play turn after turn
    REALTIME = auto()  # play: the clock repeats the last pressed action
    PAUSED = auto()  # play: the clock is stopped


class ModeEvent(Enum):
    """An event that changes the display mode or the play mode."""

    PAGE_OPENED = auto()  # a page was opened
    CLOSED = auto()  # a page, the lookahead or the lookback was closed
    LOOKBACK_STARTED = auto()  # an earlier turn of a finished game was opened
    LOOKAHEAD_STARTED = auto()  # a preview of an action was requested
    QUIT_WARNED = auto()  # the warning that quitting loses turns was shown
    KEY_PRESSED = auto()  # any key
    STARTED = auto()  # autoplay or the clock was started
    STOPPED = auto()  # autoplay or the clock was stopped


MODE_TRANSITIONS = {  # display modes first, then play modes
    Mode.BOARD: {
        ModeEvent.PAGE_OPENED: Mode.PAGE,
        ModeEvent.QUIT_WARNED: Mode.QUIT_WARNING,
        ModeEvent.LOOKAHEAD_STARTED: Mode.LOOKAHEAD,
        ModeEvent.LOOKBACK_STARTED: Mode.LOOKBACK,
    },
    Mode.LOOKAHEAD: {ModeEvent.CLOSED: Mode.BOARD, ModeEvent.PAGE_OPENED: Mode.PAGE},
    Mode.LOOKBACK: {
        ModeEvent.CLOSED: Mode.BOARD,
        ModeEvent.PAGE_OPENED: Mode.PAGE,
        ModeEvent.QUIT_WARNED: Mode.QUIT_WARNING,
    },
    Mode.PAGE: {ModeEvent.PAGE_OPENED: Mode.PAGE, ModeEvent.CLOSED: Mode.BOARD},
    Mode.QUIT_WARNING: {ModeEvent.KEY_PRESSED: Mode.BOARD, ModeEvent.PAGE_OPENED: Mode.PAGE},
    Mode.WAIT_FOR_KEY: {ModeEvent.STARTED: Mode.AUTOPLAY},
    Mode.AUTOPLAY: {ModeEvent.STOPPED: Mode.WAIT_FOR_KEY},
    Mode.REALTIME: {ModeEvent.STOPPED: Mode.PAUSED},
    Mode.PAUSED: {ModeEvent.STARTED: Mode.REALTIME},
}


class ScreenModes:
    """The current display mode and play mode."""

    def __init__(self) -> None:
        self.display_mode = Mode.BOARD
        self._mode_below_page = Mode.BOARD  # the mode to which a closed page returns
        self.play_mode = Mode.WAIT_FOR_KEY

    @property
    def is_lookback(self) -> bool:
        """True if the screen shows an earlier turn of a finished game, or a page about it."""
        is_page = self.display_mode is Mode.PAGE
        return (self._mode_below_page if is_page else self.display_mode) is Mode.LOOKBACK

    def handle_event(self, event: ModeEvent) -> None:
        """Apply the transitions of an event; a mode without one for it stays."""
        previous_mode = self.display_mode
        self.display_mode = MODE_TRANSITIONS[previous_mode].get(event, previous_mode)
        if previous_mode is Mode.PAGE and event is ModeEvent.CLOSED:
            self.display_mode = self._mode_below_page
        elif previous_mode is not Mode.PAGE and event is ModeEvent.PAGE_OPENED:
            is_lookback = previous_mode is Mode.LOOKBACK
            self._mode_below_page = Mode.LOOKBACK if is_lookback else Mode.BOARD
        self.play_mode = MODE_TRANSITIONS[self.play_mode].get(event, self.play_mode)

    def set_play_mode(self, *, is_realtime: bool) -> None:
        """Set the play mode of a new game: driven by the clock, or waiting for keys."""
        self.play_mode = Mode.REALTIME if is_realtime else Mode.WAIT_FOR_KEY

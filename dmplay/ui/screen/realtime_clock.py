"""The real-time clock: started by a key, then a countdown, then a rising rate."""

# number of beats in the countdown; beats per second
COUNTDOWN_BEATS, COUNTDOWN_BEATS_PER_SECOND = 3, 2.0
# share of the full rate at the start; turns until the full rate
INITIAL_RATE_SHARE, RAMP_TURNS = 0.1, 100
CLOCK_START_HINT = "press an action key to start the clock; P stops it"


class RealtimeClock:
    """The real-time clock, which repeats the last pressed action at a rising rate."""

    def __init__(self, rate: float | None) -> None:
        self.rate = rate  # turns per second; None if each turn waits for a key
        self.repeated_action: float | None = None  # None before the first action
        # beats left in the countdown; None before the clock starts
        self._countdown_left: int | None = None
        self._start_turn = 0  # number of turns played when the clock started

    @property
    def is_started(self) -> bool:
        """True once the countdown has started."""
        return self._countdown_left is not None

    def start_countdown(self, turn_count: int) -> str:
        """Start the countdown and return its message; return '' if the clock has started before."""
        if self.is_started:
            return ""
        self._countdown_left, self._start_turn = COUNTDOWN_BEATS, turn_count
        return f"{COUNTDOWN_BEATS} ..."

    def beats_per_second(self, turn_count: int) -> float:
        """Return the number of beats per second after `turn_count` turns of the game.

        The countdown has its own fixed rate. After it the rate rises linearly, from
        INITIAL_RATE_SHARE of
        `rate` to all of it over RAMP_TURNS turns.
        """
        if self._countdown_left or not self.rate:
            return COUNTDOWN_BEATS_PER_SECOND
        return self.rate * min(
            INITIAL_RATE_SHARE
            + (1 - INITIAL_RATE_SHARE) * (turn_count - self._start_turn) / RAMP_TURNS,
            1.0,
        )

    def count_down(self) -> str | None:
        """Count down by one beat; return the message to show, or None if the countdown is over."""
        if not self._countdown_left:
            return None
        self._countdown_left -= 1
        if self._countdown_left:
            return f"{self._countdown_left} ..."
        return "" if self.repeated_action is not None else "press an action key"

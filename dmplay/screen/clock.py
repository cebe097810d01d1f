"""Real time: it begins with a key, counts down, goes slowly at first and quickens."""

COUNTDOWN_BEATS, COUNTDOWN_BEATS_PER_SECOND = (
    3,
    2.0,
)  # beats before it begins, and how many a second
INITIAL_RATE_SHARE, RAMP_TURNS = (
    0.1,
    100,
)  # it begins at this share of its rate; all of it after so many turns
CLOCK_START_HINT = "the clock starts with a key; P stops it"


class RealtimeClock:
    """What repeats the action that was chosen last, once it was started."""

    def __init__(self, rate: float | None) -> None:
        self.rate = rate  # turns a second; None where each turn waits for a key
        self.repeated_action: float | None = None  # the action that repeats
        self._countdown_left: int | None = (
            None  # beats of the countdown; None before the key that starts it
        )
        self._start_turn = 0  # the turn at which it was started

    @property
    def is_started(self) -> bool:
        """Whether it counts down or goes."""
        return self._countdown_left is not None

    def start(self, turn_count: int) -> str:
        """Begins to count down after so many turns; what it says, nothing where it goes."""
        if self.is_started:
            return ""
        self._countdown_left, self._start_turn = COUNTDOWN_BEATS, turn_count
        return f"{COUNTDOWN_BEATS} ..."

    def beats_per_second(self, turn_count: int) -> float:
        """Beats a second: of the countdown; then of turns, slow at first, faster as they go on."""
        if self._countdown_left or not self.rate:
            return COUNTDOWN_BEATS_PER_SECOND
        return self.rate * min(
            INITIAL_RATE_SHARE
            + (1 - INITIAL_RATE_SHARE) * (turn_count - self._start_turn) / RAMP_TURNS,
            1.0,
        )

    def count_down(self) -> str | None:
        """Counts down by a beat; what it says, None once it is through."""
        if not self._countdown_left:
            return None
        self._countdown_left -= 1
        if self._countdown_left:
            return f"{self._countdown_left} ..."
        return "" if self.repeated_action is not None else "press what to do"

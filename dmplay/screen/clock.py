"""Real time: it begins with a key, counts down, goes slowly at first and quickens."""

COUNTDOWN, BEATS = 3, 2.0  # beats before it begins, and how many a second
SLOW, FULL = 0.1, 100  # it begins at this share of its rate; all of it after so many turns
STARTS = "the clock starts with a key; P stops it"


class Clock:
    """What repeats the action that was chosen last, once it was started."""

    def __init__(self, rate: float | None) -> None:
        self.rate = rate  # turns a second; None where each turn waits for a key
        self.held: float | None = None  # the action that repeats
        self._left: int | None = None  # beats of the countdown; None before the key that starts it
        self._since = 0  # the turn at which it was started

    @property
    def started(self) -> bool:
        """Whether it counts down or goes."""
        return self._left is not None

    def start(self, turns: int) -> str:
        """Begins to count down after so many turns; what it says, nothing where it goes."""
        if self.started:
            return ""
        self._left, self._since = COUNTDOWN, turns
        return f"{COUNTDOWN} ..."

    def pace(self, turns: int) -> float:
        """Beats a second: of the countdown; then of turns, slow at first, faster as they go on."""
        if self._left or not self.rate:
            return BEATS
        return self.rate * min(SLOW + (1 - SLOW) * (turns - self._since) / FULL, 1.0)

    def counted(self) -> str | None:
        """Counts down by a beat; what it says, None once it is through."""
        if not self._left:
            return None
        self._left -= 1
        if self._left:
            return f"{self._left} ..."
        return "" if self.held is not None else "press what to do"

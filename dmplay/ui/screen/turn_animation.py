"""The animation of a turn: a few short steps, stopped by the next key."""

ANIMATION_STEPS = 3  # number of steps between two boards
ANIMATION_SECONDS = 0.12  # seconds


class TurnAnimation:
    """The remaining animation steps of the last turn."""

    def __init__(self) -> None:
        self.step_seconds = ANIMATION_SECONDS / ANIMATION_STEPS  # seconds
        self._steps_left = 0

    @property
    def is_running(self) -> bool:
        """True while the board is shown between two turns."""
        return self._steps_left > 0

    @property
    def progress(self) -> float:
        """The completed share of the animation, 0 to 1."""
        return 1 - self._steps_left / (ANIMATION_STEPS + 1)

    def start(self) -> None:
        """Start the animation at its first step."""
        self._steps_left = ANIMATION_STEPS

    def advance(self) -> None:
        """Advance to the next step; after the last one, the turn's final board is shown."""
        self._steps_left = max(self._steps_left - 1, 0)

    def stop(self) -> None:
        """Stop the animation, so that the turn's final board is shown."""
        self._steps_left = 0

"""A turn that is seen to happen: a few short steps, cut short by whatever comes next."""

ANIMATION_STEPS = 3  # between two boards
ANIMATION_SECONDS = 0.12  # seconds


class TurnAnimation:
    """The steps of the last turn's motion that are yet to be shown."""

    def __init__(self) -> None:
        self.step_seconds = ANIMATION_SECONDS / ANIMATION_STEPS  # seconds
        self._steps_left = 0

    @property
    def is_running(self) -> bool:
        """Whether the board is between two turns."""
        return self._steps_left > 0

    @property
    def progress(self) -> float:
        """The share of the motion that is over."""
        return 1 - self._steps_left / (ANIMATION_STEPS + 1)

    def start(self) -> None:
        """Shows the first step next."""
        self._steps_left = ANIMATION_STEPS

    def advance(self) -> None:
        """Shows the next step, at last the turn as it ended."""
        self._steps_left = max(self._steps_left - 1, 0)

    def stop(self) -> None:
        """Shows the turn as it ended."""
        self._steps_left = 0

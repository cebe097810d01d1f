"""A turn that is seen to happen: a few short steps, cut short by whatever comes next."""

STEPS = 3  # between two boards
LASTS = 0.12  # seconds


class Motion:
    """The steps of the last turn's motion that are yet to be shown."""

    def __init__(self) -> None:
        self.step = LASTS / STEPS  # seconds
        self._left = 0

    @property
    def moves(self) -> bool:
        """Whether the board is between two turns."""
        return self._left > 0

    @property
    def passed(self) -> float:
        """The share of the motion that is over."""
        return 1 - self._left / (STEPS + 1)

    def begin(self) -> None:
        """Shows the first step next."""
        self._left = STEPS

    def go_on(self) -> None:
        """Shows the next step, at last the turn as it ended."""
        self._left = max(self._left - 1, 0)

    def cut(self) -> None:
        """Shows the turn as it ended."""
        self._left = 0

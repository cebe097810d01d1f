"""The real-time clock: started by a key, then a countdown, then a steady or a rising rate."""

from collections.abc import Sequence

from dmplay.errors import BadParameter
from dmplay.game.game import Game
from dmplay.views.protocol import Clock

# number of beats in the countdown; beats per second
COUNTDOWN_BEATS, COUNTDOWN_BEATS_PER_SECOND = 3, 2.0
# share of the full rate at the start; turns until the full rate
INITIAL_RATE_SHARE, RAMP_TURNS = 0.1, 100
CLOCK_START_HINT = "press an action key to start the clock; P stops it"

SLOW_MOTION_SHARE = 0.1  # of real time, at which a clock starts that the player started


def find_clock(game: Game) -> Clock | None:
    """Return the clock of a game that one person plays alone; None if it has none.

    Raise BadParameter if a user's view returns something else.
    """
    make_clock = getattr(game.view_module, "clock", None)
    is_alone = len(game.human_seats) == len(game.player_names) == 1
    if make_clock is None or game.predictor or not is_alone:
        return None
    clock = make_clock(game.view())
    if not isinstance(clock, Clock):
        raise BadParameter(f"clock: got {clock!r}, expected a Clock of dmplay.views.protocol")
    return clock


class RealtimeClock:
    """The real-time clock, which repeats the action of the key pressed last.

    Where the terminal reports releases, it repeats the action of the key held, or else the
    `idle_actions` by turns.
    """

    def __init__(
        self, rate: float | None, *, is_rising: bool = True, idle_actions: Sequence[float] = ()
    ) -> None:
        self.rate = rate  # turns per second; None if each turn waits for a key
        self._is_rising, self._idle_actions = is_rising, idle_actions
        self._action: float | None = None  # None before the first action
        self._actions_by_key: dict[str, float] = {}  # keys pressed and not released, latest last
        self._is_idle = False  # whether the last key was released, and there are idle actions
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

    def press_key(self, key: str, action: float) -> None:
        """Repeat the action of a pressed key from now on."""
        self._actions_by_key.pop(key, None)
        self._actions_by_key[key] = self._action = action
        self._is_idle = False

    def release_key(self, key: str) -> None:
        """Repeat the action of the key that is still held, if any, in place of a released key."""
        if self._actions_by_key.pop(key, None) is None:
            return
        actions = [*self._actions_by_key.values()]  # of the keys that are not released
        if actions:
            self._action = actions[-1]
        self._is_idle = not actions and bool(self._idle_actions)

    def find_action(self, turn_count: int) -> float | None:
        """Return the action of the next turn; None before the first key of an action."""
        if self._is_idle:
            return self._idle_actions[turn_count % len(self._idle_actions)]
        return self._action

    def beats_per_second(self, turn_count: int) -> float:
        """Return the number of beats per second after `turn_count` turns of the game.

        The countdown has its own fixed rate. After it a rising rate grows linearly, from
        INITIAL_RATE_SHARE of `rate` to all of it over RAMP_TURNS turns.
        """
        if self._countdown_left or not self.rate:
            return COUNTDOWN_BEATS_PER_SECOND
        if not self._is_rising:
            return self.rate
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
        return "" if self._action is not None else "press an action key"

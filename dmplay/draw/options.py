"""The drawing options of a board, and the parts of a hint that boards draw."""

from collections.abc import Mapping
from typing import NamedTuple

from dmplay.core.arrays import Array, Reals

NO_KEY_LABELS: Mapping[str, str] = {}
MIN_PANEL_COLUMNS = 17  # minimum columns of the side panel
# labels of the suggested action, and of others without regret
BEST_LABEL, EQUALLY_GOOD_LABEL = "best", "equal"


class Overlay(NamedTuple):
    """An overlay on the board: values, policy or states."""

    kind: str
    action_values: Reals  # [S, A], the value of each action in each state


class Forecast(NamedTuple):
    """The K possible outcomes of an action before it is played, the likeliest first."""

    action: float
    probabilities: Reals  # [K]
    outcomes: Array  # [K, ...], states, or observations if states are hidden
    beliefs: Reals | None = None  # [K, S], the belief after each outcome, if the seat has beliefs
    is_sampled: bool = False  # whether the outcomes are samples, as for real numbers
    # the probability [A] of each action of the only other agent, if a model predicts it
    reply_probabilities: Reals | None = None
    other_players: str = ""  # how the other agents are assumed to act, as text


class DrawOptions(NamedTuple):
    """The drawing options of a board: its maximum size and what else to draw on it."""

    width: int = 80
    height: int = 24
    ascii: bool = False
    overlay: Overlay | None = None
    show_keys: bool = False  # whether to write keys into the board
    keys_by_action: Mapping[str, str] = NO_KEY_LABELS  # action -> key, if it is not the view's own
    revealed_state: Array | None = None  # the true state, if it is to be revealed
    reserved_rows: int = 0  # screen rows needed in addition to the board's
    allow_large: bool = False  # whether boards may be larger than a transcript's frames
    regret: Reals | None = None  # [A], regret of each action; nan if illegal
    suggested_action: float | None = None  # action of a hint
    typed_action: float | None = None  # number typed so far, which Enter would play
    forecast: Forecast | None = None  # possible outcomes of an action, to draw on the board
    motion_progress: float = 1.0  # part of the last turn's motion that is over, from 0 to 1
    ghost_state: Array | None = None  # state of the ghost, to be drawn faintly
    # whether to write its coordinates into each free hex; None where a hex has room for them
    show_coordinates: bool | None = False
    panel_columns: int = MIN_PANEL_COLUMNS + 2  # columns of the width that the side panel needs

    @property
    def columns_beside_panel(self) -> int:
        """The columns left for a board beside the side panel; 0 unless `allow_large` is set."""
        return max(self.width - self.panel_columns, 0) if self.allow_large else 0

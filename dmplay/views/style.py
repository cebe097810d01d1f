"""What every view offers, what it is told about the screen, and which view a problem has."""

import importlib
import importlib.util
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple, Protocol, cast

import numpy as np
from rich.text import Text

from dmplay.chance import Array, Reals
from dmplay.core import Problem
from dmplay.finding import modules, problems
from dmplay.session import View
from dmplay.views.canvas import measure_text, to_ascii

NO_KEY_LABELS: Mapping[str, str] = {}
MIN_PANEL_COLUMNS = 17  # columns of the side panel at least
REGRET_TOLERANCE = 1e-9  # a loss against the best action that is none
BEST_LABEL, EQUALLY_GOOD_LABEL = (
    "best",
    "as good",
)  # what is said of the advised action, and of others without a loss


class Overlay(NamedTuple):
    """What else to write into the board: values, policy or states."""

    kind: str
    action_values: Reals  # [S, A], the value of each action in each state


class Forecast(NamedTuple):
    """What an action may bring about before it is played: K outcomes, the likeliest first."""

    action: float
    probabilities: Reals  # [K]
    outcomes: Array  # [K, ...], what the seat would see: states, or observations where they hide
    beliefs: Reals | None = None  # [K, S], what it would then believe, where it has beliefs
    is_sampled: bool = False  # whether they are samples, as nature draws reals


class DrawOptions(NamedTuple):
    """The room there is, and what is wanted in it."""

    width: int = 80
    height: int = 24
    ascii: bool = False
    overlay: Overlay | None = None
    show_keys: bool = False  # whether to write keys into the board
    keys_by_action: Mapping[str, str] = (
        NO_KEY_LABELS  # the key of an action, where it is not the view's own
    )
    revealed_state: Array | None = None  # the true state, where it is to be revealed
    reserved_rows: int = 0  # rows that the screen needs beside the drawing's
    allow_large: bool = False  # whether drawings may be larger than a transcript's frames
    regret: Reals | None = None  # [A], what each action loses against the best; nan: not legal
    suggested_action: float | None = (
        None  # the action of a hint, or that is written and Enter would play
    )
    forecast: Forecast | None = None  # what an action may bring, to be drawn on the board
    motion_progress: float = 1.0  # the share of the last turn's motion that is over
    ghost_state: Array | None = None  # the state of an agent that plays beside, to be drawn faintly
    panel_columns: int = MIN_PANEL_COLUMNS + 2  # columns of the width that the side panel needs

    def is_equal_to(self, other: "DrawOptions") -> bool:
        """Whether another asks for the same drawing."""
        return _is_deeply_equal(tuple(self), tuple(other))

    @property
    def columns_beside_panel(self) -> int:
        """The columns that a drawing may have with the side panel beside it; none without one."""
        return max(self.width - self.panel_columns, 0) if self.allow_large else 0


def _is_deeply_equal(left: object, right: object) -> bool:
    if left is right:
        return True
    if isinstance(left, tuple) and isinstance(right, tuple):
        return len(left) == len(right) and all(map(_is_deeply_equal, left, right))
    if isinstance(left, np.ndarray) and isinstance(right, np.ndarray):
        return np.array_equal(left, right)
    return type(left) is type(right) and left == right


class Lesson(NamedTuple):
    """A problem in three sentences for who never saw it, and what to do in a turn as an example."""

    role: str  # what one is, sees and can do
    objective: str
    costs: str  # what a move costs, and what is left to chance
    example_action: str = ""  # of the example; '' for any


class ViewModule(Protocol):
    """A view: a module of this shape, with the stem of its problem.

    It may also have NUDGES, keys that add so much to a typed number; LEFT, the keys of a second
    person; FAMILY, the name under which a player sets its keys where that is not the problem's;
    and MOVES, where a turn is seen to happen: it then draws what `Look.passed` says.
    """

    @property
    def KEYS(self) -> Mapping[str, str]:  # noqa: N802 - a constant of the module
        """A key -> the label of the action that it plays."""

    def iter_boards(self, view: View[Problem], options: DrawOptions) -> Iterator[Text]:
        """The drawings, the largest first."""

    def goal_lines(self, view: View[Problem]) -> list[str]:
        """What to aim for and what it costs, in clauses, the most important first."""

    def lesson(self, view: View[Problem]) -> Lesson:
        """The problem in three sentences, without their full stops."""

    def panel_rows(self, view: View[Problem]) -> list[tuple[str, str]]:
        """Facts for the side panel."""

    def describe_turn(self, view: View[Problem]) -> str:
        """What the last turn did, in sentences."""

    def describe_situation(self, view: View[Problem]) -> str:
        """Where the game stands, in sentences."""


def load_view_module(problem: Problem) -> ViewModule:
    """The view module of a problem; the generic one where it has none."""
    own = problems.builtin_stem(problem)
    name = own if own and importlib.util.find_spec(f"dmplay.views.{own}") else "generic"
    # A view is shown games of its own problem alone: the one whose stem it has.
    found = cast(ViewModule, importlib.import_module(f"dmplay.views.{name}"))
    look, keys = modules.module_view(problem), modules.module_keys(problem)
    if look is None and not keys:
        return found
    brought = importlib.import_module("dmplay.views.brought")  # which needs this module
    return cast(ViewModule, brought.UserView(look, keys))


def draw_picture(view_module: ViewModule, view: View[Problem], state: Array | None) -> Text | None:
    """The picture that a problem brings of what a seat sees, of a hidden state once it is told."""
    draw: Callable[[View[Problem], Array | None], Text | None] | None
    draw = getattr(view_module, "draw_picture", None)
    return draw(view, state) if draw else None


def expand_for_picture(
    view_module: ViewModule, view: View[Problem], columns: int, rows: int
) -> tuple[int, int]:
    """So much room, or more where the picture of a state that is seen needs it."""
    drawn = draw_picture(view_module, view, None)
    width, height = measure_text(drawn) if drawn else (0, 0)
    return max(columns, width), max(rows, height)


class TooSmallNotice(Text):
    """What room the smallest drawing needs, in place of a drawing."""


def fit_board(view_module: ViewModule, view: View[Problem], options: DrawOptions) -> Text:
    """The largest drawing that the room holds; else one line that says what is needed."""
    smallest = (0, 0)
    for drawn in view_module.iter_boards(view, options):
        smallest = measure_text(drawn)
        if smallest[0] <= options.width and smallest[1] <= options.height:
            return to_ascii(drawn) if options.ascii else drawn
    needed = f"need {smallest[0]}x{smallest[1] + options.reserved_rows}"
    told = f"{needed}; playing in text"
    return TooSmallNotice(
        told if len(told) <= options.width else needed[: options.width], no_wrap=True
    )

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
from dmplay.views.canvas import plainly, size

NOTHING: Mapping[str, str] = {}
PANEL = 17  # columns of the side panel at least
ALIKE = 1e-9  # a loss against the best action that is none
BEST, EQUAL = "best", "as good"  # what is said of the advised action, and of others without a loss


class Overlay(NamedTuple):
    """What else to write into the board: values, policy or states."""

    kind: str
    values: Reals  # [S, A], the value of each action in each state


class Outlook(NamedTuple):
    """What an action may bring about before it is played: K outcomes, the likeliest first."""

    action: float
    chances: Reals  # [K]
    states: Array  # [K, ...], what the seat would see: states, or observations where they hide
    beliefs: Reals | None = None  # [K, S], what it would then believe, where it has beliefs
    sampled: bool = False  # whether they are samples, as nature draws reals


class Look(NamedTuple):
    """The room there is, and what is wanted in it."""

    width: int = 80
    height: int = 24
    ascii: bool = False
    overlay: Overlay | None = None
    keys: bool = False  # whether to write keys into the board
    names: Mapping[str, str] = NOTHING  # the key of an action, where it is not the view's own
    state: Array | None = None  # the true state, where it is to be revealed
    around: int = 0  # rows that the screen needs beside the drawing's
    large: bool = False  # whether drawings may be larger than a transcript's frames
    regret: Reals | None = None  # [A], what each action loses against the best; nan: not legal
    advised: float | None = None  # the action of a hint, or that is written and Enter would play
    outlook: Outlook | None = None  # what an action may bring, to be drawn on the board
    passed: float = 1.0  # the share of the last turn's motion that is over
    ghost: Array | None = None  # the state of an agent that plays beside, to be drawn faintly
    panel: int = PANEL + 2  # columns of the width that the side panel needs

    def alike(self, other: "Look") -> bool:
        """Whether another asks for the same drawing."""
        return _alike(tuple(self), tuple(other))

    @property
    def beside(self) -> int:
        """The columns that a drawing may have with the side panel beside it; none without one."""
        return max(self.width - self.panel, 0) if self.large else 0


def _alike(one: object, other: object) -> bool:
    if one is other:
        return True
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(_alike, one, other))
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return np.array_equal(one, other)
    return type(one) is type(other) and one == other


class Lesson(NamedTuple):
    """A problem in three sentences for who never saw it, and what to do in a turn as an example."""

    you: str  # what one is, sees and can do
    want: str
    cost: str  # what a move costs, and what is left to chance
    action: str = ""  # of the example; '' for any


class Style(Protocol):
    """A view: a module of this shape, with the stem of its problem.

    It may also have NUDGES, keys that add so much to a typed number; LEFT, the keys of a second
    person; FAMILY, the name under which a player sets its keys where that is not the problem's;
    and MOVES, where a turn is seen to happen: it then draws what `Look.passed` says.
    """

    @property
    def KEYS(self) -> Mapping[str, str]:  # noqa: N802 - a constant of the module
        """A key -> the label of the action that it plays."""

    def boards(self, view: View[Problem], look: Look) -> Iterator[Text]:
        """The drawings, the largest first."""

    def goal(self, view: View[Problem]) -> list[str]:
        """What to aim for and what it costs, in clauses, the most important first."""

    def lesson(self, view: View[Problem]) -> Lesson:
        """The problem in three sentences, without their full stops."""

    def panel(self, view: View[Problem]) -> list[tuple[str, str]]:
        """Facts for the side panel."""

    def told(self, view: View[Problem]) -> str:
        """What the last turn did, in sentences."""

    def situation(self, view: View[Problem]) -> str:
        """Where the game stands, in sentences."""


def style_of(problem: Problem) -> Style:
    """The view module of a problem; the generic one where it has none."""
    own = problems.stem(problem)
    name = own if own and importlib.util.find_spec(f"dmplay.views.{own}") else "generic"
    # A view is shown games of its own problem alone: the one whose stem it has.
    found = cast(Style, importlib.import_module(f"dmplay.views.{name}"))
    look, keys = modules.look(problem), modules.keys(problem)
    if look is None and not keys:
        return found
    brought = importlib.import_module("dmplay.views.brought")  # which needs this module
    return cast(Style, brought.Brought(look, keys))


def pictured(style: Style, view: View[Problem], state: Array | None) -> Text | None:
    """The picture that a problem brings of what a seat sees, of a hidden state once it is told."""
    draw: Callable[[View[Problem], Array | None], Text | None] | None
    draw = getattr(style, "pictured", None)
    return draw(view, state) if draw else None


def whole(style: Style, view: View[Problem], columns: int, rows: int) -> tuple[int, int]:
    """So much room, or more where the picture of a state that is seen needs it."""
    drawn = pictured(style, view, None)
    width, height = size(drawn) if drawn else (0, 0)
    return max(columns, width), max(rows, height)


class Needed(Text):
    """What room the smallest drawing needs, in place of a drawing."""


def fit(style: Style, view: View[Problem], look: Look) -> Text:
    """The largest drawing that the room holds; else one line that says what is needed."""
    smallest = (0, 0)
    for drawn in style.boards(view, look):
        smallest = size(drawn)
        if smallest[0] <= look.width and smallest[1] <= look.height:
            return plainly(drawn) if look.ascii else drawn
    needed = f"need {smallest[0]}x{smallest[1] + look.around}"
    told = f"{needed}; playing in text"
    return Needed(told if len(told) <= look.width else needed[: look.width], no_wrap=True)

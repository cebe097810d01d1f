"""The protocol of view modules, their drawing options, and the view module of a problem."""

import importlib
from collections.abc import Callable, Iterator, Mapping
from types import ModuleType
from typing import Generic, NamedTuple, Protocol, TypeVar, cast

import numpy as np
from rich.text import Text

from dmplay.core.arrays import Array, Reals
from dmplay.core.problem import Problem
from dmplay.core.session import Session, View
from dmplay.core.text import format_count
from dmplay.draw.canvas import measure_text, to_ascii
from dmplay.draw.options import DrawOptions, Forecast, Overlay  # noqa: F401 - of users' views
from dmplay.errors import BadParameter
from dmplay.registry import problem_module_exports

P = TypeVar("P", bound=Problem)


class Lesson(NamedTuple):
    """An introduction to a problem in three sentences for new players, with an example action."""

    role: str  # role, observations and actions of the player
    objective: str
    costs: str  # the cost of each action, and the part of chance
    example_action: str = ""  # the example action; '' for any
    # a phrase with {} for the state before it, or for each word of it; '' for a general one
    example_start: str = ""
    state_name: str = "{}"  # the name of a hidden state in a belief, with {} for its text
    chances: tuple[str, ...] = ()  # sentences with the probabilities, for exact computations
    map_mark: str = ""  # the player's mark on a large map, "@" on all small ones; "" without a map


class FinishedGame(NamedTuple, Generic[P]):
    """The facts of a finished game, hidden ones included, for a sentence on how it ended."""

    problem: P
    seat: int  # of the player
    player: str  # "you", or the name of the agent or the seat
    states: Array  # [T + 1, ...]
    actions: Array  # [T, n]
    observations: Array  # [T, n], or the states
    rewards: Reals  # [T, n]
    end_reason: str  # "terminal" if the rules ended it; "horizon" or "turn limit"

    @classmethod
    def of_session(cls, session: Session, seat: int, player: str) -> "FinishedGame[P]":
        """Return the facts of a finished session of at least one turn."""
        turns = session.turns
        return cls(
            cast(P, session.problem),
            seat,
            player,
            np.array([session.initial_state, *(turn.state for turn in turns)]),
            np.array([turn.actions for turn in turns]),
            np.array([turn.observations for turn in turns]),
            np.array([turn.rewards for turn in turns]),
            session.end_reason or "",
        )

    @property
    def turns(self) -> str:
        """The number of turns with its noun."""
        return format_count(len(self.actions), "turn")

    @property
    def is_terminal(self) -> bool:
        """True if the rules ended the game, False if the turn limit did."""
        return self.end_reason == "terminal"

    @property
    def team(self) -> str:
        """The name of the player's team: the player, or all agents if they have one reward."""
        if len(self.problem.agents) == 1:
            return self.player
        return "your team" if self.player == "you" else "the team"


class Clock(NamedTuple):
    """The clock of a problem that can move by itself, repeating the action of the last key."""

    turns_per_second: float  # in real time
    # labels of the actions that take turns while no key is held, if the terminal reports releases
    idle_actions: tuple[str, ...] = ()


class ViewModule(Protocol):
    """The interface of a view module; its file is named after its problem.

    A view module may also define NUMBER_STEPS, keys that add a fixed amount to a typed number;
    NUMBER_NAME, the noun for that number; HIDDEN_FACT, what a hidden reward would tell, such as
    `the baby's hunger`; `describe_keys`, a function that returns the effects of
    some keys in a view, such as `wall`, by the label of the action;
    SECOND_PLAYER_KEYS, the keys of a second player; KEY_FAMILY, the name under which a player sets
    its keys, if it is not the problem's name; `clock`, a function that returns a Clock, if a
    person may play in slow motion and in real time; and HAS_MOTION, if turns are animated: it then
    draws the part of the motion that `DrawOptions.motion_progress` says. A view without
    `describe_end` has a general sentence.
    """

    @property
    def KEYS(self) -> Mapping[str, str]:  # noqa: N802 - a constant of the module
        """The keys, each with the label of the action that it plays."""

    def iter_boards(self, view: View[Problem], options: DrawOptions) -> Iterator[Text]:
        """Yield drawings of the board, the largest first."""

    def goal_lines(self, view: View[Problem]) -> list[str]:
        """Return the goal and the costs as clauses, the most important first."""

    def lesson(self, view: View[Problem]) -> Lesson:
        """Return the problem in three sentences, without their full stops."""

    def panel_rows(self, view: View[Problem]) -> list[tuple[str, str]]:
        """Return the rows of the side panel, as pairs of label and value."""

    def describe_turn(self, view: View[Problem]) -> str:
        """Return a description of the last turn, in sentences."""

    def describe_situation(self, view: View[Problem]) -> str:
        """Return a description of the current situation, in sentences."""

    def describe_end(self, game: FinishedGame[Problem]) -> str:
        """Describe the end of the game in a sentence: no capital, no full stop, and no score."""


VIEW_NAMES = [name for name in vars(ViewModule) if not name.startswith("_")]


def load_view_module(problem: Problem) -> ViewModule:
    """Return the view module of a problem, or the generic one if it has none.

    If the module that defines the problem also defines a view or keys, return a UserView of them.
    """
    generic_view = cast(ViewModule, importlib.import_module("dmplay.views.generic"))
    view = problem_module_exports.find_export(problem, "VIEW")
    is_view = isinstance(view, ModuleType) or any(hasattr(view, name) for name in VIEW_NAMES)
    if not (view is None or is_view):
        location = problem_module_exports.locate_export(problem, "VIEW")
        expected = f"expected a module, or an object that has some of {', '.join(VIEW_NAMES)}"
        raise BadParameter(f"{location}: got {view!r}, {expected}")
    keys = problem_module_exports.load_module_keys(problem)
    if view is None and not keys:
        return generic_view
    return cast(ViewModule, UserView(view, keys, generic_view))


class UserView:
    """A user's view, with the attributes of a view module; the generic view has those it lacks."""

    def __init__(
        self, user_view: object, keys: Mapping[str, str], generic_view: ViewModule
    ) -> None:
        self._user_view, self._generic_view = user_view, generic_view
        self.KEYS = {**getattr(user_view, "KEYS", {}), **keys}

    def __getattr__(self, name: str) -> object:
        """Return an attribute of the user's view, or else of the generic view."""
        try:
            return getattr(self._user_view, name)
        except AttributeError:
            return getattr(self._generic_view, name)


def draw_picture(view_module: ViewModule, view: View[Problem], state: Array | None) -> Text | None:
    """Return the problem's own picture of what a seat sees, or None if there is none.

    A hidden state is drawn only if `state` is given.
    """
    draw_state: Callable[[View[Problem], Array | None], Text | None] | None
    draw_state = getattr(view_module, "draw_picture", None)
    return draw_state(view, state) if draw_state else None


def expand_for_picture(
    view_module: ViewModule, view: View[Problem], columns: int, rows: int
) -> tuple[int, int]:
    """Return the given columns and rows, enlarged if the picture of a visible state needs more."""
    picture = draw_picture(view_module, view, None)
    width, height = measure_text(picture) if picture else (0, 0)
    return max(columns, width), max(rows, height)


class TooSmallNotice(Text):
    """A text in place of a board, with the columns and rows that the smallest board needs."""


def fit_board(view_module: ViewModule, view: View[Problem], options: DrawOptions) -> Text:
    """Return the largest board that fits, or a TooSmallNotice if none does."""
    smallest = (0, 0)
    for board in view_module.iter_boards(view, options):
        smallest = measure_text(board)
        if smallest[0] <= options.width and smallest[1] <= options.height:
            return to_ascii(board) if options.ascii else board
    needed_text = f"board needs {smallest[0]}x{smallest[1] + options.reserved_rows}"
    message = f"{needed_text}; playing in text"
    return TooSmallNotice(
        message if len(message) <= options.width else needed_text[: options.width], no_wrap=True
    )

"""The play screen without a terminal: keys from a pipe, frames into an emulator, one at a time."""

import io
import signal
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import pyte
from prompt_toolkit.application import application, get_app
from prompt_toolkit.input import PipeInput, create_pipe_input
from prompt_toolkit.key_binding.defaults import load_key_bindings
from rich.text import Text

from dmplay.dice import SeededUniforms
from dmplay.finding import problems
from dmplay.game.game import Game
from dmplay.game.request import GameRequest
from dmplay.game.seats import HUMAN, list_human_seats, make_seat_policy
from dmplay.game.table import GameController
from dmplay.keys.keyboard import Keyboard
from dmplay.keys.keymap import DEFAULT_KEY_PREFERENCES, KeyPreferences
from dmplay.painting.painter import Painter
from dmplay.screen import toolkit
from dmplay.screen.screen import PlayScreen
from dmplay.screen.shown import Viewport
from dmplay.session import EpisodeUniforms, Session
from dmplay.terminal import Terminal
from dmplay.words.commands import PlayerQuit
from tests.support.terminals import Shown

vars(application)["load_key_bindings"] = cache(load_key_bindings)  # alike for every screen
pyte.screens.Char._replace = cache(pyte.screens.Char._replace)  # type: ignore[method-assign]
vars(signal)["valid_signals"] = cache(signal.valid_signals)  # which asyncio asks for at each
SEQUENCES = {
    "left": "\x1b[D", "right": "\x1b[C", "up": "\x1b[A", "down": "\x1b[B",
    "home": "\x1b[H", "end": "\x1b[F", "pageup": "\x1b[5~", "pagedown": "\x1b[6~",
    "tab": "\t", "backspace": "\x7f", "enter": "\r", "escape": "\x1b", "space": " ",
    "f1": "\x1bOP", "f2": "\x1bOQ", "c-c": "\x03", "c-d": "\x04", "c-l": "\x0c", "c-r": "\x12",
    "c-_": "\x1f",
}  # fmt: skip
NOTHING: Mapping[str, object] = {}


def game(  # noqa: PLR0913 - a problem, and what of it is not as usual
    name: str,
    *seats: str,
    seed: int = 7,
    turns: int | None = None,
    parameters: Mapping[str, object] = NOTHING,
    source: EpisodeUniforms | None = None,
    keys: KeyPreferences = DEFAULT_KEY_PREFERENCES,
) -> Game:
    """A game without a transcript; people sit where nobody is named."""
    found = problems.resolve_problem(name, parameters)
    problem = found.problem
    who = list(seats) or [HUMAN] * len(problem.agents)
    policies = [make_seat_policy(problem, seat, one) for seat, one in enumerate(who)]
    session = Session(problem, source or SeededUniforms(seed, 0), policies, turn_limit=turns)
    return seated(found.name, session, who, keys=keys)


def seated(
    name: str,
    session: Session,
    who: Sequence[str],
    asked: GameRequest | None = None,
    *,
    keys: KeyPreferences = DEFAULT_KEY_PREFERENCES,
) -> Game:
    """A game of this session, without a transcript."""
    keyboard = Keyboard(session.problem, list_human_seats(who), keys)
    return Game(name, session, who, keyboard, None, asked)


def secret(name: str) -> GameRequest:
    """A wish for a game whose seed is fresh and so not shown."""
    return GameRequest(name, is_seed_visible=False)


class Played(NamedTuple):
    """What came of it: each frame, from the one before the first key on, the bytes, the code."""

    frames: list[str]
    written: str
    code: int

    @property
    def last(self) -> str:
        """The frame after the last key."""
        return self.frames[-1]


class Paper(io.StringIO):
    """What is written lands on an emulated screen too."""

    encoding = "utf-8"

    def __init__(self) -> None:
        super().__init__()
        self.screen: Any = None
        self._stream: Any = None
        self._displayed_rows = Shown(None)

    def resize(self, columns: int, rows: int) -> None:
        """Makes the emulated screen of another size, and empty."""
        self.screen = pyte.Screen(columns, rows)
        self._stream = pyte.Stream(self.screen)
        self._displayed_rows = Shown(self.screen)

    def write(self, text: str) -> int:
        """Writes to both."""
        self._stream.feed(text)
        return super().write(text)

    @property
    def text(self) -> str:
        """The screen's rows without trailing blanks."""
        return self._displayed_rows.text


class Easel(Painter):
    """A painter on paper."""

    def __init__(self, paper: Paper, columns: int, rows: int) -> None:
        super().__init__(paper, "default", erases_with_color=True)
        self.paper = paper
        self.resize(columns, rows)

    def resize(self, columns: int, rows: int) -> None:
        """Takes paper of another size."""
        self.dimensions = columns, rows
        self.paper.resize(columns, rows)

    def get_size(self) -> tuple[int, int]:
        """The paper's."""
        return self.dimensions


class Watched(PlayScreen):
    """A screen that is looked at after each frame, and then given its next key."""

    def __init__(
        self, played: Game, keys: Iterable[str], pipe: PipeInput, paper: Paper, *, motion: bool
    ) -> None:
        super().__init__(
            GameController(played), Terminal(True, "", True, True, False, motion=motion)
        )
        self.keys = iter(keys)
        self.pipe = pipe
        self.paper = paper
        self.frames: list[str] = []
        self.animation.step_seconds = 0.0

    def paint(self, painter: Painter) -> None:
        """Paints, and looks once nothing moves."""
        super().paint(painter)
        if not self.animation.is_running:
            self._look(None)

    def render_upper(self, room: Viewport) -> Text:
        """The screen's own, for the command row; the first time, asks to be told of its frames."""
        if self._look not in get_app().after_render._handlers:
            get_app().after_render += self._look
        return super().render_upper(room)

    def _look(self, app: Any) -> None:
        if app is not None and app.is_done:
            return
        self.frames.append(self.paper.text)
        key = next(self.keys, None)
        if key is not None:
            words = key.split()
            self.pipe.send_text("".join(SEQUENCES.get(word, word) for word in words))
        elif app is not None:
            app.exit(exception=PlayerQuit(0))
        else:
            self.pipe.send_text(SEQUENCES["c-d"])


def play(played: Game, *keys: str, size: tuple[int, int] = (80, 24)) -> Played:
    """Presses keys, each after the frame of the one before; `up right` are two, `:undo` many."""
    return press(played, keys, size)


def press(
    played: Game,
    keys: Iterable[str],
    size: tuple[int, int] = (80, 24),
    *,
    moment: float = 60.0,
    motion: bool = True,
) -> Played:
    """Presses keys that may depend on how the game stands; nothing quick is shown as thinking,
    however slow the machine, unless `moment` says so.
    """
    paper = Paper()
    easel = Easel(paper, *size)
    with create_pipe_input() as pipe:
        screen = Watched(played, keys, pipe, paper, motion=motion)
        screen.thinking_delay_seconds = moment
        code = toolkit.run_event_loop(screen, easel, pipe)
    return Played(screen.frames, paper.getvalue(), code)

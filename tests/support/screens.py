"""Run the play screen without a terminal: keys from a pipe, each frame drawn into an emulator."""

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

from dmplay.core.session import EpisodeUniforms, Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.game.action_input import Keyboard
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.key_preferences import DEFAULT_KEY_PREFERENCES, KeyPreferences
from dmplay.game.launch_requests import GameRequest
from dmplay.game.seats import HUMAN, list_human_seats, make_seat_policy
from dmplay.registry import problems
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.painter import Painter
from dmplay.ui.screen import event_loop
from dmplay.ui.screen.frame_state import Viewport
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.commands import PlayerQuit
from tests.support.terminals import EmulatedRows

# the same bindings for every screen
vars(application)["load_key_bindings"] = cache(load_key_bindings)
pyte.screens.Char._replace = cache(pyte.screens.Char._replace)  # type: ignore[method-assign]
# asyncio calls it for each signal handler
vars(signal)["valid_signals"] = cache(signal.valid_signals)
KEY_SEQUENCES = {
    "left": "\x1b[D", "right": "\x1b[C", "up": "\x1b[A", "down": "\x1b[B",
    "home": "\x1b[H", "end": "\x1b[F", "pageup": "\x1b[5~", "pagedown": "\x1b[6~",
    "tab": "\t", "backspace": "\x7f", "enter": "\r", "escape": "\x1b", "space": " ",
    "f1": "\x1bOP", "f2": "\x1bOQ", "c-c": "\x03", "c-d": "\x04", "c-l": "\x0c", "c-r": "\x12",
    "c-_": "\x1f",
}  # fmt: skip
NO_PARAMETERS: Mapping[str, object] = {}


def make_game(  # noqa: PLR0913 - a problem and its optional settings
    name: str,
    *seats: str,
    seed: int = 7,
    turns: int | None = None,
    parameters: Mapping[str, object] = NO_PARAMETERS,
    source: EpisodeUniforms | None = None,
    keys: KeyPreferences = DEFAULT_KEY_PREFERENCES,
) -> Game:
    """Make a game without a transcript; human players take the seats if none are named."""
    resolved = problems.resolve_problem(name, parameters)
    problem = resolved.problem
    players = list(seats) or [HUMAN] * len(problem.agents)
    policies = [make_seat_policy(problem, seat, player) for seat, player in enumerate(players)]
    session = Session(problem, source or SeededUniforms(seed, 0), policies, turn_limit=turns)
    return make_session_game(resolved.name, session, players, keys=keys)


def make_session_game(
    name: str,
    session: Session,
    players: Sequence[str],
    request: GameRequest | None = None,
    *,
    keys: KeyPreferences = DEFAULT_KEY_PREFERENCES,
) -> Game:
    """Make a game of this session, without a transcript."""
    keyboard = Keyboard(session.problem, list_human_seats(players), keys)
    return Game(name, session, players, keyboard, None, request)


def make_secret_request(name: str) -> GameRequest:
    """Request a game with a fresh seed, which stays hidden."""
    return GameRequest(name, is_seed_visible=False)


class ScreenRun(NamedTuple):
    """The result of a run: all frames (the first before any key), the output and the exit code."""

    frames: list[str]
    written: str
    code: int

    @property
    def last(self) -> str:
        """The frame after the last key."""
        return self.frames[-1]


class EmulatedScreen(io.StringIO):
    """A text stream whose output is also drawn on an emulated screen."""

    encoding = "utf-8"

    def __init__(self) -> None:
        super().__init__()
        self.screen: Any = None
        self._stream: Any = None
        self._displayed_rows = EmulatedRows(None)

    def resize(self, columns: int, rows: int) -> None:
        """Replace the emulated screen by an empty one of another size."""
        self.screen = pyte.Screen(columns, rows)
        self._stream = pyte.Stream(self.screen)
        self._displayed_rows = EmulatedRows(self.screen)

    def write(self, text: str) -> int:
        """Write to the stream and to the emulated screen."""
        self._stream.feed(text)
        return super().write(text)

    @property
    def text(self) -> str:
        """The rows of the screen without trailing blanks."""
        return self._displayed_rows.text


class EmulatedPainter(Painter):
    """A painter on an emulated screen."""

    def __init__(self, emulated: EmulatedScreen, columns: int, rows: int) -> None:
        super().__init__(emulated, "default")
        self.paper = emulated
        self.resize(columns, rows)

    def resize(self, columns: int, rows: int) -> None:
        """Resize the emulated screen."""
        self.dimensions = columns, rows
        self.paper.resize(columns, rows)

    def get_size(self) -> tuple[int, int]:
        """Return the size of the emulated screen."""
        return self.dimensions


class ScriptedScreen(PlayScreen):
    """A screen whose frames are recorded, and that receives its next key after each frame."""

    def __init__(
        self,
        game: Game,
        keys: Iterable[str],
        pipe: PipeInput,
        emulated: EmulatedScreen,
        *,
        motion: bool,
    ) -> None:
        super().__init__(GameController(game), Terminal(True, "", True, True, False, motion=motion))
        self.keys = iter(keys)
        self.pipe = pipe
        self.paper = emulated
        self.frames: list[str] = []
        self.animation.step_seconds = 0.0

    def paint(self, painter: Painter) -> None:
        """Paint, and record the frame unless an animation is running."""
        super().paint(painter)
        if not self.animation.is_running:
            self._look(None)

    def render_upper(self, room: Viewport) -> Text:
        """Return the screen's upper part; at the first call, subscribe to rendered frames."""
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
            self.pipe.send_text("".join(KEY_SEQUENCES.get(word, word) for word in words))
        elif app is not None:
            app.exit(exception=PlayerQuit(0))
        else:
            self.pipe.send_text(KEY_SEQUENCES["c-d"])


def play_keys(game: Game, *keys: str, size: tuple[int, int] = (80, 24)) -> ScreenRun:
    """Press keys, each after the frame of the previous one.

    In one argument, `up right` presses two keys and `:undo` types five characters.
    """
    return press_keys(game, keys, size)


def press_keys(
    game: Game,
    keys: Iterable[str],
    size: tuple[int, int] = (80, 24),
    *,
    moment: float = 60.0,
    motion: bool = True,
) -> ScreenRun:
    """Press keys that may depend on the state of the game.

    Short computations are never displayed as thinking, even on a slow machine, unless `moment` (in
    seconds) is set.
    """
    emulated = EmulatedScreen()
    painter = EmulatedPainter(emulated, *size)
    with create_pipe_input() as pipe:
        screen = ScriptedScreen(game, keys, pipe, emulated, motion=motion)
        screen.thinking_delay_seconds = moment
        code = event_loop.run_event_loop(screen, painter, pipe)
    return ScreenRun(screen.frames, emulated.getvalue(), code)

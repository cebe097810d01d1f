"""Terminal input: random control sequences in random pieces, read by every kind of screen.

No sequence is a key, so no event of a key may reach the screen. The clock is one of the case.
"""

import asyncio
import traceback
from collections.abc import Awaitable, Callable, Iterator
from contextlib import ExitStack
from datetime import date
from functools import cache
from pathlib import Path
from random import Random
from typing import NamedTuple

from prompt_toolkit.input import PipeInput, create_pipe_input
from prompt_toolkit.input.ansi_escape_sequences import ANSI_SEQUENCES
from prompt_toolkit.key_binding import KeyPress
from prompt_toolkit.keys import Keys

from dmplay.algorithms.registry import find_algorithm
from dmplay.algorithms.step import WatchRequest
from dmplay.game.game_series import GameController
from dmplay.game.launch_requests import GameRequest
from dmplay.game.playback import Playback
from dmplay.game.seats import HUMAN
from dmplay.game.watching import WatchedSteps
from dmplay.registry.problems import load_problem
from dmplay.terminal.capabilities import Terminal
from dmplay.ui.gallery.gallery import Gallery
from dmplay.ui.gallery.problem_entries import list_problem_entries
from dmplay.ui.screen.event_loop import KeyDrivenEventLoop, PlayEventLoop, ScreenEventLoop
from dmplay.ui.screen.key_reader import attach_key_reader
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.screen.screen_protocols import KeyDrivenScreen
from dmplay.ui.shell.commands import PlayerQuit
from dmplay.ui.watch.step_viewer import StepViewer
from tests.fuzz.case import Case, CaseOutcome
from tests.fuzz.screens import StringPainter
from tests.support.screens import make_game

TERMINAL = Terminal(True, "", True, color=True, ascii=False)
TRANSCRIPTS_FOLDER = Path(__file__).parents[2] / "transcripts"
GAME_NAMES = ("hexworld", "2048", "crying-baby", "catch", "travelers-dilemma", "simple-regulator")
SCREEN_NAMES = (*GAME_NAMES, "replay", "watch", "gallery", "lesson", "prompt")
INTRODUCERS = {"[": 0x9B, "O": 0x8F, "]": 0x9D, "P": 0x90, "X": 0x98, "^": 0x9E, "_": 0x9F}
PLAYED_TEXTS = (
    "q",
    "l",
    "hlq",
    "\r",
    "1",
    "0159\r",
    " ",
    "\t",
    "\x03",
    "\x04",
    ":",
    "w\r",
    "é",
    "┼",
)
PARAMETERS, FINALS = "0123456789:;<=>?", "".join(map(chr, range(0x40, 0x7F)))
LONG_CHARS = 100_000
READ_BYTES = 1024  # that prompt_toolkit reads at once
PIPES = ExitStack()  # open until the process ends
PROBE, PROBE_KEY = b"\x1b[24~", "f12"  # a key without a meaning, which must still arrive


class Prompt:
    """The input of the shell's prompt, as an event loop: its events are keys, without pastes."""

    def __init__(self, pipe: PipeInput) -> None:
        self.input, self._key_reader = pipe, attach_key_reader(pipe)
        self._handle_suspend_key = None
        self._events: list[tuple[str, Callable[[], Awaitable[None]]]] = []

    def _enqueue_keys(self, presses: list[KeyPress]) -> None:
        """Keep the keys that the line editor would receive."""
        keys = [press.key for press in presses if press.key != Keys.BracketedPaste]
        self._events += [(key.value if isinstance(key, Keys) else key, _ignore_key) for key in keys]

    def _drain_events(self) -> list[tuple[str, Callable[[], Awaitable[None]]]]:
        """Return the events since the last call."""
        events, self._events = self._events, []
        return events


async def _ignore_key() -> None:
    """Do nothing, as a line editor does for the key of the probe."""


class InputScreen(NamedTuple):
    """A screen with the event loop that reads its input, and with the clock of its reader."""

    loop: ScreenEventLoop | Prompt
    pipe: PipeInput
    clock: list[float]


def draw_input_case(random: Random) -> Case:
    """Draw a screen and one to four sequences, cut into pieces with pauses."""
    pieces = [
        piece for _ in range(random.randint(1, 4)) for piece in _draw_pieces(random, *_draw(random))
    ]
    return Case((random.choice(SCREEN_NAMES),), pieces=tuple(pieces))


def _draw(random: Random) -> tuple[bytes, bool]:
    """Draw a sequence that is no key; the second value is whether it has no end."""
    introducer = random.choice("[[[[O]]]PPX^_ (#")
    body, is_torn = "", random.random() < 0.1
    if introducer in " (#":
        intermediates = "".join(random.choices(" !#$(/", k=random.choice((0, 0, 1, 9))))
        return f"\x1b{introducer}{intermediates}{random.choice('08lhqB~')}".encode(), False
    if introducer in "[O":
        while (
            introducer + body in ("[M", "[[")
            or "\x1b" + introducer + body in ANSI_SEQUENCES
            or (not body)
        ):
            parameters = "".join(random.choices(PARAMETERS, k=random.choice((0, 1, 2, 4, 9, 30))))
            intermediates = "".join(random.choices(" !$'*+", k=random.choice((0, 0, 1, 2))))
            # the cursor's position and the mouse's, which are known
            final = random.choice(FINALS.replace("R", "").replace("M", "").replace("m", ""))
            body = parameters + intermediates + final
        is_torn = False
        special = random.random()
        if introducer == "[" and special < 0.15:
            mouse = bytes(random.choices(range(0x20, 0xC0), k=3))
            body = "M" + mouse.decode("utf-8", "surrogateescape")
        elif introducer == "[" and special < 0.2:
            body = "[" + random.choice("FGlq0")
        elif introducer == "[" and special < 0.3:
            body = f"200~{_draw_text(random)}\x1b[31m{_draw_text(random)}\x1b[201~"
        elif special < 0.4:
            body = body[:-1] + random.choice("\x18\x1a")
    else:
        endings = (
            "\x1b\\",
            "\x1b\\",
            "\x9c",
            "\udc9c",
            "\x18",
            "\x1a",
            *["\x07"] * (introducer == "]"),
        )
        body = _draw_text(random) + ("" if is_torn else random.choice(endings))
    code = INTRODUCERS[introducer]
    head = random.choice((f"\x1b{introducer}", f"\x1b{introducer}", chr(code), chr(0xDC00 + code)))
    if random.random() < 0.01 and not body.startswith(("M", "[", "200~")):
        offset = random.randint(0, max(len(body) - 2, 0)) if introducer in "]PX^_" else 0
        body = body[:offset] + "1" * LONG_CHARS + body[offset:]
    return (head + body).encode("utf-8", "surrogateescape"), is_torn


def _draw_text(random: Random) -> str:
    """Draw the text of a string or a paste, which would play or quit if it were typed."""
    return "".join(random.choices(PLAYED_TEXTS, k=random.choice((0, 1, 3, 20))))


def _draw_pieces(random: Random, sent: bytes, is_torn: bool) -> Iterator[tuple[float, bytes]]:
    """Yield pieces with the seconds before each; an introducer soon follows its ESC."""
    cuts = sorted({random.randrange(len(sent)) for _ in range(random.choice((0, 0, 1, 2, 5)))})
    for start, end in zip([0, *cuts], [*cuts, len(sent)], strict=True):
        if start < end or not cuts:
            # what follows ESC or an intermediate without a pause
            is_soon = start and sent[:1] == b"\x1b" and (start == 1 or sent[1] in b" (#")
            yield random.uniform(0, 0.045 if is_soon else 0.95), sent[start:end]
    if is_torn:
        yield 1.05, b""


def run_input(case: Case) -> CaseOutcome:
    """Send the pieces of a case to its screen, then a key, which alone must arrive."""
    screen = _open_screen(case.words[0])
    keys, trace, ending = [], "", "read"
    try:
        for seconds, data in (*case.pieces, (1.05, PROBE)):
            keys += _send(screen, seconds, data)
    except PlayerQuit:
        keys.append("the player left")
    except Exception as error:
        ending, trace = type(error).__name__, traceback.format_exc()
    if ending != "read" or keys != [PROBE_KEY]:
        PIPES.close()
        _open_screen.cache_clear()
    if ending == "read" and keys != [PROBE_KEY]:
        ending = "keys of a sequence" if keys[-1:] == [PROBE_KEY] else "a key is missing"
    return CaseOutcome(ending, trace=trace)


def _send(screen: InputScreen, seconds: float, data: bytes) -> list[str]:
    """Wait, send bytes, handle all events, and return the keys among them."""
    keys: list[str] = []
    _wait(screen, seconds)
    for start in range(0, len(data), READ_BYTES):
        screen.pipe.send_bytes(data[start : start + READ_BYTES])
        screen.loop._enqueue_keys(screen.loop.input.read_keys())
    for key, handler in screen.loop._drain_events():
        if handler == screen.loop._handle_suspend_key:
            keys.append("c-z")
        keys += [key] * (key != "")
        if key == PROBE_KEY:  # Others may wait for more input.
            asyncio.run(_handle(handler))
    return keys


async def _handle(handler: Callable[[], Awaitable[None]]) -> None:
    """Run the handler of an event."""
    await handler()


def _wait(screen: InputScreen, seconds: float) -> None:
    """Move the clock, and flush the input when its time has come, as the event loop does."""
    end = screen.clock[0] + seconds
    reader = screen.loop._key_reader
    while (left := reader.seconds_to_flush()) is not None and screen.clock[0] + left <= end:
        screen.clock[0] += left + 1e-9
        screen.loop._enqueue_keys(screen.loop.input.flush_keys())
    screen.clock[0] = end


@cache
def _open_screen(name: str) -> InputScreen:
    """Open a screen whose input is a pipe."""
    clock, pipe = [100.0], PIPES.enter_context(create_pipe_input())
    attach_key_reader(pipe, clock=lambda: clock[0])
    if name == "prompt":
        return InputScreen(Prompt(pipe), pipe, clock)
    screen = _make_screen(name)
    terminal_io = StringPainter((80, 24)), pipe, None
    if isinstance(screen, PlayScreen):
        return InputScreen(PlayEventLoop(screen, *terminal_io), pipe, clock)
    loop = KeyDrivenEventLoop(screen, *terminal_io)
    loop._drain_events()  # that of the first frame
    return InputScreen(loop, pipe, clock)


def _make_screen(name: str) -> PlayScreen | KeyDrivenScreen:
    """Make the screen of a game, or another one."""
    match name:
        case "replay":
            replayed = Playback(sorted(TRANSCRIPTS_FOLDER.glob("hexworld/*.dmt"))[0])
            return PlayScreen(GameController(replayed), TERMINAL)
        case "watch":
            request = WatchRequest(load_problem("hexworld"), iterations=5)
            watched = WatchedSteps(find_algorithm("value-iteration"), request, "hexworld")
            return StepViewer(watched, TERMINAL)
        case "gallery":
            gallery = Gallery(list_problem_entries(), TERMINAL, today=date(2026, 11, 22))
            gallery.handle_key("")
            return gallery
        case _:
            partners = ("random",) if name == "travelers-dilemma" else ()
            problem_name = "hexworld" if name == "lesson" else name
            game = make_game(problem_name, *([HUMAN] * bool(partners)), *partners)
            if name == "lesson":
                game.request = GameRequest(problem_name, lesson_goal="reach the exit")
            return PlayScreen(GameController(game), TERMINAL)

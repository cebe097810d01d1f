"""The play screen at work: keys read by prompt-toolkit, the clock, signals, the command row.

Events come one after the other. What an event has the game do is a thought: where it takes longer
than a moment, the events that come meanwhile are told apart by `meanwhile`.
"""

import asyncio
import contextlib
import os
import signal
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable, Iterator
from functools import partial

from prompt_toolkit.application import Application
from prompt_toolkit.history import InMemoryHistory
from prompt_toolkit.input import Input, create_input
from prompt_toolkit.input.typeahead import get_typeahead, store_typeahead
from prompt_toolkit.key_binding import KeyPress
from prompt_toolkit.keys import Keys

from dmplay.painting.painter import Painter
from dmplay.screen.acts import autoplay_turn, clock_rate, run_typed_line, tick_clock
from dmplay.screen.meanwhile import QUIT_KEYS, BusyKeyAction, classify_busy_key
from dmplay.screen.modes import Mode
from dmplay.screen.press import handle_key
from dmplay.screen.screen import PlayScreen
from dmplay.screen.staged import FullScreen, KeyDrivenScreen
from dmplay.signals import (
    INTERRUPTED_EXIT_CODE,
    SIGNAL_EXIT_CODES,
    TERMINAL_LOST_EXIT_CODE,
    TURN_GATE,
    defer_signals,
)
from dmplay.thought import CANCEL_SECONDS, BackgroundTask, TaskInfo
from dmplay.words.commands import PlayerQuit

ESCAPE_TIMEOUT_SECONDS = (
    0.05  # seconds until a lone Esc counts; the library's default is half a second
)
POLL_SECONDS = 0.1  # seconds after which a thought is looked at again
QUIT_PATIENCE_SECONDS = 0.1  # seconds that who leaves waits for a thought to stop
FORCE_QUIT_KEYS = ("c-c", "c-d")  # keys that leave whatever the game does
KEY_NAMES: dict[str, str] = {  # the library's names of keys, as the views name them
    " ": "space",
    Keys.ControlH: "backspace", Keys.ControlUnderscore: "backspace", Keys.ControlI: "tab",
    Keys.ControlM: "enter", Keys.ControlJ: "enter", Keys.F1: "?", Keys.F2: "N",
}  # fmt: skip
IGNORED_KEYS = {Keys.CPRResponse, Keys.Vt100MouseEvent, Keys.Ignore, Keys.BracketedPaste}
WHEEL_KEYS = {"\x1b[<64": "wheel up", "\x1b[<65": "wheel down"}  # as a terminal reports it

EventHandler = Callable[[], Awaitable[None]]


def run_event_loop(
    screen: PlayScreen | KeyDrivenScreen, painter: Painter, input_: Input | None = None
) -> int:
    """Shows the screen until the player leaves or a signal comes; returns the exit code."""
    by = painter, input_ or create_input()
    stage: ScreenEventLoop = (
        PlayEventLoop(screen, *by)
        if isinstance(screen, PlayScreen)
        else KeyDrivenEventLoop(screen, *by)
    )
    TURN_GATE.raise_postponed()
    try:
        with (
            defer_signals() as early
        ):  # for what is raised within the loop may leave all as it stands
            return asyncio.run(stage.run(early))
    except asyncio.CancelledError:
        return stage.exit_code
    except (EOFError, OSError):  # the terminal is gone
        return TERMINAL_LOST_EXIT_CODE


async def _redraw_only() -> None:
    """What only lets the next frame come."""


class ScreenEventLoop(ABC):
    """What happens on the screen, one event after the other, a frame after each."""

    def __init__(
        self,
        screen: FullScreen,
        key_handler: Callable[[str], None],
        painter: Painter,
        input_: Input,
    ) -> None:
        self.screen = screen
        self.key_handler = key_handler  # what a key says; raises Leave
        self.painter = painter
        self.input = input_
        self.exit_code = 0  # of a signal that ends the game
        self._events: asyncio.Queue[tuple[str, EventHandler]] = asyncio.Queue()  # with their keys
        self._background_task: BackgroundTask | None = None  # that takes longer than a moment
        self._prompt_application: Application[str | None] | None = None  # while a command is typed
        self._escape_timer: asyncio.TimerHandle | None = None
        self._control_key_handlers: dict[str, EventHandler] = {
            Keys.ControlZ: self._handle_suspend_key, Keys.ControlL: self._redraw,
            Keys.ControlC: partial(self._quit, INTERRUPTED_EXIT_CODE),
            Keys.ControlD: partial(self._quit, 0),
        }  # fmt: skip

    async def run(self, early_signals: list[int]) -> int:
        """Takes events until the player leaves, signals that came before first; the exit code."""
        with (
            self.input.raw_mode(),
            self.input.attach(self._read_keys),
            self._handle_signals(early_signals),
        ):
            self.painter.enable_input_reports()
            clocks = [asyncio.ensure_future(clock) for clock in self._iter_clocks()]
            try:
                while True:
                    self.screen.paint(self.painter)
                    step = self._schedule_animation_step()
                    _, event = await self._events.get()
                    if step:
                        step.cancel()
                    await event()
                    while not self._events.empty():  # a burst of keys has one frame
                        _, event = self._events.get_nowait()
                        await event()
            except PlayerQuit as leave:
                return leave.exit_code
            finally:
                for clock in clocks:
                    clock.cancel()

    # Where events come from

    def _read_keys(self) -> None:
        self._enqueue_keys(self.input.read_keys())
        if self.input.closed:
            self._enqueue_event(partial(self._quit, TERMINAL_LOST_EXIT_CODE))
        loop = asyncio.get_running_loop()
        self._cancel_escape_timer()
        self._escape_timer = loop.call_later(
            ESCAPE_TIMEOUT_SECONDS, lambda: self._enqueue_keys(self.input.flush_keys())
        )

    def _cancel_escape_timer(self) -> None:
        """Leaves what may be a lone Esc to who reads the keys next."""
        if self._escape_timer:
            self._escape_timer.cancel()

    def _enqueue_event(self, handler: EventHandler, key: str = "") -> None:
        self._events.put_nowait((key, handler))

    def _enqueue_keys(self, presses: list[KeyPress]) -> None:
        for place, one in enumerate(presses):
            name = KEY_NAMES.get(one.key, one.key)
            wheel = WHEEL_KEYS.get(one.data.partition(";")[0])
            key = wheel or str(getattr(name, "value", name))
            if key == ":":
                self._enqueue_event(partial(self._open_command_prompt, presses[place + 1 :]), key)
                return
            if wheel or one.key not in IGNORED_KEYS:
                event = self._control_key_handlers.get(one.key, partial(self._handle_key, key))
                self._enqueue_event(
                    event, "" if event in (self._handle_suspend_key, self._redraw) else key
                )

    def _iter_clocks(self) -> Iterator[Awaitable[None]]:
        """What moves without a key."""
        return iter(())

    def _schedule_animation_step(self) -> asyncio.TimerHandle | None:
        """Has the next step of what moves come in time; None where nothing moves."""
        return None

    @abstractmethod
    async def _open_command_prompt(self, typeahead: list[KeyPress]) -> None:
        """Takes a colon, with what was typed ahead."""

    async def _run_clock(
        self, rate: Callable[[], float], on_beat: Callable[[], None], is_running: Callable[[], bool]
    ) -> None:
        """Beats so many times a second; a beat that finds the last one waiting is left out."""
        loop = asyncio.get_running_loop()
        due = loop.time()
        while True:
            due = max(due + 1 / rate(), loop.time())
            await asyncio.sleep(due - loop.time())
            if is_running() and self._events.empty():
                self._enqueue_event(partial(self._handle_beat, on_beat))

    @contextlib.contextmanager
    def _handle_signals(self, early_signals: list[int]) -> Iterator[None]:
        """Signals that end the game, stop it or tell of another size."""
        loop, play = asyncio.get_running_loop(), asyncio.current_task()
        ends = SIGNAL_EXIT_CODES | {signal.SIGINT: INTERRUPTED_EXIT_CODE}
        before = {number: signal.getsignal(number) for number in ends}

        def stop_with_code(code: int) -> None:
            self.exit_code = code
            assert play is not None
            play.cancel()

        for number, code in ends.items():
            loop.add_signal_handler(number, stop_with_code, code)
        while early_signals:
            stop_with_code(ends[signal.Signals(early_signals.pop())])
        loop.add_signal_handler(signal.SIGWINCH, self._enqueue_event, self._redraw)
        loop.add_signal_handler(signal.SIGTSTP, self._suspend)
        loop.add_signal_handler(signal.SIGCONT, self._resume)
        try:
            yield
        finally:
            for number in (signal.SIGWINCH, signal.SIGTSTP, signal.SIGCONT):
                loop.remove_signal_handler(number)
            for number, handler in before.items():
                loop.remove_signal_handler(number)
                signal.signal(number, handler)

    # What they do

    async def _handle_key(self, key: str) -> None:
        await self._run_action(partial(self.key_handler, key), key)

    async def _handle_beat(self, on_beat: Callable[[], None]) -> None:
        if not self._background_task:
            await self._run_action(on_beat)

    async def _run_action(self, action: Callable[[], None], key: str = "") -> None:
        """Has the game do what a key says; what takes longer than a moment is shown as thinking."""
        thought, then = BackgroundTask(action), None
        if not thought.wait_until_finished(self.screen.thinking_delay_seconds):
            self._background_task = thought
            try:
                then = await self._wait_for_task(thought, key)
            except BaseException:  # of leaving
                thought.cancel(QUIT_PATIENCE_SECONDS)
                raise
            finally:
                self._background_task, self.screen.progress_message = None, ""
        if thought.is_abandoned:
            self.screen.abandon_task()
        else:
            thought.raise_error()
        if then:
            await then()

    async def _wait_for_task(self, task: BackgroundTask, trigger_key: str) -> EventHandler | None:
        """Shows what is thought of, up to its end; what is to happen after it."""
        loop, about, then = asyncio.get_running_loop(), None, None
        task.set_finish_callback(
            partial(loop.call_soon_threadsafe, self._enqueue_event, _redraw_only)
        )
        while not (task.is_finished or task.is_abandoned):
            thinks = self._paint_progress(task)
            if not thinks:  # nobody may come between what the game does
                for key, event in self._drain_events():
                    if key in FORCE_QUIT_KEYS:
                        await event()
                    self._enqueue_event(event, key)
                await asyncio.sleep(POLL_SECONDS)
                continue
            about = thinks
            tick = loop.call_later(POLL_SECONDS, self._enqueue_event, _redraw_only)
            key, event = await self._events.get()
            tick.cancel()
            told = classify_busy_key(key, about, trigger_key) if key else None
            if told is None:
                await event()
            elif told is not BusyKeyAction.IGNORE:
                then = event if told is BusyKeyAction.CANCEL_THEN_RUN else None
                task.cancel(QUIT_PATIENCE_SECONDS if key in QUIT_KEYS else CANCEL_SECONDS)
        if about and about.is_agent_move:
            self._drop_typed_keys()
        return then

    def _paint_progress(self, task: BackgroundTask) -> TaskInfo | None:
        """Paints the game with what is thought of; None where it acts."""
        with task.pause_game() as about:
            if about:
                self.screen.show_progress(about, task.progress_text)
                self.screen.paint(self.painter)
        return about

    def _drop_typed_keys(self) -> None:
        """Drops the keys that were typed while an agent thought, but for those that leave."""
        self._read_keys()
        for key, event in self._drain_events():
            if not key or key in QUIT_KEYS:
                self._enqueue_event(event, key)

    def _drain_events(self) -> list[tuple[str, EventHandler]]:
        """Takes the events that came so far."""
        return [self._events.get_nowait() for _ in range(self._events.qsize())]

    async def _quit(self, exit_code: int) -> None:
        raise PlayerQuit(exit_code)

    async def _redraw(self) -> None:
        self.painter.invalidate()

    async def _handle_suspend_key(self) -> None:
        self._suspend()

    def _suspend(self) -> None:
        """Stops as other programs do on Ctrl-Z, the terminal as it was meanwhile."""
        loop = asyncio.get_running_loop()
        self.painter.leave_screen()
        loop.remove_signal_handler(signal.SIGTSTP)
        with self.input.cooked_mode():
            os.kill(0, signal.SIGTSTP)
        loop.add_signal_handler(signal.SIGTSTP, self._suspend)
        self._resume()

    def _resume(self) -> None:
        """Takes the terminal again, however the program was stopped."""
        self.input.raw_mode().__enter__()  # up to the end: who entered first leaves
        self.painter.enter_screen()
        self.painter.enable_input_reports()
        if self._prompt_application:
            self._prompt_application.output.hide_cursor()  # as it is: the next frame shows it
            self._prompt_application.renderer.clear()
            self._prompt_application.invalidate()
        self._enqueue_event(self._redraw)


class KeyDrivenEventLoop(ScreenEventLoop):
    """A screen whose keys are all alike; one that none is pressed for follows the first frame."""

    def __init__(self, screen: KeyDrivenScreen, painter: Painter, input_: Input) -> None:
        super().__init__(screen, screen.handle_key, painter, input_)
        self._enqueue_event(partial(self._handle_key, ""))

    async def _open_command_prompt(self, ahead: list[KeyPress]) -> None:
        """Takes a colon as any other key; what was typed ahead is for who reads next."""
        try:
            await self._handle_key(":")
        except PlayerQuit:
            store_typeahead(self.input, ahead)
            raise
        self._enqueue_keys(ahead)


class PlayEventLoop(ScreenEventLoop):
    """The play screen: it has clocks, and a row for commands."""

    def __init__(self, screen: PlayScreen, painter: Painter, input_: Input) -> None:
        super().__init__(screen, partial(handle_key, screen), painter, input_)
        self._play_screen = screen
        self._history = InMemoryHistory()

    def _iter_clocks(self) -> Iterator[Awaitable[None]]:
        screen = self._play_screen
        beat, running = (
            partial(autoplay_turn, screen),
            lambda: screen.modes.play_mode is Mode.AUTOPLAY,
        )
        yield self._run_clock(lambda: screen.speed, beat, running)
        if screen.realtime_rate:
            beat, running = partial(tick_clock, screen), lambda: screen.clock.is_started
            yield self._run_clock(partial(clock_rate, screen), beat, running)

    def _schedule_animation_step(self) -> asyncio.TimerHandle | None:
        motion = self._play_screen.animation
        if not motion.is_running:
            return None
        return asyncio.get_running_loop().call_later(
            motion.step_seconds, self._enqueue_event, self._advance_animation
        )

    async def _advance_animation(self) -> None:
        self._play_screen.animation.advance()

    async def _open_command_prompt(self, ahead: list[KeyPress]) -> None:
        """Opens the command row, with what was typed ahead, and does what it says."""
        if self._play_screen.controller.awaiting_handover:
            return
        self._play_screen.animation.stop()
        from dmplay.screen import row  # not needed before

        self._cancel_escape_timer()
        store_typeahead(self.input, ahead)
        self._prompt_application = row.create_application(
            self._play_screen, self.painter, self.input, self._history, self._suspend
        )
        self._prompt_application.ttimeoutlen = self._prompt_application.timeoutlen = (
            ESCAPE_TIMEOUT_SECONDS
        )
        try:
            with self.input.detach():
                typed = await self._prompt_application.run_async(handle_sigint=False)
        finally:
            self._prompt_application = None
        self.painter.invalidate()
        self._enqueue_keys(get_typeahead(self.input))
        if typed is not None:
            await self._run_action(partial(run_typed_line, self._play_screen, typed))

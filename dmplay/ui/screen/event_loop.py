"""The event loop of full screens: keys, clocks, signals and the command row.

prompt_toolkit reads the keys. Events are handled one after another. A key that only plays a turn is
handled at once. Where an agent, a hint or code of users may take longer, the event runs as a
background task, and the keys pressed meanwhile are handled as `busy_keys` decides.
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

from dmplay.game.background_tasks import CANCEL_SECONDS, BackgroundTask, TaskInfo
from dmplay.terminal.background import discard_late_reply
from dmplay.terminal.input_sequences import ESC, ESCAPE_SECONDS, TERMINAL_INPUT, InputSequences
from dmplay.terminal.key_releases import RELEASE_PREFIX
from dmplay.terminal.painter import Painter
from dmplay.terminal.signals import (
    INTERRUPTED_EXIT_CODE,
    SIGNAL_EXIT_CODES,
    TERMINAL_LOST_EXIT_CODE,
    defer_signals,
)
from dmplay.ui.screen.busy_keys import QUIT_KEYS, BusyKeyAction, classify_busy_key
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.key_reader import attach_key_reader
from dmplay.ui.screen.modes import Mode
from dmplay.ui.screen.play_operations import (
    autoplay_turn,
    get_autoplay_rate,
    get_clock_rate,
    run_typed_line,
    tick_clock,
)
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.screen.screen_protocols import FullScreen, KeyDrivenScreen, apply_background
from dmplay.ui.shell.commands import PlayerQuit

POLL_SECONDS = 0.1  # between two checks of a running task
QUIT_PATIENCE_SECONDS = 0.1  # maximum wait for a task to stop when the player quits
FORCE_QUIT_KEYS = ("c-c", "c-d")  # keys that quit even if the screen cannot be painted
KEY_NAMES: dict[str, str] = {  # prompt_toolkit's key names -> names used by the views
    " ": "space",
    Keys.ControlH: "backspace", Keys.ControlUnderscore: "backspace", Keys.ControlI: "tab",
    Keys.ControlM: "enter", Keys.ControlJ: "enter", Keys.F1: "?", Keys.F2: "N",
}  # fmt: skip
IGNORED_KEYS = {Keys.CPRResponse, Keys.Vt100MouseEvent, Keys.Ignore, Keys.BracketedPaste}
WHEEL_KEYS = {"\x1b[<64": "wheel up", "\x1b[<65": "wheel down"}  # prefixes of SGR mouse reports

EventHandler = Callable[[], Awaitable[None]]


def run_event_loop(
    screen: PlayScreen | KeyDrivenScreen, painter: Painter, input_: Input | None = None
) -> int:
    """Show a full screen until the player quits or a signal arrives, and return the exit code."""
    terminal_io = (painter, input_, None) if input_ else (painter, create_input(), TERMINAL_INPUT)
    event_loop: ScreenEventLoop = (
        PlayEventLoop(screen, *terminal_io)
        if isinstance(screen, PlayScreen)
        else KeyDrivenEventLoop(screen, *terminal_io)
    )
    try:
        with (
            defer_signals() as early_signals
            # Signals are deferred, because an exception raised inside the loop could skip its
            # cleanup.
        ):
            return asyncio.run(event_loop.run(early_signals))
    except asyncio.CancelledError:
        return event_loop.exit_code
    except (EOFError, OSError):  # The terminal is gone.
        return TERMINAL_LOST_EXIT_CODE


async def _redraw_only() -> None:
    """Do nothing; the event only makes the loop paint the next frame."""


class ScreenEventLoop(ABC):
    """An event loop of a full screen, which paints a frame after each burst of events."""

    def __init__(
        self,
        screen: FullScreen,
        key_handler: Callable[[str], None],
        painter: Painter,
        input_: Input,
        sequences: InputSequences | None,
    ) -> None:
        self.screen = screen
        self.key_handler = key_handler  # handles a key; raises PlayerQuit
        self.painter = painter
        self.input = input_
        self._key_reader = attach_key_reader(input_, sequences, self._receive_background)
        self.exit_code = 0  # set by a signal that ends the game
        self._release_handler: Callable[[str], None] | None = None
        # (key, handler); the key is '' for other events
        self._events: asyncio.Queue[tuple[str, EventHandler]] = asyncio.Queue()
        self._background_task: BackgroundTask | None = None  # task that takes longer than a moment
        self._prompt_application: Application[str | None] | None = None  # while a command is typed
        self._escape_timer: asyncio.TimerHandle | None = None
        self._control_key_handlers: dict[str, EventHandler] = {
            Keys.ControlZ: self._handle_suspend_key, Keys.ControlL: self._redraw,
            Keys.ControlC: partial(self._quit, INTERRUPTED_EXIT_CODE),
            Keys.ControlD: partial(self._quit, 0),
        }  # fmt: skip

    async def run(self, early_signals: list[int]) -> int:
        """Handle events until the player quits, and return the exit code.

        Signals that arrived before the start are handled first.
        """
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
                    animation_timer = self._schedule_animation_step()
                    _, handler = await self._events.get()
                    if animation_timer:
                        animation_timer.cancel()
                    await handler()
                    while not self._events.empty():  # A burst of keys gets a single frame.
                        _, handler = self._events.get_nowait()
                        await handler()
            except PlayerQuit as player_quit:
                return player_quit.exit_code
            finally:
                for clock in clocks:
                    clock.cancel()

    # Sources of events

    def _read_keys(self) -> None:
        """Read the pressed keys, and start the timer of an unfinished sequence."""
        self._enqueue_keys(self.input.read_keys())
        if self.input.closed:
            self._enqueue_event(partial(self._quit, TERMINAL_LOST_EXIT_CODE))
        self._schedule_flush()

    def _schedule_flush(self) -> None:
        """Start the timer after which a lone Esc counts as a key, or a sequence as ended."""
        self._cancel_escape_timer()
        seconds = self._key_reader.seconds_to_flush()
        if seconds is not None:
            loop = asyncio.get_running_loop()
            self._escape_timer = loop.call_later(seconds, self._flush_keys)

    def _flush_keys(self) -> None:
        """Add events for keys that are complete because nothing followed them."""
        self._enqueue_keys(self.input.flush_keys())
        self._schedule_flush()

    def _receive_background(self, background: str) -> None:
        """Use the theme that suits the background that the terminal replied."""
        apply_background(self.screen, self.painter, background)
        if self._prompt_application:
            self._prompt_application.invalidate()
        self._enqueue_event(self._redraw)

    def _cancel_escape_timer(self) -> None:
        """Cancel the timer of a lone Esc; the next reader may complete an escape sequence."""
        if self._escape_timer:
            self._escape_timer.cancel()

    def _enqueue_event(self, handler: EventHandler, key: str = "") -> None:
        """Add an event handler to the queue, with the key that caused it if there is one."""
        self._events.put_nowait((key, handler))

    def _enqueue_keys(self, presses: list[KeyPress]) -> None:
        """Add an event for each key press; a colon takes all later keys with it as typeahead.

        prompt_toolkit reports Alt with a key in one sequence as Esc and that key, which has no
        data of its own; neither is a key of a screen.
        """
        for index, key_press in enumerate(presses):
            if key_press.data.startswith(RELEASE_PREFIX):
                released = key_press.data.removeprefix(RELEASE_PREFIX)
                self._enqueue_event(partial(self._handle_release, released))
                continue
            if not key_press.data or (key_press.key is Keys.Escape and key_press.data != ESC):
                continue
            name = KEY_NAMES.get(key_press.key, key_press.key)
            wheel_key = WHEEL_KEYS.get(key_press.data.partition(";")[0])
            key = wheel_key or str(getattr(name, "value", name))
            if key == ":":
                self._enqueue_event(partial(self._open_command_prompt, presses[index + 1 :]), key)
                return
            if wheel_key or key_press.key not in IGNORED_KEYS:
                handler = self._control_key_handlers.get(
                    key_press.key, partial(self._handle_key, key)
                )
                self._enqueue_event(
                    handler, "" if handler in (self._handle_suspend_key, self._redraw) else key
                )

    def _iter_clocks(self) -> Iterator[Awaitable[None]]:
        """Return coroutines that add events on a clock, without keys; none by default."""
        return iter(())

    def _schedule_animation_step(self) -> asyncio.TimerHandle | None:
        """Schedule the next animation step; return its timer, or None if nothing moves."""
        return None

    @abstractmethod
    async def _open_command_prompt(self, typeahead: list[KeyPress]) -> None:
        """Handle a colon; `typeahead` are the keys typed after it."""

    async def _run_clock(
        self, rate: Callable[[], float], on_beat: Callable[[], None], is_running: Callable[[], bool]
    ) -> None:
        """Add an `on_beat` event `rate()` times per second while `is_running()`.

        A beat is skipped if events are still waiting.
        """
        loop = asyncio.get_running_loop()
        due = loop.time()
        while True:
            due = max(due + 1 / rate(), loop.time())
            await asyncio.sleep(due - loop.time())
            if is_running() and self._events.empty():
                self._enqueue_event(partial(self._handle_beat, on_beat))

    @contextlib.contextmanager
    def _handle_signals(self, early_signals: list[int]) -> Iterator[None]:
        """Run the block with handlers for signals that end, suspend or resize.

        `early_signals` arrived before and are handled at once.
        """
        loop, main_task = asyncio.get_running_loop(), asyncio.current_task()
        exit_codes = SIGNAL_EXIT_CODES | {signal.SIGINT: INTERRUPTED_EXIT_CODE}
        previous_handlers = {number: signal.getsignal(number) for number in exit_codes}

        def stop_with_code(code: int) -> None:
            self.exit_code = code
            assert main_task is not None
            main_task.cancel()

        for number, code in exit_codes.items():
            loop.add_signal_handler(number, stop_with_code, code)
        while early_signals:
            stop_with_code(exit_codes[signal.Signals(early_signals.pop())])
        loop.add_signal_handler(signal.SIGWINCH, self._enqueue_event, self._redraw)
        loop.add_signal_handler(signal.SIGTSTP, self._suspend_program)
        loop.add_signal_handler(signal.SIGCONT, self._resume_screen)
        try:
            yield
        finally:
            for number in (signal.SIGWINCH, signal.SIGTSTP, signal.SIGCONT):
                loop.remove_signal_handler(number)
            for number, handler in previous_handlers.items():
                loop.remove_signal_handler(number)
                signal.signal(number, handler)

    # Event handlers

    async def _handle_key(self, key: str) -> None:
        """Run the key handler for a key."""
        await self._run_action(partial(self.key_handler, key), key)

    async def _handle_release(self, key: str) -> None:
        """Run the handler of a released key, which only games have."""
        if self._release_handler:
            self._release_handler(key)

    async def _handle_beat(self, on_beat: Callable[[], None]) -> None:
        """Run the handler of a clock beat, unless a task is running."""
        if not self._background_task:
            await self._run_action(on_beat)

    async def _run_action(self, action: Callable[[], None], key: str = "") -> None:
        """Run an action, in the background if it may take long, and then its follow-up."""
        if self.screen.may_take_long(key):
            await self._run_in_background(action, key)
        else:
            action()
        follow_up = self.screen.follow_up
        if follow_up:
            await self._run_in_background(follow_up, key)

    async def _run_in_background(self, action: Callable[[], None], key: str) -> None:
        """Run an action as a background task, and show its progress if it takes long.

        Raise the action's error. A key that cancelled the task may then be handled itself.
        """
        task, next_handler = BackgroundTask(action), None
        if not task.wait_until_finished(self.screen.thinking_delay_seconds):
            self._background_task = task
            try:
                next_handler = await self._wait_for_task(task, key)
            except BaseException:  # PlayerQuit or a signal
                task.cancel(QUIT_PATIENCE_SECONDS)
                raise
            finally:
                self._background_task, self.screen.progress_message = None, ""
        if task.is_abandoned:
            self.screen.abandon_task()
        else:
            task.raise_error()
        if next_handler:
            await next_handler()

    async def _wait_for_task(self, task: BackgroundTask, trigger_key: str) -> EventHandler | None:
        """Handle events until a task ends or is abandoned; return a handler to run next.

        The handler is None unless a key cancelled the task in order to run itself:
        `classify_busy_key` decides this, and which keys wait for the end. Keys typed while an agent
        chose are dropped, except for the quit keys.
        """
        loop, task_info, next_handler = asyncio.get_running_loop(), None, None
        waiting_events: list[tuple[str, EventHandler]] = []
        task.set_finish_callback(
            partial(loop.call_soon_threadsafe, self._enqueue_event, _redraw_only)
        )
        while not (task.is_finished or task.is_abandoned):
            current_info = self._paint_progress(task)
            # The task is changing the game, so only the force-quit keys are handled.
            if not current_info:
                for key, handler in self._drain_events():
                    if key in FORCE_QUIT_KEYS:
                        await handler()
                    self._enqueue_event(handler, key)
                await asyncio.sleep(POLL_SECONDS)
                continue
            if current_info != task_info:  # Keys need not wait for the next part.
                for key, handler in waiting_events:
                    self._enqueue_event(handler, key)
                waiting_events.clear()
            task_info = current_info
            timer = loop.call_later(POLL_SECONDS, self._enqueue_event, _redraw_only)
            key, handler = await self._events.get()
            timer.cancel()
            effect = classify_busy_key(key, task_info, trigger_key) if key else None
            if effect is None:
                await handler()
            elif effect is BusyKeyAction.RUN_LATER:
                waiting_events.append((key, handler))
            elif effect is not BusyKeyAction.IGNORE:
                next_handler = handler if effect is BusyKeyAction.CANCEL_THEN_RUN else None
                task.cancel(QUIT_PATIENCE_SECONDS if key in QUIT_KEYS else CANCEL_SECONDS)
        if task_info and task_info.is_agent_move:
            self._drop_typed_keys()
        for key, handler in waiting_events:
            self._enqueue_event(handler, key)
        return next_handler

    def _paint_progress(self, task: BackgroundTask) -> TaskInfo | None:
        """Paint the screen with the task's progress; return None if the task changes the game."""
        with task.pause_game() as task_info:
            if task_info:
                self.screen.show_progress(task_info, task.progress_text)
                self.screen.paint(self.painter)
        return task_info

    def _drop_typed_keys(self) -> None:
        """Drop the keys typed while an agent chose, except for the quit keys."""
        self._read_keys()
        for key, handler in self._drain_events():
            if not key or key in QUIT_KEYS:
                self._enqueue_event(handler, key)

    def _drain_events(self) -> list[tuple[str, EventHandler]]:
        """Remove all waiting events from the queue and return them."""
        return [self._events.get_nowait() for _ in range(self._events.qsize())]

    async def _quit(self, exit_code: int) -> None:
        """Raise PlayerQuit with an exit code."""
        raise PlayerQuit(exit_code)

    async def _redraw(self) -> None:
        """Make the next frame repaint the whole screen."""
        self.painter.mark_screen_unknown()

    async def _handle_suspend_key(self) -> None:
        """Suspend the program, as the handler of Ctrl-Z."""
        self._suspend_program()

    def _suspend_program(self) -> None:
        """Suspend the program, as on Ctrl-Z, with the terminal restored until it resumes."""
        loop = asyncio.get_running_loop()
        self.painter.leave_screen()
        discard_late_reply(self.input.fileno(), self._key_reader.sequences)
        loop.remove_signal_handler(signal.SIGTSTP)
        with self.input.cooked_mode():
            os.kill(0, signal.SIGTSTP)
        loop.add_signal_handler(signal.SIGTSTP, self._suspend_program)
        self._resume_screen()

    def _resume_screen(self) -> None:
        """Take over the terminal again after the program was suspended by any means."""
        # The first raw_mode context restores the terminal at the end.
        self.input.raw_mode().__enter__()
        self.painter.enter_screen()
        self.painter.enable_input_reports()
        if self._prompt_application:
            # The cursor is hidden now; the next frame shows it.
            self._prompt_application.output.hide_cursor()
            self._prompt_application.renderer.clear()
            self._prompt_application.invalidate()
        self._enqueue_event(self._redraw)


class KeyDrivenEventLoop(ScreenEventLoop):
    """The event loop of a screen that handles all keys itself, such as the gallery.

    The first frame is followed by an event with an empty key.
    """

    def __init__(
        self,
        screen: KeyDrivenScreen,
        painter: Painter,
        input_: Input,
        sequences: InputSequences | None,
    ) -> None:
        super().__init__(screen, screen.handle_key, painter, input_, sequences)
        self._key_screen = screen
        self._enqueue_event(partial(self._handle_key, ""))

    def _iter_clocks(self) -> Iterator[Awaitable[None]]:
        """Yield the clock that sends the empty key while the screen plays."""
        screen = self._key_screen
        yield self._run_clock(
            lambda: screen.speed, partial(screen.handle_key, ""), lambda: screen.is_playing
        )

    async def _open_command_prompt(self, typeahead: list[KeyPress]) -> None:
        """Handle a colon as any other key; if it quits, keep the typeahead for the next reader."""
        try:
            await self._handle_key(":")
        except PlayerQuit:
            store_typeahead(self.input, typeahead)
            raise
        self._enqueue_keys(typeahead)


class PlayEventLoop(ScreenEventLoop):
    """The event loop of the play screen, which has clocks, animations and a command row."""

    def __init__(
        self, screen: PlayScreen, painter: Painter, input_: Input, sequences: InputSequences | None
    ) -> None:
        super().__init__(screen, partial(handle_key, screen), painter, input_, sequences)
        self._play_screen = screen
        self._history = InMemoryHistory()
        self._key_reader.on_keyboard = self._receive_keyboard
        self._release_handler = self._release_key

    async def run(self, early_signals: list[int]) -> int:
        """Handle events until the player quits, with hints loaded in the background."""
        self._play_screen.load_hints_in_background()
        return await super().run(early_signals)

    def _iter_clocks(self) -> Iterator[Awaitable[None]]:
        """Yield the clocks of autoplay, of a viewed algorithm, and of real time."""
        screen = self._play_screen
        on_beat, is_running = (
            partial(autoplay_turn, screen),
            lambda: screen.modes.play_mode is Mode.AUTOPLAY,
        )
        yield self._run_clock(partial(get_autoplay_rate, screen), on_beat, is_running)
        yield self._run_clock(
            lambda: screen.viewer.speed if screen.viewer else 1.0,
            partial(screen.handle_viewer_key, ""),
            lambda: screen.viewer is not None and screen.viewer.is_playing,
        )
        on_beat, is_running = partial(tick_clock, screen), lambda: screen.clock.is_started
        yield self._run_clock(partial(get_clock_rate, screen), on_beat, is_running)

    def _schedule_animation_step(self) -> asyncio.TimerHandle | None:
        """Schedule the next step of a running turn animation; return None if none is running."""
        animation = self._play_screen.animation
        if not animation.is_running:
            return None
        return asyncio.get_running_loop().call_later(
            animation.step_seconds, self._enqueue_event, self._advance_animation
        )

    def _receive_keyboard(self) -> None:
        """Ask a terminal that can report releases of keys for it; the clock then follows them."""
        self._key_reader.reads_releases = True
        self.painter.report_releases()

    def _release_key(self, key: str) -> None:
        """Let the clock no longer repeat the action of a released key."""
        self._play_screen.clock.release_key(key)

    async def _advance_animation(self) -> None:
        """Advance the turn animation by one step."""
        self._play_screen.animation.advance()

    async def _open_command_prompt(self, typeahead: list[KeyPress]) -> None:
        """Open the command row with the typeahead, and run the commands typed in it.

        Do nothing before a handover.
        """
        if self._play_screen.controller.awaiting_handover or self._play_screen.viewer:
            return
        self._play_screen.animation.stop()
        from dmplay.ui.screen import (
            command_prompt,  # Imported late, because many games never need it.
        )

        self._cancel_escape_timer()
        store_typeahead(self.input, typeahead)
        self._prompt_application = command_prompt.create_application(
            self._play_screen, self.painter, self.input, self._history, self._suspend_program
        )
        self._prompt_application.timeoutlen = ESCAPE_SECONDS
        self._prompt_application.ttimeoutlen = self._key_reader.sequences.escape_seconds
        try:
            with self.input.detach():
                line = await self._prompt_application.run_async(handle_sigint=False)
        finally:
            self._prompt_application = None
        self.painter.mark_screen_unknown()
        self._enqueue_keys(get_typeahead(self.input))
        self._schedule_flush()
        if line is not None:
            await self._run_action(partial(run_typed_line, self._play_screen, line))

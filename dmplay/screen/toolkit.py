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
from dmplay.screen.acts import autoplay, obey, pace, tick
from dmplay.screen.meanwhile import LEAVES, Heed, heed
from dmplay.screen.modes import Mode
from dmplay.screen.press import press
from dmplay.screen.screen import Screen
from dmplay.screen.staged import Pressed, Staged
from dmplay.signals import ENDS, GONE, INTERRUPTED, WHOLE, held
from dmplay.thought import PATIENCE, About, Thought
from dmplay.words.commands import Leave

ESCAPE_WAIT = 0.05  # seconds until a lone Esc counts; the library's default is half a second
BEAT = 0.1  # seconds after which a thought is looked at again
HASTE = 0.1  # seconds that who leaves waits for a thought to stop
AWAY = ("c-c", "c-d")  # keys that leave whatever the game does
NAMES: dict[str, str] = {  # the library's names of keys, as the views name them
    " ": "space",
    Keys.ControlH: "backspace", Keys.ControlUnderscore: "backspace", Keys.ControlI: "tab",
    Keys.ControlM: "enter", Keys.ControlJ: "enter", Keys.F1: "?", Keys.F2: "N",
}  # fmt: skip
DEAF = {Keys.CPRResponse, Keys.Vt100MouseEvent, Keys.Ignore, Keys.BracketedPaste}
WHEEL = {"\x1b[<64": "wheel up", "\x1b[<65": "wheel down"}  # as a terminal reports it

Event = Callable[[], Awaitable[None]]


def run(screen: Screen | Pressed, painter: Painter, input_: Input | None = None) -> int:
    """Shows the screen until the player leaves or a signal comes; returns the exit code."""
    by = painter, input_ or create_input()
    stage: Stage = Playing(screen, *by) if isinstance(screen, Screen) else Browsing(screen, *by)
    WHOLE.settle()
    try:
        with held() as early:  # for what is raised within the loop may leave all as it stands
            return asyncio.run(stage.perform(early))
    except asyncio.CancelledError:
        return stage.code
    except (EOFError, OSError):  # the terminal is gone
        return GONE


async def _nothing() -> None:
    """What only lets the next frame come."""


class Stage(ABC):
    """What happens on the screen, one event after the other, a frame after each."""

    def __init__(
        self, screen: Staged, does: Callable[[str], None], painter: Painter, input_: Input
    ) -> None:
        self.screen = screen
        self.does = does  # what a key says; raises Leave
        self.painter = painter
        self.input = input_
        self.code = 0  # of a signal that ends the game
        self._events: asyncio.Queue[tuple[str, Event]] = asyncio.Queue()  # with their keys
        self._thought: Thought | None = None  # that takes longer than a moment
        self._row: Application[str | None] | None = None  # while a command is typed
        self._escape: asyncio.TimerHandle | None = None
        self._keys: dict[str, Event] = {
            Keys.ControlZ: self._stop, Keys.ControlL: self._repaint,
            Keys.ControlC: partial(self._leave, INTERRUPTED),
            Keys.ControlD: partial(self._leave, 0),
        }  # fmt: skip

    async def perform(self, early: list[int]) -> int:
        """Takes events until the player leaves, signals that came before first; the exit code."""
        with self.input.raw_mode(), self.input.attach(self._read), self._signals(early):
            self.painter.listen()
            clocks = [asyncio.ensure_future(clock) for clock in self._clocks()]
            try:
                while True:
                    self.screen.paint(self.painter)
                    step = self._next_step()
                    _, event = await self._events.get()
                    if step:
                        step.cancel()
                    await event()
                    while not self._events.empty():  # a burst of keys has one frame
                        _, event = self._events.get_nowait()
                        await event()
            except Leave as leave:
                return leave.code
            finally:
                for clock in clocks:
                    clock.cancel()

    # Where events come from

    def _read(self) -> None:
        self._take(self.input.read_keys())
        if self.input.closed:
            self._put(partial(self._leave, GONE))
        loop = asyncio.get_running_loop()
        self._wait_no_more()
        self._escape = loop.call_later(ESCAPE_WAIT, lambda: self._take(self.input.flush_keys()))

    def _wait_no_more(self) -> None:
        """Leaves what may be a lone Esc to who reads the keys next."""
        if self._escape:
            self._escape.cancel()

    def _put(self, event: Event, key: str = "") -> None:
        self._events.put_nowait((key, event))

    def _take(self, presses: list[KeyPress]) -> None:
        for place, one in enumerate(presses):
            name = NAMES.get(one.key, one.key)
            wheel = WHEEL.get(one.data.partition(";")[0])
            key = wheel or str(getattr(name, "value", name))
            if key == ":":
                self._put(partial(self._command, presses[place + 1 :]), key)
                return
            if wheel or one.key not in DEAF:
                event = self._keys.get(one.key, partial(self._press, key))
                self._put(event, "" if event in (self._stop, self._repaint) else key)

    def _clocks(self) -> Iterator[Awaitable[None]]:
        """What moves without a key."""
        return iter(())

    def _next_step(self) -> asyncio.TimerHandle | None:
        """Has the next step of what moves come in time; None where nothing moves."""
        return None

    @abstractmethod
    async def _command(self, ahead: list[KeyPress]) -> None:
        """Takes a colon, with what was typed ahead."""

    async def _clock(
        self, rate: Callable[[], float], beat: Callable[[], None], running: Callable[[], bool]
    ) -> None:
        """Beats so many times a second; a beat that finds the last one waiting is left out."""
        loop = asyncio.get_running_loop()
        due = loop.time()
        while True:
            due = max(due + 1 / rate(), loop.time())
            await asyncio.sleep(due - loop.time())
            if running() and self._events.empty():
                self._put(partial(self._beat, beat))

    @contextlib.contextmanager
    def _signals(self, early: list[int]) -> Iterator[None]:
        """Signals that end the game, stop it or tell of another size."""
        loop, play = asyncio.get_running_loop(), asyncio.current_task()
        ends = ENDS | {signal.SIGINT: INTERRUPTED}
        before = {number: signal.getsignal(number) for number in ends}

        def end(code: int) -> None:
            self.code = code
            assert play is not None
            play.cancel()

        for number, code in ends.items():
            loop.add_signal_handler(number, end, code)
        while early:
            end(ends[signal.Signals(early.pop())])
        loop.add_signal_handler(signal.SIGWINCH, self._put, self._repaint)
        loop.add_signal_handler(signal.SIGTSTP, self._suspend)
        loop.add_signal_handler(signal.SIGCONT, self._go_on)
        try:
            yield
        finally:
            for number in (signal.SIGWINCH, signal.SIGTSTP, signal.SIGCONT):
                loop.remove_signal_handler(number)
            for number, handler in before.items():
                loop.remove_signal_handler(number)
                signal.signal(number, handler)

    # What they do

    async def _press(self, key: str) -> None:
        await self._act(partial(self.does, key), key)

    async def _beat(self, beat: Callable[[], None]) -> None:
        if not self._thought:
            await self._act(beat)

    async def _act(self, act: Callable[[], None], key: str = "") -> None:
        """Has the game do what a key says; what takes longer than a moment is shown as thinking."""
        thought, then = Thought(act), None
        if not thought.ends(self.screen.moment):
            self._thought = thought
            try:
                then = await self._wait(thought, key)
            except BaseException:  # of leaving
                thought.cancel(HASTE)
                raise
            finally:
                self._thought, self.screen.thinking = None, ""
        if thought.left:
            self.screen.leave_alone()
        else:
            thought.finish()
        if then:
            await then()

    async def _wait(self, thought: Thought, asked: str) -> Event | None:
        """Shows what is thought of, up to its end; what is to happen after it."""
        loop, about, then = asyncio.get_running_loop(), None, None
        thought.then(partial(loop.call_soon_threadsafe, self._put, _nothing))
        while not (thought.over or thought.left):
            thinks = self._show(thought)
            if not thinks:  # nobody may come between what the game does
                for key, event in self._come():
                    if key in AWAY:
                        await event()
                    self._put(event, key)
                await asyncio.sleep(BEAT)
                continue
            about = thinks
            tick = loop.call_later(BEAT, self._put, _nothing)
            key, event = await self._events.get()
            tick.cancel()
            told = heed(key, about, asked) if key else None
            if told is None:
                await event()
            elif told is not Heed.DROPPED:
                then = event if told is Heed.ACTS else None
                thought.cancel(HASTE if key in LEAVES else PATIENCE)
        if about and about.move:
            self._drop()
        return then

    def _show(self, thought: Thought) -> About | None:
        """Paints the game with what is thought of; None where it acts."""
        with thought.resting() as about:
            if about:
                self.screen.ponder(about, thought.far)
                self.screen.paint(self.painter)
        return about

    def _drop(self) -> None:
        """Drops the keys that were typed while an agent thought, but for those that leave."""
        self._read()
        for key, event in self._come():
            if not key or key in LEAVES:
                self._put(event, key)

    def _come(self) -> list[tuple[str, Event]]:
        """Takes the events that came so far."""
        return [self._events.get_nowait() for _ in range(self._events.qsize())]

    async def _leave(self, code: int) -> None:
        raise Leave(code)

    async def _repaint(self) -> None:
        self.painter.forget()

    async def _stop(self) -> None:
        self._suspend()

    def _suspend(self) -> None:
        """Stops as other programs do on Ctrl-Z, the terminal as it was meanwhile."""
        loop = asyncio.get_running_loop()
        self.painter.leave()
        loop.remove_signal_handler(signal.SIGTSTP)
        with self.input.cooked_mode():
            os.kill(0, signal.SIGTSTP)
        loop.add_signal_handler(signal.SIGTSTP, self._suspend)
        self._go_on()

    def _go_on(self) -> None:
        """Takes the terminal again, however the program was stopped."""
        self.input.raw_mode().__enter__()  # up to the end: who entered first leaves
        self.painter.enter()
        self.painter.listen()
        if self._row:
            self._row.output.hide_cursor()  # as it is: the next frame shows it
            self._row.renderer.clear()
            self._row.invalidate()
        self._put(self._repaint)


class Browsing(Stage):
    """A screen whose keys are all alike; one that none is pressed for follows the first frame."""

    def __init__(self, screen: Pressed, painter: Painter, input_: Input) -> None:
        super().__init__(screen, screen.press, painter, input_)
        self._put(partial(self._press, ""))

    async def _command(self, ahead: list[KeyPress]) -> None:
        """Takes a colon as any other key; what was typed ahead is for who reads next."""
        try:
            await self._press(":")
        except Leave:
            store_typeahead(self.input, ahead)
            raise
        self._take(ahead)


class Playing(Stage):
    """The play screen: it has clocks, and a row for commands."""

    def __init__(self, screen: Screen, painter: Painter, input_: Input) -> None:
        super().__init__(screen, partial(press, screen), painter, input_)
        self._played = screen
        self._history = InMemoryHistory()

    def _clocks(self) -> Iterator[Awaitable[None]]:
        screen = self._played
        beat, running = partial(autoplay, screen), lambda: screen.modes.moves is Mode.AUTO
        yield self._clock(lambda: screen.speed, beat, running)
        if screen.rate:
            beat, running = partial(tick, screen), lambda: screen.clock.started
            yield self._clock(partial(pace, screen), beat, running)

    def _next_step(self) -> asyncio.TimerHandle | None:
        motion = self._played.motion
        if not motion.moves:
            return None
        return asyncio.get_running_loop().call_later(motion.step, self._put, self._go_on_moving)

    async def _go_on_moving(self) -> None:
        self._played.motion.go_on()

    async def _command(self, ahead: list[KeyPress]) -> None:
        """Opens the command row, with what was typed ahead, and does what it says."""
        if self._played.table.curtained:
            return
        self._played.motion.cut()
        from dmplay.screen import row  # not needed before

        self._wait_no_more()
        store_typeahead(self.input, ahead)
        self._row = row.opened(self._played, self.painter, self.input, self._history, self._suspend)
        self._row.ttimeoutlen = self._row.timeoutlen = ESCAPE_WAIT
        try:
            with self.input.detach():
                typed = await self._row.run_async(handle_sigint=False)
        finally:
            self._row = None
        self.painter.forget()
        self._take(get_typeahead(self.input))
        if typed is not None:
            await self._act(partial(obey, self._played, typed))

"""The play screen at work: keys read by prompt-toolkit, the clock, signals, the command row."""

import asyncio
import contextlib
import os
import signal
from collections.abc import Awaitable, Callable, Iterator
from functools import partial

from prompt_toolkit.history import InMemoryHistory
from prompt_toolkit.input import Input, create_input
from prompt_toolkit.input.typeahead import get_typeahead, store_typeahead
from prompt_toolkit.key_binding import KeyPress
from prompt_toolkit.keys import Keys

from dmplay.screen.modes import Mode
from dmplay.screen.painter import Painter
from dmplay.screen.screen import Screen
from dmplay.signals import ENDS, GONE, INTERRUPTED
from dmplay.words.commands import Leave

ESCAPE_WAIT = 0.05  # seconds until a lone Esc counts
NAMES: dict[str, str] = {  # the library's names of keys, as the views name them
    " ": "space",
    Keys.ControlH: "backspace", Keys.ControlUnderscore: "backspace", Keys.ControlI: "tab",
    Keys.ControlM: "enter", Keys.ControlJ: "enter", Keys.F1: "?", Keys.F2: "N",
}  # fmt: skip
DEAF = {Keys.CPRResponse, Keys.Vt100MouseEvent, Keys.Ignore, Keys.BracketedPaste}

Event = Callable[[], Awaitable[None]]


def run(screen: Screen, painter: Painter, input_: Input | None = None) -> int:
    """Plays on the screen until the player leaves or a signal comes; returns the exit code."""
    stage = Stage(screen, painter, input_ or create_input())
    try:
        return asyncio.run(stage.perform())
    except asyncio.CancelledError:
        return stage.code
    except (EOFError, OSError):  # the terminal is gone
        return GONE


class Stage:
    """What happens on the screen, one event after the other, a frame after each."""

    def __init__(self, screen: Screen, painter: Painter, input_: Input) -> None:
        self.screen = screen
        self.painter = painter
        self.input = input_
        self.code = 0  # of a signal that ends the game
        self._events: asyncio.Queue[Event] = asyncio.Queue()
        self._history = InMemoryHistory()
        self._escape: asyncio.TimerHandle | None = None
        self._keys: dict[str, Event] = {
            Keys.ControlZ: self._suspend, Keys.ControlL: self._repaint,
            Keys.ControlC: partial(self._leave, INTERRUPTED),
            Keys.ControlD: partial(self._leave, 0),
        }  # fmt: skip

    async def perform(self) -> int:
        """Takes events until the player leaves; returns the exit code."""
        with self.input.raw_mode(), self.input.attach(self._read), self._signals():
            self.painter.listen()
            clocks = [asyncio.ensure_future(clock) for clock in self._clocks()]
            try:
                while True:
                    self.screen.paint(self.painter)
                    await (await self._events.get())()
                    while not self._events.empty():  # a burst of keys has one frame
                        await self._events.get_nowait()()
            except Leave as leave:
                return leave.code
            finally:
                for clock in clocks:
                    clock.cancel()

    # Where events come from

    def _read(self) -> None:
        self._take(self.input.read_keys())
        if self.input.closed:
            self._events.put_nowait(partial(self._leave, GONE))
        loop = asyncio.get_running_loop()
        self._wait_no_more()
        self._escape = loop.call_later(ESCAPE_WAIT, lambda: self._take(self.input.flush_keys()))

    def _wait_no_more(self) -> None:
        """Leaves what may be a lone Esc to who reads the keys next."""
        if self._escape:
            self._escape.cancel()

    def _take(self, presses: list[KeyPress]) -> None:
        for place, press in enumerate(presses):
            if press.key == ":":
                self._events.put_nowait(partial(self._command, presses[place + 1 :]))
                return
            if press.key not in DEAF:
                event = self._keys.get(press.key, partial(self._press, press.key))
                self._events.put_nowait(event)

    def _clocks(self) -> Iterator[Awaitable[None]]:
        screen = self.screen
        yield self._clock(
            lambda: screen.speed, screen.autoplay, lambda: screen.modes.moves is Mode.AUTO
        )
        if screen.rate:
            rate = screen.rate
            yield self._clock(lambda: rate, screen.tick, lambda: screen.held is not None)

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
                self._events.put_nowait(partial(self._beat, beat))

    @contextlib.contextmanager
    def _signals(self) -> Iterator[None]:
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
        for number, event in ((signal.SIGWINCH, self._repaint), (signal.SIGTSTP, self._suspend)):
            loop.add_signal_handler(number, self._events.put_nowait, event)
        try:
            yield
        finally:
            for number in (signal.SIGWINCH, signal.SIGTSTP):
                loop.remove_signal_handler(number)
            for number, handler in before.items():
                loop.remove_signal_handler(number)
                signal.signal(number, handler)

    # What they do

    async def _press(self, key: str) -> None:
        name = NAMES.get(key, key)
        pressed = str(getattr(name, "value", name))
        if self.screen.ponders(pressed):
            self.screen.paint(self.painter)
        self.screen.press(pressed)

    async def _beat(self, beat: Callable[[], None]) -> None:
        beat()

    async def _leave(self, code: int) -> None:
        raise Leave(code)

    async def _repaint(self) -> None:
        self.painter.forget()

    async def _command(self, ahead: list[KeyPress]) -> None:
        """Opens the command row, with what was typed ahead, and does what it says."""
        if self.screen.table.curtained:
            return
        from dmplay.screen import row  # not needed before

        self._wait_no_more()
        store_typeahead(self.input, ahead)
        with self.input.detach():
            typed = await row.ask(self.screen, self.painter, self.input, self._history)
        self.painter.forget()
        if typed is not None:
            self.screen.type(typed)
        self._take(get_typeahead(self.input))

    async def _suspend(self) -> None:
        """Stops as other programs do on Ctrl-Z, the terminal as it was meanwhile."""
        loop = asyncio.get_running_loop()
        self.painter.leave()
        loop.remove_signal_handler(signal.SIGTSTP)
        with self.input.cooked_mode():
            os.kill(0, signal.SIGTSTP)
        loop.add_signal_handler(signal.SIGTSTP, self._events.put_nowait, self._suspend)
        self.painter.enter()
        self.painter.listen()

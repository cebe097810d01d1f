"""Work on many games, done in blocks: here, in processes of this machine, or by any executor.

What comes of a game does not depend on its block, so no result depends on who did it.
"""

import math
import os
import pickle
import signal
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from functools import lru_cache
from multiprocessing import get_all_start_methods, get_context
from multiprocessing.connection import Connection
from queue import SimpleQueue
from threading import Thread
from typing import Any, Generic, Literal, NamedTuple, TypeVar

from dmplay.budget import between
from dmplay.errors import BadParameter, LostGames
from dmplay.signals import held

R = TypeVar("R")
Work = Callable[[range], R]  # what is done with the games of a block
Workers = int | Literal["auto"]
MOST = 16_384  # games of a block
PAYS = 4.0  # seconds of work left for which processes are started
TRIES = 3  # before a block is given up
SMALLER = 8  # times, at the end
AHEAD = 2  # blocks for each worker, so that none waits for the next


class _Found(NamedTuple, Generic[R]):
    """What came of a block."""

    result: R


class _Met(NamedTuple):
    """The error that the work met."""

    error: Exception


_Answer = _Found[R] | _Met


class _Blocks:
    """Games cut into blocks of a size; smaller at the end, so that all workers end together.

    But not much smaller than the size, below which a block costs more than its games; where there
    are few games, each worker has one block.
    """

    def __init__(self, games: range, size: int, workers: int) -> None:
        self.left, self.size, self.workers = games, size, workers
        self.least = min(max(size // SMALLER, 1), math.ceil(len(games) / workers))

    def next(self) -> range:
        """The next block; empty when there is none."""
        fair = math.ceil(len(self.left) / self.workers)
        many = min(self.size, max(fair, self.least))
        block, self.left = self.left[:many], self.left[many:]
        return block


def done(
    work: Work[R],
    games: range,
    *,
    size: int = MOST,
    workers: Workers = 1,
    executor: Executor | None = None,
) -> Iterator[tuple[range, R]]:
    """Each block of at most `size` games with what came of it, in any order.

    Done in this process, in so many others, or by an executor; `auto` starts others where so much
    is left that they pay. An error of the work is raised at once. What a worker takes with it when
    it dies is done again; LostGames is raised at the end for what was lost three times.
    """
    if isinstance(workers, int) and workers < 1:
        raise BadParameter(f"workers: got {workers}, expected auto, or 1 or more")
    many = cores() if workers == "auto" or (executor and workers == 1) else workers
    if executor is None and (workers == "auto" or many == 1):
        games = yield from _here(work, _Blocks(games, size, 1), auto=many > 1)
    if games:
        yield from _Crew(work, many, executor).done(_Blocks(games, size, many))


def cores() -> int:
    """The cores that this process may use."""
    able = getattr(os, "sched_getaffinity", None)
    return len(able(0)) if able else os.cpu_count() or 1


def _here(work: Work[R], blocks: _Blocks, *, auto: bool) -> Generator[tuple[range, R], None, range]:
    """The blocks one after another; returns those that are better left to processes."""
    many, started = len(blocks.left), time.monotonic()
    while block := blocks.next():
        after = many - len(blocks.left)
        with between(1 - (len(blocks.left) + len(block)) / many, after / many):
            result = work(block)
        yield block, result
        if auto and (time.monotonic() - started) / after * len(blocks.left) > PAYS:
            break
    return blocks.left


class _Crew(Generic[R]):
    """Workers, and what each of them has in hand."""

    def __init__(self, work: Work[R], workers: int, executor: Executor | None) -> None:
        try:
            self.work = pickle.dumps(work)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise BadParameter(f"a worker cannot be sent this: {error}") from None
        self.workers, self.given = workers, executor
        self.executor = executor or _started(workers)
        self.running: dict[Future[_Answer[R]], range] = {}
        self.ended: SimpleQueue[Future[_Answer[R]]] = SimpleQueue()
        self.again: list[range] = []
        self.tries: Counter[range] = Counter()
        self.lost: list[tuple[range, str]] = []

    def done(self, blocks: _Blocks) -> Iterator[tuple[range, R]]:
        """Each block with what came of it, the first to end first."""
        try:
            while self._send(blocks):
                future = self.ended.get()
                block = self.running.pop(future)
                answer = self._answer(future, block)
                if answer is None:
                    continue
                if isinstance(answer, _Met):
                    raise answer.error
                yield block, answer.result
        finally:
            with self._unbroken():
                for future in self.running:
                    future.cancel()
                if isinstance(self.executor, _Processes):
                    self._leave(self.executor)
        if self.lost:
            raise LostGames([(games.start, games.stop) for games, _ in self.lost], self.lost[0][1])

    def _unbroken(self) -> AbstractContextManager[object]:
        """Has Ctrl-C wait: it may leave a lock taken for which processes of ours would wait."""
        return held() if self.given is None else nullcontext()

    def _leave(self, processes: "_Processes") -> None:
        """Ends processes that are not to stay, or that do what nobody waits for any more."""
        if self.running or _staying.get() is None:
            processes.end(at_once=bool(self.running))

    def _send(self, blocks: _Blocks) -> bool:
        """Gives the workers what they have room for; whether any has work.

        What was lost is done alone, so that nothing else is lost with it.
        """
        room = 1 if self.again else AHEAD * self.workers
        while len(self.running) < room:
            block = self.again.pop() if self.again else blocks.next()
            if not block:
                break
            with self._unbroken():
                future = self.executor.submit(_answer, self.work, block)
                self.running[future] = block
                future.add_done_callback(self.ended.put)
        return bool(self.running)

    def _answer(self, future: Future[_Answer[R]], block: range) -> _Answer[R] | None:
        """What a worker says; None when it was lost with its block."""
        try:
            with self._unbroken():
                return future.result()
        except Exception as error:
            self.tries[block] += 1
            if self.tries[block] == TRIES:
                self.lost.append((block, str(error) or type(error).__name__))
            else:
                self.again.append(block)
            if isinstance(error, BrokenExecutor) and self.given is None and not self.running:
                self.executor = _started(self.workers, anew=True)
            return None


_staying: ContextVar[dict[int, "_Processes"] | None] = ContextVar("staying", default=None)


@contextmanager
def staying() -> Iterator[None]:
    """Has processes that are started meanwhile stay for whatever games come next, to the end."""
    pools: dict[int, _Processes] = {}
    before = _staying.set(pools)
    try:
        yield
    finally:
        _staying.reset(before)
        for pool in pools.values():
            pool.end()


def _started(workers: int, *, anew: bool = False) -> "_Processes":
    """Processes that are there, or new ones."""
    pools = _staying.get()
    if pools is None:
        return _Processes(workers)
    if anew or workers not in pools or pools[workers].ended:
        pools[workers] = _Processes(workers)
    return pools[workers]


class _Processes(ProcessPoolExecutor):
    """Processes of this machine that begin with nothing of this one, and do not outlive it."""

    def __init__(self, workers: int) -> None:
        method = "forkserver" if "forkserver" in get_all_start_methods() else "spawn"
        context = get_context(method)
        held, self._leash = context.Pipe(duplex=False)
        super().__init__(workers, context, initializer=_begun, initargs=(held,))
        self.ended = False

    def end(self, *, at_once: bool = False) -> None:
        """Lets the processes go once they are idle; or at once, whatever they do."""
        self.ended = True
        self.shutdown(wait=False, cancel_futures=True)
        if at_once:
            self._leash.close()


def _begun(leash: Connection) -> None:
    """Leaves Ctrl-C to the process that waits, and ends when that lets go."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with, args=[leash], daemon=True).start()


def _end_with(leash: Connection) -> None:
    leash.poll(None)
    os._exit(1)


def _answer(work: bytes, block: range) -> _Answer[Any]:
    """Does a block, in a worker."""
    try:
        return _Found(_made(work)(block))
    except Exception as error:
        return _Met(_sendable(error))


@lru_cache(maxsize=4)
def _made(work: bytes) -> Work[Any]:
    """The work, its problem and agents made once for all blocks of a worker."""
    made: Work[Any] = pickle.loads(work)
    return made


def _sendable(error: Exception) -> Exception:
    """An error that survives the way back, or its text."""
    try:
        again: Exception = pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return again

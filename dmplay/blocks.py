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

from dmplay.budget import scale_progress
from dmplay.errors import BadParameter, LostGames
from dmplay.signals import defer_signals

R = TypeVar("R")
BlockFunction = Callable[[range], R]  # what is done with the games of a block
WorkerCount = int | Literal["auto"]
MAX_BLOCK_EPISODES = 16_384  # games of a block
MIN_PARALLEL_SECONDS = 4.0  # seconds of work left for which processes are started
MAX_BLOCK_ATTEMPTS = 3  # before a block is given up
FINAL_BLOCK_DIVISOR = 8  # times, at the end
BLOCKS_PER_WORKER = 2  # blocks for each worker, so that none waits for the next


class _BlockResult(NamedTuple, Generic[R]):
    """What came of a block."""

    result: R


class _BlockError(NamedTuple):
    """The error that the work met."""

    error: Exception


_BlockAnswer = _BlockResult[R] | _BlockError


class _BlockQueue:
    """Games cut into blocks of a size; smaller at the end, so that all workers end together.

    But not much smaller than the size, below which a block costs more than its games; where there
    are few games, each worker has one block.
    """

    def __init__(self, episodes: range, size: int, workers: int) -> None:
        self.remaining, self.size, self.workers = episodes, size, workers
        self.min_size = min(max(size // FINAL_BLOCK_DIVISOR, 1), math.ceil(len(episodes) / workers))

    def next_block(self) -> range:
        """The next block; empty when there is none."""
        fair = math.ceil(len(self.remaining) / self.workers)
        many = min(self.size, max(fair, self.min_size))
        block, self.remaining = self.remaining[:many], self.remaining[many:]
        return block


def run_blocks(
    block_function: BlockFunction[R],
    episodes: range,
    *,
    size: int = MAX_BLOCK_EPISODES,
    workers: WorkerCount = 1,
    executor: Executor | None = None,
) -> Iterator[tuple[range, R]]:
    """Each block of at most `size` games with what came of it, in any order.

    Done in this process, in so many others, or by an executor; `auto` starts others where so much
    is left that they pay. An error of the work is raised at once. What a worker takes with it when
    it dies is done again; LostGames is raised at the end for what was lost three times.
    """
    if isinstance(workers, int) and workers < 1:
        raise BadParameter(f"workers: got {workers}, expected auto, or 1 or more")
    many = count_cores() if workers == "auto" or (executor and workers == 1) else workers
    if executor is None and (workers == "auto" or many == 1):
        episodes = yield from _run_blocks_in_process(
            block_function, _BlockQueue(episodes, size, 1), may_stop_early=many > 1
        )
    if episodes:
        yield from WorkerPool(block_function, many, executor).run_blocks(
            _BlockQueue(episodes, size, many)
        )


def count_cores() -> int:
    """The cores that this process may use."""
    able = getattr(os, "sched_getaffinity", None)
    return len(able(0)) if able else os.cpu_count() or 1


def _run_blocks_in_process(
    block_function: BlockFunction[R], blocks: _BlockQueue, *, may_stop_early: bool
) -> Generator[tuple[range, R], None, range]:
    """The blocks one after another; returns those that are better left to processes."""
    many, started = len(blocks.remaining), time.monotonic()
    while block := blocks.next_block():
        after = many - len(blocks.remaining)
        with scale_progress(1 - (len(blocks.remaining) + len(block)) / many, after / many):
            result = block_function(block)
        yield block, result
        if (
            may_stop_early
            and (time.monotonic() - started) / after * len(blocks.remaining) > MIN_PARALLEL_SECONDS
        ):
            break
    return blocks.remaining


class WorkerPool(Generic[R]):
    """Workers, and what each of them has in hand."""

    def __init__(
        self, block_function: BlockFunction[R], workers: int, executor: Executor | None
    ) -> None:
        try:
            self.pickled_function = pickle.dumps(block_function)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise BadParameter(f"a worker cannot be sent this: {error}") from None
        self.workers, self.caller_executor = workers, executor
        self.executor = executor or _get_processes(workers)
        self.running: dict[Future[_BlockAnswer[R]], range] = {}
        self.finished: SimpleQueue[Future[_BlockAnswer[R]]] = SimpleQueue()
        self.retry_blocks: list[range] = []
        self.attempts: Counter[range] = Counter()
        self.lost_blocks: list[tuple[range, str]] = []

    def run_blocks(self, blocks: _BlockQueue) -> Iterator[tuple[range, R]]:
        """Each block with what came of it, the first to end first."""
        try:
            while self._submit_blocks(blocks):
                future = self.finished.get()
                block = self.running.pop(future)
                answer = self._collect_answer(future, block)
                if answer is None:
                    continue
                if isinstance(answer, _BlockError):
                    raise answer.error
                yield block, answer.result
        finally:
            with self._defer_signals():
                for future in self.running:
                    future.cancel()
                if isinstance(self.executor, _ProcessPool):
                    self._release_processes(self.executor)
        if self.lost_blocks:
            raise LostGames(
                [(games.start, games.stop) for games, _ in self.lost_blocks], self.lost_blocks[0][1]
            )

    def _defer_signals(self) -> AbstractContextManager[object]:
        """Has Ctrl-C wait: it may leave a lock taken for which processes of ours would wait."""
        return defer_signals() if self.caller_executor is None else nullcontext()

    def _release_processes(self, processes: "_ProcessPool") -> None:
        """Ends processes that are not to stay, or that do what nobody waits for any more."""
        if self.running or _shared_pools.get() is None:
            processes.shut_down(at_once=bool(self.running))

    def _submit_blocks(self, blocks: _BlockQueue) -> bool:
        """Gives the workers what they have room for; whether any has work.

        What was lost is done alone, so that nothing else is lost with it.
        """
        room = 1 if self.retry_blocks else BLOCKS_PER_WORKER * self.workers
        while len(self.running) < room:
            block = self.retry_blocks.pop() if self.retry_blocks else blocks.next_block()
            if not block:
                break
            with self._defer_signals():
                future = self.executor.submit(_run_block_in_worker, self.pickled_function, block)
                self.running[future] = block
                future.add_done_callback(self.finished.put)
        return bool(self.running)

    def _collect_answer(
        self, future: Future[_BlockAnswer[R]], block: range
    ) -> _BlockAnswer[R] | None:
        """What a worker says; None when it was lost with its block."""
        try:
            with self._defer_signals():
                return future.result()
        except Exception as error:
            self.attempts[block] += 1
            if self.attempts[block] == MAX_BLOCK_ATTEMPTS:
                self.lost_blocks.append((block, str(error) or type(error).__name__))
            else:
                self.retry_blocks.append(block)
            if (
                isinstance(error, BrokenExecutor)
                and self.caller_executor is None
                and not self.running
            ):
                self.executor = _get_processes(self.workers, restart=True)
            return None


_shared_pools: ContextVar[dict[int, "_ProcessPool"] | None] = ContextVar("staying", default=None)


@contextmanager
def reuse_processes() -> Iterator[None]:
    """Has processes that are started meanwhile stay for whatever games come next, to the end."""
    pools: dict[int, _ProcessPool] = {}
    before = _shared_pools.set(pools)
    try:
        yield
    finally:
        _shared_pools.reset(before)
        for pool in pools.values():
            pool.shut_down()


def _get_processes(workers: int, *, restart: bool = False) -> "_ProcessPool":
    """Processes that are there, or new ones."""
    pools = _shared_pools.get()
    if pools is None:
        return _ProcessPool(workers)
    if restart or workers not in pools or pools[workers].is_shut_down:
        pools[workers] = _ProcessPool(workers)
    return pools[workers]


class _ProcessPool(ProcessPoolExecutor):
    """Processes of this machine that begin with nothing of this one, and do not outlive it."""

    def __init__(self, workers: int) -> None:
        method = "forkserver" if "forkserver" in get_all_start_methods() else "spawn"
        context = get_context(method)
        held, self._lifeline = context.Pipe(duplex=False)
        super().__init__(workers, context, initializer=_initialize_worker, initargs=(held,))
        self.is_shut_down = False

    def shut_down(self, *, at_once: bool = False) -> None:
        """Lets the processes go once they are idle; or at once, whatever they do."""
        self.is_shut_down = True
        self.shutdown(wait=False, cancel_futures=True)
        if at_once:
            self._lifeline.close()


def _initialize_worker(lifeline: Connection) -> None:
    """Leaves Ctrl-C to the process that waits, and ends when that lets go."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_exit_with_parent, args=[lifeline], daemon=True).start()


def _exit_with_parent(lifeline: Connection) -> None:
    lifeline.poll(None)
    os._exit(1)


def _run_block_in_worker(pickled_function: bytes, block: range) -> _BlockAnswer[Any]:
    """Does a block, in a worker."""
    try:
        return _BlockResult(_load_block_function(pickled_function)(block))
    except Exception as error:
        return _BlockError(_to_picklable_error(error))


@lru_cache(maxsize=4)
def _load_block_function(pickled_function: bytes) -> BlockFunction[Any]:
    """The work, its problem and agents made once for all blocks of a worker."""
    made: BlockFunction[Any] = pickle.loads(pickled_function)
    return made


def _to_picklable_error(error: Exception) -> Exception:
    """An error that survives the way back, or its text."""
    try:
        again: Exception = pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return again

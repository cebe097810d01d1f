"""Blocks of episodes run in this process, in worker processes, or by any executor.

The result of an episode does not depend on its block, so no result depends on the worker that
computed it.
"""

import math
import os
import pickle
import signal
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from functools import lru_cache
from multiprocessing import get_all_start_methods, get_context
from multiprocessing.connection import Connection
from queue import SimpleQueue
from threading import Thread
from typing import Any, Generic, Literal, NamedTuple, TypeVar

from dmplay.core.user_code_locations import check_main_guard
from dmplay.core.work_budget import scale_progress
from dmplay.errors import BadParameter, LostGames
from dmplay.terminal.signals import defer_signals

R = TypeVar("R")
BlockFunction = Callable[[range], R]  # computes the result of one block of episodes
WorkerCount = int | Literal["auto"]
MAX_BLOCK_EPISODES = 16_384  # maximum episodes of one block
# seconds of remaining work from which starting processes pays, and pays surely
MIN_REQUESTED_PARALLEL_SECONDS, MIN_PARALLEL_SECONDS = 2.0, 4.0
MAX_SINGLE_PROCESS_SECONDS = 1.0  # seconds after which requested processes are not delayed further
MAX_BLOCK_ATTEMPTS = 3  # attempts before a block is given up
# lost blocks in a row, without a finished one, after which the remaining blocks are not tried
MAX_CONSECUTIVE_LOST_BLOCKS = 5
# the first blocks for requested workers, and the last blocks, are at most this many times smaller
SMALL_BLOCK_DIVISOR = 8
BLOCKS_PER_WORKER = 2  # submitted blocks per worker, so that no worker waits for its next block


class _BlockResult(NamedTuple, Generic[R]):
    """The result of a block."""

    result: R


class _BlockError(NamedTuple):
    """The error that the block function raised."""

    error: Exception


_BlockAnswer = _BlockResult[R] | _BlockError


class _BlockQueue:
    """A queue of blocks of episodes, smaller at the end so that all workers finish together.

    Blocks do not become much smaller than `size`, because a small block costs more than its
    episodes; if there are few episodes, each worker gets one block.
    """

    def __init__(self, episodes: range, size: int, workers: int) -> None:
        self.remaining, self.size, self.workers = episodes, size, workers
        self.min_size = min(max(size // SMALL_BLOCK_DIVISOR, 1), math.ceil(len(episodes) / workers))

    def next_block(self) -> range:
        """Remove and return the next block; empty if no episodes remain."""
        even_share = math.ceil(len(self.remaining) / self.workers)
        count = min(self.size, max(even_share, self.min_size))
        block, self.remaining = self.remaining[:count], self.remaining[count:]
        return block


def run_blocks(
    block_function: BlockFunction[R],
    episodes: range,
    *,
    size: int = MAX_BLOCK_EPISODES,
    workers: WorkerCount = 1,
    executor: Executor | None = None,
) -> Iterator[tuple[range, R]]:
    """Yield each block of at most `size` episodes with its result, in any order.

    The blocks run in an executor, or in this process until so much work remains that `workers`
    processes pay; "auto" is one for each core. An error of the block function is raised at once.
    Blocks that are lost when a worker dies are run again; LostGames is raised at the end for
    blocks that were lost three times. After five such blocks in a row, it is raised at once for
    all unfinished blocks.
    """
    if isinstance(workers, int) and workers < 1:
        raise BadParameter(f"workers: got {workers}, expected auto, or 1 or more")
    worker_count = count_cores() if workers == "auto" or (executor and workers == 1) else workers
    if executor is None:
        episodes = yield from _run_blocks_in_process(
            block_function, episodes, size, worker_count, is_requested=workers != "auto"
        )
    if episodes:
        yield from WorkerPool(block_function, worker_count, executor).run_blocks(
            _BlockQueue(episodes, size, worker_count)
        )


def count_cores() -> int:
    """Return the number of CPU cores that this process may use."""
    get_affinity = getattr(os, "sched_getaffinity", None)
    return len(get_affinity(0)) if get_affinity else os.cpu_count() or 1


def _run_blocks_in_process(
    block_function: BlockFunction[R],
    episodes: range,
    size: int,
    workers: int,
    *,
    is_requested: bool,
) -> Generator[tuple[range, R], None, range]:
    """Run blocks one after another, yield their results, and return the remaining episodes.

    Episodes remain only for several workers, if the processes are running already, or if the
    estimated work pays for their start. The first blocks are small if the number of workers is
    requested, so that the other workers do not wait for them.
    """
    shared = _shared_pools.get() or _SharedPools()
    is_growing = is_requested and workers > 1
    if is_growing and workers in shared.pools:
        return episodes
    min_seconds = MIN_REQUESTED_PARALLEL_SECONDS if is_requested else MIN_PARALLEL_SECONDS
    blocks = _BlockQueue(episodes, max(size // SMALL_BLOCK_DIVISOR, 1) if is_growing else size, 1)
    total, start_time = len(episodes), time.monotonic()
    end_time = start_time
    while block := blocks.next_block():
        completed, block_start_time = total - len(blocks.remaining), time.monotonic()
        with scale_progress(1 - (len(blocks.remaining) + len(block)) / total, completed / total):
            result = block_function(block)
        end_time = time.monotonic()
        yield block, result
        seconds_left = (end_time - block_start_time) / len(block) * len(blocks.remaining)
        is_measured = blocks.size == size or end_time - start_time > MAX_SINGLE_PROCESS_SECONDS
        is_long = seconds_left + shared.single_process_seconds > min_seconds
        if workers > 1 and is_measured and is_long:
            break
        blocks.size = min(4 * blocks.size, size)
    shared.single_process_seconds += end_time - start_time
    return blocks.remaining


class WorkerPool(Generic[R]):
    """A pool of workers, and the blocks that each of them is running."""

    def __init__(
        self, block_function: BlockFunction[R], workers: int, executor: Executor | None
    ) -> None:
        try:
            self.pickled_function = pickle.dumps(block_function)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise BadParameter(
                f"cannot pickle the problem or an agent for a worker process: {error}"
            ) from None
        self.workers, self.caller_executor = workers, executor
        self.executor = executor or _get_processes(workers)
        self.running: dict[Future[_BlockAnswer[R]], range] = {}
        self.finished: SimpleQueue[Future[_BlockAnswer[R]]] = SimpleQueue()
        self.retry_blocks: list[range] = []
        self.attempts: Counter[range] = Counter()
        self.lost_blocks: list[tuple[range, str]] = []
        self.consecutive_lost_blocks = 0

    def run_blocks(self, blocks: _BlockQueue) -> Iterator[tuple[range, R]]:
        """Yield each block with its result, in the order of completion.

        Raise the error of a block at once, and LostGames at the end if blocks were lost. If every
        block is lost, as when each kills its worker, the remaining blocks are not tried.
        """
        try:
            while self._submit_blocks(blocks):
                future = self.finished.get()
                block = self.running.pop(future)
                answer = self._collect_answer(future, block)
                if answer is None:
                    if self.consecutive_lost_blocks == MAX_CONSECUTIVE_LOST_BLOCKS:
                        break
                    continue
                self.consecutive_lost_blocks = 0
                if isinstance(answer, _BlockError):
                    raise answer.error
                yield block, answer.result
        finally:
            with self._defer_signals():
                for future in self.running:
                    future.cancel()
                # Processes are reused unless they still run superfluous blocks.
                is_reused = _shared_pools.get() is not None and not self.running
                if isinstance(self.executor, _ProcessPool) and not is_reused:
                    self.executor.shut_down(at_once=bool(self.running))
        if self.lost_blocks:
            untried = [*self.running.values(), *self.retry_blocks, blocks.remaining]
            unfinished = [*(block for block, _ in self.lost_blocks), *filter(None, untried)]
            reason, count = self.lost_blocks[0][1], MAX_CONSECUTIVE_LOST_BLOCKS
            if self.consecutive_lost_blocks == count:
                reason = f"{reason.rstrip('.')}; {count} blocks in a row were lost"
            raise LostGames(_join_adjacent_blocks(unfinished), reason)

    def _defer_signals(self) -> AbstractContextManager[object]:
        """Return a context that defers signals while processes of this pool are used.

        A Ctrl-C could leave a lock taken that the processes would wait for. A caller's executor
        needs no deferral.
        """
        return defer_signals() if self.caller_executor is None else nullcontext()

    def _submit_blocks(self, blocks: _BlockQueue) -> bool:
        """Submit blocks up to the limit of running blocks; return whether any block is running.

        A block that was lost is run alone, so that no other block is lost with it.
        """
        max_running = 1 if self.retry_blocks else BLOCKS_PER_WORKER * self.workers
        while len(self.running) < max_running:
            block = self.retry_blocks.pop() if self.retry_blocks else blocks.next_block()
            if not block:
                break
            with self._defer_signals():
                future = self._submit_block(block)
                self.running[future] = block
                future.add_done_callback(self.finished.put)
        return bool(self.running)

    def _submit_block(self, block: range) -> Future[_BlockAnswer[R]]:
        """Submit a block; return a failed future if the executor accepts no more work."""
        try:
            return self.executor.submit(_run_block_in_worker, self.pickled_function, block)
        except RuntimeError as error:  # a pool whose worker died, or that was shut down
            failed_future: Future[_BlockAnswer[R]] = Future()
            failed_future.set_exception(error)
            return failed_future

    def _collect_answer(
        self, future: Future[_BlockAnswer[R]], block: range
    ) -> _BlockAnswer[R] | None:
        """Return the answer of a finished block; None if it was lost with its worker.

        A lost block is queued again, or recorded as lost after MAX_BLOCK_ATTEMPTS attempts.
        """
        try:
            with self._defer_signals():
                return future.result()
        except Exception as error:
            self.attempts[block] += 1
            if self.attempts[block] == MAX_BLOCK_ATTEMPTS:
                self.lost_blocks.append((block, str(error) or type(error).__name__))
                self.consecutive_lost_blocks += 1
            else:
                self.retry_blocks.append(block)
            is_own_pool_broken = isinstance(error, BrokenExecutor) and self.caller_executor is None
            if is_own_pool_broken and not self.running:
                self.executor = _get_processes(self.workers, restart=True)
            return None


def _join_adjacent_blocks(blocks: Iterable[range]) -> list[tuple[int, int]]:
    """Return the start and stop of each gapless sequence of blocks, in ascending order."""
    joined: list[tuple[int, int]] = []
    for block in sorted(blocks, key=lambda block: block.start):
        if joined and joined[-1][1] == block.start:
            joined[-1] = joined[-1][0], block.stop
        else:
            joined.append((block.start, block.stop))
    return joined


class _SharedPools:
    """The process pools that several runs reuse, by their number of workers."""

    def __init__(self) -> None:
        self.pools: dict[int, _ProcessPool] = {}
        self.single_process_seconds = 0.0  # of the runs that started no processes


IN_WORKER = (
    "a worker process imports a line that starts worker processes; "
    'put this line below `if __name__ == "__main__":`'
)
_is_worker = ContextVar("is_worker", default=False)  # True in a process of a pool
_shared_pools: ContextVar[_SharedPools | None] = ContextVar("shared_pools", default=None)


@contextmanager
def reuse_processes() -> Iterator[None]:
    """Run the block with worker processes that are reused by all runs within it."""
    shared = _SharedPools()
    token = _shared_pools.set(shared)
    try:
        yield
    finally:
        _shared_pools.reset(token)
        for pool in shared.pools.values():
            pool.shut_down()


def _get_processes(workers: int, *, restart: bool = False) -> "_ProcessPool":
    """Return the reused process pool for this number of workers, or a new one."""
    shared = _shared_pools.get()
    if shared is None:
        return _ProcessPool(workers)
    pools = shared.pools
    if restart or workers not in pools or pools[workers].is_shut_down:
        pools[workers] = _ProcessPool(workers)
    return pools[workers]


class _ProcessPool(ProcessPoolExecutor):
    """A pool of processes that start without this process's state and end when it ends.

    Raises BadParameter if they would run the main script again, and so start processes themselves.
    """

    def __init__(self, workers: int) -> None:
        check_main_guard()
        if _is_worker.get():
            raise BadParameter(IN_WORKER)
        method = "forkserver" if "forkserver" in get_all_start_methods() else "spawn"
        context = get_context(method)
        worker_end, self._lifeline = context.Pipe(duplex=False)
        super().__init__(workers, context, initializer=_initialize_worker, initargs=(worker_end,))
        self.is_shut_down = False

    def shut_down(self, *, at_once: bool = False) -> None:
        """Shut down the processes when they are idle, or `at_once` even while they run a block."""
        self.is_shut_down = True
        self.shutdown(wait=False, cancel_futures=True)
        if at_once:
            self._lifeline.close()


def _initialize_worker(lifeline: Connection) -> None:
    """Ignore Ctrl-C in a worker, and start the thread that ends it with its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _is_worker.set(True)
    Thread(target=_wait_for_parent_then_exit, args=[lifeline], daemon=True).start()


def _wait_for_parent_then_exit(lifeline: Connection) -> None:
    """Exit the worker process when the parent closes its end of the connection."""
    lifeline.poll(None)
    os._exit(1)


def _run_block_in_worker(pickled_function: bytes, block: range) -> _BlockAnswer[Any]:
    """Run a block in a worker and return its result or its error."""
    try:
        return _BlockResult(_load_block_function(pickled_function)(block))
    except Exception as error:
        return _BlockError(_to_picklable_error(error))


@lru_cache(maxsize=4)
def _load_block_function(pickled_function: bytes) -> BlockFunction[Any]:
    """Return the unpickled block function, cached so that a worker builds its problem only once."""
    try:
        block_function: BlockFunction[Any] = pickle.loads(pickled_function)
    except (AttributeError, ImportError) as error:  # such as a class that was defined at a prompt
        remedy = "define the problem and the agents in a file"
        raise BadParameter(f"a worker process found no code: {error}; {remedy}") from None
    return block_function


def _to_picklable_error(error: Exception) -> Exception:
    """Return an error that can be pickled, or a RuntimeError with its text."""
    try:
        unpickled: Exception = pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return unpickled

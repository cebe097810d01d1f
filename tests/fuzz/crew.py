"""Workers that try cases beside one another: a fresh one after some thousand or a fault."""

import multiprocessing
import os
import time
import warnings
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkProcess
from typing import NamedTuple

from tests.fuzz.judging import Fault
from tests.fuzz.kinds import Kind
from tests.fuzz.trial import Result, tried

FRESH = 2000  # cases of one worker
PATIENCE = 600.0  # seconds without a result until a worker hangs, on a busy machine too
FORK = multiprocessing.get_context("fork")


class Task(NamedTuple):
    """Cases of a kind for one worker, by their numbers."""

    kind: Kind
    seed: int
    numbers: range


class Worker:
    """A process that tries the cases of a task, one after the other."""

    def __init__(self, task: Task) -> None:
        self.task = task
        self.told, there = FORK.Pipe(duplex=False)
        self._process: ForkProcess = FORK.Process(target=_work, args=(task, there))
        self._process.start()
        there.close()
        self.since = time.monotonic()

    def result(self) -> Result:
        """What it tells next: what became of a case, or that it died of it."""
        self.since = time.monotonic()
        try:
            found: Result = self.told.recv()
        except EOFError:
            found = self._lost("died")
        rest = range(found.number + 1, self.task.numbers.stop)
        self.task = self.task._replace(numbers=rest)
        return found

    def hurry(self, patience: float) -> None:
        """Ends it where nothing was heard of it for so many seconds."""
        if time.monotonic() - self.since > patience:
            self._process.kill()

    def gone(self) -> None:
        """Waits for its end."""
        self._process.join()
        self.told.close()

    def _lost(self, how: str) -> Result:
        number = self.task.numbers[0]
        self._process.join()
        code = self._process.exitcode
        return Result(self.task.kind.name, number, how, (Fault(how, f"exit code {code}"),))


def results(tasks: Sequence[Task], workers: int, patience: float = PATIENCE) -> Iterator[Result]:
    """What becomes of all cases, in whatever order they are done."""
    left, busy = list(reversed(tasks)), dict[Connection, Worker]()
    while left or busy:
        while left and len(busy) < workers:
            worker = Worker(left.pop())
            busy[worker.told] = worker
        for told in wait([*busy], timeout=patience / 2):
            assert isinstance(told, Connection)
            worker = busy[told]
            found = worker.result()
            yield found
            if found.faults or not worker.task.numbers:
                worker.gone()
                del busy[told]
                if worker.task.numbers:
                    left.append(worker.task)
        for worker in busy.values():
            worker.hurry(patience)


def shared(kind: Kind, seed: int, count: int) -> Iterator[Task]:
    """So many cases of a kind, as tasks."""
    for first in range(0, count, FRESH):
        yield Task(kind, seed, range(first, min(first + FRESH, count)))


def _work(task: Task, told: Connection) -> None:
    """Is a worker, without a terminal: tries cases until one has a fault."""
    os.setsid()
    warnings.simplefilter("default")  # as the program has them
    for number in task.numbers:
        found = tried(task.kind, task.seed, number)
        told.send(found)
        if found.faults:
            return

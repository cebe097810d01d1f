"""A pool of workers that run cases; each is replaced after many cases or a fault."""

import multiprocessing
import os
import time
import warnings
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkProcess
from typing import NamedTuple

from tests.fuzz.case_kinds import Kind
from tests.fuzz.case_runner import Result, run_case
from tests.fuzz.verdicts import Fault

CASES_PER_WORKER = 2000
MAX_SILENCE_SECONDS = 600.0  # without a result before a worker is killed, on a busy machine too
FORK_CONTEXT = multiprocessing.get_context("fork")


class Task(NamedTuple):
    """A range of case numbers of one kind, for one worker."""

    kind: Kind
    seed: int
    numbers: range


class Worker:
    """A process that runs the cases of a task in order."""

    def __init__(self, task: Task) -> None:
        self.task = task
        self.results, sender = FORK_CONTEXT.Pipe(duplex=False)
        self._process: ForkProcess = FORK_CONTEXT.Process(target=_run_worker, args=(task, sender))
        self._process.start()
        sender.close()
        self.since = time.monotonic()

    def result(self) -> Result:
        """Return the next result: that of a case, or the fault that a case ended the worker."""
        self.since = time.monotonic()
        try:
            result: Result = self.results.recv()
        except EOFError:
            result = self._lost("died")
        remaining = range(result.number + 1, self.task.numbers.stop)
        self.task = self.task._replace(numbers=remaining)
        return result

    def hurry(self, patience: float) -> None:
        """Kill the worker if it has sent nothing for this many seconds."""
        if time.monotonic() - self.since > patience:
            self._process.kill()

    def gone(self) -> None:
        """Wait for the process to end, and close the pipe."""
        self._process.join()
        self.results.close()

    def _lost(self, how: str) -> Result:
        number = self.task.numbers[0]
        self._process.join()
        code = self._process.exitcode
        return Result(self.task.kind.name, number, how, (Fault(how, f"exit code {code}"),))


def run_tasks(
    tasks: Sequence[Task], workers: int, patience: float = MAX_SILENCE_SECONDS
) -> Iterator[Result]:
    """Yield the results of all cases, in the order in which they finish."""
    waiting_tasks, busy = list(reversed(tasks)), dict[Connection, Worker]()
    while waiting_tasks or busy:
        while waiting_tasks and len(busy) < workers:
            worker = Worker(waiting_tasks.pop())
            busy[worker.results] = worker
        for receiver in wait([*busy], timeout=patience / 2):
            assert isinstance(receiver, Connection)
            worker = busy[receiver]
            result = worker.result()
            yield result
            if result.faults or not worker.task.numbers:
                worker.gone()
                del busy[receiver]
                if worker.task.numbers:
                    waiting_tasks.append(worker.task)
        for worker in busy.values():
            worker.hurry(patience)


def split_into_tasks(kind: Kind, seed: int, count: int) -> Iterator[Task]:
    """Split this number of cases of a kind into tasks."""
    for first in range(0, count, CASES_PER_WORKER):
        yield Task(kind, seed, range(first, min(first + CASES_PER_WORKER, count)))


def _run_worker(task: Task, sender: Connection) -> None:
    """Run as a worker process without a terminal: run cases until one has a fault."""
    os.setsid()
    warnings.simplefilter("default")  # as in the program
    for number in task.numbers:
        result = run_case(task.kind, task.seed, number)
        sender.send(result)
        if result.faults:
            return

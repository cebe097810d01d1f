"""Execution backends that play many games: local processes, a Dask cluster, or any Executor."""

import logging
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from importlib import import_module
from typing import Any, NamedTuple

from dmplay.core.user_code_locations import describe_error_location
from dmplay.errors import BadParameter, UnknownName
from dmplay.registry.user_code import load_named_attribute
from dmplay.simulation.worker_pool import WorkerCount, count_cores, reuse_processes

DASK = "dask"
NO_WORKERS_SECONDS = 30.0  # after which games are lost if all workers of a new cluster died


class ExecutionBackend(NamedTuple):
    """A number of workers of an executor, or of this machine if the executor is None."""

    workers: WorkerCount = 1
    executor: Executor | None = None


@contextmanager
def open_execution_backend(spec: str, workers: WorkerCount = "auto") -> Iterator[ExecutionBackend]:
    """Run the block with the execution backend that `spec` names, and shut it down afterwards.

    The backend is `dask` (a new cluster on this machine), `dask:tcp://HOST:PORT`, `MODULE:FACTORY`,
    `./FILE.py:FACTORY`, or empty for processes of this machine.
    """
    name, _, address = spec.partition(":")
    if not spec:
        with reuse_processes():
            yield ExecutionBackend(workers)
    elif name == DASK:
        with _connect_dask_client(address, workers) as client:
            worker_count = sum(client.nthreads().values()) if workers == "auto" else workers
            yield ExecutionBackend(max(worker_count, 1), client.get_executor(pure=False))
    else:
        with _load_executor(spec) as executor:
            yield ExecutionBackend(workers, executor)


def _connect_dask_client(address: str, workers: WorkerCount) -> Any:
    """Return a client of the Dask cluster at `address` or, if empty, of a new local one."""
    try:
        client_class = import_module("distributed").Client
    except ImportError:
        message = "--executor dask: not installed; try: pip install 'dmplay[dask]'"
        raise BadParameter(message) from None
    try:
        if address:
            return client_class(address, timeout="10s", set_as_default=False)
        worker_count = count_cores() if workers == "auto" else workers
        timeout = {"distributed.scheduler.no-workers-timeout": f"{NO_WORKERS_SECONDS}s"}
        with import_module("dask").config.set(timeout):
            # Lost blocks are run again, and reported, by dmplay itself.
            return client_class(
                n_workers=worker_count, threads_per_worker=1, dashboard_address="127.0.0.1:0",
                scheduler_kwargs={"allowed_failures": 0}, silence_logs=logging.CRITICAL,
            )  # fmt: skip
    except (OSError, ValueError) as error:
        raise BadParameter(
            f"--executor: cannot connect to a Dask cluster at {address or 'this machine'}; {error}"
        ) from None


def _load_executor(spec: str) -> Executor:
    """Return the executor that a `MODULE:FACTORY` or `./FILE.py:FACTORY` creates."""
    try:
        factory = load_named_attribute(spec)
    except (BadParameter, UnknownName, ImportError) as error:
        if describe_error_location(error):  # raised on a line of user code
            raise
        expected = "dask, dask:tcp://HOST:PORT, MODULE:FACTORY or ./FILE.py:FACTORY"
        raise BadParameter(f"--executor: got {spec!r}, expected {expected}; {error}") from None
    if not callable(factory):
        kind = type(factory).__name__
        raise BadParameter(
            f"--executor: {spec} is a {kind}, expected a function that returns an Executor"
        )
    try:
        executor = factory()
    except TypeError as error:
        if describe_error_location(error):  # raised on a line of user code
            raise
        expected = "expected a function without parameters"
        raise BadParameter(f"--executor: {spec}: {error}; {expected}") from None
    if not isinstance(executor, Executor):
        raise BadParameter(
            f"--executor: {spec} returned a {type(executor).__name__}, expected an Executor"
        )
    return executor

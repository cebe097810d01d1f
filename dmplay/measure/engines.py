"""Engines that play many games: processes of this machine, a dask cluster, any Executor."""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from importlib import import_module
from typing import Any, NamedTuple

from dmplay.blocks import WorkerCount, count_cores, reuse_processes
from dmplay.errors import BadParameter

DASK = "dask"


class ExecutionBackend(NamedTuple):
    """Who plays: so many workers of an executor, or of this machine where there is none."""

    workers: WorkerCount = 1
    executor: Executor | None = None


@contextmanager
def open_execution_backend(spec: str, workers: WorkerCount = "auto") -> Iterator[ExecutionBackend]:
    """The engine `dask` (a cluster of this machine), `dask:tcp://HOST:PORT`, or `MODULE:FACTORY`.

    It is shut down after. Without a name it is this machine's processes.
    """
    name, _, address = spec.partition(":")
    if not spec:
        with reuse_processes():
            yield ExecutionBackend(workers)
    elif name == DASK:
        with _connect_dask_client(address, workers) as client:
            many = sum(client.nthreads().values()) if workers == "auto" else workers
            yield ExecutionBackend(max(many, 1), client.get_executor(pure=False))
    else:
        with _load_executor(spec) as executor:
            yield ExecutionBackend(workers, executor)


def _connect_dask_client(address: str, workers: WorkerCount) -> Any:
    """A client of the cluster there; without an address, of a new one on this machine."""
    try:
        make = import_module("distributed").Client
    except ImportError:
        told = "--executor dask: not installed; try: pip install 'dmplay[dask]'"
        raise BadParameter(told) from None
    try:
        if address:
            return make(address, timeout="10s", set_as_default=False)
        many = count_cores() if workers == "auto" else workers
        return make(n_workers=many, threads_per_worker=1, dashboard_address=None)
    except (OSError, ValueError) as error:
        raise BadParameter(f"--executor: no cluster at {address}; {error}") from None


def _load_executor(spec: str) -> Executor:
    """The executor that a factory makes."""
    module, _, name = spec.partition(":")
    try:
        make = getattr(import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        told = f"expected MODULE:FACTORY, dask or dask:tcp://HOST:PORT; {error}"
        raise BadParameter(f"--executor: got {spec!r}, {told}") from None
    made = make()
    if not isinstance(made, Executor):
        raise BadParameter(f"--executor: {spec} made a {type(made).__name__}, not an Executor")
    return made

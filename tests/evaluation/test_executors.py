"""Tests of execution backends: user-defined executors, and a cluster whose workers die."""

import hashlib
import os
import re
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.core.user_code_locations import describe_error_location
from dmplay.errors import BadParameter
from dmplay.evaluation import executors
from dmplay.evaluation.executors import ExecutionBackend, open_execution_backend
from dmplay.evaluation.many_games import rollout
from dmplay.simulation.rollouts import Rollout
from dmplay.simulation.worker_pool import reuse_processes, run_blocks

HEXWORLD = dmplay.load_problem("hexworld")
SEARCH_POLICIES = [dmplay.load_agent(HEXWORLD, 0, "search:simulations=20")]
RUN_ARGUMENTS = ["run", "hexworld", "--episodes", "40", "--csv"]


def hash_rollout(result: Rollout) -> str:
    """Return a hash of all bits of a rollout."""
    content = b"".join(np.ascontiguousarray(array).tobytes() for array in result)
    return hashlib.sha256(content).hexdigest()


def test_without_a_name_games_run_on_this_machine() -> None:
    with open_execution_backend("", 3) as backend:
        assert backend == ExecutionBackend(3, None)


def test_a_factory_makes_an_executor_that_is_shut_down_afterwards() -> None:
    with open_execution_backend("concurrent.futures:ThreadPoolExecutor") as (workers, executor):
        assert workers == "auto"
        assert executor
        assert executor.submit(abs, -1).result() == 1
    with pytest.raises(RuntimeError, match="after shutdown"):
        executor.submit(abs, -1)


def test_another_executor_gives_the_same_run() -> None:
    arguments = [*RUN_ARGUMENTS, "--executor", "concurrent.futures:ThreadPoolExecutor"]
    assert interpret_command(arguments) == interpret_command(RUN_ARGUMENTS)


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (
            "nothing",
            "--executor: got 'nothing', expected dask, dask:tcp://HOST:PORT, MODULE:FACTORY or",
        ),
        ("no.such:thing", "no.such:thing: no module 'no'"),
        ("./missing.py:make", "no such file: ./missing.py"),
        ("builtins:nothing", "unknown attribute 'nothing'"),
        ("builtins:dict", "--executor: builtins:dict returned a dict, expected an Executor"),
        ("string:digits", "--executor: string:digits is a str, expected a function that returns"),
        ("operator:neg", "--executor: operator:neg: .* expected a function without parameters"),
    ],
)
def test_a_bad_executor_name_gives_a_clear_error(spec: str, message: str) -> None:
    with pytest.raises(BadParameter, match=message), open_execution_backend(spec):
        pass


EXECUTOR_FILE = """
from concurrent.futures import ThreadPoolExecutor
def make(): return ThreadPoolExecutor(2)
def break_down(): return len(3)
"""
IMPORTING_FILE = "import no_such_library"


@pytest.mark.parametrize("name", ["./pool.py", "pool.py", "{folder}/pool.py", "pool"])
def test_a_factory_can_be_in_a_file_of_the_user(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    Path("pool.py").write_text(EXECUTOR_FILE)
    with open_execution_backend(f"{name.format(folder=tmp_path)}:make") as (_, executor):
        assert isinstance(executor, ThreadPoolExecutor)


@pytest.mark.parametrize(
    ("text", "location"),
    [
        (EXECUTOR_FILE, "./broken.py:4: TypeError: "),
        (IMPORTING_FILE, "./broken.py:1: ModuleNotFoundError: "),
    ],
)
def test_an_error_in_the_file_of_a_factory_keeps_its_line(
    text: str, location: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("broken.py").write_text(text)
    with (
        pytest.raises((TypeError, ImportError)) as caught,
        open_execution_backend("./broken.py:break_down"),
    ):
        pass
    assert describe_error_location(caught.value).startswith(location)


def test_the_error_for_missing_dask_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(BadParameter, match=r"try: pip install 'dmplay\[dask\]'"),
        open_execution_backend("dask"),
    ):
        pass


def _get_process_id(games: range) -> int:
    return os.getpid()


def _sleep_and_get_process_id(seconds: float, games: range) -> int:
    time.sleep(seconds * len(games))
    return os.getpid()


@pytest.mark.slow
def test_worker_processes_are_reused_for_later_blocks() -> None:
    with reuse_processes():
        first = {pid for _, pid in run_blocks(_get_process_id, range(8), size=1, workers=1)}
        sleep = partial(_sleep_and_get_process_id, 0.3)
        process_ids = [
            {pid for _, pid in run_blocks(sleep, range(count), size=1, workers=2)}
            for count in (12, 2)
        ]
    assert first == {os.getpid()}
    assert os.getpid() in process_ids[0]
    assert len(process_ids[0] - first) <= 2
    assert process_ids[1] <= process_ids[0] - first


@pytest.mark.parametrize("workers", [2, 3])
def test_games_of_a_second_are_played_without_worker_processes(workers: int) -> None:
    sleep = partial(_sleep_and_get_process_id, 0.01)
    results = [*run_blocks(sleep, range(100), size=16, workers=workers)]
    assert {pid for _, pid in results} == {os.getpid()}
    assert [game for block, _ in results for game in block] == [*range(100)]


@pytest.mark.slow
def test_worker_processes_start_while_a_requested_run_is_still_short() -> None:
    sleep = partial(_sleep_and_get_process_id, 0.05)
    results = [*run_blocks(sleep, range(200), size=1024, workers=2)]
    assert len({pid for _, pid in results}) > 1


@pytest.mark.slow
def test_short_runs_one_after_another_start_the_requested_processes() -> None:
    sleep = partial(_sleep_and_get_process_id, 0.1)
    with reuse_processes():
        process_ids = [
            {pid for _, pid in run_blocks(sleep, range(8), size=1, workers=2)} for _ in range(4)
        ]
    assert process_ids[0] == {os.getpid()}
    assert os.getpid() not in process_ids[-1]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # warnings of the killed worker
@pytest.mark.extra("dask")
def test_a_cluster_gives_the_same_games_after_a_worker_is_killed() -> None:
    expected = hash_rollout(rollout(HEXWORLD, SEARCH_POLICIES, episodes=400, seed=5))
    client = import_module("distributed").Client(
        n_workers=2, threads_per_worker=1, dashboard_address=None
    )
    killed: list[int] = []

    def kill(share: float) -> None:
        if share and not killed:
            killed.append(next(iter(client.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGKILL)

    with client:
        result = rollout(
            HEXWORLD, SEARCH_POLICIES, episodes=400, seed=5, workers=2,
            executor=client.get_executor(pure=False), progress=kill,
        )  # fmt: skip
        address = client.scheduler.address
        arguments = [*RUN_ARGUMENTS, "--executor", f"dask:{address}"]
        assert interpret_command(arguments) == interpret_command(RUN_ARGUMENTS)
    assert killed
    assert hash_rollout(result) == expected


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.extra("dask")
def test_a_missing_cluster_gives_a_clear_error() -> None:
    with (
        pytest.raises(BadParameter, match="cannot connect to a Dask cluster at no://where; "),
        open_execution_backend("dask:no://where"),
    ):
        pass


DASHBOARD_PORT = 8787  # of Dask, by default
DYING_AGENT = """
import multiprocessing, os, signal, time
import numpy as np
class Die:
    uniform_count = 1
    def __init__(self, problem, seat): pass
    def initial_memory(self, observation): return ()
    def update_memory(self, memory, percept): return ()
    def choose(self, memory, legal, u):
        if multiprocessing.parent_process():
            os.kill(os.getpid(), signal.SIGKILL)
        end = time.thread_time() + 0.002 * len(u)  # so much work that processes pay
        while time.thread_time() < end:
            pass
        return np.zeros(len(u), int)
"""


@pytest.mark.slow
@pytest.mark.extra("dask")
def test_a_cluster_without_workers_does_not_wait_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executors, "NO_WORKERS_SECONDS", 0.2)
    with executors._connect_dask_client("", 1) as client, client.cluster as cluster:
        cluster.scale(0)
        while client.nthreads():
            time.sleep(0.05)
        with pytest.raises(Exception, match="without any running workers"):
            client.submit(pow, 2, 3).result(timeout=60)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "first_lost", "exit_code"),
    [
        (["--workers", "2"], "[1-9][0-9]*", 1),
        pytest.param(["--executor", "dask", "--workers", "2"], "0", 2,
                     marks=pytest.mark.extra("dask")),
    ],
)  # fmt: skip
def test_an_agent_that_kills_every_worker_ends_the_run_with_one_line(
    engine: list[str], first_lost: str, exit_code: int, tmp_path: Path
) -> None:
    (tmp_path / "die.py").write_text(DYING_AGENT)
    arguments = ["prisoners-dilemma", "--agent", "./die.py:Die", "--vs", "grim"]
    with socket.socket() as other_cluster:
        with suppress(OSError):  # else another cluster of this machine has it
            other_cluster.bind(("", DASHBOARD_PORT))
            other_cluster.listen()
        process = subprocess.run(
            [sys.executable, "-m", "dmplay", "run", *arguments, "--episodes", "20000", *engine],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(Path(dmplay.__file__).parents[1])},
            capture_output=True,
            text=True,
            check=False,
        )
    assert (process.returncode, bool(process.stdout)) == (exit_code, exit_code == 1)
    (line,) = process.stderr.splitlines()
    assert re.match(rf"(error: )?games {first_lost} to 19999 were lost: ", line)
    assert "; 5 blocks in a row were lost" in line

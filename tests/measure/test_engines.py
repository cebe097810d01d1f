"""Engines: anything that is an Executor, and a cluster of which workers die."""

import hashlib
import os
import signal
import sys
from importlib import import_module

import numpy as np
import pytest

import dmplay
from dmplay.blocks import reuse_processes, run_blocks
from dmplay.cli.errands import interpret_command
from dmplay.errors import BadParameter
from dmplay.measure.engines import ExecutionBackend, open_execution_backend
from dmplay.rollouts import Rollout, rollout

HEX = dmplay.load_problem("hexworld")
WALKER = [dmplay.load_agent(HEX, 0, "search:simulations=20")]
RUN = ["run", "hexworld", "--episodes", "40", "--csv"]


def digest(played: Rollout) -> str:
    """What tells games from others, to the last bit."""
    whole = b"".join(np.ascontiguousarray(array).tobytes() for array in played)
    return hashlib.sha256(whole).hexdigest()


def test_without_a_name_this_machine_plays() -> None:
    with open_execution_backend("", 3) as found:
        assert found == ExecutionBackend(3, None)


def test_a_factory_makes_an_executor_that_is_shut_down_after() -> None:
    with open_execution_backend("concurrent.futures:ThreadPoolExecutor") as (workers, executor):
        assert workers == "auto"
        assert executor
        assert executor.submit(abs, -1).result() == 1
    with pytest.raises(RuntimeError, match="after shutdown"):
        executor.submit(abs, -1)


def test_a_run_by_another_engine_is_the_same_run() -> None:
    by_threads = [*RUN, "--executor", "concurrent.futures:ThreadPoolExecutor"]
    assert interpret_command(by_threads) == interpret_command(RUN)


@pytest.mark.parametrize(
    ("spec", "told"),
    [
        ("nothing", "--executor: got 'nothing', expected MODULE:FACTORY, dask or dask:tcp"),
        ("no.such:thing", "No module named 'no'"),
        ("builtins:dict", "--executor: builtins:dict made a dict, not an Executor"),
    ],
)
def test_what_is_no_engine_is_one_line(spec: str, told: str) -> None:
    with pytest.raises(BadParameter, match=told), open_execution_backend(spec):
        pass


def test_where_dask_is_not_installed_it_is_told_how_to(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(BadParameter, match=r"try: pip install 'dmplay\[dask\]'"),
        open_execution_backend("dask"),
    ):
        pass


def _process(games: range) -> int:
    return os.getpid()


@pytest.mark.slow
def test_processes_stay_for_the_games_that_come_next() -> None:
    with reuse_processes():
        first = {pid for _, pid in run_blocks(_process, range(8), size=1, workers=1)}
        known = [
            {pid for _, pid in run_blocks(_process, range(8), size=1, workers=2)} for _ in range(2)
        ]
    assert first == {os.getpid()}
    assert len(known[0] | known[1]) <= 2


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # of what a worker that is killed leaves behind
def test_a_cluster_of_which_a_worker_is_killed_plays_the_same_games() -> None:
    whole = digest(rollout(HEX, WALKER, episodes=400, seed=5))
    client = import_module("distributed").Client(
        n_workers=2, threads_per_worker=1, dashboard_address=None
    )
    killed: list[int] = []

    def kill(share: float) -> None:
        if share and not killed:
            killed.append(next(iter(client.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGKILL)

    with client:
        played = rollout(
            HEX, WALKER, episodes=400, seed=5, workers=2,
            executor=client.get_executor(pure=False), progress=kill,
        )  # fmt: skip
        address = client.scheduler.address
        words = [*RUN, "--executor", f"dask:{address}"]
        assert interpret_command(words) == interpret_command(RUN)
    assert killed
    assert digest(played) == whole


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_where_no_cluster_is_it_is_one_line() -> None:
    with (
        pytest.raises(BadParameter, match="no cluster at no://where; "),
        open_execution_backend("dask:no://where"),
    ):
        pass

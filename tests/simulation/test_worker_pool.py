"""Tests of rollouts in blocks: results do not depend on the executor, and lost blocks are run
again.
"""

import os
import platform
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import (
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
)
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.agents.random_agent import Random
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Memory
from dmplay.errors import BadParameter, LostGames, UnknownName
from dmplay.evaluation.many_games import rollout
from dmplay.simulation.rollouts import (
    Rollout,
    RolloutBlocksLost,
    RolloutInterrupted,
    RolloutSpec,
    rollout_entrants,
)
from dmplay.simulation.worker_pool import run_blocks

HEXWORLD = dmplay.load_problem("hexworld")
POLICIES = [dmplay.load_agent(HEXWORLD, 0, "optimal")]
FULL_ROLLOUT = rollout(HEXWORLD, POLICIES, episodes=200, seed=5)


class LossyExecutor(Executor):
    """An executor that loses its first blocks, or every block with one of the given games."""

    def __init__(self, first: int = 0, games: Sequence[int] = ()) -> None:
        self.left, self.games = first, games

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Run the work at once, or return a future that fails as if its worker had died."""
        future: Future[Any] = Future()
        if self.left > 0 or set(self.games) & {*args[1]}:
            self.left -= 1
            future.set_exception(BrokenExecutor("a worker went away"))
        else:
            future.set_result(fn(*args, **kwargs))
        return future


def is_same_rollout(part: Rollout, whole: Rollout, first: int = 0) -> bool:
    """Return whether a rollout equals another one from its game `first` on."""
    return all(np.array_equal(a, b[first:]) for a, b in zip(part, whole, strict=True))


@pytest.mark.parametrize("size", [1, 7, 64, 200])
def test_the_blocks_contain_each_game_once(size: int) -> None:
    results = list(run_blocks(list, range(3, 203), size=size))
    assert sorted(game for block, games in results for game in games) == [*range(3, 203)]
    assert all([*block] == games for block, games in results)
    assert max(len(block) for block, _ in results) <= size


def test_rollouts_are_bitwise_equal_with_any_executor() -> None:
    with ThreadPoolExecutor(3) as threads:
        assert is_same_rollout(
            rollout(HEXWORLD, POLICIES, episodes=200, seed=5, executor=threads), FULL_ROLLOUT
        )
    assert is_same_rollout(
        rollout(HEXWORLD, POLICIES, episodes=200, seed=5, executor=LossyExecutor()), FULL_ROLLOUT
    )
    part = rollout(HEXWORLD, POLICIES, episodes=50, first_episode=150, seed=5, workers="auto")
    assert is_same_rollout(part, FULL_ROLLOUT, first=150)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [2, 3])
def test_rollouts_are_bitwise_equal_with_worker_processes(workers: int) -> None:
    assert is_same_rollout(
        rollout(HEXWORLD, POLICIES, episodes=200, seed=5, workers=workers), FULL_ROLLOUT
    )


def test_lost_blocks_are_run_again() -> None:
    assert is_same_rollout(
        rollout(
            HEXWORLD, POLICIES, episodes=200, seed=5, workers=4, executor=LossyExecutor(first=2)
        ),
        FULL_ROLLOUT,
    )


def test_a_block_lost_three_times_is_reported_with_the_other_results() -> None:
    with pytest.raises(
        RolloutBlocksLost, match=r"games 0 to \d+ were lost: a worker went away"
    ) as caught:
        rollout(
            HEXWORLD, POLICIES, episodes=200, seed=5, workers=4, executor=LossyExecutor(games=[0])
        )
    ((first, end),) = caught.value.blocks
    assert first == 0
    (partial,), games = caught.value.partial_results
    assert is_same_rollout(partial, FULL_ROLLOUT, first=end)
    assert games.tolist() == [*range(end, 200)]


def test_a_callers_pool_whose_process_is_killed_loses_only_its_unfinished_games() -> None:
    slow_policies = [dmplay.load_agent(HEXWORLD, 0, "search:simulations=20")]
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        process_id = pool.submit(os.getpid).result()
        killed = list[int]()

        def kill_worker(share: float) -> None:
            if share and not killed:
                killed.append(process_id)
                os.kill(process_id, signal.SIGKILL)

        with pytest.raises(
            RolloutBlocksLost, match=r"games \d+ to 199 were lost: A .*process.* abruptly"
        ) as caught:
            rollout(
                HEXWORLD,
                slow_policies,
                episodes=200,
                seed=5,
                workers=4,
                executor=pool,
                progress=kill_worker,
            )
    ((first, end),) = caught.value.blocks
    (partial,), games = caught.value.partial_results
    assert end == 200
    assert games.tolist() == [*range(first)]
    whole = rollout(HEXWORLD, slow_policies, episodes=first, seed=5)
    assert is_same_rollout(partial, whole)


@pytest.mark.parametrize("blocks_before", [0, 3])
def test_a_callers_executor_that_accepts_no_more_work_loses_the_other_games(
    blocks_before: int,
) -> None:
    threads = ThreadPoolExecutor(1)
    finished = list[int]()
    if not blocks_before:
        threads.shutdown()

    def play_until_refused() -> None:
        for block, _ in run_blocks(list, range(20), size=1, executor=threads):
            finished.extend(block)
            if len(finished) == blocks_before:
                threads.shutdown()

    refusal = "cannot schedule new futures after shutdown"
    with pytest.raises(LostGames, match=rf"^games \d+ to 19 were lost: {refusal}; 5 ") as caught:
        play_until_refused()
    ((first, end),) = caught.value.blocks
    assert finished == [*range(first)]
    assert end == 20


def test_lost_blocks_that_are_not_adjacent_are_named_apart() -> None:
    with pytest.raises(LostGames, match="games 3 to 3, 5 to 6 were lost"):
        list(run_blocks(list, range(9), size=1, executor=LossyExecutor(games=(3, 5, 6))))


@pytest.mark.parametrize("first_lost", [0, 3, 500])
def test_blocks_that_are_all_lost_are_given_up_soon(first_lost: int) -> None:
    executor = LossyExecutor(games=range(first_lost, 1000))
    finished = list[int]()

    def play_until_lost() -> None:
        for block, _ in run_blocks(list, range(1000), size=1, executor=executor, workers=2):
            finished.extend(block)

    reason = "a worker went away; 5 blocks in a row were lost"
    with pytest.raises(LostGames, match=rf"^games {first_lost} to 999 were lost: {reason}$"):
        play_until_lost()
    assert finished == [*range(first_lost)]
    assert -executor.left <= 20  # attempts, of 3 for each block


def test_lost_blocks_between_finished_ones_are_all_tried() -> None:
    lost_games = [*range(0, 60, 10)]
    finished = list[int]()

    def play() -> None:
        for block, _ in run_blocks(
            list, range(60), size=1, executor=LossyExecutor(games=lost_games)
        ):
            finished.extend(block)

    with pytest.raises(
        LostGames, match=r"0 to 0, 10 to 10, .*50 to 50 were lost: a worker went away$"
    ):
        play()
    assert sorted(finished) == [game for game in range(60) if game not in lost_games]


def test_an_interrupted_rollout_returns_the_finished_games_of_all_entrants() -> None:
    def stop(share: float) -> None:
        if share > 0.4:
            raise KeyboardInterrupt

    entrants = [POLICIES, [dmplay.load_agent(HEXWORLD, 0, "random")]]
    with ThreadPoolExecutor(1) as thread, pytest.raises(RolloutInterrupted) as caught:
        rollout_entrants(HEXWORLD, entrants, RolloutSpec(range(200), None, 5, 4, thread, stop))
    (optimal, random_play), games = caught.value.partial_results
    assert 0 < len(games) < 200
    assert np.array_equal(optimal.returns, FULL_ROLLOUT.returns[games])
    assert len(random_play.returns) == len(games)


def test_an_error_in_a_block_is_raised_unchanged() -> None:
    def refuse(games: range) -> None:
        raise BadParameter("no such game")

    with pytest.raises(BadParameter, match="no such game"):
        list(run_blocks(refuse, range(9)))


def test_only_the_requested_arrays_are_returned() -> None:
    result = rollout(HEXWORLD, POLICIES, episodes=200, seed=5, keep=["returns"])
    assert np.array_equal(result.returns, FULL_ROLLOUT.returns)
    assert [len(array) for array in result] == [200, *[0] * (len(result) - 1)]
    with pytest.raises(UnknownName, match="unknown array 'return'; did you mean returns"):
        rollout(HEXWORLD, POLICIES, episodes=2, keep=["return"])


def test_a_short_rollout_skips_the_timing_probe() -> None:
    batch_sizes = list[int]()

    class Counted(Random):
        def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
            batch_sizes.append(len(u))
            return super().choose(memory, legal, u)

    shares = list[float]()
    rollout(HEXWORLD, [Counted(HEXWORLD, 0)], episodes=3, turn_limit=1, progress=shares.append)
    assert batch_sizes == [3]
    assert shares[-1] == 1.0


def test_a_busy_machine_does_not_make_blocks_smaller() -> None:
    batch_sizes = list[int]()

    class Interrupted(Random):
        """Loses the core to another program for a while in every turn of many games."""

        def initial_memory(self, observation: Array) -> Memory:
            batch_sizes.append(len(observation))
            return super().initial_memory(observation)

        def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
            if len(u) > 2:
                time.sleep(0.02)
            return super().choose(memory, legal, u)

    players = [Interrupted(HEXWORLD, 0)]
    rollout(HEXWORLD, players, episodes=1000, turn_limit=1, progress=lambda share: None)
    assert batch_sizes[-1] == 1000  # one block, after the probes


def test_a_slow_game_is_probed_a_few_times_only() -> None:
    batch_sizes = list[int]()

    class Waiting(Random):
        """Waits for another program, which takes no time of its own."""

        def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
            batch_sizes.append(len(u))
            time.sleep(0.01)
            return super().choose(memory, legal, u)

    rollout(HEXWORLD, [Waiting(HEXWORLD, 0)], episodes=9, turn_limit=1, progress=lambda share: None)
    assert batch_sizes == [1, 1, 1, 8, 9]


def test_games_with_large_memories_are_played_block_by_block() -> None:
    batch_sizes = list[int]()

    class Remembering(Random):
        def initial_memory(self, observation: Array) -> Memory:
            batch_sizes.append(len(observation))
            return (np.zeros((len(observation), 2**18)),)  # two megabytes per game

    result = rollout(HEXWORLD, [Remembering(HEXWORLD, 0)], episodes=70, turn_limit=0, seed=5)
    assert batch_sizes == [1, 32, 32, 6]
    assert is_same_rollout(
        result, rollout(HEXWORLD, [Random(HEXWORLD, 0)], episodes=70, turn_limit=0, seed=5)
    )


PAGE_FAULT_PROGRAM = """
import resource
import dmplay

hunt = dmplay.load_problem("predator-prey")
pair = [dmplay.load_agent(hunt, 0, "chase"), dmplay.load_agent(hunt, 1, "flee")]
for _ in range(2):  # the first rollout fills caches
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    dmplay.rollout(hunt, pair, episodes=10_000, turn_limit=20)
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.slow
@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="others keep what is freed their way")
def test_each_turn_reuses_the_memory_of_the_previous_turn() -> None:
    # Importing dask sets MALLOC_TRIM_THRESHOLD_, with which the allocator keeps no memory.
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")
    }
    process = subprocess.run(
        [sys.executable, "-c", PAGE_FAULT_PROGRAM], capture_output=True, check=True, env=environment
    )
    assert int(process.stdout) < 1000  # pages of 4 kB; each turn uses about 500 of them at a time


def test_progress_is_reported_and_never_decreases() -> None:
    shares: list[float] = []
    rollout(HEXWORLD, POLICIES, episodes=200, seed=5, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_games_that_end_early_count_as_finished_in_the_progress() -> None:
    shares: list[float] = []
    # at most 10,000 turns each
    rollout(HEXWORLD, POLICIES, episodes=8, seed=5, progress=shares.append)
    assert max(share for share in shares if share < 1.0) > 7 / 8


def test_zero_workers_are_refused() -> None:
    with pytest.raises(BadParameter, match="workers: got 0, expected auto, or 1 or more"):
        rollout(HEXWORLD, POLICIES, episodes=2, workers=0)


ENDLESS_PROGRAM = """
import sys
from functools import partial
from pathlib import Path
from dmplay.simulation.worker_pool import run_blocks
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Memory
from tests.support.worker_tasks import touch_process_file
if __name__ == "__main__":
    touch = partial(touch_process_file, Path(sys.argv[1]))
    list(run_blocks(touch, range(100_000), size=1, workers=2))
"""


@pytest.mark.slow
def test_workers_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    (tmp_path / "endless.py").write_text(ENDLESS_PROGRAM)
    (tmp_path / "seen").mkdir()
    command = [sys.executable, str(tmp_path / "endless.py"), str(tmp_path / "seen")]
    parent = subprocess.Popen(command, env={**os.environ, "PYTHONPATH": str(Path.cwd())})
    while len(workers := [*(tmp_path / "seen").iterdir()]) < 2:
        assert parent.poll() is None
    parent.kill()
    parent.wait()
    while any(_is_process_alive(worker.name) for worker in workers):
        pass


SLEEPING_PROGRAM = """
import signal, time
from pathlib import Path
from dmplay.simulation.worker_pool import run_blocks
def sleep(games):
    Path(f"asleep-{games.start}").touch()
    time.sleep(600 * (games.start > 0))
if __name__ == "__main__":
    # A suite in the background may hand down that interrupts are ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for block, _ in run_blocks(sleep, range(100_000), size=1, workers=2):
        print("woke", flush=True)
"""


@pytest.mark.slow
def test_busy_workers_end_at_once_after_an_interrupt(tmp_path: Path) -> None:
    (tmp_path / "asleep.py").write_text(SLEEPING_PROGRAM)
    environment = {**os.environ, "PYTHONPATH": str(Path.cwd())}
    parent = subprocess.Popen(
        [sys.executable, "asleep.py"], cwd=tmp_path, env=environment, stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )  # fmt: skip
    assert parent.stdout
    assert parent.stdout.readline() == b"woke\n"
    while len([*tmp_path.glob("asleep-*")]) < 3:
        assert parent.poll() is None
    parent.send_signal(signal.SIGINT)
    assert parent.wait(timeout=60) != 0
    parent.stdout.close()


INTERRUPTING_PROGRAM = """
import os, signal
from concurrent.futures import Future
calm = Future.add_done_callback
def rude(future, call):
    future._condition.acquire()
    os.kill(os.getpid(), signal.SIGINT)
    future._condition.release()
    calm(future, call)
Future.add_done_callback = rude
"""


@pytest.mark.slow
def test_ctrl_c_leaves_no_lock_that_blocks_the_exit(tmp_path: Path) -> None:
    (tmp_path / "asleep.py").write_text(INTERRUPTING_PROGRAM + SLEEPING_PROGRAM)
    environment = {**os.environ, "PYTHONPATH": str(Path.cwd())}
    process = subprocess.run(
        [sys.executable, "asleep.py"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        timeout=60,
        check=False,
    )
    assert process.stderr.rstrip().endswith(b"KeyboardInterrupt")


def _is_process_alive(pid: str) -> bool:
    """Return whether a process is alive and not a zombie."""
    try:
        stat = Path("/proc", pid, "stat").read_text()
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"


SCRIPT = """
import time
from dmplay.simulation.worker_pool import run_blocks

def wait(block):
    time.sleep(0.2)
    return block

def count_games():
    print(sum(len(games) for _, games in run_blocks(wait, range(16), size=1, workers=2)))

"""
GUARD = 'if __name__ == "__main__": '


@pytest.mark.parametrize(
    ("start", "output", "error"),
    [
        (GUARD + "count_games()", "16", ""),
        ("count_games()", "", "script.py:12: worker processes import this script; put this line"),
    ],
)
def test_a_script_without_a_main_guard_is_named_before_a_process_starts(
    start: str, output: str, error: str, tmp_path: Path
) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT + start)
    command = [sys.executable, str(script)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)
    assert (result.returncode, result.stdout.strip()) == (int(bool(error)), output)
    assert error in result.stderr.strip().splitlines()[-1] if error else not result.stderr


def test_a_module_that_starts_workers_when_it_is_imported_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "games.py").write_text(SCRIPT + "count_games()")
    command = [sys.executable, "-c", "import games"]
    result = subprocess.run(
        command, capture_output=True, text=True, timeout=100, check=False, cwd=tmp_path
    )
    assert "a worker process imports a line that starts" in result.stderr.splitlines()[-1]

"""Many games in blocks: the same bits whoever plays them, and what is lost is done again."""

import os
import platform
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.blocks import run_blocks
from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory
from dmplay.errors import BadParameter, UnknownName
from dmplay.policies.general import Random
from dmplay.rollouts import (
    Rollout,
    RolloutBlocksLost,
    RolloutInterrupted,
    RolloutSpec,
    rollout,
    rollout_entrants,
)

HEX = dmplay.load_problem("hexworld")
WALKER = [dmplay.load_agent(HEX, 0, "optimal")]
WHOLE = rollout(HEX, WALKER, episodes=200, seed=5)


class Losing(Executor):
    """An engine that loses the first blocks that it is sent, or any with a certain game."""

    def __init__(self, first: int = 0, game: int = -1) -> None:
        self.left, self.game = first, game

    def submit(self, fn: Callable[..., Any], /, *args: Any, **more: Any) -> Future[Any]:
        """Does the work at once, or tells that it was lost."""
        future: Future[Any] = Future()
        if self.left > 0 or self.game in args[1]:
            self.left -= 1
            future.set_exception(BrokenExecutor("a worker went away"))
        else:
            future.set_result(fn(*args, **more))
        return future


def same(one: Rollout, other: Rollout, first: int = 0) -> bool:
    """Whether all is equal from the first of the other's games on."""
    return all(np.array_equal(a, b[first:]) for a, b in zip(one, other, strict=True))


@pytest.mark.parametrize("size", [1, 7, 64, 200])
def test_the_blocks_are_all_games_once(size: int) -> None:
    found = list(run_blocks(list, range(3, 203), size=size))
    assert sorted(game for block, games in found for game in games) == [*range(3, 203)]
    assert all([*block] == games for block, games in found)
    assert max(len(block) for block, _ in found) <= size


def test_games_are_the_same_bits_by_any_engine() -> None:
    with ThreadPoolExecutor(3) as threads:
        assert same(rollout(HEX, WALKER, episodes=200, seed=5, executor=threads), WHOLE)
    assert same(rollout(HEX, WALKER, episodes=200, seed=5, executor=Losing()), WHOLE)
    part = rollout(HEX, WALKER, episodes=50, first_episode=150, seed=5, workers="auto")
    assert same(part, WHOLE, first=150)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [2, 3])
def test_games_are_the_same_bits_by_processes(workers: int) -> None:
    assert same(rollout(HEX, WALKER, episodes=200, seed=5, workers=workers), WHOLE)


def test_what_an_engine_loses_is_done_again() -> None:
    assert same(
        rollout(HEX, WALKER, episodes=200, seed=5, workers=4, executor=Losing(first=2)), WHOLE
    )


def test_what_is_lost_three_times_is_named_and_the_rest_is_told() -> None:
    with pytest.raises(
        RolloutBlocksLost, match=r"games 0 to \d+ were lost: a worker went away"
    ) as lost:
        rollout(HEX, WALKER, episodes=200, seed=5, workers=4, executor=Losing(game=0))
    ((first, end),) = lost.value.blocks
    assert first == 0
    (rest,), games = lost.value.partial_results
    assert same(rest, WHOLE, first=end)
    assert games.tolist() == [*range(end, 200)]


def test_what_was_played_before_an_interruption_is_kept_of_all_who_played() -> None:
    def stop(share: float) -> None:
        if share > 0.4:
            raise KeyboardInterrupt

    both = [WALKER, [dmplay.load_agent(HEX, 0, "random")]]
    with ThreadPoolExecutor(1) as thread, pytest.raises(RolloutInterrupted) as stopped:
        rollout_entrants(HEX, both, RolloutSpec(range(200), None, 5, 4, thread, stop))
    (one, other), games = stopped.value.partial_results
    assert 0 < len(games) < 200
    assert np.array_equal(one.returns, WHOLE.returns[games])
    assert len(other.returns) == len(games)


def test_an_error_of_the_work_is_raised_as_it_was_and_at_once() -> None:
    def refuse(games: range) -> None:
        raise BadParameter("no such game")

    with pytest.raises(BadParameter, match="no such game"):
        list(run_blocks(refuse, range(9)))


def test_only_what_is_wanted_is_kept() -> None:
    kept = rollout(HEX, WALKER, episodes=200, seed=5, keep=["returns"])
    assert np.array_equal(kept.returns, WHOLE.returns)
    assert [len(array) for array in kept] == [200, 0, 0, 0, 0, 0]
    with pytest.raises(UnknownName, match="unknown array to keep 'return'; did you mean returns"):
        rollout(HEX, WALKER, episodes=2, keep=["return"])


def test_a_few_games_are_played_without_a_trial_of_what_they_cost() -> None:
    asked = list[int]()

    class Counted(Random):
        def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
            asked.append(len(u))
            return super().choose(memory, legal, u)

    told = list[float]()
    rollout(HEX, [Counted(HEX, 0)], episodes=3, turn_limit=1, progress=told.append)
    assert asked == [3]
    assert told[-1] == 1.0


def test_games_whose_memories_would_not_fit_together_are_played_block_by_block() -> None:
    begun = list[int]()

    class Remembering(Random):
        def initial_memory(self, observation: Array) -> Memory:
            begun.append(len(observation))
            return (np.zeros((len(observation), 2**18)),)  # two megabytes a game

    found = rollout(HEX, [Remembering(HEX, 0)], episodes=70, turn_limit=0, seed=5)
    assert begun == [1, 32, 32, 6]
    assert same(found, rollout(HEX, [Random(HEX, 0)], episodes=70, turn_limit=0, seed=5))


HUNTS = """
import resource
import dmplay

hunt = dmplay.load_problem("predator-prey")
pair = [dmplay.load_agent(hunt, 0, "chase"), dmplay.load_agent(hunt, 1, "flee")]
for _ in range(2):  # what is made once is made
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    dmplay.rollout(hunt, pair, episodes=10_000, turns=20)
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.slow
@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="others keep what is freed their way")
def test_one_turn_is_played_in_the_memory_of_the_last() -> None:
    done = subprocess.run([sys.executable, "-c", HUNTS], capture_output=True, check=True)
    assert int(done.stdout) < 1000  # pages of 4 kB; each turn has some 500 at a time


def test_progress_is_told_and_never_less_than_before() -> None:
    told: list[float] = []
    rollout(HEX, WALKER, episodes=200, seed=5, progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_games_that_are_over_before_their_last_turn_are_told_as_played() -> None:
    told: list[float] = []
    rollout(HEX, WALKER, episodes=8, seed=5, progress=told.append)  # of 10,000 turns at most
    assert max(share for share in told if share < 1.0) > 7 / 8


def test_no_workers_are_refused() -> None:
    with pytest.raises(BadParameter, match="workers: got 0, expected auto, or 1 or more"):
        rollout(HEX, WALKER, episodes=2, workers=0)


ENDLESS = """
import sys
from functools import partial
from pathlib import Path
from dmplay.blocks import done
from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory
from tests.support.workers import noted
if __name__ == "__main__":
    list(done(partial(noted, Path(sys.argv[1])), range(100_000), size=1, workers=2))
"""


@pytest.mark.slow
def test_workers_do_not_outlive_who_sent_them(tmp_path: Path) -> None:
    (tmp_path / "endless.py").write_text(ENDLESS)
    (tmp_path / "seen").mkdir()
    words = [sys.executable, str(tmp_path / "endless.py"), str(tmp_path / "seen")]
    sender = subprocess.Popen(words, env={**os.environ, "PYTHONPATH": str(Path.cwd())})
    while len(workers := [*(tmp_path / "seen").iterdir()]) < 2:
        assert sender.poll() is None
    sender.kill()
    sender.wait()
    while any(_lives(worker.name) for worker in workers):
        pass


ASLEEP = """
import time
from functools import partial
from pathlib import Path
from dmplay.blocks import done
from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory
def sleep(games):
    Path(f"asleep-{games.start}").touch()
    time.sleep(600 * (games.start > 0))
if __name__ == "__main__":
    for block, _ in done(sleep, range(100_000), size=1, workers=2):
        print("woke", flush=True)
"""


@pytest.mark.slow
def test_workers_that_nobody_waits_for_any_more_end_at_once(tmp_path: Path) -> None:
    (tmp_path / "asleep.py").write_text(ASLEEP)
    world = {**os.environ, "PYTHONPATH": str(Path.cwd())}
    sender = subprocess.Popen(
        [sys.executable, "asleep.py"], cwd=tmp_path, env=world, stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )  # fmt: skip
    assert sender.stdout
    assert sender.stdout.readline() == b"woke\n"
    while len([*tmp_path.glob("asleep-*")]) < 3:
        assert sender.poll() is None
    sender.send_signal(signal.SIGINT)
    assert sender.wait(timeout=60) != 0
    sender.stdout.close()


INTERRUPTED = """
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
def test_ctrl_c_leaves_no_lock_taken_for_which_the_end_would_wait(tmp_path: Path) -> None:
    (tmp_path / "asleep.py").write_text(INTERRUPTED + ASLEEP)
    world = {**os.environ, "PYTHONPATH": str(Path.cwd())}
    found = subprocess.run(
        [sys.executable, "asleep.py"], cwd=tmp_path, env=world, capture_output=True, timeout=60,
        check=False,
    )  # fmt: skip
    assert found.stderr.rstrip().endswith(b"KeyboardInterrupt")


def _lives(pid: str) -> bool:
    """Whether a process is there, and more than a name."""
    try:
        stat = Path("/proc", pid, "stat").read_text()
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"

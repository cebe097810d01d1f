"""Measure the time per turn of the guide's bots in each language, and of a built-in agent."""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from statistics import median
from time import perf_counter

import dmplay
from dmplay.guide.topics import read_topic
from tests.support.document_examples import extract_file

TURNS = 1000
BATCH_EPISODES, BATCH_TURN_LIMIT = 100, 50  # a batch of simultaneous games
BOT_FILES = ("first.c", "first.sh")
AGENTS_BY_LANGUAGE: Mapping[str, str] = {
    "built-in": "random",
    "C": "bot:./first",
    "bash": "bot:bash first.sh",
}


def report(runs: int) -> None:
    """Print the median and 90th percentile of the time per choice, and the turns per second of a
    batch of simultaneous games.
    """
    previous_folder = Path.cwd()
    print(
        f"programs in a seat, 2048, {runs * TURNS} turns: ms a choice, 90%; turns a second at once"
    )
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for name in BOT_FILES:
            Path(name).write_text(extract_file(read_topic("bots"), name), encoding="utf-8")
        if shutil.which("cc"):
            subprocess.run(["cc", "-O2", "-o", "first", "first.c"], check=True)
        for language, name in AGENTS_BY_LANGUAGE.items():
            if language == "C" and not shutil.which("cc"):
                print("  C                       there is no compiler here")
                continue
            milliseconds = sorted(
                1000 * seconds
                for run in range(runs)
                for seconds in _measure_choice_seconds(name, run)
            )
            rate = median(_measure_turn_rate(name, run) for run in range(runs))
            percentile_90 = milliseconds[len(milliseconds) * 9 // 10]
            print(f"  {language:<24}{median(milliseconds):8.3f} {percentile_90:7.3f} {rate:10,.0f}")
        os.chdir(previous_folder)


def _measure_choice_seconds(name: str, seed: int) -> list[float]:
    """Return the seconds of each choice except the first, which starts the program."""
    problem = dmplay.load_problem("2048")
    session = dmplay.Session(
        problem, dmplay.SeededUniforms(seed), [dmplay.load_agent(problem, 0, name)]
    )
    seconds: list[float] = []
    while len(seconds) <= TURNS and not session.over:
        start_time = perf_counter()
        actions = session.fill_in_actions()
        seconds.append(perf_counter() - start_time)
        session.advance(actions)
    return seconds[1:]


def _measure_turn_rate(name: str, seed: int) -> float:
    """Return the turns per second of a batch of simultaneous games."""
    problem = dmplay.load_problem("2048")
    agents = [dmplay.load_agent(problem, 0, name)]
    start_time = perf_counter()
    result = dmplay.rollout(
        problem, agents, episodes=BATCH_EPISODES, turn_limit=BATCH_TURN_LIMIT, seed=seed
    )
    return float(result.turn_counts.sum()) / (perf_counter() - start_time)

"""What a turn of a program costs: the guide's bots in each language, beside an agent of ours."""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from statistics import median
from time import perf_counter

import dmplay
from dmplay.finding.topics import read_topic
from tests.support.blocks import file

TURNS = 1000
GAMES, LENGTH = 100, 50  # of many games at once
FILES = ("first.c", "first.sh")
BOTS: Mapping[str, str] = {"built-in": "random", "C": "bot:./first", "bash": "bot:bash first.sh"}


def report(runs: int) -> None:
    """Prints the median and the ninetieth percentile of a choice, and how many turns of many games
    are played in a second.
    """
    before = Path.cwd()
    print(
        f"programs in a seat, 2048, {runs * TURNS} turns: ms a choice, 90%; turns a second at once"
    )
    with tempfile.TemporaryDirectory() as place:
        os.chdir(place)
        for name in FILES:
            Path(name).write_text(file(read_topic("bots"), name), encoding="utf-8")
        if shutil.which("cc"):
            subprocess.run(["cc", "-O2", "-o", "first", "first.c"], check=True)
        for language, name in BOTS.items():
            if language == "C" and not shutil.which("cc"):
                print("  C                       there is no compiler here")
                continue
            spent = sorted(1000 * one for run in range(runs) for one in _choices(name, run))
            rate = median(_rate(name, run) for run in range(runs))
            most = spent[len(spent) * 9 // 10]
            print(f"  {language:<24}{median(spent):8.3f} {most:7.3f} {rate:10,.0f}")
        os.chdir(before)


def _choices(name: str, seed: int) -> list[float]:
    """Seconds of each choice but the first, which starts the program."""
    problem = dmplay.load_problem("2048")
    game = dmplay.Session(
        problem, dmplay.SeededUniforms(seed), [dmplay.load_agent(problem, 0, name)]
    )
    spent: list[float] = []
    while len(spent) <= TURNS and not game.over:
        begun = perf_counter()
        decided = game.fill_in_actions()
        spent.append(perf_counter() - begun)
        game.advance(decided)
    return spent[1:]


def _rate(name: str, seed: int) -> float:
    """Turns a second of many games at once."""
    problem = dmplay.load_problem("2048")
    agents = [dmplay.load_agent(problem, 0, name)]
    begun = perf_counter()
    played = dmplay.rollout(problem, agents, episodes=GAMES, turn_limit=LENGTH, seed=seed)
    return float(played.turn_counts.sum()) / (perf_counter() - begun)

"""Check that the program that trained the 2048 network still learns."""

import platform
import re
import shutil
import subprocess
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

import dmplay
from dmplay.problems.game_2048 import ntuple_network
from dmplay.problems.game_2048.ntuple_network import ENTRIES_PER_PATTERN, PATTERNS, STAGE_COUNT

SOURCE_PATH = Path(__file__).with_name("learn_2048.c")
COMPILER = shutil.which("cc") or ""
CAN_COMPILE = COMPILER and platform.machine() == "x86_64"


def test_the_program_and_the_search_use_the_same_patterns() -> None:
    pictures = [pattern.replace(" ", "").rstrip(".") for pattern in PATTERNS]
    (source_list,) = re.findall(
        r"PICTURES\[PATTERNS\] = (.*?);", SOURCE_PATH.read_text(), re.DOTALL
    )
    assert re.findall('"(.+?)"', source_list) == pictures


@pytest.mark.slow
@pytest.mark.skipif(not CAN_COMPILE, reason="it is written for a C compiler and processors of x86")
def test_a_few_seconds_of_learning_beat_the_corner_agent(tmp_path: Path) -> None:
    program, tables = tmp_path / "learn", tmp_path / "tables"
    warnings = ("-Wall", "-Wextra", "-Werror")
    command = [COMPILER, "-O3", "-march=native", *warnings, "-o", str(program), str(SOURCE_PATH)]
    subprocess.run([*command, "-lpthread", "-lm"], check=True)
    subprocess.run([program, tables, "1", "2", "1"], check=True)
    learned = np.fromfile(tables, np.float32).reshape(
        len(PATTERNS), STAGE_COUNT, ENTRIES_PER_PATTERN
    )
    steps = np.round(learned / ntuple_network.POINTS_PER_UNIT).astype(np.int16).transpose(1, 0, 2)
    problem = dmplay.load_problem("2048")
    with patch.object(ntuple_network, "load_pattern_tables", lambda stage: steps[stage]):
        agent = dmplay.load_agent(problem, 0, "expectimax:depth=1")
        learned_games = dmplay.rollout(problem, [agent], episodes=20, seed=1)
    corner_games = dmplay.rollout(
        problem, [dmplay.load_agent(problem, 0, "corner")], episodes=20, seed=1
    )
    assert learned_games.returns.mean() > 2 * corner_games.returns.mean()

"""Tests that invalid rewards and observations of users' problems are refused at their turn."""

from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.core.problem import Outcome, validate_outcome
from dmplay.errors import BadParameter
from tests.support.programs import run_dmplay

LINE_SOURCE = """
from dataclasses import dataclass
import numpy as np
from dmplay import Labels, Outcome, Problem

@dataclass(frozen=True)
class Line(Problem):
    actions = (Labels(("on", "back")),)
    state_count = 5
    discount: float = 0.9

    def initial_chance(self, rows):
        return ()

    def initial_states(self, rows, events):
        return np.zeros(rows, int)

    def chance(self, s, a):
        return ()

    def resolve_events(self, s, a, events):
        new = np.clip(s + 1 - 2 * a[:, 0], 0, 4)
        return Outcome(new, np.where(new == 3, REWARD, 1.0)[:, None], new)

    def terminal(self, s):
        return s == 4

    def format_state(self, s):
        return str(int(s))

    def parse_state(self, text):
        return np.array(int(text))
"""
RESOLVE_LINE = 1 + LINE_SOURCE[: LINE_SOURCE.index("    def resolve_events")].count("\n")


@pytest.fixture(params=["np.nan", "np.inf", "-np.inf", "1e300"])
def folder(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """A folder with a problem that pays such a reward in its third turn."""
    (tmp_path / "line.py").write_text(LINE_SOURCE.replace("REWARD", request.param))
    return tmp_path


def test_play_keeps_the_turns_before_and_names_the_line(folder: Path) -> None:
    played = run_dmplay(folder, "./line.py", "-o", "g.dmt", "--seed", "1", stdin="on\n" * 4)
    assert played.returncode == 2
    assert f"./line.py:{RESOLVE_LINE} resolve_events: got the reward " in played.stderr
    assert "expected a number from -1e+290 to 1e+290" in played.stderr
    assert "Traceback" not in played.stderr
    content = (folder / "g.dmt").read_text()
    assert "NaN" not in content
    assert "Infinity" not in content
    verified = run_dmplay(folder, "verify", "g.dmt", "--trust", "--allow-unfinished")
    assert "(2 turns" in verified.stdout


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "./line.py", "--agent", "script:on,on,on,on", "--episodes", "5"),
        ("solve", "./line.py"),
        ("play", "./line.py", "--agent", "script:on,on,on,on", "-o", "a.dmt"),
        ("compare", "./line.py", "random", "script:on,on,on,on", "--episodes", "5"),
    ],
    ids=lambda arguments: str(arguments[0]),
)
def test_no_command_computes_with_such_a_reward(folder: Path, arguments: tuple[str, ...]) -> None:
    done = run_dmplay(folder, *arguments)
    assert done.returncode == 2
    assert f"./line.py:{RESOLVE_LINE} resolve_events: got the reward " in done.stderr
    assert "unexpected" not in done.stderr


def test_check_still_names_the_fault(folder: Path) -> None:
    checked = run_dmplay(folder, "check", "./line.py")
    assert checked.returncode == 2
    assert f"./line.py:{RESOLVE_LINE} resolve_events: " in checked.stdout
    assert checked.stdout.splitlines()[-1].startswith("./line.py: ")


def test_the_seat_of_the_reward_is_named() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")

    def check(*rewards: list[float]) -> None:
        rows = np.array(rewards).reshape(-1, 2)
        validate_outcome(problem, Outcome(np.zeros(len(rows), int), rows, np.zeros(len(rows), int)))

    check([1.0, -1e290])
    check()
    with pytest.raises(BadParameter, match="got the reward nan of agent2"):
        check([1.0, 2.0], [0.0, np.nan])


def test_an_observation_is_the_index_of_a_label() -> None:
    baby = dmplay.load_problem("crying-baby")
    states, rewards = np.zeros(2, int), np.zeros((2, 1))
    validate_outcome(baby, Outcome(states, rewards, np.array([[0], [1]])))
    for wrong in (-1, 2):
        with pytest.raises(
            BadParameter, match=f"the observation {wrong} of agent, expected 0 to 1"
        ):
            validate_outcome(baby, Outcome(states, rewards, np.array([[0], [wrong]])))


ECHO_SOURCE = (
    LINE_SOURCE.replace("Line", "Echo")
    .replace("REWARD", "1.0")
    .replace("    state_count", '    observations = (Labels(("x",)),)\n    state_count')
    .replace("[:, None], new)", "[:, None], a)")
)


@pytest.mark.parametrize(
    "words", [("play",), ("solve",), ("run", "--agent", "script:back"), ("check",)]
)
def test_an_observation_without_a_label_is_refused_with_its_line(
    tmp_path: Path, words: tuple[str, ...]
) -> None:
    (tmp_path / "echo.py").write_text(ECHO_SOURCE)
    command, *options = words
    done = run_dmplay(tmp_path, command, "./echo.py", *options, stdin="back\n")
    assert done.returncode == 2
    assert f"./echo.py:{RESOLVE_LINE + 1} resolve_events: got the observation" in (
        done.stdout + done.stderr
    )
    assert "unexpected" not in done.stderr

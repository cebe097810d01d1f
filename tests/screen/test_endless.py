"""An agent that never answers, and does not even count its work, ends nobody's game badly."""

import json
import os
import signal
from pathlib import Path

import pytest

from tests.support.games import values, verified
from tests.support.programs import ended, started
from tests.support.terminals import CTRL_C, CTRL_D, ENTER, Terminal

pytestmark = pytest.mark.slow

AGENTS = """\
import time
from pathlib import Path

import numpy as np

from dmplay.budget import Budget


class Busy:
    uniform_count = 0

    def __init__(self, problem, seat):
        pass

    def initial_memory(self, observation):
        return ()

    def update_memory(self, memory, percept):
        return ()

    def choose(self, memory, legal, u):
        Path("asked").touch()
        self.think()

    def think(self):
        while True:
            pass

    def action_values(self, memory):
        return None


class Asleep(Busy):
    def think(self):
        time.sleep(1000)


class Deep(Busy):
    def think(self):
        budget = Budget("thought", "none", work=np.inf)
        while True:
            budget.spend(1, 0.42)
"""
ENDLESS = ("Busy", "Asleep", "Deep")
SIGNALS = [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)]
every_agent = pytest.mark.parametrize("agent", ENDLESS)
every_signal = pytest.mark.parametrize(("number", "code"), SIGNALS)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where these agents are."""
    (tmp_path / "agents.py").write_text(AGENTS)
    return tmp_path


def against(agent: str, *words: str) -> tuple[str, ...]:
    """A game with this agent in a seat."""
    game = ("prisoners-dilemma", "--vs", f"./agents.py:{agent}", "--seed", "7")
    return (*game, "-o", "game.dmt", *words)


def reason(folder: Path) -> str:
    """How the game ended, by its whole transcript."""
    path = folder / "game.dmt"
    verified(path)
    return str(json.loads(values(path, "end")[0])["reason"])


@every_agent
@every_signal
def test_a_signal_ends_a_game_while_an_agent_thinks(
    agent: str, number: int, code: int, folder: Path
) -> None:
    with Terminal(*against(agent), folder=folder) as terminal:
        terminal.ready().press("c", f"agents.py:{agent} is thinking").signal(number)
        assert terminal.ended() == code
        assert terminal.left_clean()
        assert "Traceback" not in terminal.printed
    assert reason(folder) == "interrupted"


@every_agent
def test_a_game_is_left_while_an_agent_thinks_and_what_was_typed_is_not_played(
    agent: str, folder: Path
) -> None:
    with Terminal(*against(agent), folder=folder) as terminal:
        terminal.ready().press("c", f"agents.py:{agent} is thinking").press("ddd").calm()
        assert terminal.press("q").ended() == 0
        assert terminal.left_clean()
    assert reason(folder) == "quit"
    assert values(folder / "game.dmt", "actions") == []


def test_a_move_is_cancelled_and_the_game_goes_on_and_ends_as_it_should(folder: Path) -> None:
    with Terminal(*against("Busy"), folder=folder) as terminal:
        terminal.ready().press("c", "agents.py:Busy is thinking").press(CTRL_C, "does not stop")
        terminal.press("d", "agents.py:Busy is thinking").press(CTRL_C, "does not stop")
        assert terminal.press(CTRL_C).ended() == 130
        assert terminal.left_clean()
    assert reason(folder) == "interrupted"


@every_agent
@every_signal
@pytest.mark.parametrize("words", [("--plain",), ("--json",), ("--quiet",)], ids=" ".join)
def test_a_signal_ends_a_game_in_lines_while_an_agent_thinks(
    agent: str, number: int, code: int, words: tuple[str, ...], folder: Path
) -> None:
    seats = ("--agent", "random")
    program = started(folder, *against(agent, *seats, *words))
    while not (folder / "asked").exists():
        assert program.is_alive()
        program.join(0.01)
    assert program.pid
    os.kill(program.pid, number)
    assert ended(program) == code
    assert reason(folder) == "interrupted"


def test_ctrl_c_in_the_shell_stops_an_agent_that_thinks_and_the_shell_goes_on(
    folder: Path,
) -> None:
    with Terminal("shell", folder=folder) as terminal:
        terminal.ready().press(f"play {' '.join(against('Busy'))}{ENTER}", "t0]>").calm()
        terminal.press(f"cooperate{ENTER}").until((folder / "asked").exists)
        terminal.press(CTRL_C, "interrupted.").until("t0]>").calm().press(CTRL_D)
        assert terminal.ended() == 0
    assert reason(folder) == "quit"


def test_a_problem_that_never_says_what_happens_is_left(folder: Path) -> None:
    (folder / "stuck.py").write_text(
        "from dataclasses import dataclass\n\n"
        "from dmplay.problems.hexworld import HexWorld\n\n\n"
        "@dataclass(frozen=True)\n"
        "class Stuck(HexWorld):\n"
        "    def resolve_events(self, s, a, events):\n"
        "        while len(s) == 1:\n"
        "            pass\n"
        "        return super().move(s, a, events)\n"
    )
    words = ("./stuck.py:Stuck", "--seed", "7", "-o", "game.dmt")
    with Terminal(*words, folder=folder) as terminal:
        terminal.ready().press("1").calm().press(CTRL_C)
        assert terminal.ended() == 130
        assert terminal.left_clean()

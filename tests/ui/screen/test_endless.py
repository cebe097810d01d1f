"""Tests of agents and problems that never answer: the game can still be ended cleanly."""

import json
import os
import signal
from pathlib import Path

import pytest

from tests.support.fork_server import wait_for_exit
from tests.support.games import assert_verified, read_values
from tests.support.programs import start_dmplay
from tests.support.terminals import CTRL_C, CTRL_D, ENTER, Terminal

pytestmark = pytest.mark.slow

AGENTS_SOURCE = """\
import threading
import time
from pathlib import Path

import numpy as np

from dmplay.core.work_budget import Budget


class Busy:
    uniform_count = 0

    def __init__(self, problem, seat):
        pass

    def initial_memory(self, observation):
        return ()

    def update_memory(self, memory, percept):
        return ()

    def choose(self, memory, legal, u):
        # Python can miss a signal just before a sleep, so tests send theirs after this
        threading.Timer(0.05, Path("asked").touch).start()
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
        budget = Budget("thought", "none", work_limit=np.inf)
        while True:
            budget.spend_work(1, 0.42)
"""
ENDLESS_AGENTS = ("Busy", "Asleep", "Deep")
SIGNALS_AND_CODES = [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)]
every_agent = pytest.mark.parametrize("agent", ENDLESS_AGENTS)
every_signal = pytest.mark.parametrize(("number", "code"), SIGNALS_AND_CODES)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder that contains the agents' module."""
    (tmp_path / "agents.py").write_text(AGENTS_SOURCE)
    return tmp_path


def make_arguments(agent: str, *options: str) -> tuple[str, ...]:
    """Return the arguments of a game against this agent."""
    game = ("prisoners-dilemma", "--vs", f"./agents.py:{agent}", "--seed", "7")
    return (*game, "-o", "game.dmt", *options)


def read_end_reason(folder: Path) -> str:
    """Verify the transcript and return the reason why the game ended."""
    path = folder / "game.dmt"
    assert_verified(path)
    return str(json.loads(read_values(path, "end")[0])["reason"])


@every_agent
@every_signal
def test_a_signal_ends_a_game_while_an_agent_thinks(
    agent: str, number: int, code: int, folder: Path
) -> None:
    with Terminal(*make_arguments(agent), folder=folder) as terminal:
        terminal.ready().press("c", f"agents.py:{agent} is thinking").signal(number)
        assert terminal.ended() == code
        assert terminal.left_clean()
        assert "Traceback" not in terminal.printed
    assert read_end_reason(folder) == "interrupted"


@every_agent
def test_quitting_while_an_agent_thinks_discards_the_typed_actions(
    agent: str, folder: Path
) -> None:
    with Terminal(*make_arguments(agent), folder=folder) as terminal:
        terminal.ready().press("c", f"agents.py:{agent} is thinking").press("ddd").calm()
        assert terminal.press("q").ended() == 0
        assert terminal.left_clean()
    assert read_end_reason(folder) == "quit"
    assert read_values(folder / "game.dmt", "actions") == []


def test_a_cancelled_turn_does_not_end_the_game(folder: Path) -> None:
    with Terminal(*make_arguments("Busy"), folder=folder) as terminal:
        terminal.ready().press("c", "agents.py:Busy is thinking").press(CTRL_C, "still runs")
        terminal.press("d", "agents.py:Busy is thinking").press(CTRL_C, "still runs")
        assert terminal.press(CTRL_C).ended() == 130
        assert terminal.left_clean()
    assert read_end_reason(folder) == "interrupted"


@every_agent
@every_signal
@pytest.mark.parametrize("options", [("--plain",), ("--json",), ("--quiet",)], ids=" ".join)
def test_a_signal_ends_a_plain_game_while_an_agent_thinks(
    agent: str, number: int, code: int, options: tuple[str, ...], folder: Path
) -> None:
    seats = ("--agent", "random")
    program = start_dmplay(folder, *make_arguments(agent, *seats, *options))
    while not (folder / "asked").exists():
        assert program.is_alive()
        program.join(0.01)
    assert program.pid
    os.kill(program.pid, number)
    assert wait_for_exit(program) == code
    assert read_end_reason(folder) == "interrupted"


def test_ctrl_c_in_the_shell_stops_a_thinking_agent_but_not_the_shell(folder: Path) -> None:
    with Terminal("shell", folder=folder) as terminal:
        terminal.ready().press(f"play {' '.join(make_arguments('Busy'))}{ENTER}", "t0]>").calm()
        terminal.press(f"cooperate{ENTER}").until((folder / "asked").exists)
        terminal.press(CTRL_C, "interrupted.").until("t0]>").calm().press(CTRL_D)
        assert terminal.ended() == 0
    assert read_end_reason(folder) == "quit"


def test_a_game_whose_problem_never_returns_can_be_quit(folder: Path) -> None:
    (folder / "stuck.py").write_text(
        "from dataclasses import dataclass\n\n"
        "from dmplay.problems.hexworld.rules import HexWorld\n\n\n"
        "@dataclass(frozen=True)\n"
        "class Stuck(HexWorld):\n"
        "    def resolve_events(self, s, a, events):\n"
        "        while len(s) == 1:\n"
        "            pass\n"
        "        return super().resolve_events(s, a, events)\n"
    )
    arguments = ("./stuck.py:Stuck", "--seed", "7", "-o", "game.dmt")
    with Terminal(*arguments, folder=folder) as terminal:
        terminal.ready().press("1").calm().press(CTRL_C)
        assert terminal.ended() == 130
        assert terminal.left_clean()

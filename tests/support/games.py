"""Helpers that set up, play and record games for tests in one line."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

import dmplay
from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem
from dmplay.core.session import View
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.game.transcript_verification import verify
from dmplay.transcript.reader import read_transcript


class ScriptedUniforms:
    """A source of fixed uniforms: those of nature by turn, those of each seat always one half."""

    def __init__(self, *draws: Sequence[float]) -> None:
        self.draws = draws

    def generate_uniforms(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        if stream:
            return np.full((1, count), 0.5)
        return np.array([self.draws[turn]], float)[:, :count]


def make_session(problem: str, *draws: Sequence[float], **parameters: object) -> dmplay.Session:
    """Return a game of human players on these uniforms."""
    return dmplay.Session(dmplay.load_problem(problem, **parameters), ScriptedUniforms(*draws))


def make_session_from_state(
    problem: str, state: Sequence[float], actions: Sequence[float] = (), *draws: Sequence[float]
) -> dmplay.Session:
    """Return a one-player game from this state, after these actions on these uniforms."""
    start_uniforms = [0.5] * dmplay.load_problem(problem).uniform_counts.start
    game = make_session(problem, start_uniforms, *(draws or [[]] * len(actions)))
    game.initial_state = np.array(state, float)
    for action in actions:
        game.advance([action])
    return game


def make_view_after(
    name: str, *turns: str, seat: int = 0, seed: int = 5, **parameters: object
) -> View[Problem]:
    """Return a seat's view after these turns, each a string of the agents' actions."""
    problem = dmplay.load_problem(name, **parameters)
    game = dmplay.Session(problem, dmplay.SeededUniforms(seed))
    for turn in turns:
        game.advance([problem.parse_action(i, word) for i, word in enumerate(turn.split())])
    return game.view(seat)


def play_actions(problem: Problem, game: dmplay.Session, *actions: str) -> None:
    """Play these actions in the first seat."""
    for name in actions:
        game.advance([problem.parse_action(0, name), *[None] * (len(problem.agents) - 1)])


def record_game(path: Path, problem: str, agent: str, seed: int = 7, **options: object) -> str:
    """Record a game without human players to a file; return the text of the transcript."""
    game = start_new_game(GameRequest(problem, agent=agent, seed=seed, record_path=path, **options))  # type: ignore[arg-type]
    while game.play_agent_turn():
        pass
    game.finish()
    return path.read_text()


def read_values(path: Path, key: str) -> list[str]:
    """Return the values after `key: ` in a transcript, one for each such line."""
    start = f"{key}: "
    lines = path.read_text().splitlines()
    return [line.removeprefix(start) for line in lines if line.startswith(start)]


def assert_verified(path: Path) -> Path:
    """Assert that a transcript verifies; return its path."""
    report = verify(path)
    assert report.is_ok, str(report)
    return path


def replace_in_file(path: Path, before: str, after: str) -> int:
    """Replace the only occurrence of a text in a file; return the number of its line."""
    text = path.read_text()
    assert text.count(before) == 1, f"{before!r} stands {text.count(before)} times"
    path.write_text(text.replace(before, after))
    return text[: text.index(before)].count("\n") + 1


__all__ = [
    "ScriptedUniforms",
    "assert_verified",
    "make_session",
    "make_session_from_state",
    "make_view_after",
    "play_actions",
    "read_transcript",
    "read_values",
    "record_game",
    "replace_in_file",
]

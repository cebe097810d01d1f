"""Games for tests, set up in a line."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

import dmplay
from dmplay.chance import Reals
from dmplay.core import Problem
from dmplay.game.checking import verify_file
from dmplay.game.request import GameRequest
from dmplay.game.start import start_new_game
from dmplay.session import View
from dmplay.transcript.reading import read_transcript


class Scripted:
    """Draws written down beforehand: nature by turn, each seat always one half."""

    def __init__(self, *draws: Sequence[float]) -> None:
        self.draws = draws

    def generate_uniforms(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        if stream:
            return np.full((1, count), 0.5)
        return np.array([self.draws[turn]], float)[:, :count]


def session(problem: str, *draws: Sequence[float], **parameters: object) -> dmplay.Session:
    """A game of people under these draws."""
    return dmplay.Session(dmplay.load_problem(problem, **parameters), Scripted(*draws))


def started(
    problem: str, state: Sequence[float], actions: Sequence[float] = (), *draws: Sequence[float]
) -> dmplay.Session:
    """A game of one person from this state on, after these actions under these draws, if any."""
    opening = [0.5] * dmplay.load_problem(problem).uniform_counts.start
    game = session(problem, opening, *(draws or [[]] * len(actions)))
    game.initial_state = np.array(state, float)
    for action in actions:
        game.advance([action])
    return game


def after(
    name: str, *turns: str, seat: int = 0, seed: int = 5, **parameters: object
) -> View[Problem]:
    """A seat's view after these turns, the actions of one turn with spaces between."""
    problem = dmplay.load_problem(name, **parameters)
    game = dmplay.Session(problem, dmplay.SeededUniforms(seed))
    for turn in turns:
        game.advance([problem.parse_action(i, word) for i, word in enumerate(turn.split())])
    return game.view(seat)


def play(problem: Problem, who: dmplay.Session, *actions: str) -> None:
    """Plays these actions for the first seat."""
    for name in actions:
        who.advance([problem.parse_action(0, name), *[None] * (len(problem.agents) - 1)])


def recorded(path: Path, problem: str, agent: str, seed: int = 7, **options: object) -> str:
    """Plays an unattended game into a file; its text."""
    game = start_new_game(GameRequest(problem, agent=agent, seed=seed, record_path=path, **options))  # type: ignore[arg-type]
    while game.play_agent_turn():
        pass
    game.finish()
    return path.read_text()


def values(path: Path, key: str) -> list[str]:
    """What stands after `key: ` in a transcript, line by line."""
    start = f"{key}: "
    lines = path.read_text().splitlines()
    return [line.removeprefix(start) for line in lines if line.startswith(start)]


def verified(path: Path) -> Path:
    """A transcript that holds."""
    report = verify_file(path)
    assert report.is_ok, str(report)
    return path


def altered(path: Path, before: str, after: str) -> int:
    """Replaces the one place where a text stands; the line it is on."""
    text = path.read_text()
    assert text.count(before) == 1, f"{before!r} stands {text.count(before)} times"
    path.write_text(text.replace(before, after))
    return text[: text.index(before)].count("\n") + 1


__all__ = [
    "Scripted",
    "after",
    "altered",
    "play",
    "read_transcript",
    "recorded",
    "session",
    "started",
]

"""Games that are killed: one of an agent, and one of a person who undoes turns."""

import json
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

from tests.support.games import read_values
from tests.support.programs import run_dmplay

SEED, TURNS = "7", "30"
AGENTS = {  # including hidden states, several seats and real numbers
    "2048": "corner", "crying-baby": "random", "hexworld": "random", "predator-prey": "random",
    "simple-regulator": "random", "travelers-dilemma": "random",
}  # fmt: skip
EXTRA_ARGUMENTS = {"hexworld": ("--set", "rewards=[]"), "predator-prey": ("--vs", "flee")}
UNDO_INTERVAL = 7  # turns after which a person undoes one and plays it again


class Game(NamedTuple):
    """A game of a problem whose first seat is played by an agent or a person."""

    problem: str
    by: str

    @property
    def words(self) -> tuple[str, ...]:
        """Return the arguments that start the game."""
        agent_arguments = ("--agent", AGENTS[self.problem]) if self.by == "agent" else ()
        extra_arguments = EXTRA_ARGUMENTS.get(self.problem, ())
        return (self.problem, *agent_arguments, *extra_arguments, "--seed", SEED, "--turns", TURNS)

    @property
    def actions(self) -> Sequence[str]:
        """Return the actions that a person types to play like the agent; an agent types nothing."""
        return _read_actions(self.problem) if self.by == "person" else ()

    @property
    def script(self) -> Sequence[str]:
        """Return the actions with undone turns between: a line for each block of the file."""
        lines_by_turn = [(action, "undo", action) for action in self.actions]
        return [
            line
            for number, lines in enumerate(lines_by_turn, 1)
            for line in (lines if number % UNDO_INTERVAL == 0 else lines[:1])
        ]


GAMES = [Game(problem, by) for problem in AGENTS for by in ("agent", "person")]


@cache
def play_without_kill(game: Game) -> bytes:
    """Play the whole game, and return its transcript."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "g.dmt")
        stdin = "\n".join([*game.script, ""])
        process = run_dmplay(Path(folder), *game.words, "-o", path.name, stdin=stdin)
        assert process.returncode == 0, process.stderr
        return path.read_bytes()


@cache
def _read_actions(problem: str) -> list[str]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "g.dmt")
        path.write_bytes(play_without_kill(Game(problem, "agent")))
        turns = [json.loads(line) for line in read_values(path, "actions")]
    return [str(next(iter(turn.values()))) for turn in turns]


def truncate_transcript(content: bytes, event_count: int) -> bytes:
    """Return the transcript after this number of turns and events."""
    blocks = content.split(b"\n\n")
    return b"\n\n".join([*blocks[: event_count + 2], b""])


def count_events(content: bytes) -> int:
    """Count the complete turns and events of a transcript."""
    return max(content.count(b"\n\n") - 2, 0)

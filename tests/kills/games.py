"""The games that are killed: an agent's, and a person's who takes turns back."""

import json
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

from tests.support.games import values
from tests.support.programs import run

SEED, TURNS = "7", "30"
AGENTS = {  # hidden states, several seats and real numbers among them
    "2048": "corner", "crying-baby": "random", "hexworld": "random", "predator-prey": "random",
    "simple-regulator": "random", "travelers-dilemma": "random",
}  # fmt: skip
SETTINGS = {"hexworld": ("--set", "rewards=[]"), "predator-prey": ("--vs", "flee")}
EACH = 7  # turns after which a person takes one back and plays it again


class Game(NamedTuple):
    """A game of a problem, and who plays its first seat: an agent or a person."""

    problem: str
    by: str

    @property
    def words(self) -> tuple[str, ...]:
        """What begins it."""
        who = ("--agent", AGENTS[self.problem]) if self.by == "agent" else ()
        more = SETTINGS.get(self.problem, ())
        return (self.problem, *who, *more, "--seed", SEED, "--turns", TURNS)

    @property
    def actions(self) -> Sequence[str]:
        """What a person types to play as the agent does; an agent needs no words."""
        return _actions(self.problem) if self.by == "person" else ()

    @property
    def script(self) -> Sequence[str]:
        """The same with turns taken back: a line for each block of the file."""
        again = [(action, "undo", action) for action in self.actions]
        return [
            line
            for number, lines in enumerate(again, 1)
            for line in (lines if number % EACH == 0 else lines[:1])
        ]


GAMES = [Game(problem, by) for problem in AGENTS for by in ("agent", "person")]


@cache
def unbroken(game: Game) -> bytes:
    """The bytes of the whole game."""
    with tempfile.TemporaryDirectory() as place:
        path = Path(place, "g.dmt")
        typed = "\n".join([*game.script, ""])
        done = run(Path(place), *game.words, "-o", path.name, stdin=typed)
        assert done.returncode == 0, done.stderr
        return path.read_bytes()


@cache
def _actions(problem: str) -> list[str]:
    with tempfile.TemporaryDirectory() as place:
        path = Path(place, "g.dmt")
        path.write_bytes(unbroken(Game(problem, "agent")))
        turns = [json.loads(line) for line in values(path, "actions")]
    return [str(next(iter(turn.values()))) for turn in turns]


def begun(content: bytes, events: int) -> bytes:
    """The file as it is after so many turns and events."""
    blocks = content.split(b"\n\n")
    return b"\n\n".join([*blocks[: events + 2], b""])


def events(content: bytes) -> int:
    """The turns and events that stand whole in a file."""
    return max(content.count(b"\n\n") - 2, 0)

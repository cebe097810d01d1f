"""Problems of other libraries, put through all that a game goes through."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

import dmplay
from dmplay.errors import BadParameter, UnknownName
from dmplay.game.checking import check
from dmplay.game.request import Request
from dmplay.game.start import new
from dmplay.rollouts import rollout

SEED = 3


class Tried(NamedTuple):
    """What came of a problem: how many turns were played, or why it does not play."""

    name: str
    turns: int
    refused: str = ""


def tried(name: str, path: Path, turns: int) -> Tried:
    """A game of agents that is recorded, partly taken back, gone on with and verified.

    One that is refused is refused in one line.
    """
    try:
        problem = dmplay.load(name)
    except (BadParameter, UnknownName) as error:
        return Tried(name, 0, str(error))
    game = new(
        Request(
            name,
            agent="random",
            others=_others(problem),
            seed=SEED,
            turns=turns,
            record=path,
            force=True,
        )
    )
    for _ in game.run():
        pass
    session = game.session
    played, told = [*session.turns], [session.returns(), session.totals()]
    undone = min(2, len(played))
    game.undo(undone)
    while game.unattended():
        pass
    game.finish()
    for one, again in zip(played, session.turns, strict=True):
        assert all(map(np.array_equal, one, again)), name
    report = check(path, trusted=True)
    assert report.ok, f"{name}: {report}"
    assert not report.altered
    assert report.turns == len(played)
    many = rollout(
        problem,
        [dmplay.agent(problem, n, "random") for n in range(len(game.seats))],
        episodes=2,
        turns=turns,
        seed=SEED,
    )
    assert many.turns[0] == len(played), name
    assert np.allclose([many.returns[0], many.totals[0]], told), name
    return Tried(name, len(played))


def _others(problem: dmplay.Problem) -> str:
    return "random" if len(problem.agents) > 1 else ""

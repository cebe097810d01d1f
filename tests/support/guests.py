"""Problems of other libraries, put through all that a game goes through."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

import dmplay
from dmplay.errors import BadParameter, UnknownName
from dmplay.game.checking import verify_file
from dmplay.game.request import GameRequest
from dmplay.game.start import start_new_game
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
        problem = dmplay.load_problem(name)
    except (BadParameter, UnknownName) as error:
        return Tried(name, 0, str(error))
    game = start_new_game(
        GameRequest(
            name,
            agent="random",
            other_agent=_others(problem),
            seed=SEED,
            turns=turns,
            record_path=path,
            force=True,
        )
    )
    for _ in game.iter_agent_turns():
        pass
    session = game.session
    played, told = [*session.turns], [session.returns(), session.total_rewards()]
    undone = min(2, len(played))
    game.undo(undone)
    while game.play_agent_turn():
        pass
    game.finish()
    for one, again in zip(played, session.turns, strict=True):
        assert all(map(np.array_equal, one, again)), name
    report = verify_file(path, trusted=True)
    assert report.is_ok, f"{name}: {report}"
    assert not report.problem_change
    assert report.turns == len(played)
    many = rollout(
        problem,
        [dmplay.load_agent(problem, n, "random") for n in range(len(game.player_names))],
        episodes=2,
        turn_limit=turns,
        seed=SEED,
    )
    assert many.turn_counts[0] == len(played), name
    assert np.allclose([many.returns[0], many.total_rewards[0]], told), name
    return Tried(name, len(played))


def _others(problem: dmplay.Problem) -> str:
    return "random" if len(problem.agents) > 1 else ""

"""Check external problems by all steps of a game: play, record, undo, verify, roll out."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

import dmplay
from dmplay.errors import BadParameter, UnknownName
from dmplay.evaluation.many_games import rollout
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.game.transcript_verification import verify

SEED = 3


class ExternalProblemResult(NamedTuple):
    """The result of a check: the number of turns played, or the error that prevents play."""

    name: str
    turns: int
    refused: str = ""


def check_external_problem(name: str, path: Path, turns: int) -> ExternalProblemResult:
    """Record a game of agents with undone turns, verify it and compare it with a rollout.

    A problem that cannot be loaded yields its error message, of one line.
    """
    try:
        problem = dmplay.load_problem(name)
    except (BadParameter, UnknownName) as error:
        return ExternalProblemResult(name, 0, str(error))
    game = start_new_game(
        GameRequest(
            name,
            agent="random",
            other_agent=_choose_other_agent(problem),
            seed=SEED,
            turns=turns,
            record_path=path,
            force=True,
        )
    )
    for _ in game.iter_agent_turns():
        pass
    session = game.session
    played_turns, expected_returns = [*session.turns], [session.returns(), session.total_rewards()]
    undo_count = min(2, len(played_turns))
    game.undo(undo_count)
    while game.play_agent_turn():
        pass
    game.finish()
    for turn, replayed_turn in zip(played_turns, session.turns, strict=True):
        assert all(map(np.array_equal, turn[:5], replayed_turn[:5])), name
    report = verify(path, trusted=True)
    assert report.is_ok, f"{name}: {report}"
    assert not report.problem_change
    assert report.turns == len(played_turns)
    batch = rollout(
        problem,
        [dmplay.load_agent(problem, n, "random") for n in range(len(game.player_names))],
        episodes=2,
        turn_limit=turns,
        seed=SEED,
    )
    assert batch.turn_counts[0] == len(played_turns), name
    assert np.allclose([batch.returns[0], batch.total_rewards[0]], expected_returns), name
    return ExternalProblemResult(name, len(played_turns))


def _choose_other_agent(problem: dmplay.Problem) -> str:
    return "random" if len(problem.agents) > 1 else ""

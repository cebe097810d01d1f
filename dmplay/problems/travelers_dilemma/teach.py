"""Rules of thumb of the traveler's dilemma, and the games of its puzzles."""

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.game.position import Position
from dmplay.game.rules_of_thumb import MIN_PROBABILITY_DIFFERENCE, RuleOfThumb, get_last_actions
from dmplay.registry import agents
from dmplay.tutor.puzzle_mining import GameSetup


def _undercut_last_claim(position: Position) -> int | None:
    """Choose the claim below the other agent's last one, if there is one."""
    last = get_last_actions(position)
    return last[1] - 1 if last is not None and last[1] else None


def _play_pure_equilibrium(position: Position) -> int | None:
    """Choose the action of the Nash equilibrium, if it is not mixed."""
    nash = agents.load_agent(position.problem, position.seat, "nash")
    assert isinstance(nash, SeatPolicy)
    probabilities = nash.choice_probabilities(nash.initial_memory(position.state[None]))
    assert probabilities is not None
    is_mixed = probabilities.max() < 1.0 - MIN_PROBABILITY_DIFFERENCE
    return None if is_mixed else int(np.argmax(probabilities))


RULES_OF_THUMB = [
    RuleOfThumb("claim one less than the other's last claim", _undercut_last_claim),
    RuleOfThumb("claim the highest amount", lambda _: "100"),
    RuleOfThumb(
        "play the Nash equilibrium, from which no agent gains by a change of its own",
        _play_pure_equilibrium,
    ),
]
PUZZLE_GAMES = [
    GameSetup({"agent2": name}) for name in ("level-k", "level-k:level=1", "claim:claim=90", "nash")
]
PUZZLE_DAY = 8

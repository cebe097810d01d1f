"""Reasons for a claim, rules of thumb of the traveler's dilemma, and the games of its puzzles."""

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.game.position import Position
from dmplay.game.rules_of_thumb import MIN_PROBABILITY_DIFFERENCE, RuleOfThumb, get_last_actions
from dmplay.registry import agents
from dmplay.tutor.puzzle_mining import GameSetup

from .rules import BONUS_DOLLARS, MAX_CLAIM, MIN_CLAIM


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


def give_reasons(position: Position, action: int) -> list[str]:
    """Return the chances that the other's claim is lower, equal or higher, and the payments.

    They are those of this round. Return [] if nothing predicts the other agent.
    """
    parts = position.break_down(action)
    if parts is None or parts.replies is None:
        return []
    other, claim = position.problem.agents[1 - position.seat], MIN_CLAIM + action

    def sum_chances(first: int, end: int | None = None) -> str:
        """Return the probability of the replies from `first` up to `end`."""
        assert parts is not None
        assert parts.replies is not None
        return f"{parts.replies[first:end].sum():.2f}"

    lower, equal, higher = (
        sum_chances(*ends) for ends in ((0, action), (action, action + 1), (action + 1,))
    )
    reasons = [
        f"{other[:1].upper()}{other[1:]} now claims less than {claim} with probability {lower}, "
        f"{claim} with {equal} and more with {higher}.",
        f"{claim} gets you {claim + BONUS_DOLLARS} if {other} claims more, {claim} if the same, "
        f"else {BONUS_DOLLARS} less than it claims.",
    ]
    if claim < MAX_CLAIM:
        reasons.append(
            f"{claim + 1} gets 1 more if {other} claims more than {claim + 1} (probability "
            f"{sum_chances(action + 2)}), {BONUS_DOLLARS - 1} less if {claim + 1} "
            f"({sum_chances(action + 1, action + 2)}), {BONUS_DOLLARS} less if {claim} ({equal}), "
            "else as much."
        )
    return reasons


REASONS = give_reasons
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

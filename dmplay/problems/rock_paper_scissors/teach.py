"""Reasons for an action of rock-paper-scissors, rules of thumb, and the games of its puzzles."""

import numpy as np

from dmplay.core.text import join_words
from dmplay.game.position import Position
from dmplay.game.rules_of_thumb import MIN_PROBABILITY_DIFFERENCE, REPLY_TO_COUNTS, REPLY_TO_LAST
from dmplay.tutor.puzzle_mining import GameSetup

from .rules import RockPaperScissors


def give_reasons(position: Position, action: int) -> list[str]:
    """Return the other agent's expected action, and the player's counts if these explain it."""
    parts = position.break_down(action)
    if parts is None or parts.replies is None:
        return []
    other, problem, reply = 1 - position.seat, position.problem, int(parts.replies.argmax())
    assert isinstance(problem, RockPaperScissors)
    name, chance = problem.format_action(other, reply), float(parts.replies[reply])
    agent = problem.agents[other]
    agent = f"{agent[:1].upper()}{agent[1:]}"
    if np.ptp(parts.replies) < MIN_PROBABILITY_DIFFERENCE:
        return [f"{agent} is expected to choose each action with the same probability."]
    sure = "" if chance > 1.0 - MIN_PROBABILITY_DIFFERENCE else f" with probability {chance:.2f}"
    reasons = [f"{agent} is expected to choose {name} now{sure}."]
    own_actions = [int(actions[position.seat]) for actions in position.view.joint_actions or ()]
    counts = np.bincount(own_actions, minlength=len(position.labels))
    pays = np.moveaxis(problem.payoffs[..., other], position.seat, 0).T @ counts
    if counts.any() and pays[reply] == pays.max():
        pairs = zip(position.labels, counts, strict=True)
        used = join_words([f"{label} {count}" for label, count in pairs])
        reasons.append(f"So far you used {used} times; against all of these, {name} does best.")
    return reasons


REASONS = give_reasons
RULES_OF_THUMB = [REPLY_TO_COUNTS, REPLY_TO_LAST._replace(text="beat the other's last action")]
PUZZLE_GAMES = [GameSetup({"agent2": name}) for name in ("beat-last", "frequency")]
PUZZLE_DAY = 6

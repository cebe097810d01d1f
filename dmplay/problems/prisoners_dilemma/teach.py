"""Rules of thumb of the prisoner's dilemma, and the games of its puzzles."""

from dmplay.game.position import Position
from dmplay.game.rules_of_thumb import RuleOfThumb, get_last_actions
from dmplay.tutor.puzzle_mining import GameSetup


def _copy_last_action(position: Position) -> int | None:
    """Choose the other agent's last action; None in the first round."""
    last = get_last_actions(position)
    return None if last is None else last[1]


def _win_stay_lose_shift(position: Position) -> int | None:
    """Repeat the last action if the other agent cooperated, else change it."""
    last = get_last_actions(position)
    if last is None:
        return None
    has_cooperated = position.labels[last[1]] == "cooperate"
    return last[0] if has_cooperated else 1 - last[0]


RULES_OF_THUMB = [
    RuleOfThumb("do what the other did last", _copy_last_action),
    RuleOfThumb(
        "repeat your last action if the other cooperated, else change it (win-stay, lose-shift)",
        _win_stay_lose_shift,
    ),
    RuleOfThumb("cooperate, whatever the other does", lambda _: "cooperate"),
    RuleOfThumb("defect, as it pays more in each single round", lambda _: "defect"),
]
PUZZLE_GAMES = [
    GameSetup({"agent2": name})
    for name in (
        "tit-for-tat", "grim", "tit-for-two-tats", "win-stay-lose-shift", "two-tits-for-tat",
        "majority", "suspicious-tit-for-tat",
    )
]  # fmt: skip
PUZZLE_DAY = 4

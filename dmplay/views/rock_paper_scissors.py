"""How rock-paper-scissors looks: figure F.15 with the last play."""

from dmplay.views._payoffs import boards, panel, situation, told

KEYS = {"r": "rock", "p": "paper", "s": "scissors"}

__all__ = ["KEYS", "boards", "panel", "situation", "told"]

"""How the prisoner's dilemma looks: figure F.14 with the last play."""

from dmplay.views._payoffs import boards, panel, situation, told

KEYS = {"c": "cooperate", "d": "defect"}

__all__ = ["KEYS", "boards", "panel", "situation", "told"]

"""How the prisoner's dilemma looks: figure F.14 with the last play."""

from dmplay.problems.prisoners_dilemma import PrisonersDilemma
from dmplay.session import View
from dmplay.views._payoffs import boards, panel, situation, told

KEYS = {"c": "cooperate", "d": "defect"}


def goal(view: View[PrisonersDilemma]) -> list[str]:
    """What each choice pays, as the other chooses."""
    (cc, cd), (dc, dd) = view.problem.payoffs[:, :, 0]
    return [
        f"cooperate pays {cc:g} or {cd:g}, defect pays {dc:g} or {dd:g}",
        "as the other cooperates or defects",
        "both choose at once",
    ]


__all__ = ["KEYS", "boards", "goal", "panel", "situation", "told"]

"""How the baby of two caregivers looks: what one of them heard, and what it may believe alone."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.problems.multicaregiver_crying_baby import MulticaregiverCryingBaby
from dmplay.session import View
from dmplay.views import crying_baby
from dmplay.views.crying_baby import KEYS, goal, lesson, panel, told
from dmplay.views.style import Look


def partner(view: View[MulticaregiverCryingBaby]) -> str:
    """The name of the other caregiver."""
    return view.problem.agents[1 - view.seat]


def boards(view: View[MulticaregiverCryingBaby], look: Look) -> Iterator[Text]:
    """As for one caregiver, with what the belief takes the other to do."""
    note = f"{partner(view)} is unseen: believed to act at random"
    if len(note) > look.width:
        note = f"{partner(view)}: believed to act at random"
    for drawn in crying_baby.boards(view, look):
        yield drawn.copy().append(f"\n{note}", "dim")
        yield drawn


def situation(view: View[MulticaregiverCryingBaby]) -> str:
    """The last observation, the belief, and what it rests on."""
    words = crying_baby.situation(view)
    return f"{words} {partner(view)} is unseen and believed to act uniformly at random."


FAMILY = "crying-baby"

__all__ = ["FAMILY", "KEYS", "boards", "goal", "lesson", "panel", "situation", "told"]

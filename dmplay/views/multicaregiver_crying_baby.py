"""How the baby of two caregivers looks: what one of them heard, and what it may believe alone."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.problems.multicaregiver_crying_baby import MulticaregiverCryingBaby
from dmplay.session import View
from dmplay.views import crying_baby
from dmplay.views.crying_baby import KEYS, describe_turn, goal_lines, lesson, panel_rows
from dmplay.views.style import DrawOptions


def get_partner_name(view: View[MulticaregiverCryingBaby]) -> str:
    """The name of the other caregiver."""
    return view.problem.agents[1 - view.seat]


def iter_boards(view: View[MulticaregiverCryingBaby], options: DrawOptions) -> Iterator[Text]:
    """As for one caregiver, with what the belief takes the other to do."""
    note = f"{get_partner_name(view)} is unseen: believed to act at random"
    if len(note) > options.width:
        note = f"{get_partner_name(view)}: believed to act at random"
    for drawn in crying_baby.iter_boards(view, options):
        yield drawn.copy().append(f"\n{note}", "dim")
        yield drawn


def describe_situation(view: View[MulticaregiverCryingBaby]) -> str:
    """The last observation, the belief, and what it rests on."""
    words = crying_baby.describe_situation(view)
    return f"{words} {get_partner_name(view)} is unseen and believed to act uniformly at random."


KEY_FAMILY = "crying-baby"

__all__ = [
    "KEYS",
    "KEY_FAMILY",
    "describe_situation",
    "describe_turn",
    "goal_lines",
    "iter_boards",
    "lesson",
    "panel_rows",
]

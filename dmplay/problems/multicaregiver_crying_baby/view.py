"""The view of the crying baby with two caregivers: one caregiver's observations and belief."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.core.session import View
from dmplay.draw.options import DrawOptions
from dmplay.problems.crying_baby import view as crying_baby

from .rules import MulticaregiverCryingBaby

KEY_FAMILY, KEYS, HIDDEN_FACT = "crying-baby", crying_baby.KEYS, crying_baby.HIDDEN_FACT
goal_lines, lesson, panel_rows = crying_baby.goal_lines, crying_baby.lesson, crying_baby.panel_rows
describe_end = crying_baby.describe_end


def iter_boards(view: View[MulticaregiverCryingBaby], options: DrawOptions) -> Iterator[Text]:
    """Yield each board for one caregiver with a note about the other caregiver, then without it.

    The note names the policy of the other caregiver that the belief takes into account, or says
    that the belief assumes a random one; then it names the policy that a forecast assumes, if that
    is another one. Without a belief, there is no note.
    """
    if view.beliefs is None:
        yield from crying_baby.iter_boards(view, options)
        return
    name = view.problem.agents[1 - view.seat]
    assumption = options.forecast.other_players if options.forecast else ""
    note = f"bars: your belief, computed as if {name} acted at random"
    short_note = f"belief as if {name} acted at random"
    if view.known_partner:
        note = f"bars: your belief; {name} plays {view.known_partner}"
        short_note = f"{name} plays {view.known_partner}"
    elif assumption.startswith("if "):
        policy = assumption.removeprefix("if ")
        note = f"bars: {name} acts at random; forecast: {policy}"
        short_note = f"bars assume a random {name}"
    if len(note) > options.width:
        note = short_note
    for board in crying_baby.iter_boards(view, options):
        yield board.copy().append(f"\n{note}", "dim")
        yield board


def describe_turn(view: View[MulticaregiverCryingBaby]) -> str:
    """Return a description of the last turn; the first one says that the partner's is hidden."""
    text = crying_baby.describe_turn(view)
    partner = view.problem.agents[1 - view.seat]
    return f"{text} you do not see what {partner} did." if view.turns_played == 1 else text


def describe_situation(view: View[MulticaregiverCryingBaby]) -> str:
    """Return a description of the last observation, the belief and the hidden partner."""
    partner = view.problem.agents[1 - view.seat]
    return f"{crying_baby.describe_situation(view)} what {partner} does is hidden."

"""How the crying baby looks: what you heard, and what you may believe."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.problems.crying_baby import CryingBaby
from dmplay.problems.multicaregiver_crying_baby import MulticaregiverCryingBaby
from dmplay.session import View
from dmplay.tabular import Tabular
from dmplay.views._belief import bars, spark, truth, words
from dmplay.views.canvas import Canvas, percent
from dmplay.views.generic import seen
from dmplay.views.style import Look

HISTORY = 20  # turns of it that are drawn
KEYS = {"f": "feed", "s": "sing", "i": "ignore"}


def boards(view: View[Tabular], look: Look) -> Iterator[Text]:
    """The last observation, the belief as bars, and how it moved."""
    for history in (True, False):
        canvas = Canvas()
        canvas.put(0, 0, "heard  ")
        crying = seen(view) == "crying"
        canvas.put(7, 0, seen(view), "bold yellow" if crying else "bold")
        y = bars(canvas, 2, view.problem.names, view.belief, look)
        if history:
            title = f"history of {view.problem.names[-1]} "
            room = max(min(HISTORY, look.width - len(title)), 1)
            canvas.put(0, y, title, "dim")
            worst = [float(b[-1]) for b in (view.beliefs or ())[-room:]]
            shown = spark(worst, look.ascii).ljust(room, " " if look.ascii else "·")
            canvas.put(len(title), y, shown, "cyan")
            y += 1
        truth(canvas, y, view.problem.names, look)
        yield canvas.text()


def goal(view: View[CryingBaby | MulticaregiverCryingBaby]) -> list[str]:
    """What hunger and each effort cost this seat, and what crying tells."""
    problem = view.problem
    feeding, singing, _ = problem.efforts[view.seat]
    return [
        "keep the baby sated",
        f"hunger costs {-problem.hungry_reward:g}",
        f"feeding {-feeding:g}",
        f"singing {-singing:g}",
        f"{percent(problem.cries_hungry)} of the hungry cry"
        + (f", {percent(problem.cries_sated)} of the sated" if problem.cries_sated else ""),
    ]


def panel(view: View[Tabular]) -> list[tuple[str, str]]:
    """The last turn; the reward is hidden until the end, as it would betray the state."""
    return [
        ("last", view.last or "-"),
        ("heard", seen(view)),
        ("reward", f"{view.rewards[-1]:g}" if view.rewards else "hidden"),
        ("gamma", f"{view.problem.discount:.2f}"),
    ]


def told(view: View[Tabular]) -> str:
    """What you did, what you heard, what to believe."""
    return f"{seen(view)}. chose {view.last}. {belief(view)}"


def situation(view: View[Tabular]) -> str:
    """The last observation and the belief."""
    return f"heard {seen(view)}. {belief(view)}"


def belief(view: View[Tabular]) -> str:
    """The belief in words."""
    return f"belief: {words(view.problem.names, view.belief)}."

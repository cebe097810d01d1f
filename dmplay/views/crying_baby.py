"""How the crying baby looks: what you heard, and what you may believe."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.session import View
from dmplay.tabular import Tabular
from dmplay.views._belief import bars, spark, words
from dmplay.views.canvas import Canvas
from dmplay.views.style import Look

HISTORY = 20  # turns of it that are drawn
KEYS = {"f": "feed", "s": "sing", "i": "ignore"}


def names(view: View) -> tuple[str, ...]:
    """The names of the states."""
    assert isinstance(view.problem, Tabular)
    return view.problem.names


def heard(view: View, turn: int = -1) -> str:
    """The observation after a turn, by name."""
    label = int(view.observations[turn])
    labels = (view.problem.observations or ())[view.seat]
    return labels[label] if label >= 0 else "nothing yet"


def boards(view: View, look: Look) -> Iterator[Text]:
    """The last observation, the belief as bars, and how it moved."""
    assert view.beliefs is not None
    for history in (True, False):
        canvas = Canvas()
        canvas.put(0, 0, "heard  ")
        crying = heard(view) == "crying"
        canvas.put(7, 0, heard(view), "bold yellow" if crying else "bold")
        y = bars(canvas, 2, names(view), view.beliefs[-1], look)
        if history:
            title = f"history of {names(view)[-1]} "
            room = max(min(HISTORY, look.width - len(title)), 1)
            canvas.put(0, y, title, "dim")
            worst = [float(b[-1]) for b in view.beliefs[-room:]]
            shown = spark(worst, look.ascii).ljust(room, " " if look.ascii else "·")
            canvas.put(len(title), y, shown, "cyan")
            y += 1
        if look.state is not None:
            canvas.put(0, y, f"truly {names(view)[int(look.state)]}", "bold magenta")
        yield canvas.text()


def panel(view: View) -> list[tuple[str, str]]:
    """The last turn; the reward is hidden until the end, as it would betray the state."""
    last = view.problem.action_name(view.seat, view.actions[-1]) if view.turn else "-"
    return [
        ("last", last),
        ("heard", heard(view)),
        ("reward", f"{view.rewards[-1]:g}" if view.rewards else "hidden"),
        ("gamma", f"{view.problem.discount:.2f}"),
    ]


def told(view: View) -> str:
    """What you did, what you heard, what to believe."""
    action = view.problem.action_name(view.seat, view.actions[-1])
    return f"{heard(view)}. chose {action}. {belief(view)}"


def situation(view: View) -> str:
    """The last observation and the belief."""
    return f"heard {heard(view)}. {belief(view)}"


def belief(view: View) -> str:
    """The belief in words."""
    assert view.beliefs is not None
    return f"belief: {words(names(view), view.beliefs[-1])}."

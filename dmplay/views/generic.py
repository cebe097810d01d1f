"""How a problem without a view of its own looks: labels and numbers, digits as keys."""

import inspect
from collections.abc import Iterator

from rich.text import Text

from dmplay.core import Problem
from dmplay.session import View
from dmplay.views._belief import bars, words
from dmplay.views.canvas import Canvas, signed
from dmplay.views.style import Look

TOLD = 3  # states that are told in words
KEYS: dict[str, str] = {}


def seen(view: View[Problem]) -> str:
    """What the seat saw last, by name."""
    observation = view.observation
    if not view.problem.hidden:
        return view.problem.notation(observation)
    label = int(observation)
    return view.problem.observations[view.seat][label] if label >= 0 else "nothing yet"


def boards(view: View[Problem], look: Look) -> Iterator[Text]:
    """The observation, the belief where there is one, and the actions with their digits."""
    for full in (True, False):
        canvas = Canvas()
        what = "seen" if view.problem.hidden else "state"
        canvas.put(0, 0, f"{what}  {seen(view)}"[: max(look.width, 1)], "bold")
        y = 2
        if view.beliefs is not None and full:
            y = bars(canvas, y, _names(view), view.belief, look) + 1
        actions = view.problem.actions[view.seat]
        if not actions.labels:
            canvas.put(0, y, actions.words())
        for number, label in enumerate(actions.labels if full else (), 1):
            legal = view.legal is None or view.legal[number - 1]
            canvas.put(0, y, f"{number} {label}" if legal else f"[{number} {label}]")
            y += 1
        yield canvas.text()


def goal(view: View[Problem]) -> list[str]:
    """The problem in the words of whoever wrote it."""
    first, *_ = (inspect.getdoc(type(view.problem)) or "").split("\n\n")
    return [" ".join(first.split()).rstrip(".")] if first else []


def panel(view: View[Problem]) -> list[tuple[str, str]]:
    """The last action and reward."""
    reward = signed(view.rewards[-1]) if view.rewards else "-"
    return [("last", view.last or "-"), ("reward", reward), ("gamma", f"{view.problem.discount:g}")]


def told(view: View[Problem]) -> str:
    """The action and what was seen after it."""
    return f"{seen(view)}. chose {view.last}.{_believed(view)}"


def situation(view: View[Problem]) -> str:
    """What was seen last and what can be done."""
    can = view.problem.actions[view.seat].words(view.legal)
    return f"{seen(view)}.{_believed(view)} actions: {can or 'none'}."


def _names(view: View[Problem]) -> list[str]:
    """The names of the states."""
    return [view.problem.notation(s) for s in view.problem.enumerated()]


def _believed(view: View[Problem]) -> str:
    """The likeliest states in words, where there is a belief."""
    if view.beliefs is None:
        return ""
    ranked = words(_names(view), view.belief).split(", ")
    return f" belief: {', '.join(ranked[:TOLD])}{', ...' if len(ranked) > TOLD else ''}."

"""How the machine looks: what was seen, the belief as bars and in a triangle, and prospects."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.chance import Reals
from dmplay.problems.machine_replacement import MachineReplacement
from dmplay.session import View
from dmplay.views._belief import bars, spark, words
from dmplay.views.canvas import Canvas
from dmplay.views.style import Look

HISTORY = 40  # turns of it that are drawn
KEYS = {"m": "manufacture", "e": "examine", "i": "interrupt", "r": "replace"}
NAMES = ("0 failed", "1 failed", "2 failed")
BARS, TRIANGLE = 36, 21  # columns
MIDDLE, FOOT = 10, 4  # of the triangle: the column of its top, the row of its base


def _problem(view: View) -> MachineReplacement:
    assert isinstance(view.problem, MachineReplacement)
    return view.problem


def _belief(view: View) -> Reals:
    assert view.beliefs is not None
    return view.beliefs[-1]


def _seen(view: View) -> str:
    """The last product, as observed."""
    if not view.turn:
        return "nothing yet"
    (labels,) = _problem(view).observations
    return labels[int(view.observation)]


def _prospects(view: View, look: Look) -> list[tuple[str, str, float]]:
    """Key, action and the reward expected of it at once, under the belief."""
    each = _belief(view) @ _problem(view).tables.rewards[:, :, 0]
    return [
        (look.names.get(name, key), name, float(reward))
        for (key, name), reward in zip(KEYS.items(), each, strict=True)
    ]


def boards(view: View, look: Look) -> Iterator[Text]:
    """Everything with the triangle; without it; the bars and one line of prospects."""
    for triangle in (True, False):
        canvas = Canvas()
        y = _beliefs(view, look, canvas, 2)
        if triangle:
            _triangle(canvas, BARS + 4, _belief(view))
        title = "history of a failure "
        room = max(min(HISTORY, look.width - len(title)), 1)
        failed = [1.0 - float(b[0]) for b in (view.beliefs or ())[-room:]]
        canvas.put(0, y, title, "dim")
        canvas.put(len(title), y, spark(failed, look.ascii), "cyan")
        canvas.put(0, y + 2, "reward expected at once", "dim")
        for number, (key, name, reward) in enumerate(_prospects(view, look)):
            canvas.put(0, y + 3 + number, f"{key} {name:<11} {reward:+.3f}")
        _truth(canvas, y + 8, look)
        yield canvas.text()
    canvas = Canvas()
    y = _beliefs(view, look, canvas, 1)
    line = "  ".join(f"{key} {reward:+.2f}" for key, _, reward in _prospects(view, look))
    canvas.put(0, y, line)
    _truth(canvas, y + 1, look)
    yield canvas.text()


def _beliefs(view: View, look: Look, canvas: Canvas, y: int) -> int:
    """The last product and the bars; the row after them."""
    seen = _seen(view)
    canvas.put(0, 0, "saw  ")
    canvas.put(5, 0, seen, "bold yellow" if seen == "defective" else "bold")
    return bars(canvas, y, NAMES, _belief(view), look._replace(width=min(look.width, BARS)))


def _triangle(canvas: Canvas, x: int, belief: Reals) -> None:
    """The belief as a dot between three corners, each of which is a state for sure."""
    for row in range(1, FOOT + 1):
        canvas.put(x + MIDDLE - 2 * row, row, "╱", "dim")
        canvas.put(x + MIDDLE + 2 * row, row, "╲", "dim")
    canvas.put(x + 3, FOOT, "─" * (TRIANGLE - 6), "dim")
    row = round(FOOT * float(1.0 - belief[0]))
    column = MIDDLE + round(2.0 * FOOT * float(belief[2] - belief[1]))
    canvas.put(x + MIDDLE - (2 if row == 0 else 0), 0, "0")
    canvas.put(x, FOOT, "1")
    canvas.put(x + TRIANGLE - 1, FOOT, "2")
    canvas.put(x + column, row, "●", "bold cyan")


def _truth(canvas: Canvas, y: int, look: Look) -> None:
    if look.state is not None:
        canvas.put(0, y, f"truly {NAMES[int(look.state)]}", "bold magenta")


def panel(view: View) -> list[tuple[str, str]]:
    """The last turn; the reward stays hidden, as it would betray the state."""
    last = view.problem.action_name(view.seat, view.actions[-1]) if view.turn else "-"
    return [
        ("last", last),
        ("reward", "hidden"),
        ("gamma", f"{view.problem.discount:.2f}"),
    ]


def told(view: View) -> str:
    """The product, what you did, what to believe."""
    action = view.problem.action_name(view.seat, view.actions[-1])
    return f"{_seen(view)}. chose {action}. {_believed(view)}"


def situation(view: View) -> str:
    """The product, the belief, and the reward to expect of each action."""
    each = ", ".join(f"{name} {reward:.3f}" for _, name, reward in _prospects(view, Look()))
    return f"saw {_seen(view)}. {_believed(view)} expected reward at once: {each}."


def _believed(view: View) -> str:
    return f"belief: {words(NAMES, _belief(view))}."

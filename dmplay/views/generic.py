"""How a problem without a view of its own looks: labels and numbers, digits as keys."""

import inspect
from collections.abc import Iterator

from rich.text import Text

from dmplay.chance import Array
from dmplay.core import Problem
from dmplay.errors import BadParameter
from dmplay.places import place
from dmplay.session import View
from dmplay.views._advice import branches, label, loss, losses, ranked, under
from dmplay.views._belief import bars, shares, words
from dmplay.views.canvas import Canvas, picture, signed
from dmplay.views.style import Lesson, Look

TOLD = 3  # states that are told in words
BAR = 20  # columns of a bar
KEYS: dict[str, str] = {}


def seen(view: View[Problem]) -> str:
    """What the seat saw last, by name."""
    return label(view.problem, view.seat, view.observation)


def boards(view: View[Problem], look: Look) -> Iterator[Text]:
    """The picture that the problem brings; else the observation and the belief; then the actions.

    Of a hidden state there is a picture only once it is told, below what the seat saw.
    """
    shown = pictured(view, look.state)
    if shown is None:
        yield from _written(view, look)
    elif view.problem.hidden:
        yield from (Text("\n\n").join([drawn, shown]) for drawn in _written(view, look))
        yield from _written(view, look)
    else:
        labels, below = view.labels, Canvas()
        after = branches(view, look, [])
        _actions(view, below, 0, look)
        full = Text("\n\n").join([shown, below.text()])
        yield from under([full], ["", *after] if after else [], look)
        yield from under([shown], [*losses(look, labels), *after], look)


def _written(view: View[Problem], look: Look) -> Iterator[Text]:
    """The observation, the belief where there is one, and the actions with their digits."""
    labels = view.labels
    after = branches(view, look, _names(view) if look.outlook and view.beliefs is not None else [])
    full, small = _seen(view, look), _seen(view, look)
    y = 2
    if view.beliefs is not None:
        most = 2 * BAR if look.large else BAR
        y = bars(full, y, *shares(view), look, most=most) + 1
    _actions(view, full, y, look)
    yield from under([full.text()], ["", *after] if after else [], look)
    if not labels:
        _actions(view, small, 2, look)
    yield from under([small.text()], [*losses(look, labels), *after], look)


def pictured(view: View[Problem], state: Array | None) -> Text | None:
    """The picture that a problem brings of a state, of one that is hidden only once it is told."""
    draw = getattr(view.problem, "picture", None)
    known = state if view.problem.hidden else view.observation
    if draw is None or known is None:
        return None
    drawn = draw(known)
    if not isinstance(drawn, str | Text):
        where = place(type(view.problem), "picture")
        raise BadParameter(f"{where} picture: got {drawn!r}, expected text, or Text of rich")
    return picture(drawn)


def _seen(view: View[Problem], look: Look) -> Canvas:
    """A drawing of what was seen."""
    canvas = Canvas()
    what = "seen" if view.problem.hidden else "state"
    canvas.put(0, 0, f"{what}  {seen(view)}"[: max(look.width, 1)], "bold")
    return canvas


def _actions(view: View[Problem], canvas: Canvas, y: int, look: Look) -> None:
    """What can be done: the best first, with what each loses, where that is told."""
    labels = view.labels
    if not labels:
        canvas.put(0, y, view.problem.actions[view.seat].words())
    longest = max(map(len, labels), default=0)
    order = ranked(look, len(labels))
    if view.called is not None and view.legal is not None:  # of other states, names say nothing
        order = [action for action in order if view.legal[action]]
    for row, action in enumerate(order, y):
        legal = view.legal is None or view.legal[action]
        name = f"{action + 1} {labels[action]}"
        canvas.put(0, row, name if legal else f"[{name}]")
        canvas.put(longest + 6, row, loss(look, action, BAR), "yellow")


def goal(view: View[Problem]) -> list[str]:
    """The problem in the words of whoever wrote it."""
    about: str = getattr(view.problem, "about", "")  # of its file
    first, *_ = (about or inspect.getdoc(type(view.problem)) or "").split("\n\n")
    return [" ".join(first.split()).rstrip(".")] if first else []


def lesson(view: View[Problem]) -> Lesson:
    """What the problem says of itself, and where its prices are told."""
    problem, (first, *_) = view.problem, [*goal(view), "You want the largest sum of rewards"]
    others = len(problem.agents) - 1
    who = f"You are {problem.agents[view.seat]}{f', one of {others + 1}' if others else ''}"
    sees = "the state is hidden" if problem.hidden else "you see the state"
    paid = "after every turn" if problem.rewards_observed else "at the end"
    actions = problem.actions[view.seat].words()
    return Lesson(f"{who}, and {sees}", first, f"You can do {actions}; the reward is told {paid}")


def panel(view: View[Problem]) -> list[tuple[str, str]]:
    """The last reward and the discount; what was done and seen is in the log and on the board."""
    reward = signed(view.rewards[-1]) if view.rewards else "-"
    return [("reward", reward), ("discount", f"{view.problem.discount:g}")]


def told(view: View[Problem]) -> str:
    """The action and what was seen after it."""
    return f"{seen(view)}. chose {view.last}.{_believed(view)}"


def situation(view: View[Problem]) -> str:
    """What was seen last and what can be done."""
    can = (view.labels or view.problem.actions[view.seat]).words(view.legal)
    return f"{seen(view)}.{_believed(view)} actions: {can or 'none'}."


def _names(view: View[Problem]) -> list[str]:
    """The names of the states."""
    return [view.problem.notation(s) for s in view.problem.enumerated()]


def _believed(view: View[Problem]) -> str:
    """The likeliest states in words, where there is a belief."""
    if view.beliefs is None:
        return ""
    names, likely = shares(view)
    many = len(names) - (len(names) < len(view.belief))  # without what is left
    ranked = words(names[:many], likely[:many]).split(", ")
    return f" belief: {', '.join(ranked[:TOLD])}{', ...' if len(ranked) > TOLD else ''}."

"""How a problem without a view of its own looks: labels and numbers, digits as keys."""

from collections.abc import Iterator
from textwrap import wrap

from rich.text import Text

from dmplay.chance import Array
from dmplay.core import WAIT, Problem
from dmplay.describe import counted
from dmplay.errors import BadParameter
from dmplay.places import place
from dmplay.session import MOST_TURNS, View
from dmplay.views._advice import branches, label, loss, losses, ranked, under
from dmplay.views._belief import bars, likeliest, shares
from dmplay.views.canvas import Canvas, picture, signed
from dmplay.views.style import Lesson, Look

TOLD = 3  # states that are told in words
BAR = 20  # columns of a bar
SHORT = 40  # characters of what was seen that are told beside a picture of it
DIGITS = 10  # keys
LISTED = 40  # actions that have a row each
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
        yield from _seen_by(view, look)
    elif view.problem.hidden:
        yield from (Text("\n\n").join([drawn, shown]) for drawn in _seen_by(view, look))
        yield from _seen_by(view, look)
    else:
        yield from _over(view, look, shown)


def _seen_by(view: View[Problem], look: Look) -> Iterator[Text]:
    """What the seat saw: as the problem draws that, else in words."""
    draw = getattr(view.problem, "glimpse", None)
    drawn = draw(view.observation) if draw and view.problem.hidden else ""
    yield from _over(view, look, picture(drawn)) if drawn else _written(view, look)


def _over(view: View[Problem], look: Look, shown: Text) -> Iterator[Text]:
    """A picture, and the actions below it."""
    labels, below = view.labels, Canvas()
    after = branches(view, look, [])
    _actions(view, below, 0, look)
    full = Text("\n\n").join([shown, below.text()])
    yield from under([full], ["", *after] if after else [], look)
    rows = look.height - len(shown.plain.split("\n")) - 1
    named = Text("\n\n").join([shown, _named(view, look, rows).text()])
    yield from under([named, shown], [*losses(look, labels), *after], look)


def _named(view: View[Problem], look: Look, rows: int) -> Canvas:
    """The actions by name alone, in so many rows."""
    canvas = Canvas()
    open_ = (view.labels or view.problem.actions[view.seat]).words(view.legal).replace(", ", "  ")
    told = wrap(open_, max(look.width, 20), break_on_hyphens=False, max_lines=max(rows, 1))
    for row, text in enumerate(told):
        canvas.put(0, row, text)
    return canvas


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
    if len(labels) > LISTED:
        seen_ = small.text()
        yield Text("\n\n").join([seen_, _named(view, look, look.height - 2).text()])
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
    return picture(drawn) if drawn else None


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
    shown = [action for action in ranked(look, len(labels)) if _listed(view, action)]
    longest = max((len(labels[action]) for action in shown), default=0)
    crowd = view.called is not None and len(labels) > DIGITS
    bare = crowd or labels[:1] == ("0",)  # whose numbers would be others
    for row, action in enumerate(shown[:LISTED], y):
        legal = _may(view, action)
        name = labels[action] if bare else f"{action + 1} {labels[action]}"
        canvas.put(0, row, name if legal else f"[{name}]")
        canvas.put(longest + 6, row, loss(look, action, BAR), "yellow")


def _may(view: View[Problem], action: int) -> bool:
    return view.legal is None or bool(view.legal[action])


def _listed(view: View[Problem], action: int) -> bool:
    """Whether an action has a row: where it can be done, and else if it has a name and few others.

    Of other states, names that depend on the state say nothing.
    """
    labels = view.labels
    waits = labels[action] == WAIT and len(view.problem.agents) > 1
    unnamed = view.called is not None or len(labels) > LISTED
    return _may(view, action) or not (waits or unnamed)


def goal(view: View[Problem]) -> list[str]:
    """The problem in the words of whoever wrote it; without any, what there is to gather."""
    told = _story(view)
    if told:
        return [told]
    discount = view.problem.discount
    return [
        "gather the largest sum of rewards",
        *([f"in {counted(view.limit, 'turn')}"] if view.limit not in {None, MOST_TURNS} else []),
        *([f"what comes a turn later counts {discount:g} as much"] if discount < 1 else []),
    ]


def _story(view: View[Problem]) -> str:
    """The first paragraph that whoever wrote the problem says of it, without its full stop."""
    first, *_ = view.problem.story().split("\n\n")
    return " ".join(first.split()).rstrip(".")


def lesson(view: View[Problem]) -> Lesson:
    """What the problem says of itself, and where its prices are told."""
    problem, first = view.problem, _story(view) or "You want the largest sum of rewards"
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
    drawn = hasattr(view.problem, "picture") and len(seen(view)) > SHORT
    return f"{'' if drawn else _saw(view)}{_did(view)}{_believed(view)}"


def _saw(view: View[Problem]) -> str:
    """What was seen last, a sentence; nothing where there is but one state to see."""
    problem = view.problem
    return "" if problem.states == 1 and not problem.hidden else f"{seen(view)}. "


def _did(view: View[Problem]) -> str:
    """What was done: by the seat, and by all where they see each other's actions.

    In a game of turns only by those whose turn it was.
    """
    problem, mine = view.problem, f"chose {view.last}."
    if len(problem.agents) == 1:
        return mine
    if view.joint is None:
        return mine if view.last != WAIT else "waited."
    known = problem.called(view.observations[-2])
    names = [
        known[n][action] if known else problem.action_name(n, action)
        for n, action in enumerate(view.joint[-1].tolist())
    ]
    every = zip(problem.agents, names, strict=True)
    return "; ".join(f"{agent} chose {name}" for agent, name in every if name != WAIT) + "."


def situation(view: View[Problem]) -> str:
    """What was seen last and what can be done."""
    can = (view.labels or view.problem.actions[view.seat]).words(view.legal)
    told = f"{_saw(view).rstrip()}{_believed(view)} actions: {can or 'none'}."
    return told.lstrip()


def _names(view: View[Problem]) -> list[str]:
    """The names of the states."""
    return [view.problem.notation(s) for s in view.problem.enumerated()]


def _believed(view: View[Problem]) -> str:
    """The likeliest states in words, where there is a belief."""
    if view.beliefs is None:
        return ""
    names, likely = shares(view)
    many = len(names) - (len(names) < len(view.belief))  # without what is left
    told = likeliest(names[:many], likely[:many])
    return f" belief: {', '.join(told[:TOLD])}{', ...' if len(told) > TOLD else '.'}"

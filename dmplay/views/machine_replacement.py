"""How the machine looks: what was seen, the belief as bars and in a triangle, and prospects."""

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from rich.text import Text

from dmplay.chance import Reals
from dmplay.problems.machine_replacement import MachineReplacement
from dmplay.session import View
from dmplay.solvers.alpha_vectors import Stage, action_values, stages
from dmplay.solvers.value_iteration import best
from dmplay.tabular import tabulate
from dmplay.views import crying_baby
from dmplay.views._advice import branches, loss, losses, ranked, shown, under
from dmplay.views._belief import bars, spark, truth, words
from dmplay.views.canvas import Canvas
from dmplay.views.generic import seen
from dmplay.views.style import Lesson, Look

HISTORY = 40  # turns of it that are drawn
KEYS = {"m": "manufacture", "e": "examine", "i": "interrupt", "r": "replace"}
NAMES = ("0 failed", "1 failed", "2 failed")
BARS, TRIANGLE = 36, 21  # columns
TALL, LOSS = 11, 8  # rows of the tall triangle; columns of a bar of what is lost
LEGEND = (
    "● the belief, · before: the nearer a",
    "corner, the likelier that many failed;",
    "Tab writes what is best where",
)
REGIONS = (
    "● the belief; letters: the best key",
    "at a belief that is where they stand,",
    "with the turns that are left",
)
REGION = ("dim", "cyan", "magenta", "yellow")  # the style of each action
LONGEST = 40  # turns that are planned for the regions
MIDDLE, FOOT = 10, 4  # of the triangle: the column of its top, the row of its base


def _prospects(view: View[MachineReplacement], look: Look) -> list[tuple[str, str, float]]:
    """Key, action and the reward expected of it at once, under the belief."""
    each = view.belief @ view.problem.tables.rewards[:, :, 0]
    return [
        (look.names.get(name, key), name, float(reward))
        for (key, name), reward in zip(KEYS.items(), each, strict=True)
    ]


def boards(view: View[MachineReplacement], look: Look) -> Iterator[Text]:
    """Everything with a triangle that explains itself; with a small one; without; in few rows."""
    if look.large:
        yield _large(view, look)
    after = branches(view, look, view.problem.names)
    yield from under(_drawings(view, look), [*losses(look, shown(KEYS, look)), *after], look)


def _drawings(view: View[MachineReplacement], look: Look) -> Iterator[Text]:
    """Everything with the triangle; without it; the bars and one line of prospects."""
    for triangle in (True, False):
        canvas = Canvas()
        y = _beliefs(view, look, canvas, 2)
        if triangle:
            _triangle(canvas, BARS + 4, view.belief)
        _history(view, canvas, y, look)
        canvas.put(0, y + 2, "reward expected at once", "dim")
        for number, (key, name, reward) in enumerate(_prospects(view, look)):
            canvas.put(0, y + 3 + number, f"{key} {name:<11} {reward:+.3f}")
        truth(canvas, y + 8, NAMES, look)
        yield canvas.text()
    canvas = Canvas()
    y = _beliefs(view, look, canvas, 1)
    line = "  ".join(f"{key} {reward:+.2f}" for key, _, reward in _prospects(view, look))
    canvas.put(0, y, line)
    truth(canvas, y + 1, NAMES, look)
    yield canvas.text()


def _history(view: View[MachineReplacement], canvas: Canvas, y: int, look: Look) -> None:
    """How the belief in a failure moved."""
    title = "history of a failure "
    room = max(min(HISTORY, look.width - len(title)), 1)
    failed = [1.0 - float(b[0]) for b in (view.beliefs or ())[-room:]]
    canvas.put(0, y, title, "dim")
    canvas.put(len(title), y, spark(failed, look.ascii), "cyan")


def _large(view: View[MachineReplacement], look: Look) -> Text:
    """What is known at the left, with what each action loses; at the right the tall triangle."""
    canvas = Canvas()
    y = _beliefs(view, look, canvas, 2)
    _history(view, canvas, y, look._replace(width=min(look.width, BARS)))
    tail = "; in the end" if look.regret is not None else ""
    canvas.put(0, y + 2, f"expected at once{tail}", "dim")
    prospects = _prospects(view, look)
    for row, action in enumerate(ranked(look, len(prospects)), y + 3):
        key, name, reward = prospects[action]
        canvas.put(0, row, f"{key} {name:<11} {reward:+.3f}")
        canvas.put(21, row, loss(look, action, LOSS), "yellow")
    truth(canvas, y + 7, NAMES, look)
    open_ = LEGEND if view.rewards is None else LEGEND[:-1]  # no hint is given after the end
    legend = open_ if look.regret is None else REGIONS
    for row, words_ in enumerate(branches(view, look, view.problem.names) or legend, y + 8):
        canvas.put(0, row, words_, "" if look.outlook else "dim")
    _tall(view, canvas, BARS + 2, look)
    return canvas.text()


def _tall(view: View[MachineReplacement], canvas: Canvas, x: int, look: Look) -> None:
    """The tall triangle: its corners by name, the beliefs so far, the present, those to come."""
    for row in range(1, TALL):
        canvas.put(x + TALL - row, row + 1, "╱", "dim")
        canvas.put(x + TALL + row, row + 1, "╲", "dim")
    canvas.put(x, TALL + 1, "─" * (2 * TALL + 1), "dim")
    canvas.put(x + TALL - len(NAMES[0]) // 2, 0, NAMES[0])
    canvas.put(x, TALL + 2, NAMES[1])
    if look.regret is not None:
        _regions(view, canvas, x, look)
    canvas.put(x + 2 * TALL + 1 - len(NAMES[2]), TALL + 2, NAMES[2])
    to_come = look.outlook.beliefs if look.outlook else None
    marks = [(belief, "·", "cyan") for belief in view.beliefs or ()]
    marks += [(belief, "○", "bold yellow") for belief in ([] if to_come is None else to_come)]
    for belief, glyph, style in [*marks, (view.belief, "●", "bold cyan")]:
        column = round(TALL * (1.0 + float(belief[2] - belief[1])))
        canvas.put(x + column, 1 + round(TALL * float(1.0 - belief[0])), glyph, style)


def _regions(view: View[MachineReplacement], canvas: Canvas, x: int, look: Look) -> None:
    """The key of the best action at beliefs all over the triangle."""
    keys = shown(KEYS, look)
    places = [(row, aside) for row in range(2, TALL) for aside in range(2 - row, row, 2)]
    failed, skew = np.array(places).T / TALL
    beliefs = np.stack([1.0 - failed, (failed - skew) / 2, (failed + skew) / 2], axis=1)
    left = LONGEST if view.limit is None else min(view.limit - view.turn, LONGEST)
    stage = _stages(view.problem, left)[-1]
    for (row, aside), action in zip(places, best(action_values(stage, beliefs)), strict=True):
        number = int(np.argmax(action))
        canvas.put(x + TALL + aside, row + 1, keys[number], REGION[number])


@lru_cache(maxsize=LONGEST)
def _stages(problem: MachineReplacement, turns: int) -> list[Stage]:
    """The best plans of so many turns."""
    return stages(tabulate(problem), problem.discount, turns)


def _beliefs(view: View[MachineReplacement], look: Look, canvas: Canvas, y: int) -> int:
    """The last product and the bars; the row after them."""
    product = seen(view)
    canvas.put(0, 0, "saw  ")
    canvas.put(5, 0, product, "bold yellow" if product == "defective" else "bold")
    return bars(canvas, y, NAMES, view.belief, look._replace(width=min(look.width, BARS)))


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


def goal(view: View[MachineReplacement]) -> list[str]:
    """What a part pays, what wears unseen, and the price of looking and mending."""
    labels = view.problem.actions[0].labels
    sound, *failed = view.problem.tables.rewards[:, :, 0]
    worse = " or ".join(f"{pays[0]:.3g}" for pays in failed)
    others = [f"{label} pays {pay:.3g}" for label, pay in zip(labels, sound, strict=True)]
    return [
        f"keep the machine producing: {sound[0]:.3g} a turn",
        f"with failed parts {worse}",
        "parts fail unseen",
        *others[:0:-1],
    ]


def lesson(view: View[MachineReplacement]) -> Lesson:
    """The machine, what is to be wanted, and what each action costs."""
    rewards = view.problem.tables.rewards[:, :, 0]
    makes, *others = zip(view.problem.actions[0].labels, rewards.T, strict=True)
    each = [f"{name} {_spread(pays)}" for name, pays in others]
    return Lesson(
        "You run a machine of two parts; they fail unseen, and only to examine a product tells",
        "You want it to produce as much as it can: "
        f"{makes[0]} pays {_spread(makes[1])} with none, one or two failed",
        f"With as many failed, the others pay: {'; '.join(each)}",
        "examine",
    )


def _spread(pays: Reals) -> str:
    """What an action pays, by how many parts have failed."""
    each = [f"{pay:.3g}" for pay in pays]
    return each[0] if len(set(each)) == 1 else ", ".join(each)


def panel(view: View[MachineReplacement]) -> list[tuple[str, str]]:
    """What is not on the board; the reward is hidden until the end, as it betrays the state."""
    return crying_baby.panel(view)


def told(view: View[MachineReplacement]) -> str:
    """The product, what you did, what to believe."""
    return f"{seen(view)}. chose {view.last}. {_believed(view)}"


def situation(view: View[MachineReplacement]) -> str:
    """The product, the belief, and the reward to expect of each action."""
    each = ", ".join(f"{name} {reward:.3f}" for _, name, reward in _prospects(view, Look()))
    return f"saw {seen(view)}. {_believed(view)} expected reward at once: {each}."


def _believed(view: View[MachineReplacement]) -> str:
    return f"belief: {words(NAMES, view.belief)}."

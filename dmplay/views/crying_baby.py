"""How the crying baby looks: what you heard, and what you may believe."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.problems.crying_baby import CryingBaby
from dmplay.problems.multicaregiver_crying_baby import MulticaregiverCryingBaby
from dmplay.session import View
from dmplay.tabular import Tabular
from dmplay.views._advice import branches, loss, losses, ranked, shown, under
from dmplay.views._belief import bars, spark, truth, words
from dmplay.views._scale import plus
from dmplay.views.canvas import Canvas
from dmplay.views.generic import seen
from dmplay.views.style import Lesson, Look

Care = CryingBaby | MulticaregiverCryingBaby
HISTORY = 20  # turns of it that are drawn
WIDE, LOSS = 40, 10  # columns of a bar where there is room, and of one of a loss
KEYS = {"f": "feed", "s": "sing", "i": "ignore"}


def boards(view: View[Care], look: Look) -> Iterator[Text]:
    """The last observation, the belief as bars, how it moved; what each action costs."""
    if look.large:
        yield _large(view, look)
    after = branches(view, look, view.problem.names)
    told = losses(look, shown(KEYS, look)) or [_sums(view, look)] * (look.large and not view.ending)
    yield from under(_drawings(view, look), [*told, *after], look)


def _drawings(view: View[Care], look: Look) -> Iterator[Text]:
    """What was heard and the belief, with its history and without."""
    for history in (True, False):
        canvas = Canvas()
        y = _heard(view, canvas, look)
        if history:
            y = _history(view, canvas, y, look)
        truth(canvas, y, view.problem.names, look)
        yield canvas.text()


def _heard(view: View[Care], canvas: Canvas, look: Look, most: int = 20) -> int:
    """What was heard and the bars; the row after them."""
    canvas.put(0, 0, "heard  ")
    canvas.put(7, 0, seen(view), "bold yellow" if seen(view) == "crying" else "bold")
    return bars(canvas, 2, view.problem.names, view.belief, look, most=most)


def _history(view: View[Care], canvas: Canvas, y: int, look: Look) -> int:
    """How the worst belief moved; the row after it."""
    title = f"history of {view.problem.names[-1]} "
    room = max(min(HISTORY, look.width - len(title)), 1)
    canvas.put(0, y, title, "dim")
    worst = [float(b[-1]) for b in (view.beliefs or ())[-room:]]
    moved = spark(worst, look.ascii).ljust(room, " " if look.ascii else "·")
    canvas.put(len(title), y, moved, "cyan")
    return y + 1


def _large(view: View[Care], look: Look) -> Text:
    """Everything, with the reward to expect of each action, what it loses and what crying tells."""
    canvas = Canvas()
    y = _history(view, canvas, _heard(view, canvas, look, WIDE), look) + 1
    _prospects(view, canvas, y, look)
    y += len(KEYS) + 2
    for row in branches(view, look, view.problem.names) or _cries(view):
        canvas.put(0, y, row, "" if look.outlook else "dim")
        y += 1
    truth(canvas, y, view.problem.names, look)
    return canvas.text()


def _prospects(view: View[Care], canvas: Canvas, y: int, look: Look) -> None:
    """The reward to expect of each action at once: of hunger under the belief, and of the effort.

    The best first, with what each loses in the end, where that is told.
    """
    heads = "expected reward  hunger  effort     sum"
    canvas.put(0, y, heads, "dim")
    canvas.put(len(heads) + 2, y, "in the end" if look.regret is not None else "", "dim")
    hunger = float(view.belief[-1]) * view.problem.hungry_reward
    keys, labels = shown(KEYS, look), view.problem.actions[view.seat].labels
    for row, action in enumerate(ranked(look, len(keys)), y + 1):
        effort = view.problem.efforts[view.seat][action]
        canvas.put(0, row, f"{keys[action]} {labels[action]}")
        each = "".join(f"{plus(value, 2):>8}" for value in (hunger, effort, hunger + effort))
        canvas.put(15, row, each)
        canvas.put(len(heads) + 2, row, loss(look, action, LOSS), "yellow")


def _sums(view: View[Care], look: Look) -> str:
    """The reward to expect of each action at once, in a row."""
    hunger = float(view.belief[-1]) * view.problem.hungry_reward
    each = zip(shown(KEYS, look), view.problem.efforts[view.seat], strict=True)
    return "  ".join(["pays", *(f"{key} {plus(hunger + effort, 2)}" for key, effort in each)])


def _cries(view: View[Care]) -> list[str]:
    """How often each baby cries, sung to or not."""
    problem = view.problem
    hungry = _sung(problem.cries_hungry, problem.cries_hungry_sung)
    sated = _sung(problem.cries_sated, problem.cries_sated_sung)
    return [
        f"a hungry baby cries {hungry}",
        f"a sated one {sated}; unfed, {problem.becomes_hungry:.0%} get hungry",
    ]


def _sung(quiet: float, sung: float) -> str:
    """A probability without a song and with one."""
    return f"{quiet:.0%}, sung to {sung:.0%}" if quiet != sung else f"{quiet:.0%}, sung to or not"


def goal(view: View[Care]) -> list[str]:
    """What hunger and each effort cost this seat, and what crying tells."""
    problem = view.problem
    feeding, singing, _ = problem.efforts[view.seat]
    return [
        "keep the baby sated",
        f"hunger costs {-problem.hungry_reward:g}",
        f"feeding {-feeding:g}",
        f"singing {-singing:g}",
        "only its crying tells",
    ]


def lesson(view: View[Care]) -> Lesson:
    """Who cares for whom, what is to be wanted, and what each action costs."""
    problem = view.problem
    feeding, singing, ignoring = (f"{0.0 - effort:g}" for effort in problem.efforts[view.seat])
    alone = len(problem.agents) == 1
    who = "" if alone else f"{problem.agents[view.seat]}, one of two who cannot talk; you "
    return Lesson(
        f"You {'are ' * (not alone)}{who}care for a baby that is hungry or sated; you only hear "
        "whether it cries",
        "You want it sated: feeding sates it for sure, a song makes its crying tell you more",
        f"A turn that finds it hungry costs {-problem.hungry_reward:g}, feeding {feeding}, "
        f"singing {singing}, ignoring {ignoring}",
        "feed",
    )


def panel(view: View[Tabular]) -> list[tuple[str, str]]:
    """What is not on the board; the reward is hidden until the end, as it betrays the state."""
    reward = f"{view.rewards[-1]:g}" if view.rewards else "hidden"
    return [("reward", reward), ("discount", f"{view.problem.discount:.2f}")]


def told(view: View[Care]) -> str:
    """What you did, what you heard, what to believe."""
    return f"{seen(view)}. chose {view.last}. {belief(view)}"


def situation(view: View[Care]) -> str:
    """The last observation and the belief."""
    return f"heard {seen(view)}. {belief(view)}"


def belief(view: View[Care]) -> str:
    """The belief in words."""
    return f"belief: {words(view.problem.names, view.belief)}."

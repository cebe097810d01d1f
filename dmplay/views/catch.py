"""How catch looks: the curves of figure F.13, the belief over them, what each throw promises."""

from collections.abc import Iterator, Sequence

from rich.text import Text

from dmplay.chance import Reals
from dmplay.problems.catch import CAUGHT, DISTANCES, PROFICIENCIES, Catch
from dmplay.session import View
from dmplay.views._advice import branches, fewest, losses, under
from dmplay.views._belief import bar, bars, spark, words
from dmplay.views.canvas import Canvas, percent
from dmplay.views.style import ALIKE, Lesson, Look

KEYS: dict[str, str] = {}  # a distance is typed
NUDGES = {"left": -10, "right": 10}  # metres; Enter throws
NAMES = tuple(f"{proficiency} m" for proficiency in PROFICIENCIES)
STUB, COLUMN, HIGH = 6, 4, 6  # of the plot: columns before it, a distance, rows from 1.0 to 0.0
EDGE, CELL = 20, 4  # of the rows of heat: columns before them, of a distance
HEAT = ("dim", "", "cyan", "bold cyan")  # the styles of a catch from never to always
HEIGHTS = (6, 4, 2, 0)  # rows of the columns of what is paid
LEGEND_OF_SKILL = "skill: metres of which half are caught; cells: percent caught"
DOING = "throw {} m"
LEGEND = ("p(caught) by", "proficiency:", "2 is 20 m,", "4 is 40 m ...")


def _throw(view: View[Catch], turn: int) -> tuple[str, bool]:
    """The distance of a throw, and whether it was caught."""
    name = view.problem.action_name(view.seat, view.actions[turn])
    return name, int(view.observations[turn + 1]) == CAUGHT


def _promises(view: View[Catch]) -> Reals:
    """The reward expected of each distance under the belief."""
    return view.belief @ view.problem.catches * DISTANCES


def boards(view: View[Catch], look: Look) -> Iterator[Text]:
    """The curves as rows of heat over columns of what is paid; plots and tables."""
    for high in HEIGHTS if look.large else ():
        yield _large(view, look, high)
    best = [f"{distance:.0f} m" for distance in DISTANCES]
    after = branches(view, look, NAMES, DOING)
    yield from under(_drawings(view, look), [*losses(look, best), *after], look)


def _large(view: View[Catch], look: Look, high: int) -> Text:
    """Each proficiency's belief and curve in a row, columns of the pay to expect, the throws."""
    canvas = Canvas()
    canvas.put(0, 0, "skill believed throw", "dim")
    _cells(canvas, 0, [f"{distance:.0f}" for distance in DISTANCES], "dim")
    if look.advised is not None:
        _marked(canvas, 0, int(look.advised))
    rows = zip(NAMES, view.belief, view.problem.catches, strict=True)
    for y, (name, share, caught) in enumerate(rows, 1):
        canvas.put(0, y, name)
        canvas.put(5, y, bar(float(share), 8, look.ascii), "cyan")
        canvas.put(14, y, f"{share:.3f}", "bold")
        heat = spark([float(chance) for chance in caught], look.ascii)
        for column, (glyph, chance) in enumerate(zip(heat, caught, strict=True)):
            style = HEAT[min(int(chance * len(HEAT)), len(HEAT) - 1)]
            canvas.put(EDGE + CELL * column + 1, y, f"{glyph}{100 * chance:2.0f}", style)
    y = len(NAMES) + 2
    promises = _promises(view)
    y = _columns(canvas, y, promises / promises.max(), high=high, style="green", look=look)
    canvas.put(0, y, "pays on average")
    _cells(canvas, y, [f"{promise:.0f}" for promise in promises], "bold")
    if look.regret is not None:
        shares = look.regret / (look.regret.max() or 1.0)
        y = _columns(canvas, y + 1, shares, high=1, style="yellow", look=look)
        canvas.put(0, y, "loses (● is best)")
        _cells(canvas, y, [_lost(lost) for lost in look.regret], "yellow")
    rows_ = branches(view, look, NAMES, DOING) or [LEGEND_OF_SKILL]
    _throws(view, canvas, y + 2, look)
    for row, words_ in enumerate(rows_, y + 3 + bool(look.outlook)):
        canvas.put(0, row, words_, "" if look.outlook else "dim")
    return canvas.text()


def _lost(lost: float) -> str:
    """What is lost, in three columns; a dot where nothing is."""
    return "●" if lost < ALIKE else fewest(lost, 3)


def _cells(canvas: Canvas, y: int, cells: Sequence[str], style: str) -> None:
    """A text a distance, at the right of its columns."""
    for column, cell in enumerate(cells):
        canvas.put(EDGE + CELL * column, y, cell.rjust(CELL), style)


def _marked(canvas: Canvas, y: int, throw: int) -> None:
    """The distance of a hint, or the one that is written, between arrows."""
    told = f"→{DISTANCES[throw]:.0f}←"
    canvas.put(EDGE + CELL * (throw + 1) + 1 - len(told), y, told, "bold green")


def price(view: View[Catch], throw: float) -> str:
    """Which throw an action is, how likely it is caught, and what it pays on average."""
    distance, promise = DISTANCES[int(throw)], float(_promises(view)[int(throw)])
    caught = percent(promise / distance)
    return f"throws {distance:.0f} m: caught {caught}, pays {promise:.0f} on average"


def _columns(  # noqa: PLR0913 - a place on the canvas, and what goes there
    canvas: Canvas, y: int, shares: Reals, *, high: int, style: str, look: Look
) -> int:
    """A column a distance, so many rows high; the row after them."""
    for row in range(high):
        parts = [min(max(high * float(share) - (high - 1 - row), 0.0), 1.0) for share in shares]
        blocks = zip(spark(parts, look.ascii), parts, strict=True)
        _cells(canvas, y + row, [2 * glyph if part > 0.0 else "" for glyph, part in blocks], style)
    return y + high


def _drawings(view: View[Catch], look: Look) -> Iterator[Text]:
    """The plot with the belief beside it, or below; a table; the table with the belief in a row."""
    wide = STUB + COLUMN * len(DISTANCES)
    for beside in (True, False):
        canvas = Canvas()
        y = _plot(view, canvas)
        if beside:
            _beliefs(view, canvas, wide + 18, 0, look)
        else:
            y = _beliefs(view, canvas, 0, y + 1, look)
        _throws(view, canvas, y + beside, look)
        yield canvas.text()
    for full in (True, False):
        canvas = Canvas()
        y = _table(view, canvas)
        if full:
            y = bars(canvas, y, NAMES, view.belief, look._replace(width=34))
        else:
            pairs = zip(PROFICIENCIES, view.belief, strict=True)
            canvas.put(0, y, "  ".join(f"{name}: {share:.2f}" for name, share in pairs))
            y += 1
        _throws(view, canvas, y, look)
        yield canvas.text()


def _plot(view: View[Catch], canvas: Canvas) -> int:
    """The probability of a catch by distance, a digit a proficiency: 2 is 20 m."""
    for row in range(HIGH + 1):
        label = {0: "1.0 ┤", HIGH // 2: "0.5 ┤", HIGH: "0.0 ┤"}.get(row, "    │")
        canvas.put(0, row, label, "dim")
    foot = HIGH + 1
    right = STUB + COLUMN * len(DISTANCES) + 2
    for row, words_ in enumerate(LEGEND):
        canvas.put(right, row, words_, "dim")
    canvas.put(right, foot + 2, "expected", "dim")
    canvas.put(4, foot, "└" + "─" * (COLUMN * len(DISTANCES) + 1), "dim")
    canvas.put(0, foot + 1, "metres", "dim")
    canvas.put(0, foot + 2, "pays")
    for column, (distance, promise) in enumerate(zip(DISTANCES, _promises(view), strict=True)):
        x = STUB + column * COLUMN
        marks: dict[int, str] = {}
        for proficiency, caught in zip(PROFICIENCIES, view.problem.catches, strict=True):
            row = round(HIGH * (1.0 - float(caught[column])))
            marks[row] = marks.get(row, "") + str(proficiency // 10)
        for row, digits in marks.items():
            canvas.put(x, row, digits.rjust(COLUMN), "cyan")
        canvas.put(x, foot + 1, f"{distance:{COLUMN}.0f}", "dim")
        canvas.put(x, foot + 2, f"{promise:{COLUMN}.0f}", "bold")
    return foot + 3


def _beliefs(view: View[Catch], canvas: Canvas, x: int, y: int, look: Look) -> int:
    """The belief in bars at any place; the row after it."""
    drawn = Canvas()
    bars(drawn, 0, NAMES, view.belief, look._replace(width=min(look.width, 36)))
    canvas.put(x, y, "belief in the proficiency", "dim")
    for row, line in enumerate(drawn.text().split("\n")):
        canvas.put(x, y + 1 + row, line.plain, "cyan")
    return y + 1 + len(NAMES)


def _table(view: View[Catch], canvas: Canvas) -> int:
    """Distances, the probability of a catch in percent, and the reward to expect."""
    caught = view.belief @ view.problem.catches
    rows = [("metres", DISTANCES), ("caught %", caught * 100), ("expected", _promises(view))]
    for y, (name, values) in enumerate(rows):
        canvas.put(0, y, name, "dim")
        for column, value in enumerate(values):
            canvas.put(
                8 + 3 * column, y, f"{value:{4 if column == 9 else 3}.0f}", "bold" * (y == 2)
            )
    return len(rows)


def _throws(view: View[Catch], canvas: Canvas, y: int, look: Look) -> None:
    """The last throws, and once it is told the truth."""
    thrown = [_throw(view, turn) for turn in range(view.turn)]
    words_ = [f"{name}{'✓' if caught else '✗'}" for name, caught in thrown]
    truth = "" if look.state is None else f"truly {NAMES[int(look.state)]}  "
    while words_ and len(truth) + 7 + len(" ".join(words_)) > look.width:
        words_ = words_[1:]
    canvas.put(0, y, truth, "bold magenta")
    canvas.put(len(truth), y, "throws " + (" ".join(words_) or "none yet"))


def goal(view: View[Catch]) -> list[str]:
    """What a throw pays, and what is not known."""
    return [
        "throw far: a catch pays its metres",
        "a drop nothing",
        "how far the other can catch is hidden",
    ]


def lesson(view: View[Catch]) -> Lesson:
    """Who throws to whom, what pays, and what a throw costs."""
    limit = f"one of your {view.limit} throws" if view.limit else "a turn"
    return Lesson(
        f"You throw a ball, {DISTANCES[0]:g} to {DISTANCES[-1]:g} m far, to somebody whose skill "
        "you do not know",
        "You want long throws that are caught: a catch pays its metres, a drop nothing",
        f"A throw costs nothing but {limit}; each catch and each drop tells how good the other is",
        "60",
    )


def panel(view: View[Catch]) -> list[tuple[str, str]]:
    """What the last throw paid, the sum, and the discount."""
    rewards = view.rewards or ()
    return [
        ("reward", f"{rewards[-1]:g}" if rewards else "-"),
        ("total", f"{sum(rewards):g}"),
        ("discount", f"{view.problem.discount:.2f}"),
    ]


def told(view: View[Catch]) -> str:
    """Caught or dropped, how far it was, what to believe."""
    name, caught = _throw(view, view.turn - 1)
    likeliest = words(NAMES, view.belief).partition(",")[0]
    return (
        f"{'caught' if caught else 'dropped'}. threw {name} m. proficiency likeliest {likeliest}."
    )


def situation(view: View[Catch]) -> str:
    """The last throw, the belief, and the reward to expect of each distance."""
    each = zip(DISTANCES, _promises(view), strict=True)
    promises = ", ".join(f"{distance:.0f} m {promise:.1f}" for distance, promise in each)
    before = "no throw yet."
    if view.turn:
        name, caught = _throw(view, view.turn - 1)
        before = f"{'caught' if caught else 'dropped'} {name} m."
    belief = f"belief in the proficiency: {words(NAMES, view.belief)}."
    return f"{before} {belief} expected reward: {promises}."

"""A recorded game as a page of its own: the board, the log, a timeline and plots, no network."""

import json
import re
from collections.abc import Iterator, Sequence
from importlib.resources import files
from itertools import chain
from string import Template
from tempfile import SpooledTemporaryFile
from typing import IO, NamedTuple

from dmplay.describe import counted, score
from dmplay.errors import BadParameter
from dmplay.game.playback import Playback
from dmplay.painting.markup import DARK, LIGHT, WORDS, escaped, palette, rows
from dmplay.session import believed
from dmplay.terminal import clean
from dmplay.views.kept import Moment, Once
from dmplay.views.style import Look

LEFT, WIDTH, HEIGHT, ROOM = 44, 640, 120, 10  # of a plot, in its own units
COLORS = ("blue", "yellow", "green", "magenta", "red", "cyan")
MOST_SEEN = 512  # boards and facts that are remembered as JSON
MOST_HELD, PART = 2**20, 2**13  # characters of a long file that are in memory, and read at once
MOST_STATES = 6  # whose beliefs are plotted


class Seen(NamedTuple):
    """The board as HTML, row by row, and the facts beside it; both come again."""

    board: list[str]
    panel: list[tuple[str, str]]


class Line(NamedTuple):
    """A series of a plot: its name, and a value a step."""

    name: str
    values: list[float]


class Steps:
    """The opening and every turn, undo or reroll: the one shown, and all of them, in files."""

    def __init__(self, wanted: int | None, log: IO[str], data: IO[str]) -> None:
        self.wanted, self.log, self.data = wanted, log, data
        self.many = self.turns = 0
        self.table: dict[str, int] = {}  # rows of boards, with their numbers
        self.at, self.shown, self.said = -1, Seen([], []), ""
        self._told = Once[Seen](self._json, MOST_SEEN)

    def add(self, turn: int, seen: Seen, said: str) -> None:
        """One more, as an item of the log and as JSON that can stand in a page."""
        self.log.write("\n" * (self.many > 0) + f"<li>{escaped(said)}</li>")
        told = f'{{"turn": {turn}, {self._told.of(seen)}, "said": {_quoted(said)}}}'
        self.data.write(", " * (self.many > 0) + told)
        if self.wanted in {None, turn}:  # the last of several
            self.at, self.shown, self.said = self.many, seen, said
        self.many, self.turns = self.many + 1, max(self.turns, turn)

    def _json(self, seen: Seen) -> str:
        board = [self.table.setdefault(row, len(self.table)) for row in seen.board]
        return f'"board": {_quoted(board)}, "panel": {_quoted(seen.panel)}'


def page(game: Playback, turn: int | None, look: Look) -> Iterator[str]:
    """The page, open at a turn, or at the last; raises BadParameter where there is none."""
    with _file() as log, _file() as data:
        yield from _page(game, Steps(turn, log, data), look)


def _file() -> IO[str]:
    """What is no longer in memory where it is long."""
    return SpooledTemporaryFile(MOST_HELD, "w+", encoding="utf-8", newline="")


def _page(game: Playback, steps: Steps, look: Look) -> Iterator[str]:
    returns, beliefs = _played(game, steps, look)
    if steps.at < 0:
        raise BadParameter(f"--at: got {steps.wanted}, the game has {counted(steps.turns, 'turn')}")
    plots = [_plot(f"{score(game.problem)} so far", returns), _plot("belief", beliefs)]
    facts = steps.shown.panel
    panel = (f"<dt>{escaped(label)}</dt><dd>{escaped(told)}</dd>" for label, told in facts)
    words = {
        "title": escaped(f"dmplay {game.name}"),
        "goal": escaped("; ".join(game.account.kept.goal(game.moment(0)))),
        "light": LIGHT,
        "dark": DARK,
        "words": WORDS,
        "palette": palette(steps.table),
        "board": "\n".join(steps.shown.board),
        "said": escaped(steps.said),
        "panel": "".join(panel),
        "plots": "\n".join(filter(None, plots)),
        "result": escaped(f"over: {game.account.result()}"),
        "last": steps.many - 1,
        "at": steps.at,
    }
    told = {"log": _whole(steps.log), "data": _data(steps)}  # which are long
    template = files("dmplay.reports").joinpath("page.html").read_text(encoding="utf-8")
    for part in re.split(r"\$(log|data)\b", template):
        yield from told.get(part) or [Template(part).substitute(words)]


def _whole(file: IO[str]) -> Iterator[str]:
    """All that a file holds, part by part."""
    file.seek(0)
    while part := file.read(PART):
        yield part


def _data(steps: Steps) -> Iterator[str]:
    """All that the page's script shows, as JSON that can stand in a page."""
    yield f'{{"rows": {_quoted([*steps.table])}, "steps": ['
    yield from _whole(steps.data)
    yield f'], "left": {LEFT}, "width": {WIDTH}}}'


def _quoted(told: object) -> str:
    return json.dumps(told, ensure_ascii=False).replace("<", "\\u003c")


def _played(game: Playback, steps: Steps, look: Look) -> tuple[list[Line], list[Line]]:
    """Adds every step; the return of each seat after it, and the first's belief in each state."""
    returns, beliefs = [Line(agent, []) for agent in game.problem.agents], _believed(game)
    changes = (game.account.change(game.moment(), before) for before in game.run())
    for said in chain([game.account.situation(game.moment())], changes):
        now = game.moment()
        steps.add(now.turn, _seen(game, look), clean(said))
        for seat, line in enumerate(returns):
            line.values.append(game.session.returned(seat))
        for line, value in zip(beliefs, now.view.belief.tolist() if beliefs else (), strict=False):
            line.values.append(value)
    return returns, beliefs


def _seen(game: Playback, look: Look) -> Seen:
    """The board and the facts now, as they were seen wherever the game was so."""

    def seen(now: Moment) -> Seen:
        facts = game.account.kept.panel(now)
        panel = [(clean(label), clean(value)) for label, value in facts]
        return Seen(rows(game.draw(look, now)), panel)

    wanted = (look.width, look.height, look.ascii, game.session.state.tobytes())
    return game.account.kept.answer("page", game.moment(), seen, wanted)


def _believed(game: Playback) -> list[Line]:
    """A line for each state that the first seat believes in, where these are few enough to plot."""
    problem = game.problem
    few = game.session.believes and believed(problem) <= MOST_STATES
    return [Line(problem.notation(state), []) for state in problem.enumerated()] if few else []


def _plot(title: str, lines: Sequence[Line]) -> str:
    """Lines over the steps, with a mark that moves; nothing where there is none."""
    if not lines or len(lines[0].values) < 2:
        return ""
    values = [value for line in lines for value in line.values]
    low, high = min(*values, 0.0), max(*values, 0.0)
    steps = len(lines[0].values) - 1

    def y(value: float) -> float:
        return ROOM + HEIGHT * (high - value) / ((high - low) or 1.0)

    drawn = [
        f'<polyline class="series" stroke="var(--{color})" points="'
        + " ".join(
            f"{LEFT + WIDTH * n / steps:.1f},{y(value):.1f}" for n, value in enumerate(line.values)
        )
        + '"/>'
        for line, color in zip(lines, _colors(len(lines)), strict=True)
    ]
    axis = f'<line class="axis" x1="{LEFT}" x2="{LEFT + WIDTH}" y1="{y(0):.1f}" y2="{y(0):.1f}"/>'
    ends = "".join(
        f'<text x="{LEFT - 6}" y="{y(value) + 4:.1f}" text-anchor="end">{value:.3g}</text>'
        for value in {low, high}
    )
    now = f'<line class="now" x1="{LEFT}" x2="{LEFT}" y1="{ROOM}" y2="{ROOM + HEIGHT}"/>'
    told = ", ".join(
        f'<span class="{color}">{escaped(line.name)} {line.values[-1]:.4g}</span>'
        for line, color in zip(lines, _colors(len(lines)), strict=True)
    )
    box = f'viewBox="0 0 {LEFT + WIDTH + ROOM} {HEIGHT + 2 * ROOM}" preserveAspectRatio="none"'
    return (
        f'<figure><figcaption>{title}: {told}</figcaption><svg {box} role="img" '
        f'aria-label="{title}">{axis}{ends}{"".join(drawn)}{now}</svg></figure>'
    )


def _colors(many: int) -> list[str]:
    return [COLORS[number % len(COLORS)] for number in range(many)]

"""A recorded game as a page of its own: the board, the log, a timeline and plots, no network."""

import json
import re
from collections.abc import Iterator, Sequence
from importlib.resources import files
from string import Template
from typing import NamedTuple

from rich.text import Text

from dmplay.core import Problem
from dmplay.describe import counted, score
from dmplay.errors import BadParameter
from dmplay.game.playback import Playback
from dmplay.painting.markup import DARK, LIGHT, WORDS, escaped, palette, rows
from dmplay.session import believed
from dmplay.terminal import clean
from dmplay.views.style import Look

LEFT, WIDTH, HEIGHT, ROOM = 44, 640, 120, 10  # of a plot, in its own units
COLORS = ("blue", "yellow", "green", "magenta", "red", "cyan")
MOST_DRAWN = 512  # drawings that are remembered as HTML
MOST_STATES = 6  # whose beliefs are plotted


class Step(NamedTuple):
    """What the page shows at one step: the opening, a turn, an undo or a reroll."""

    turn: int
    board: list[str]  # its rows as HTML
    panel: list[tuple[str, str]]
    said: str


class Line(NamedTuple):
    """A series of a plot: its name, and a value a step."""

    name: str
    values: list[float]


def page(game: Playback, turn: int | None, look: Look) -> Iterator[str]:
    """The page, open at a turn, or at the last; raises BadParameter where there is none."""
    steps, returns, beliefs = _steps(game, look)
    at = _place(steps, turn)
    table = list(dict.fromkeys(row for step in steps for row in step.board))
    shown = steps[at]
    plots = [_plot(f"{score(game.problem)} so far", returns), _plot("belief", beliefs)]
    panel = (f"<dt>{escaped(label)}</dt><dd>{escaped(told)}</dd>" for label, told in shown.panel)
    words = {
        "title": escaped(f"dmplay {game.name}"),
        "goal": escaped("; ".join(game.account.kept.goal(game.moment(0)))),
        "light": LIGHT,
        "dark": DARK,
        "words": WORDS,
        "palette": palette(table),
        "board": "\n".join(shown.board),
        "said": escaped(shown.said),
        "panel": "".join(panel),
        "plots": "\n".join(filter(None, plots)),
        "result": escaped(f"over: {game.account.result()}"),
        "last": len(steps) - 1,
        "at": at,
    }
    told = {"log": _log(steps), "data": _data(steps, table)}  # which are long
    template = files("dmplay.reports").joinpath("page.html").read_text(encoding="utf-8")
    for part in re.split(r"\$(log|data)\b", template):
        yield from told.get(part) or [Template(part).substitute(words)]


def _log(steps: Sequence[Step]) -> Iterator[str]:
    for number, step in enumerate(steps):
        yield "\n" * (number > 0) + f"<li>{escaped(step.said)}</li>"


def _data(steps: Sequence[Step], table: Sequence[str]) -> Iterator[str]:
    """All that the page's script shows, as JSON that can stand in a page."""
    place = {row: number for number, row in enumerate(table)}
    yield f'{{"rows": {_quoted(table)}, "steps": ['
    for number, step in enumerate(steps):
        told = step._asdict() | {"board": [place[row] for row in step.board]}
        yield ", " * (number > 0) + _quoted(told)
    yield f'], "left": {LEFT}, "width": {WIDTH}}}'


def _quoted(told: object) -> str:
    return json.dumps(told, ensure_ascii=False).replace("<", "\\u003c")


def _steps(game: Playback, look: Look) -> tuple[list[Step], list[Line], list[Line]]:
    """Every step, the return of each seat after it, and its belief in each state."""
    drawn: dict[int, tuple[Text, list[str]]] = {}  # rows as HTML, by the drawing itself
    steps = [_step(game, look, game.account.situation(game.moment()), drawn)]
    sums, seen = [game.session.returns().tolist()], [_belief(game)]
    for before in game.run():
        steps.append(_step(game, look, game.account.change(game.moment(), before), drawn))
        sums.append(game.session.returns().tolist())
        seen.append(_belief(game))
    agents = game.problem.agents
    returns = [Line(who, [row[seat] for row in sums]) for seat, who in enumerate(agents)]
    return steps, returns, _believed(game.problem, seen)


def _step(game: Playback, look: Look, said: str, drawn: dict[int, tuple[Text, list[str]]]) -> Step:
    board, facts = game.draw(look), game.account.kept.panel(game.moment())
    if id(board) not in drawn:
        if len(drawn) == MOST_DRAWN:
            drawn.clear()
        drawn[id(board)] = board, rows(board)
    panel = [(clean(label), clean(value)) for label, value in facts]
    return Step(game.moment().turn, drawn[id(board)][1], panel, clean(said))


def _belief(game: Playback) -> list[float]:
    """What the first seat believes, where that is little enough to plot."""
    few = game.session.believes and believed(game.problem) <= MOST_STATES
    return game.view().belief.tolist() if few else []


def _believed(problem: Problem, seen: Sequence[Sequence[float]]) -> list[Line]:
    if not seen[0]:
        return []
    names = [problem.notation(state) for state in problem.enumerated()]
    return [Line(name, [row[at] for row in seen]) for at, name in enumerate(names)]


def _place(steps: Sequence[Step], turn: int | None) -> int:
    """The last step at a turn; the last of all if none is named."""
    if turn is None:
        return len(steps) - 1
    found = [number for number, step in enumerate(steps) if step.turn == turn]
    if not found:
        turns = counted(max(step.turn for step in steps), "turn")
        raise BadParameter(f"--at: got {turn}, the game has {turns}")
    return found[-1]


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

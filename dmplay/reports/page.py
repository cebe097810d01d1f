"""A recorded game as a page of its own: the board, the log, a timeline and plots, no network."""

import json
from collections.abc import Sequence
from importlib.resources import files
from string import Template
from typing import NamedTuple

from dmplay.core import Problem
from dmplay.describe import counted, score
from dmplay.errors import BadParameter
from dmplay.game.playback import Playback
from dmplay.reports.markup import DARK, LIGHT, WORDS, escaped, palette, rows
from dmplay.session import View
from dmplay.terminal import clean
from dmplay.views.style import Look

LEFT, WIDTH, HEIGHT, ROOM = 44, 640, 120, 10  # of a plot, in its own units
COLORS = ("blue", "yellow", "green", "magenta", "red", "cyan")
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


def page(game: Playback, turn: int | None, look: Look) -> str:
    """The page, open at a turn, or at the last; raises BadParameter where there is none."""
    steps, returns, beliefs = _steps(game, look)
    at = _place(steps, turn)
    table = list(dict.fromkeys(row for step in steps for row in step.board))
    place = {row: number for number, row in enumerate(table)}
    data = {
        "rows": table,
        "steps": [one._asdict() | {"board": [place[row] for row in one.board]} for one in steps],
        "left": LEFT,
        "width": WIDTH,
    }
    shown = steps[at]
    plots = [_plot(f"{score(game.problem)} so far", returns), _plot("belief", beliefs)]
    template = Template(files("dmplay.reports").joinpath("page.html").read_text(encoding="utf-8"))
    return template.substitute(
        title=escaped(f"dmplay {game.name}"),
        goal=escaped("; ".join(game.style.goal(game.view(0)))),
        light=LIGHT,
        dark=DARK,
        words=WORDS,
        palette=palette(table),
        board="\n".join(shown.board),
        said=escaped(shown.said),
        panel="".join(
            f"<dt>{escaped(label)}</dt><dd>{escaped(value)}</dd>" for label, value in shown.panel
        ),
        plots="\n".join(filter(None, plots)),
        log="\n".join(f"<li>{escaped(step.said)}</li>" for step in steps),
        result=escaped(f"over: {game.account.result()}"),
        data=json.dumps(data, ensure_ascii=False).replace("<", "\\u003c"),
        last=len(steps) - 1,
        at=at,
    )


def _steps(game: Playback, look: Look) -> tuple[list[Step], list[Line], list[Line]]:
    """Every step, the return of each seat after it, and its belief in each state."""
    steps = [_step(game, look, game.account.situation(game.view(0)))]
    sums, seen = [[*game.session.returns()]], [_belief(game.view(0))]
    for before in game.run():
        steps.append(_step(game, look, game.account.change(game.view(0), before)))
        sums.append([*game.session.returns()])
        seen.append(_belief(game.view(0)))
    agents = game.problem.agents
    returns = [Line(who, [float(row[seat]) for row in sums]) for seat, who in enumerate(agents)]
    return steps, returns, _believed(game.problem, seen)


def _step(game: Playback, look: Look, said: str) -> Step:
    view = game.view(0)
    facts = [(clean(label), clean(value)) for label, value in game.style.panel(view)]
    return Step(view.turn, rows(game.draw(look)), facts, clean(said))


def _belief(view: View[Problem]) -> list[float]:
    """What the first seat believes, where that is little enough to plot."""
    if view.beliefs is None or len(view.belief) > MOST_STATES:
        return []
    return [float(share) for share in view.belief]


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

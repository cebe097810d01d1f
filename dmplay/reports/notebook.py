"""A game as a notebook shows it: the board as one seat may know it, as text and as HTML."""

from rich.text import Text

from dmplay.core import Problem
from dmplay.describe import score
from dmplay.finding import problems
from dmplay.finding.names import name_of
from dmplay.game.playback import Playback
from dmplay.painting.markup import DARK, LIGHT, WORDS, escaped, palette, rows
from dmplay.session import Session, View
from dmplay.terminal import clean
from dmplay.views.style import Look, fit, style_of

LOOK = Look(80, 24, large=True)
BOX = """color: var(--ink); background: var(--paper); border: 1px solid var(--line);
  font: .9rem/1.5 system-ui, sans-serif; padding: .5rem 1rem; width: fit-content;
  max-width: 100%; overflow-x: auto;"""
BOARD = """font: 1em/1.16 "DejaVu Sans Mono", Menlo, Consolas, monospace; color: inherit;
  background: none; margin: .5rem 0;"""
ON_LIGHT = '[data-jp-theme-light="true"] .dmplay, .vscode-light .dmplay'
ON_DARK = '[data-jp-theme-light="false"] .dmplay, .vscode-dark .dmplay'


def bundle(game: Session | Playback) -> dict[str, str]:
    """A game by the type of what it is shown as.

    While it goes on it is shown as the first seat sees it that is played from outside, or the first
    of all; as none where several are and see different things. Of a recording nothing is hidden.
    """
    session, open_ = (game.session, True) if isinstance(game, Playback) else (game, game.over)
    secret = session.problem.hidden and not open_
    seat = _seat(session, secret=secret)
    title = f"dmplay {_name(session.problem)}"
    if seat is None:
        told = f"turn {len(session.turns)}. each seat sees something else: view(seat) has it."
        return {"text/plain": f"{title}  {told}", "text/html": _html(title, [told], Text(""))}
    view = session.view(seat)
    look = LOOK._replace(state=session.state if session.problem.hidden and open_ else None)
    board = fit(style_of(session.problem), view, look)
    head, facts = f"{title}  {_stands(session, view)}", _facts(view)
    plain = "\n".join(row.rstrip() for row in board.plain.split("\n"))
    return {"text/plain": "\n".join([head, plain, *facts]), "text/html": _html(head, facts, board)}


def _seat(session: Session, *, secret: bool) -> int | None:
    """The seat whose view is shown; None where several would see what only one of them may."""
    played = [seat for seat, agent in enumerate(session.followers) if agent is None] or [0]
    return None if secret and len(played) > 1 else played[0]


def _name(problem: Problem) -> str:
    stem = problems.stem(problem)
    return name_of(stem) if stem else type(problem).__name__


def _stands(session: Session, view: View[Problem]) -> str:
    """Turn, score where it is known, whose view this is, and how it ended."""
    parts = [f"turn {view.turn}"]
    if view.rewards is not None:
        parts.append(f"{score(view.problem)} {session.returns()[view.seat]:.6g}")
    if len(view.problem.agents) > 1:
        parts.append(f"as {view.problem.agents[view.seat]} sees it")
    return "  ".join([*parts, *filter(None, [view.ending])])


def _facts(view: View[Problem]) -> list[str]:
    """What the side panel of the screen has."""
    return [clean(f"{label} {value}") for label, value in style_of(view.problem).panel(view)]


def _html(title: str, facts: list[str], board: Text) -> str:
    """A box in the colours of the notebook, dark or light; its styles are for it alone."""
    drawn = rows(board)
    lines = "\n".join(drawn)
    styles = [
        f".dmplay {{ {LIGHT} {BOX} pre {{ {BOARD} }}\n{WORDS}\n{palette(drawn)} }}",
        f"@media (prefers-color-scheme: dark) {{ .dmplay {{ {DARK} }} }}",
        f"{ON_LIGHT} {{ {LIGHT} }}",
        f"{ON_DARK} {{ {DARK} }}",
    ]
    return "\n".join(
        [
            f'<div class="dmplay"><style>{" ".join(styles)}</style>',
            f"<strong>{escaped(title)}</strong>",
            f"<pre>{lines}</pre>",
            f"<span>{' · '.join(map(escaped, facts))}</span></div>",
        ]
    )

"""A game as a notebook shows it: the board as one seat may know it, as text and as HTML."""

from rich.text import Text

from dmplay.core import Problem
from dmplay.describe import score_label
from dmplay.finding import problems
from dmplay.finding.names import stem_to_name
from dmplay.game.playback import Playback
from dmplay.painting.markup import (
    DARK_THEME_CSS,
    LIGHT_THEME_CSS,
    STYLE_CLASS_CSS,
    build_palette_css,
    escape_html,
    render_html_rows,
)
from dmplay.session import Session, View
from dmplay.terminal import escape_unprintable
from dmplay.views.style import DrawOptions, fit_board, load_view_module

DRAW_OPTIONS = DrawOptions(80, 24, allow_large=True)
BOX_CSS = """color: var(--ink); background: var(--paper); border: 1px solid var(--line);
  font: .9rem/1.5 system-ui, sans-serif; padding: .5rem 1rem; width: fit-content;
  max-width: 100%; overflow-x: auto;"""
BOARD_CSS = """font: 1em/1.16 "DejaVu Sans Mono", Menlo, Consolas, monospace; color: inherit;
  background: none; margin: .5rem 0;"""
LIGHT_THEME_SELECTOR = '[data-jp-theme-light="true"] .dmplay, .vscode-light .dmplay'
DARK_THEME_SELECTOR = '[data-jp-theme-light="false"] .dmplay, .vscode-dark .dmplay'


def mime_bundle(game: Session | Playback) -> dict[str, str]:
    """A game by the type of what it is shown as.

    While it goes on it is shown as the first seat sees it that is played from outside, or the first
    of all; as none where several are and see different things. Of a recording nothing is hidden.
    """
    session, open_ = (game.session, True) if isinstance(game, Playback) else (game, game.over)
    secret = session.problem.partially_observable and not open_
    seat = _visible_seat(session, secret=secret)
    title = f"dmplay {_problem_name(session.problem)}"
    if seat is None:
        told = f"turn {len(session.turns)}. each seat sees something else: view(seat) has it."
        return {
            "text/plain": f"{title}  {told}",
            "text/html": _render_html(title, [told], Text("")),
        }
    view = session.view(seat)
    look = DRAW_OPTIONS._replace(
        revealed_state=session.state if session.problem.partially_observable and open_ else None
    )
    board = fit_board(load_view_module(session.problem), view, look)
    head, facts = f"{title}  {_status_line(session, view)}", _panel_lines(view)
    plain = "\n".join(row.rstrip() for row in board.plain.split("\n"))
    return {
        "text/plain": "\n".join([head, plain, *facts]),
        "text/html": _render_html(head, facts, board),
    }


def _visible_seat(session: Session, *, secret: bool) -> int | None:
    """The seat whose view is shown; None where several would see what only one of them may."""
    played = [seat for seat, agent in enumerate(session.seated_policies) if agent is None] or [0]
    return None if secret and len(played) > 1 else played[0]


def _problem_name(problem: Problem) -> str:
    stem = problems.builtin_stem(problem)
    return stem_to_name(stem) if stem else type(problem).__name__


def _status_line(session: Session, view: View[Problem]) -> str:
    """Turn, score where it is known, whose view this is, and how it ended."""
    parts = [f"turn {view.turns_played}"]
    if view.rewards is not None:
        parts.append(f"{score_label(view.problem)} {session.returns()[view.seat]:.6g}")
    if len(view.problem.agents) > 1:
        parts.append(f"as {view.problem.agents[view.seat]} sees it")
    return "  ".join([*parts, *filter(None, [view.end_reason])])


def _panel_lines(view: View[Problem]) -> list[str]:
    """What the side panel of the screen has."""
    return [
        escape_unprintable(f"{label} {value}")
        for label, value in load_view_module(view.problem).panel_rows(view)
    ]


def _render_html(title: str, facts: list[str], board: Text) -> str:
    """A box in the colours of the notebook, dark or light; its styles are for it alone."""
    drawn = render_html_rows(board)
    lines = "\n".join(drawn)
    styles = [
        f".dmplay {{ {LIGHT_THEME_CSS} {BOX_CSS} pre {{ {BOARD_CSS} }}\n{STYLE_CLASS_CSS}\n{build_palette_css(drawn)} }}",
        f"@media (prefers-color-scheme: dark) {{ .dmplay {{ {DARK_THEME_CSS} }} }}",
        f"{LIGHT_THEME_SELECTOR} {{ {LIGHT_THEME_CSS} }}",
        f"{DARK_THEME_SELECTOR} {{ {DARK_THEME_CSS} }}",
    ]
    return "\n".join(
        [
            f'<div class="dmplay"><style>{" ".join(styles)}</style>',
            f"<strong>{escape_html(title)}</strong>",
            f"<pre>{lines}</pre>",
            f"<span>{' · '.join(map(escape_html, facts))}</span></div>",
        ]
    )

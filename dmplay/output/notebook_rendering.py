"""A game in a notebook: the board with one seat's information, as text and as HTML."""

from rich.text import Text

from dmplay.core.problem import Problem
from dmplay.core.problem_summary import score_label
from dmplay.core.session import Session, View
from dmplay.core.text import escape_unprintable, format_reward
from dmplay.draw.options import DrawOptions
from dmplay.game.playback import Playback
from dmplay.output.html_markup import (
    DARK_THEME_CSS,
    LIGHT_THEME_CSS,
    STYLE_CLASS_CSS,
    build_palette_css,
    escape_html,
    render_html_rows,
)
from dmplay.registry.problem_module_exports import get_problem_name
from dmplay.views.protocol import fit_board, load_view_module

DRAW_OPTIONS = DrawOptions(80, 24, allow_large=True)
BOX_CSS = """color: var(--ink); background: var(--paper); border: 1px solid var(--line);
  font: .9rem/1.5 system-ui, sans-serif; padding: .5rem 1rem; width: fit-content;
  max-width: 100%; overflow-x: auto; overflow-wrap: anywhere;"""
BOARD_CSS = """font: 1em/1.16 "DejaVu Sans Mono", Menlo, Consolas, monospace; color: inherit;
  background: none; margin: .5rem 0;"""
LIGHT_THEME_SELECTOR = '[data-jp-theme-light="true"] .dmplay, .vscode-light .dmplay'
DARK_THEME_SELECTOR = '[data-jp-theme-light="false"] .dmplay, .vscode-dark .dmplay'


def render_mime_bundle(game: Session | Playback) -> dict[str, str]:
    """Return a game as a MIME bundle of plain text and HTML.

    A running game is shown from the first seat that is played from outside, or from the first seat
    if there is none. If several seats are played from outside and their information differs, no
    board is shown. A finished game and a recording are shown with hidden states revealed.
    """
    session, is_revealed = (game.session, True) if isinstance(game, Playback) else (game, game.over)
    is_private = session.problem.partially_observable and not is_revealed
    seat = _find_visible_seat(session, secret=is_private)
    title = f"dmplay {get_problem_name(session.problem)}"
    if seat is None:
        message = f"turn {len(session.turns)}. each seat has its own view: call view(seat)."
        return {
            "text/plain": f"{title}  {message}",
            "text/html": _render_html(title, [message], Text("")),
        }
    view = session.view(seat)
    options = DRAW_OPTIONS._replace(
        revealed_state=session.state
        if session.problem.partially_observable and is_revealed
        else None
    )
    style = load_view_module(session.problem)
    board, heading = (fit_board(style, view, options), f"{title}  {_format_status(session, view)}")
    facts = [escape_unprintable(f"{label} {value}") for label, value in style.panel_rows(view)]
    plain = "\n".join(row.rstrip() for row in board.plain.split("\n"))
    return {
        "text/plain": "\n".join([heading, plain, *facts]),
        "text/html": _render_html(heading, facts, board),
    }


def _find_visible_seat(session: Session, *, secret: bool) -> int | None:
    """Return the seat whose view is shown, or None if several seats have private information."""
    outside_seats = [
        seat for seat, agent in enumerate(session.seated_policies) if agent is None
    ] or [0]
    return None if secret and len(outside_seats) > 1 else outside_seats[0]


def _format_status(session: Session, view: View[Problem]) -> str:
    """Return a line with the turn, the score if visible, the seat shown and the end reason."""
    parts = [f"turn {view.turns_played}"]
    if view.rewards is not None:
        parts.append(f"{score_label(view.problem)} {format_reward(session.returns()[view.seat])}")
    if len(view.problem.agents) > 1:
        parts.append(f"as {view.problem.agents[view.seat]} sees it")
    return "  ".join([*parts, *filter(None, [view.end_reason])])


def _render_html(title: str, facts: list[str], board: Text) -> str:
    """Return a box in the notebook's colours, dark or light, with styles that apply to it alone."""
    html_rows = render_html_rows(board)
    lines = "\n".join(html_rows)
    styles = [
        (
            f".dmplay {{ {LIGHT_THEME_CSS} {BOX_CSS} pre {{ {BOARD_CSS} "
            f"}}\n{STYLE_CLASS_CSS}\n{build_palette_css(html_rows)} }}"
        ),
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

"""Drawings as HTML: their rows, and the colours that these have on a light and on a dark page."""

import html
from collections.abc import Iterable

from rich.text import Text

from dmplay.styles import PALETTE_HEX, split_style_runs
from dmplay.terminal import escape_unprintable

LIGHT_THEME_CSS = """--ink: #1c1c1c; --paper: #ffffff; --faint: #595959; --line: #bfbfbf; --mark: #0b57a4;
  --red: #b00000; --green: #0a6b0a; --yellow: #7a5200; --blue: #0b57a4; --magenta: #8a008a;
  --cyan: #006a70;"""
DARK_THEME_CSS = """--ink: #e6e6e6; --paper: #16181c; --faint: #a3a3a3; --line: #4a4d52; --mark: #7db8ff;
  --red: #ff8080; --green: #7ddc7d; --yellow: #ffd24d; --blue: #7db8ff; --magenta: #ff8cff;
  --cyan: #5fe0e6;"""
STYLE_CLASS_CSS = """\
.bold { font-weight: bold; } .dim { color: var(--faint); }
.underline { text-decoration: underline; }
.reverse { color: var(--paper); background: var(--ink); }
[class*="on-c"] { padding: .12em 0; }
.red { color: var(--red); } .green { color: var(--green); } .yellow { color: var(--yellow); }
.blue { color: var(--blue); } .magenta { color: var(--magenta); } .cyan { color: var(--cyan); }"""


def render_html_rows(text: Text) -> list[str]:
    """A drawing as HTML, row by row."""
    found = [""]
    for words, piece in split_style_runs(text):
        for number, part in enumerate(piece.split("\n")):
            found += [""] if number else []
            found[-1] += _wrap_in_span(words, escape_html(part))
    return found


def _wrap_in_span(style_words: Iterable[str], part: str) -> str:
    names = " ".join(sorted(map(_format_css_class, style_words)))
    return f'<span class="{names}">{part}</span>' if names and part.strip() + names else part


def _format_css_class(style_word: str) -> str:
    """The class of a word of a style: `color(214)` is c214, `on_color(214)` is on-c214."""
    return style_word.replace("on_", "on-").replace("color(", "c").removesuffix(")")


def build_palette_css(rows: Iterable[str]) -> str:
    """The classes of the palette's colours that these rows have."""
    whole = "".join(rows)
    written = (f".c{n} {{ color: {rgb}; }}" for n, rgb in PALETTE_HEX.items() if f"c{n}" in whole)
    filled = (
        f".on-c{n} {{ background: {rgb}; }}"
        for n, rgb in PALETTE_HEX.items()
        if f"on-c{n}" in whole
    )
    return "\n".join([*written, *filled])


def escape_html(text: str) -> str:
    """A text safe to stand in a page, and in a template of one."""
    return html.escape(escape_unprintable(text)).replace("$", "&#36;")

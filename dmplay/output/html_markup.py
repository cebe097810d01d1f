"""Render styled text as HTML rows, with colours for light and dark pages."""

import html
from collections.abc import Iterable

from rich.text import Text

from dmplay.core.text import escape_unprintable
from dmplay.terminal.styles import PALETTE_HEX, SGR_CODES, split_style_runs

LIGHT_THEME_CSS = """--ink: #1c1c1c; --paper: #ffffff; --faint: #595959; --line: #bfbfbf;
  --mark: #0b57a4; --current: #e2ebf4;
  --red: #b00000; --green: #0a6b0a; --yellow: #7a5200; --blue: #0b57a4; --magenta: #8a008a;
  --cyan: #006a70;"""
DARK_THEME_CSS = """--ink: #e6e6e6; --paper: #16181c; --faint: #a3a3a3; --line: #4a4d52;
  --mark: #7db8ff; --current: #222b37;
  --red: #ff8080; --green: #7ddc7d; --yellow: #ffd24d; --blue: #7db8ff; --magenta: #ff8cff;
  --cyan: #5fe0e6;"""
STYLE_CLASS_CSS = """\
.bold { font-weight: bold; } .dim { color: var(--faint); }
.underline { text-decoration: underline; }
.reverse { color: var(--paper); background: var(--ink); }
[class*="on-c"] { padding: .12em 0; }
.red { color: var(--red); } .green { color: var(--green); } .yellow { color: var(--yellow); }
.blue { color: var(--blue); } .magenta { color: var(--magenta); } .cyan { color: var(--cyan); }
"""
# Reversed text in a colour is paper on that colour, as on a terminal; a colour on ink is too dark.
STYLE_CLASS_CSS += " ".join(
    f".reverse.{color} {{ color: var(--paper); background: var(--{color}); }}"
    for color in ("red", "green", "yellow", "blue", "magenta", "cyan")
)


def render_html_rows(text: Text) -> list[str]:
    """Return styled text as HTML, one string per row."""
    html_rows = [""]
    for style_words, piece in split_style_runs(text):
        for index, part in enumerate(piece.split("\n")):
            html_rows += [""] if index else []
            html_rows[-1] += _wrap_in_span(style_words, escape_html(part))
    return html_rows


def _wrap_in_span(style_words: Iterable[str], part: str) -> str:
    """Wrap a piece of text in a span with the classes of its style words, if it has any.

    Words that are not styles of a terminal are left out: a user's text may have any, such as the
    target of a link, and they would be markup of the page.
    """
    known_words = (word for word in style_words if word in SGR_CODES)
    class_names = " ".join(sorted(map(_format_css_class, known_words)))
    if class_names and part.strip() + class_names:
        return f'<span class="{class_names}">{part}</span>'
    return part


def _format_css_class(style_word: str) -> str:
    """Return the CSS class of a style word: `color(214)` is c214, `on_color(214)` is on-c214."""
    return style_word.replace("on_", "on-").replace("color(", "c").removesuffix(")")


def build_palette_css(rows: Iterable[str]) -> str:
    """Return the CSS rules of the palette colours that occur in these HTML rows."""
    markup = "".join(rows)
    foreground_rules = (
        f".c{n} {{ color: {rgb}; }}" for n, rgb in PALETTE_HEX.items() if f"c{n}" in markup
    )
    background_rules = (
        f".on-c{n} {{ background: {rgb}; }}"
        for n, rgb in PALETTE_HEX.items()
        if f"on-c{n}" in markup
    )
    return "\n".join([*foreground_rules, *background_rules])


def escape_html(text: str) -> str:
    """Escape text for an HTML page that is also a string template."""
    return html.escape(escape_unprintable(text)).replace("$", "&#36;")

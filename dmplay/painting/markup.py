"""Drawings as HTML: their rows, and the colours that these have on a light and on a dark page."""

import html
from collections.abc import Iterable

from rich.text import Text

from dmplay.styles import PALETTE, runs
from dmplay.terminal import clean

LIGHT = """--ink: #1c1c1c; --paper: #ffffff; --faint: #595959; --line: #bfbfbf; --mark: #0b57a4;
  --red: #b00000; --green: #0a6b0a; --yellow: #7a5200; --blue: #0b57a4; --magenta: #8a008a;
  --cyan: #006a70;"""
DARK = """--ink: #e6e6e6; --paper: #16181c; --faint: #a3a3a3; --line: #4a4d52; --mark: #7db8ff;
  --red: #ff8080; --green: #7ddc7d; --yellow: #ffd24d; --blue: #7db8ff; --magenta: #ff8cff;
  --cyan: #5fe0e6;"""
WORDS = """\
.bold { font-weight: bold; } .dim { color: var(--faint); }
.underline { text-decoration: underline; }
.reverse { color: var(--paper); background: var(--ink); }
[class*="on-c"] { padding: .12em 0; }
.red { color: var(--red); } .green { color: var(--green); } .yellow { color: var(--yellow); }
.blue { color: var(--blue); } .magenta { color: var(--magenta); } .cyan { color: var(--cyan); }"""


def rows(drawn: Text) -> list[str]:
    """A drawing as HTML, row by row."""
    found = [""]
    for words, piece in runs(drawn):
        for number, part in enumerate(piece.split("\n")):
            found += [""] if number else []
            found[-1] += _styled(words, escaped(part))
    return found


def _styled(words: Iterable[str], part: str) -> str:
    names = " ".join(sorted(map(_class, words)))
    return f'<span class="{names}">{part}</span>' if names and part.strip() + names else part


def _class(word: str) -> str:
    """The class of a word of a style: `color(214)` is c214, `on_color(214)` is on-c214."""
    return word.replace("on_", "on-").replace("color(", "c").removesuffix(")")


def palette(rows: Iterable[str]) -> str:
    """The classes of the palette's colours that these rows have."""
    whole = "".join(rows)
    written = (f".c{n} {{ color: {rgb}; }}" for n, rgb in PALETTE.items() if f"c{n}" in whole)
    filled = (
        f".on-c{n} {{ background: {rgb}; }}" for n, rgb in PALETTE.items() if f"on-c{n}" in whole
    )
    return "\n".join([*written, *filled])


def escaped(text: str) -> str:
    """A text safe to stand in a page, and in a template of one."""
    return html.escape(clean(text)).replace("$", "&#36;")

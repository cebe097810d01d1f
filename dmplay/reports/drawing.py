"""Figures on the terminal and as pictures."""

import io
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from rich._export_format import CONSOLE_SVG_FORMAT
from rich.console import Console
from rich.text import Text

from dmplay.disk import write
from dmplay.figures.every import figure, figures
from dmplay.game.errand import Printout
from dmplay.game.formats import fits
from dmplay.styles import ansi
from dmplay.terminal import Terminal
from dmplay.views.canvas import plainly, size

# Rich's own template, but nothing is loaded from elsewhere.
SVG = re.sub(r"@font-face {{.*?}}\n", "", CONSOLE_SVG_FORMAT, flags=re.DOTALL).replace(
    "Fira Code, monospace", "'Fira Code', 'DejaVu Sans Mono', Menlo, Consolas, monospace"
)
VIEW_BOX = re.compile(r'viewBox="[^"]*"')
FILM = """
.film > svg {{ visibility: hidden; animation: turn {length}s infinite }}
@keyframes turn {{ 0% {{ visibility: visible }} {share:.4f}%, 100% {{ visibility: hidden }} }}
@media (prefers-reduced-motion: reduce) {{
  .film > svg {{ animation: none }}
  .film > svg:last-child {{ visibility: visible }}
}}
"""


def console(width: int) -> Console:
    """A console that draws a text as it is and remembers it."""
    return Console(
        width=width, record=True, file=io.StringIO(), force_terminal=True,
        color_system="standard", legacy_windows=False, highlight=False,
    )  # fmt: skip


def picture(text: Text, title: str, *, width: int = 0, name: str = "dmplay") -> str:
    """A text as SVG, as wide as it is if no width is given; `name` begins all names in it."""
    drawn = console(width or size(text)[0] + 1)
    drawn.print(text, soft_wrap=True)
    return drawn.export_svg(title=title, unique_id=name, code_format=SVG)


def film(texts: Iterable[Text], many: int, title: str, width: int) -> Iterator[str]:
    """So many texts as one animated SVG, a second each; the last alone for who wants no motion."""
    style = FILM.format(length=many, share=100 / many)
    for second, text in enumerate(texts):
        drawn = picture(text, title, width=width, name=f"t{second}")
        if not second:
            box = VIEW_BOX.search(drawn)
            assert box
            yield f'<svg class="film" {box[0]} xmlns="http://www.w3.org/2000/svg">\n'
            yield f"<style>{style}</style>\n"
        timed = f'<svg style="animation-delay: {second}s"'
        yield drawn.replace("<svg", timed, 1) + "\n"
    yield "</svg>\n"


def shown(text: Text, terminal: Terminal) -> str:
    """A text, in colour and in Unicode where the terminal can."""
    able = plainly(text) if terminal.ascii else text
    return ansi(able, terminal.theme) if terminal.color else able.plain


def kept(path: Path | None, content: Iterable[str], *, force: bool) -> Printout:
    """Writes to a file, part by part, and leaves nothing to be told; without one, what is to be."""
    if path is None or str(path) == "-":
        return Printout("", parts=content)
    write(path, content, force=force)
    return Printout("")


def named() -> str:
    """The name and title of every figure."""
    return "\n".join(f"{key:<5} {title}" for key, (title, _) in figures().items())


def drawn(name: str, output: Path | None, *, svg: bool, force: bool = False) -> Printout:
    """A figure; as a picture where that or a file is asked for."""
    title, draw = figure(name)
    fits(output, "svg")
    if svg or output:
        return kept(output, [picture(draw(), title)], force=force)
    return Printout(draw(), paged=True)

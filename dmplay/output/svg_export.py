"""Export of texts to the terminal and to SVG."""

import io
import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from rich._export_format import CONSOLE_SVG_FORMAT
from rich.console import Console
from rich.text import Text

from dmplay.core.safe_files import write_file
from dmplay.game.command_line_results import Printout
from dmplay.game.saves import choose_free_path
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.styles import to_ansi
from dmplay.views.toolkit.canvas import measure_text, to_ascii

# Rich's own template, without the fonts that it loads from the network.
SVG_TEMPLATE = re.sub(r"@font-face {{.*?}}\n", "", CONSOLE_SVG_FORMAT, flags=re.DOTALL).replace(
    "Fira Code, monospace", "'Fira Code', 'DejaVu Sans Mono', Menlo, Consolas, monospace"
)
# In a film, the window and the fonts are written once, and the text for each picture.
FILM_TEMPLATE = """<svg viewBox="0 0 {width} {height}" xmlns="http://www.w3.org/2000/svg">
<style>
.film {{ font: {char_height}px 'Fira Code', 'DejaVu Sans Mono', Menlo, Consolas, monospace }}
.{unique_id}-title {{ font: bold 18px arial }}
.film > g {{ visibility: hidden; animation: turn DURATIONs infinite }}
@keyframes turn {{ 0% {{ visibility: visible }} SHARE%, 100% {{ visibility: hidden }} }}
@media (prefers-reduced-motion: reduce) {{
  .film > g {{ animation: none }}
  .film > g:last-child {{ visibility: visible }}
}}
</style>
{chrome}
<g class="film" transform="translate({terminal_x}, {terminal_y})">
"""
PICTURE_TEMPLATE = """<g style="animation-delay: DELAYs"><style>{styles}</style>
{backgrounds}
{matrix}
</g>
"""
# Rich clips each line, and ends it with a text that holds a line feed; neither shows.
INVISIBLE_PATTERN = re.compile(r' clip-path="[^"]*"|<text [^>]*>\n</text>')


def make_recording_console(width: int) -> Console:
    """Return a console that records the texts printed on it, with their styles."""
    return Console(
        width=width, record=True, file=io.StringIO(), force_terminal=True,
        color_system="standard", legacy_windows=False, highlight=False,
    )  # fmt: skip


def text_to_svg(text: Text, title: str, *, width: int = 0, name: str = "dmplay") -> str:
    """Return a text as SVG, as wide as the text if `width` is 0.

    `name` is the prefix of all ids in the SVG.
    """
    recorder = make_recording_console(width or measure_text(text)[0] + 1)
    recorder.print(text, soft_wrap=True)
    return recorder.export_svg(title=title, unique_id=name, code_format=SVG_TEMPLATE)


def texts_to_animated_svg(
    texts: Iterable[Text], count: int, title: str, width: int
) -> Iterator[str]:
    """Yield an animated SVG that shows each of `count` texts of equal height for one second.

    Readers who prefer reduced motion see the last text only.
    """
    head = FILM_TEMPLATE.replace("DURATION", str(count)).replace("SHARE", f"{100 / count:.4f}")
    for second, text in enumerate(texts):
        recorder = make_recording_console(width)
        recorder.print(text, soft_wrap=True)
        if not second:
            yield recorder.export_svg(title=title, unique_id="film", code_format=head, clear=False)
        picture = recorder.export_svg(unique_id=f"t{second}", code_format=PICTURE_TEMPLATE)
        yield INVISIBLE_PATTERN.sub("", picture).replace("DELAY", str(second), 1)
    yield "</g>\n</svg>\n"


def render_for_terminal(text: Text, terminal: Terminal) -> str:
    """Return a text as a string for a terminal, in colour and in Unicode if the terminal can."""
    encodable = to_ascii(text) if terminal.ascii else text
    return to_ansi(encodable, terminal.theme) if terminal.color else encodable.plain


def write_or_print(path: Path | None, content: Iterable[str], *, force: bool) -> Printout:
    """Write text to a file part by part, or return it to be printed if `path` is None or `-`.

    After writing a file, the result is an empty Printout.
    """
    if path is None or str(path) == "-":
        return Printout("", text_chunks=content)
    write_file(path, content, force=force)
    return Printout("")


def choose_picture_path(output: Path | None, stem: str, extension: str) -> Path | None:
    """Return the output file; on a terminal, which cannot show a picture's code, a free name.

    The free name is STEM.EXTENSION in the current folder, or a numbered one.
    """
    if output is not None or not sys.stdout.isatty():
        return output
    return choose_free_path(Path(f"{stem}.{extension}"))

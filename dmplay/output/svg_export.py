"""Export of texts to files and to SVG."""

import inspect
import io
import re
import sys
from collections.abc import Iterable
from pathlib import Path

from rich.console import Console
from rich.text import Text

from dmplay.core.safe_files import write_file
from dmplay.draw.canvas import measure_text
from dmplay.game.command_line_results import Printout
from dmplay.game.saves import choose_free_path
from dmplay.output.provenance import add_to_chunks

# Rich's own template, without the fonts that it loads from the network.
SVG_TEMPLATE = re.sub(
    r"@font-face {{.*?}}\n",
    "",
    inspect.signature(Console.export_svg).parameters["code_format"].default,
    flags=re.DOTALL,
).replace("Fira Code, monospace", "'Fira Code', 'DejaVu Sans Mono', Menlo, Consolas, monospace")


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


def write_or_print(path: Path | None, content: Iterable[str], *, force: bool) -> Printout:
    """Write text to a file part by part, or return it to be printed if `path` is None or `-`.

    After writing a file, the result is an empty Printout.
    """
    content = add_to_chunks(content)
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

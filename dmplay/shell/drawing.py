"""Figures on the terminal and as pictures."""

import importlib
import io
from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from rich.text import Text

from dmplay.errors import UnknownName
from dmplay.shell.paint import ansi
from dmplay.shell.terminal import Terminal
from dmplay.views._canvas import plainly, size

Figure = tuple[str, Callable[[], Text]]


def figures() -> dict[str, Figure]:
    """Every figure by name: its title and what draws it."""
    found: dict[str, Figure] = {}
    for file in sorted((Path(__file__).parent.parent / "figures").glob("[a-z]*.py")):
        found |= importlib.import_module(f"dmplay.figures.{file.stem}").FIGURES
    return dict(sorted(found.items(), key=lambda item: _order(item[0])))


def _order(name: str) -> tuple[str, int]:
    letter, _, number = name.partition(".")
    return letter, int(number)


def figure(name: str) -> Figure:
    """The figure of this name, `F.10`, `f10` or `figure F.10`."""
    known = figures()
    for key, found in known.items():
        if key.replace(".", "").lower() == name.rsplit(maxsplit=1)[-1].replace(".", "").lower():
            return found
    raise UnknownName("figure", name, known)


def console(width: int) -> Console:
    """A console that draws a text as it is and remembers it."""
    return Console(
        width=width, record=True, file=io.StringIO(), force_terminal=True,
        color_system="standard", legacy_windows=False, highlight=False,
    )  # fmt: skip


def picture(text: Text, title: str) -> str:
    """A text as SVG."""
    drawn = console(size(text)[0] + 1)
    drawn.print(text, soft_wrap=True)
    return drawn.export_svg(title=title, unique_id="dmplay")


def show(text: Text, terminal: Terminal) -> None:
    """Prints a text, in colour and in Unicode where the terminal can."""
    shown = plainly(text) if terminal.ascii else text
    if terminal.color:
        print(ansi(shown, terminal.theme).replace("\r\n", "\n"))
    else:
        print("\n".join(row.rstrip() for row in shown.plain.split("\n")))

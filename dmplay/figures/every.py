"""Every figure and table of the book's appendix F that is drawn, by name."""

import importlib
from collections.abc import Callable
from pathlib import Path

from rich.text import Text

from dmplay.errors import UnknownName

Figure = tuple[str, Callable[[], Text]]


def load_figures() -> dict[str, Figure]:
    """Every figure by name: its title and what draws it."""
    found: dict[str, Figure] = {}
    for file in sorted(Path(__file__).parent.glob("[a-z]*.py")):
        found |= getattr(importlib.import_module(f"dmplay.figures.{file.stem}"), "FIGURES", {})
    return dict(sorted(found.items(), key=lambda item: _figure_sort_key(item[0])))


def _figure_sort_key(name: str) -> tuple[str, int]:
    letter, _, number = name.partition(".")
    return letter, int(number)


def find_figure(name: str) -> Figure:
    """The figure of this name, `F.10`, `f10` or `figure F.10`."""
    known = load_figures()
    wanted = "".join(name.split()[-1:])  # of blanks, nothing
    for key, found in known.items():
        if key.replace(".", "").lower() == wanted.replace(".", "").lower():
            return found
    raise UnknownName("figure", name, known)

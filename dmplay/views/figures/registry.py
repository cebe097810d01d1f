"""The registry of all figures and tables of the book's appendix F that are drawn."""

import importlib
from collections.abc import Callable
from pathlib import Path

from rich.text import Text

from dmplay.errors import UnknownName

Figure = tuple[str, Callable[[], Text]]


def load_figures() -> dict[str, Figure]:
    """Return all figures by name, in order, each with its title and its drawing function."""
    result: dict[str, Figure] = {}
    for file in sorted(Path(__file__).parent.glob("[a-z]*.py")):
        result |= getattr(
            importlib.import_module(f"dmplay.views.figures.{file.stem}"), "FIGURES", {}
        )
    return dict(sorted(result.items(), key=lambda item: _figure_sort_key(item[0])))


def _figure_sort_key(name: str) -> tuple[str, int]:
    """Return the letter and the number of a figure's name as a sort key."""
    letter, _, number = name.partition(".")
    return letter, int(number)


def find_figure(name: str) -> Figure:
    """Return the figure of a name such as `F.10`, `f10` or `figure F.10`.

    Raise UnknownName if there is none.
    """
    available = load_figures()
    short_name = "".join(name.split()[-1:])  # '' for a blank name
    for key, entry in available.items():
        if key.replace(".", "").lower() == short_name.replace(".", "").lower():
            return entry
    raise UnknownName("figure", name, available)

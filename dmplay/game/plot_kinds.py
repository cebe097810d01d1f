"""The kinds of plots, and the figures that show a problem, such as those of the book."""

import re
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from dmplay.errors import BadParameter
from dmplay.registry.builtin_names import stem_to_name

if TYPE_CHECKING:  # The completion of names needs no problem.
    from dmplay.core.problem import Problem


class PlotKind(NamedTuple):
    """A kind of plot: its help, an example, its argument, and the options that change it."""

    help: str
    example: str
    argument: str = "PROBLEM"  # or FILE
    options: frozenset[str] = frozenset()


class Figure(NamedTuple):
    """A figure that shows a problem: its title, its function, and whether `--turns` changes it.

    The function gets an object with `problem`, `title`, `settings` and `turns`, and returns a Plot.
    """

    title: str
    draw: Callable[[Any], object]
    has_turns: bool = False


class BookFigure(NamedTuple):
    """A figure of the book: its title and its problem."""

    title: str
    problem: str


PLOT_KINDS = {
    "values": PlotKind(
        "value and best action of each state; value of each belief",
        "values hexworld",
        options=frozenset({"turns"}),
    ),
    "policy": PlotKind(
        "best action of each state or belief", "policy hexworld", options=frozenset({"turns"})
    ),
    "alpha-vectors": PlotKind(
        "alpha vectors of a problem with two hidden states",
        "alpha-vectors crying-baby",
        options=frozenset({"turns", "methods"}),
    ),
    "payoffs": PlotKind(
        "rewards of a game of two agents, with its equilibria", "payoffs prisoners-dilemma"
    ),
    "returns": PlotKind(
        "returns of many games, a histogram for each agent",
        "returns hexworld",
        options=frozenset({"turns", "agent", "compare", "vs", "seat", "episodes", "seed"}),
    ),
    "belief": PlotKind("belief by turn, in a recorded game", "belief game.dmt", "FILE"),
    "regret": PlotKind("regret of each choice, in a recorded game", "regret game.dmt", "FILE"),
}
PICTURE_FORMATS = ("svg", "png", "pdf")
# A figure in a problem's code; its name and title are read without an import.
FIGURE_PATTERN = re.compile(r'"(\w+\.\d+)": Figure\(\s*"([^"]+)"')


@cache
def list_book_figures() -> dict[str, BookFigure]:
    """Return the figures of the book, by name, from the files `figures.py` of problems."""
    files = (Path(__file__).parent.parent / "problems").glob("*/figures.py")
    figures = {
        name: BookFigure(title, stem_to_name(file.parent.name))
        for file in files
        for name, title in FIGURE_PATTERN.findall(file.read_text(encoding="utf-8"))
    }
    return dict(sorted(figures.items(), key=lambda item: (item[0][0], int(item[0].split(".")[1]))))


def load_figures(problem: "Problem") -> Mapping[str, Figure]:
    """Return the figures that a problem's code defines in FIGURES, by name.

    One with the name of a kind of plot, such as `values`, is drawn in place of the general plot.
    Raises BadParameter if FIGURES is not a mapping of names to figures.
    """
    from dmplay.registry.problem_module_exports import find_export, locate_export

    figures = find_export(problem, "FIGURES")
    if figures is None:
        return {}
    is_mapping = isinstance(figures, Mapping) and all(isinstance(name, str) for name in figures)
    if not is_mapping or not all(isinstance(item, Figure) for item in figures.values()):
        got = f"{locate_export(problem, 'FIGURES')}: got {figures!r}"
        raise BadParameter(f"{got}, expected a mapping of names to Figure objects")
    return figures  # type: ignore[no-any-return]


def find_figure_name(text: str, names: Iterable[str]) -> str | None:
    """Return the name of a figure from a spelling such as `f10` or `figure F.10`; else None."""
    spelled = "".join(text.split()[-1:]).replace(".", "").lower()  # '' for a blank name
    return next((name for name in names if name.replace(".", "").lower() == spelled), None)

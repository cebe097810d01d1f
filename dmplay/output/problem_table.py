"""The table of all problems, table F.1 of the book."""

import shutil
from collections.abc import Mapping, Sequence
from itertools import zip_longest
from textwrap import fill, wrap
from typing import TYPE_CHECKING

from dmplay.core.problem import Problem
from dmplay.core.problem_summary import problem_summary
from dmplay.core.text import display_width, format_json_report
from dmplay.errors import UnknownName
from dmplay.registry import problems
from dmplay.registry.builtin_names import problem_names
from dmplay.terminal.capabilities import TerminalOptions, current_terminal

if TYPE_CHECKING:
    from rich.text import Text

PIPE_COLUMNS = 100  # columns of a table written to a pipe
COLUMN_GAP = 1  # columns between two columns of a table


def problem_table_rows() -> list[dict[str, str]]:
    """Return the rows of table F.1: the built-in problems, then the installed ones."""
    named_problems = [(name, problems.load_problem(name)) for name in problem_names()]
    named_problems += [
        (name, problem)
        for name, problem in problems.iter_installed_problems()
        if isinstance(problem, Problem)
    ]
    return [
        {"problem": name, "kind": problem.kind} | problem_summary(problem)
        for name, problem in named_problems
    ]


def format_load_failures() -> str:
    """Return the installed problems that cannot be loaded with their errors, one per line."""
    lines = [
        f"{name}: {error}"
        for name, error in problems.iter_installed_problems()
        if isinstance(error, str)
    ]
    return "\n".join(lines)


def list_rows_of_kind(kind: str) -> list[dict[str, str]]:
    """Return the rows of table F.1 whose kind begins with `kind` in either case, such as mdp.

    Raise UnknownName if there are none.
    """
    rows = problem_table_rows()
    matching = [row for row in rows if row["kind"].lower().startswith(kind.lower())]
    if not matching:
        raise UnknownName("kind", kind, [*dict.fromkeys(row["kind"] for row in rows), "games"])
    return matching


def _format_problem_table(rows: list[dict[str, str]], headings: list[str], width: int) -> str:
    """Return the given columns of table F.1 as lines; only a kind may take several lines."""
    table = [headings, *([row[heading] for heading in headings] for row in rows)]
    sizes = [max(map(len, column)) for column in zip(*table, strict=True)]
    excess = sum(sizes) + COLUMN_GAP * (len(sizes) - 1) - width
    if excess > 0:
        sizes[headings.index("kind") if "kind" in headings else 0] -= excess
    gap, lines = " " * COLUMN_GAP, []
    for row in table:
        cells = [
            wrap(cell, size, break_on_hyphens=False) for cell, size in zip(row, sizes, strict=True)
        ]
        for parts in zip_longest(*cells, fillvalue=""):
            padded = (part.ljust(size) for part, size in zip(parts, sizes, strict=True))
            lines.append(gap.join(padded).rstrip())
    return "\n".join(lines)


def choose_width(width: int | None) -> int:
    """Return the columns of a table: those of --width, the terminal's, or those of a pipe."""
    return width or shutil.get_terminal_size((PIPE_COLUMNS, 0)).columns


def choose_headings(
    rows: Sequence[Mapping[str, str]], width: int, gap: int = 2, *, wrapped: str = ""
) -> list[str]:
    """Return as many headings, from the left, as `width` columns can hold, at least one.

    The cells of the column `wrapped` may take two rows, so only its longest word must fit.
    """
    headings: list[str] = []
    remaining = width + gap
    for heading in rows[0]:
        cells = [row[heading] for row in rows]
        words = " ".join(cells).split() if heading == wrapped else cells
        remaining -= max(map(display_width, [heading, *words])) + gap
        if remaining < 0 and headings:
            break
        headings.append(heading)
    return headings


def describe_omitted_columns(names: Sequence[str]) -> str:
    """Return a note that names columns for which there was no room."""
    return f"columns left out: {', '.join(names)}; --width N or --json shows them"


def _shorten_cell(cell: str) -> str:
    """Return a cell with `per agent` shortened to `each`."""
    return cell.replace("per agent", "each")


def report_problem_table(kind: str, terminal_options: TerminalOptions) -> "Text | str":
    """Return table F.1, or its problems of one kind, with a note of the columns left out."""
    rows = list_rows_of_kind(kind)
    if terminal_options.json:
        return format_json_report({"problems": rows})
    width = choose_width(terminal_options.width)
    shortened = [{name: _shorten_cell(cell) for name, cell in row.items()} for row in rows]
    headings = choose_headings(shortened, width, COLUMN_GAP, wrapped="kind")
    table = _format_problem_table(shortened, headings, width)
    omitted = [*rows[0]][len(headings) :]
    if omitted:
        table += f"\n{fill(describe_omitted_columns(omitted), width)}"
    if not current_terminal(terminal_options).color:
        return table
    from rich.text import Text

    heading_row, line_end, body = table.partition("\n")
    return Text.assemble((heading_row, "bold"), line_end, body)

"""A search tree as indented rows: visits N, mean return Q, and UCB score."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.algorithms.step import TreeNode
from dmplay.core.text import format_count, format_score
from dmplay.draw.canvas import Canvas
from dmplay.draw.options import DrawOptions

NUMBER_COLUMNS = 11  # columns of Q and of the score; "-1.234e-05" has 10
LEGENDS = (  # the first that fits is drawn
    "N: tries  Q: mean return  UCB: Q + c sqrt(ln N / n)  > simulation  (+2): 2 hidden rows",
    "N: tries  Q: mean return  UCB: Q + c sqrt(ln N / n)  > simulation",
    "N: tries  Q: mean  UCB: score  > simulation",
)
NodePath = tuple[int, ...]  # the child to take at each node from the root on


def draw_search_tree(root: TreeNode, options: DrawOptions) -> Text:
    """Return the tree with the nodes that fit: those of the simulation, then the most visited."""
    open_paths = _choose_open_nodes(root, options.height - 2)
    rows = list(_iter_rows(root, (), open_paths, ""))
    omitted = len(rows) - max(options.height - 2, 1)
    canvas = Canvas()
    numbers = 6 + 2 * NUMBER_COLUMNS
    label_columns = min(max(len(text) for text, _ in rows), max(options.width - numbers, 8))
    legend = next(text for text in LEGENDS if len(text) <= options.width or text == LEGENDS[-1])
    canvas.write_text(0, 0, legend[: options.width], "dim")
    header = f"{'N':>6}{'Q':>{NUMBER_COLUMNS}}{'UCB':>{NUMBER_COLUMNS}}"
    canvas.write_text(label_columns, 1, header, "dim")
    for y, (text, node) in enumerate(rows[: max(options.height - 2, 1)], 2):
        style = "bold" if node.is_on_path else "" if node.visits else "dim"
        value = "" if node.value is None else format_score(node.value)
        score = "" if node.score is None else format_score(node.score)
        fits = len(text) <= label_columns
        canvas.write_text(0, y, text if fits else f"{text[: label_columns - 1]}…", style)
        figures = f"{node.visits:>6}{value:>{NUMBER_COLUMNS}}{score:>{NUMBER_COLUMNS}}"
        canvas.write_text(label_columns, y, figures, style)
    if omitted > 0 and options.height > 3:
        note = f"… {format_count(omitted + 1, 'more node')}"
        canvas.write_text(0, options.height - 1, note.ljust(label_columns + numbers), "dim")
    return canvas.to_text()


def _choose_open_nodes(root: TreeNode, rows: int) -> set[NodePath]:
    """Return the paths of the nodes whose children are drawn, in at most `rows` rows."""
    chosen, used = set[NodePath](), 1
    candidates: list[tuple[NodePath, TreeNode]] = [((), root)]
    while candidates:
        candidates.sort(key=lambda pair: (not pair[1].is_on_path, len(pair[0]), -pair[1].visits))
        path, node = candidates.pop(0)
        if not node.children or (used + len(node.children) > rows and not node.is_on_path):
            continue
        chosen.add(path)
        used += len(node.children)
        candidates += [((*path, index), child) for index, child in enumerate(node.children)]
    return chosen


def _iter_rows(
    node: TreeNode, path: NodePath, open_paths: set[NodePath], indent: str
) -> Iterator[tuple[str, TreeNode]]:
    """Yield each drawn node with its text, parents before children."""
    mark = ">" if node.is_on_path else " "
    hidden = len(node.children) if path not in open_paths else 0
    suffix = f" (+{hidden})" if hidden else ""
    yield f"{mark} {indent}{node.label}{suffix}", node
    if path in open_paths:
        below = indent.replace("├ ", "│ ").replace("└ ", "  ")
        for index, child in enumerate(node.children):
            branch = "└ " if index == len(node.children) - 1 else "├ "
            yield from _iter_rows(child, (*path, index), open_paths, f"{below}{branch}")

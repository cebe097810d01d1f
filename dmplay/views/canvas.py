"""A grid of characters with styles, drawn as text."""

from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate, groupby

from rich.style import Style
from rich.text import Span, Text

from dmplay.budget import Budget

ASCII_TRANSLATION = str.maketrans(
    dict(zip("─│┄━┷╋╱╲┌┐└┘├┤┬┴┼", "-|-=^#/\\+++++++++", strict=True))
    | dict(zip("←→↑↓◆●○∘·•✓✗×…▒█", "<>^v+*oo.*vxx~:#", strict=True))
    | dict(zip("▁▂▃▄▅▆▇▏▎▍▌▋▊▉", "_.:-=+*       ", strict=True))
)
BAR_LEVELS = "▁▂▃▄▅▆▇█"  # eighths of a row
MAX_CELLS = 3e6  # cells of a drawing
SPARE_CELLS = 80  # cells by which a row grows beyond what is written, as more is to come
DIAGONAL_ARROW_NAMES = {"↗": "NE", "↖": "NW", "↙": "SW", "↘": "SE"}


class Canvas:
    """Characters and styles by column and row; grows as it is written to."""

    def __init__(self) -> None:
        self._rows: list[tuple[list[str], list[str]]] = []  # glyphs, and the style of each
        self._budget = Budget("a drawing", "try a smaller map", MAX_CELLS)

    def copy(self) -> "Canvas":
        """One more with the same drawing."""
        other = Canvas()
        other._rows = [(glyphs.copy(), styles.copy()) for glyphs, styles in self._rows]
        return other

    def write_text(self, x: int, y: int, text: str, style: str = "") -> None:
        """Writes text from column x of row y on; raises TooMuch far out."""
        end = x + len(text)
        if y >= len(self._rows):
            self._budget.spend_work(y - len(self._rows))
            self._rows.extend(([], []) for _ in range(y + 1 - len(self._rows)))
        glyphs, styles = self._rows[y]
        if end > len(glyphs):
            missing = end - len(glyphs) + SPARE_CELLS
            self._budget.spend_work(missing)
            glyphs.extend(" " * missing)
            styles.extend([""] * missing)
        glyphs[x:end] = text
        styles[x:end] = [style] * len(text)

    def to_text(self) -> Text:
        """The drawing, a line a row, without trailing blanks."""
        rows: list[str] = []
        spans: list[Span] = []
        start = 0
        for glyphs, styles in self._rows:
            rows.append("".join(glyphs).rstrip())
            spans += _build_spans(rows[-1], styles, start)
            start += len(rows[-1]) + 1
        return Text("\n".join(rows), spans=spans, no_wrap=True)


def _build_spans(plain: str, styles: list[str], start: int) -> list[Span]:
    """The styled pieces of a row that begins at `start`.

    A blank takes its neighbour's style, so that a row has few pieces.
    """
    found: list[Span] = []
    style, since, at = "", 0, 0
    for own, cells in groupby(styles[: len(plain)]):
        first, at = at, at + len([*cells])
        if not own and not _is_visible_on_blank(style):
            piece = plain[first:at]
            first += len(piece) - len(piece.lstrip(" "))
        if own == style or first == at:
            continue
        if style:
            found.append(Span(start + since, start + first, style))
        style, since = own, first
    if style:
        found.append(Span(start + since, start + len(plain), style))
    return found


def _is_visible_on_blank(style: str) -> bool:
    return "underline" in style or "reverse" in style


def draw_text_rows(*rows: str) -> Text:
    """Words alone for a drawing, a line a row."""
    canvas = Canvas()
    for y, row in enumerate(rows):
        canvas.write_text(0, y, row, "bold")
    return canvas.to_text()


def sanitize_drawing(drawing: str | Text) -> Text:
    """A drawing of somebody else's: its rows as they are, its colours, and nothing that moves."""
    drawn = drawing if isinstance(drawing, Text) else Text.from_ansi(drawing)
    return Text("\n", no_wrap=True).join(map(_sanitize_row, split_rows(drawn)))


def _sanitize_row(row: Text) -> Text:
    """A row without links, and with an escape for what does not print."""
    row.expand_tabs(8)
    plain = "".join(glyph if glyph.isprintable() else "?" for glyph in row.plain)
    spans = [Span(start, end, _remove_link(style)) for start, end, style in row.spans]
    return Text(plain, spans=spans, no_wrap=True)


def _remove_link(style: str | Style) -> str | Style:
    return style.update_link(None) if isinstance(style, Style) else style


def strip_escapes(text: str) -> str:
    """Words without escape sequences, in one line."""
    plain = Text.from_ansi(text).plain if "\x1b" in text else text
    return " / ".join(filter(None, (row.strip() for row in plain.split("\n"))))


def measure_text(text: Text) -> tuple[int, int]:
    """Columns and rows of a drawing."""
    rows = text.plain.split("\n")
    return max(map(len, rows)), len(rows)


def split_rows(text: Text) -> list[Text]:
    """The rows of a drawing, each with its own pieces."""
    return split_styled_rows(text.plain, text.spans)


def split_styled_rows(plain: str, spans: Sequence[Span]) -> list[Text]:
    """The rows of a drawing of these characters and pieces."""
    each = plain.split("\n")
    starts = [0, *accumulate(len(row) + 1 for row in each[:-1])]
    own: list[list[Span]] = [[] for _ in each]
    for start, end, style in spans:
        y = bisect_right(starts, start) - 1
        while y < len(each) and starts[y] < end:
            x = starts[y]
            own[y].append(Span(max(start - x, 0), min(end - x, len(each[y])), style))
            y += 1
    return [Text(row, spans=pieces) for row, pieces in zip(each, own, strict=True)]


def to_ascii(text: Text) -> Text:
    """The same drawing in ASCII, column by column."""
    plain = text.plain
    for arrow, name in DIAGONAL_ARROW_NAMES.items():  # always with room at their right
        plain = plain.replace(f"{arrow} ", name)
    drawn = text.blank_copy(plain.translate(ASCII_TRANSLATION))
    drawn.spans = [*text.spans]
    return drawn


def format_signed(value: float) -> str:
    """A reward with its sign: +5, -10, 0."""
    return f"{value:+g}" if value else "0"


def format_percent(probability: float) -> str:
    """A probability in at most four columns: `7%`, `100%`, `<1%`; nothing for 0."""
    if probability < 1e-9:
        return ""
    return f"{100 * probability:.0f}%" if probability >= 0.005 else "<1%"


def format_to_width(value: float, width: int) -> str:
    """A value in at most so many columns."""
    for decimals in (2, 1, 0):
        text = f"{value:.{decimals}f}"
        if len(text) <= width:
            return text
    return "#" * width

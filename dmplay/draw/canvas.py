"""A grid of styled characters that renders to text, and helpers for drawings."""

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import accumulate, groupby
from textwrap import TextWrapper

from rich.style import Style
from rich.text import Span, Text

from dmplay.core.text import escape_unprintable
from dmplay.core.work_budget import Budget

ASCII_TRANSLATION = str.maketrans(
    dict(zip("─│┄━┷╋╱╲┌┐└┘├┤┬┴┼", "-|-=^#/\\+++++++++", strict=True))
    | dict(zip("←→↑↓◆●○∘·•✓✗×…░▒█", "<>^v+*oo.*vxx~%:#", strict=True))
    | dict(zip("▁▂▃▄▅▆▇▏▎▍▌▋▊▉", "_.:-=+*       ", strict=True))
)
MAX_CELLS = 3e6  # maximum number of cells of a drawing
MAX_CACHED_ROWS = 2**11  # drawn rows that are kept, as most are those of the drawing before
SPARE_CELLS = 80  # extra cells when a row grows, because more text usually follows
DIAGONAL_ARROW_NAMES = {"↗": "NE", "↖": "NW", "↙": "SW", "↘": "SE"}


class Canvas:
    """A grid of characters and styles by column and row, which grows as needed."""

    def __init__(self) -> None:
        self._rows: list[tuple[list[str], list[str]]] = []  # glyphs, and the style of each glyph
        self._budget = Budget("drawing", "try a smaller map", MAX_CELLS)

    def copy(self) -> "Canvas":
        """Return a copy of the canvas."""
        other = Canvas()
        other._rows = [(glyphs.copy(), styles.copy()) for glyphs, styles in self._rows]
        return other

    def write_text(self, x: int, y: int, text: str, style: str = "") -> None:
        """Write text from column x of row y on; raise TooMuch if the drawing becomes too large."""
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

    def write_rows(self, y: int, rows: Iterable[str], style: str = "") -> int:
        """Write texts below each other from row y on; return the next row."""
        for text in rows:
            self.write_text(0, y, text, style)
            y += 1
        return y

    def write_canvas(self, x: int, y: int, other: "Canvas") -> int:
        """Write another canvas from column x of row y on; return the next row."""
        for y_offset, (glyphs, styles) in enumerate(other._rows):
            plain = "".join(glyphs).rstrip()
            self.write_text(x, y + y_offset, plain)
            self._rows[y + y_offset][1][x : x + len(plain)] = styles[: len(plain)]
        return y + len(other._rows)

    def to_text(self) -> Text:
        """Return the drawing as text, one line per row, without trailing blanks."""
        rows = []
        for glyphs, styles in self._rows:
            plain = "".join(glyphs).rstrip()
            rows.append(_make_row(plain, _build_spans(plain, (*styles[: len(plain)],))))
        return Text("\n", no_wrap=True).join(rows)


@lru_cache(MAX_CACHED_ROWS)
def _make_row(plain: str, spans: tuple[Span, ...]) -> Text:
    """Return a row of a drawing; drawings share it, so it must not be changed."""
    return Text(plain, spans=[*spans])


@lru_cache(MAX_CACHED_ROWS)
def _build_spans(plain: str, styles: tuple[str, ...]) -> tuple[Span, ...]:
    """Return the styled spans of a row.

    A blank takes its neighbour's style if blanks do not show it, so that a row has few spans.
    """
    spans: list[Span] = []
    style, span_start, position = "", 0, 0
    for cell_style, cells in groupby(styles):
        first, position = position, position + len([*cells])
        if not cell_style and not ("underline" in style or "reverse" in style):
            piece = plain[first:position]
            first += len(piece) - len(piece.lstrip(" "))
        if cell_style == style or first == position:
            continue
        if style:
            spans.append(Span(span_start, first, style))
        style, span_start = cell_style, first
    if style:
        spans.append(Span(span_start, len(plain), style))
    return (*spans,)


def draw_borders(canvas: Canvas, x: int, count: int, size: tuple[int, int], gap: int = 1) -> None:
    """Draw the borders of a square board of `count` cells a side, from column x on.

    A cell has `size` columns and rows; `gap` is the number of rows of the border between cells.
    """
    width, height = size
    bottom = 1 + count * (height + gap) - gap
    for y in range(bottom + 1):
        canvas.write_text(x, y, "│".join(["", *[" " * width] * count, ""]), "dim")
    for row in range(count + 1):
        left, middle, right = "┌┬┐" if row == 0 else "└┴┘" if row == count else "├┼┤"
        if gap or middle != "┼":
            y = bottom if row == count else row * (height + gap)
            canvas.write_text(x, y, left + middle.join(["─" * width] * count) + right, "dim")


def draw_text_rows(*rows: str) -> Text:
    """Draw rows of bold words."""
    canvas = Canvas()
    canvas.write_rows(0, rows, "bold")
    return canvas.to_text()


def sanitize_drawing(drawing: str | Text) -> Text:
    """Convert a user's drawing to text, without links or unprintable characters."""
    text = drawing if isinstance(drawing, Text) else Text.from_ansi(drawing)
    return Text("\n", no_wrap=True).join([_sanitize_row(row.copy()) for row in split_rows(text)])


def _sanitize_row(row: Text) -> Text:
    """Return a row with tabs expanded, without links, with '?' for unprintable characters."""
    row.expand_tabs(8)
    plain = "".join(glyph if glyph.isprintable() else "?" for glyph in row.plain)
    spans = [
        Span(start, end, style.update_link(None) if isinstance(style, Style) else style)
        for start, end, style in row.spans
    ]
    return Text(plain, spans=spans, no_wrap=True)


def strip_escapes(text: str) -> str:
    """Return text without escape sequences, its lines joined into one."""
    plain = Text.from_ansi(text).plain if "\x1b" in text else text
    return " / ".join(filter(None, (row.strip() for row in plain.split("\n"))))


def measure_text(text: Text) -> tuple[int, int]:
    """Return the number of columns and rows of a drawing."""
    rows = text.plain.split("\n")
    return max(map(len, rows)), len(rows)


def split_rows(text: Text) -> list[Text]:
    """Split a drawing into rows, which must not be changed."""
    return split_styled_rows(text.plain, text.spans)


def split_styled_rows(plain: str, spans: Sequence[Span]) -> list[Text]:
    """Split the characters and spans of a drawing into rows, which must not be changed."""
    rows = plain.split("\n")
    starts = [0, *accumulate(len(row) + 1 for row in rows[:-1])]
    row_spans: list[list[Span]] = [[] for _ in rows]
    for start, end, style in spans:
        y = bisect_right(starts, start) - 1
        while y < len(rows) and starts[y] < end:
            x = starts[y]
            row_spans[y].append(Span(max(start - x, 0), min(end - x, len(rows[y])), style))
            y += 1
    return [_make_row(row, (*pieces,)) for row, pieces in zip(rows, row_spans, strict=True)]


def join_beside(drawings: Sequence[Sequence[Text]], columns: Sequence[int]) -> list[Text]:
    """Return the rows of drawings beside each other, each drawing from its column on."""
    rows = [Text() for _ in range(max(map(len, drawings), default=0))]
    for drawing, column in zip(drawings, columns, strict=True):
        for row, piece in zip(rows, drawing, strict=False):
            if piece.plain:
                row.append(" " * (column - len(row.plain))).append_text(piece)
    return rows


def join_legend(entries: Iterable[tuple[str, str]], columns: int) -> Text:
    """Return the texts and styles of a legend beside each other, in as many rows as they need."""
    rows = [Text()]
    for text, style in entries:
        if rows[-1].plain and len(rows[-1].plain) + 3 + len(text) > columns:
            rows.append(Text())
        rows[-1].append("   " * bool(rows[-1].plain)).append(text, style)
    return Text("\n").join(rows)


def wrap_text(text: str, columns: int, style: str = "") -> list[Text]:
    """Wrap text to rows without splitting words at hyphens; unprintable characters are escaped."""
    wrapper = TextWrapper(max(columns, 1), break_on_hyphens=False)
    return [Text(row, style=style) for row in wrapper.wrap(escape_unprintable(text))]


def to_ascii(text: Text) -> Text:
    """Return the same drawing in ASCII, column by column."""
    plain = text.plain
    # A diagonal arrow always has a blank at its right.
    for arrow, name in DIAGONAL_ARROW_NAMES.items():
        plain = plain.replace(f"{arrow} ", name)
    result = text.blank_copy(plain.translate(ASCII_TRANSLATION))
    result.spans = [*text.spans]
    return result


def format_signed(value: float) -> str:
    """Format a reward with its sign: +5, -10, 0."""
    return f"{value:+g}" if value else "0"


def format_percent(probability: float, decimals: int = 0) -> str:
    """Format a probability with these decimals: `7%`, `100%`, `<1%`, `50.5%`; '' for 0.

    Without decimals it has at most four columns.
    """
    if probability < 1e-9:
        return ""
    return f"{100 * probability:.{decimals}f}%" if probability >= 0.005 else "<1%"


def format_to_width(value: float, width: int) -> str:
    """Format a value with at most two decimals in `width` columns; '#' if it does not fit.

    A small negative value loses its zero, not its sign: `-.3`.
    """
    rounded = f"{value:.1f}"
    texts = (f"{value:.2f}", rounded, rounded.replace("-0.", "-."), f"{value:.0f}")
    return next((text for text in texts if len(text) <= width), "#" * width)

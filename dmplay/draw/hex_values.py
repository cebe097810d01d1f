"""Maps of hexes with a value, the best directions, or a text in each."""

from rich.text import Text

from dmplay.core.hexgrid import Hex
from dmplay.draw import theme
from dmplay.draw.canvas import format_to_width, measure_text
from dmplay.draw.hex_map import ARROWS, COMPASS, HexCell, HexSize, iter_maps
from dmplay.draw.options import DrawOptions
from dmplay.draw.panels import HexPanel

MAX_ARROWS, MANY_ARROWS_GLYPH = 2, "*"  # best directions that a hex shows
KIND_GLYPHS = {"gain": "◆", "loss": "✗", "hunter": "P", "prey": "o"}
KIND_STYLES = {"gain": theme.BEST, "loss": theme.DANGER, "hunter": theme.DANGER, "prey": theme.GOAL}
MIN_CAPTION_ROWS = 10  # rows from which on a map has a caption
UNLIMITED_ROWS = 10_000


def draw_hexes(
    panel: HexPanel, columns: int, rows: int | None = None, *, ascii_only: bool = False
) -> Text | None:
    """Return the largest map that fits, or None if none fits.

    Without a number of rows, hexes have at most their normal size. Small ones have no arrows. A map
    of dots shows only arrows and signs, so that it needs some.
    """
    has_signs = any(cell.directions or cell.kind for cell in panel.cells)
    cells = {cell.hex: cell for cell in panel.cells}
    names = COMPASS if ascii_only else ARROWS

    def make_cell(hex_: Hex, size: HexSize) -> HexCell:
        """Return the content of a hex: arrows or a sign, above a value or a text."""
        cell = cells[hex_]
        value, style = cell.value or 0.0, KIND_STYLES.get(cell.kind, "")
        number = "" if cell.value is None else format_to_width(cell.value, size.width - 1)
        text = (cell.directions and number) or cell.text or number
        if cell.kind in {"hunter", "prey"}:
            text = ""  # the sign says it
        mark = KIND_GLYPHS.get(cell.kind, "")
        if cell.directions:
            arrows = [names[direction] for direction in cell.directions]
            mark = " ".join(arrows) if len(arrows) <= MAX_ARROWS else MANY_ARROWS_GLYPH
            style = style or (theme.CHOICE if value > 0 else theme.REGRET if value else "")
        dot_glyph = mark[:1] or "."
        mark += "*" * cell.is_changed
        if cell.is_marked:
            mark, style = f">{mark}<", f"{style} bold reverse".strip()
        if size.text_rows > 1:
            return HexCell(mark, text, style=style)
        return HexCell(text or mark, dot_glyph=dot_glyph, style=style)

    options = DrawOptions(columns, rows or UNLIMITED_ROWS, allow_large=rows is not None)
    caption = panel.caption if rows is None or rows >= MIN_CAPTION_ROWS else ""
    if len(caption) > columns:
        caption = caption.rpartition("  ")[0]
    needed_columns = 0
    for drawing in iter_maps(list(cells), make_cell, options, caption):
        width, height = measure_text(drawing)
        needed_columns = needed_columns or width
        is_legible = "╱" in drawing.plain or (has_signs and bool(drawing.plain.strip()))
        if width <= options.width and height <= options.height and is_legible:
            notes = []
            if width < needed_columns and panel.value_label:
                notes.append(f"the best directions need {needed_columns} columns")
            elif any(len(cell.directions) > MAX_ARROWS for cell in panel.cells):
                notes.append(f"{MANY_ARROWS_GLYPH} more than {MAX_ARROWS} best directions")
            return Text("\n").join([drawing, *(Text(note, "dim") for note in notes)])
    return None

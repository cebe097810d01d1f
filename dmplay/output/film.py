"""Animated SVG of screens that follow each other, in which each distinct row is written once."""

import html
from collections.abc import Iterable, Iterator

from rich.color import Color, blend_rgb
from rich.color_triplet import ColorTriplet
from rich.console import Console
from rich.segment import Segment
from rich.style import Style
from rich.terminal_theme import SVG_EXPORT_THEME
from rich.text import Text

from dmplay.output.svg_export import make_recording_console

COLUMN_WIDTH, ROW_HEIGHT = 12.2, 24.4  # in SVG units, as in Rich's pictures
FIRST_BASELINE = 20  # below the upper edge of the window's content
BACKGROUND_TOP, BACKGROUND_HEIGHT = -18.5, 24.65  # from the baseline of a row
NO_BREAK_SPACE = "\u00a0"
DIM_SHARE = 0.4  # share of the background in the colour of dim text
# The window and the fonts are written once, and the rows of each screen after them.
HEAD_TEMPLATE = """<svg viewBox="0 0 {width} {height}" xmlns="http://www.w3.org/2000/svg">
<style>
.film {{ font: {char_height}px 'Fira Code', 'DejaVu Sans Mono', Menlo, Consolas, monospace }}
.{unique_id}-title {{ font: bold 18px arial }}
.film > g {{ visibility: hidden; animation: turn DURATIONs infinite }}
@keyframes turn {{ 0% {{ visibility: visible }} SHARE%, 100% {{ visibility: hidden }} }}
@media (prefers-reduced-motion: reduce) {{
  .film > g {{ animation: none }}
  .film > g:last-child {{ visibility: visible }}
}}
</style>
{chrome}
<g class="film" transform="translate({terminal_x}, {terminal_y})">
"""


def texts_to_animated_svg(
    texts: Iterable[Text], count: int, title: str, width: int
) -> Iterator[str]:
    """Yield an animated SVG that shows each of `count` texts of equal height for one second.

    Readers who prefer reduced motion see the last text only.
    """
    head = HEAD_TEMPLATE.replace("DURATION", str(count)).replace("SHARE", f"{100 / count:.4f}")
    console = make_recording_console(width)
    frames = FilmFrames(console)
    for second, text in enumerate(texts):
        if not second:
            console.print(text, soft_wrap=True)
            yield console.export_svg(title=title, unique_id="film", code_format=head)
        yield frames.render_frame(second, text)
    yield "</g>\n</svg>\n"


class FilmFrames:
    """The frames of a film, and the rows and styles that are defined so far."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._row_ids: dict[tuple[Segment, ...], str] = {}
        self._style_classes: dict[str, str] = {}

    def render_frame(self, second: int, text: Text) -> str:
        """Return the frame that is visible in this second, with the definitions that are new."""
        definitions: list[str] = []
        uses = [
            f'<use href="#{row_id}" y="{FIRST_BASELINE + ROW_HEIGHT * number:.5g}"/>'
            for number, line in enumerate(text.split("\n", allow_blank=True))
            if (row_id := self._get_row_id((*line.render(self._console),), definitions))
        ]
        new_rows = f"<defs>{''.join(definitions)}</defs>\n" if definitions else ""
        return f'<g style="animation-delay: {second}s">{new_rows}{"".join(uses)}</g>\n'

    def _get_row_id(self, row: tuple[Segment, ...], definitions: list[str]) -> str:
        """Return the id of a row, '' if it is blank; add its drawing to new definitions.

        The texts of one style are one element, with spaces between them.
        """
        if row not in self._row_ids:
            backgrounds, column = "", 0
            texts: dict[tuple[str, int], str] = {}  # by style class and by column if underlined
            for text, optional_style, _ in row:
                style = optional_style or Style()
                ink, paper = _resolve_colors(style)
                if paper:
                    backgrounds += (
                        f'<rect fill="{paper}" {_format_columns("width", column, len(text))} '
                        f'y="{BACKGROUND_TOP}" height="{BACKGROUND_HEIGHT}" '
                        'shape-rendering="crispEdges"/>'
                    )
                if not text.isspace():
                    name = self._get_style_class(ink, style, definitions)
                    key = name, column if style.underline else 0
                    texts[key] = f"{texts.get(key, ''):<{column}}{text}"
                column += len(text)
            drawing = backgrounds + "".join(
                _format_text(name, text) for (name, _), text in texts.items()
            )
            row_id = f"r{len(self._row_ids)}" if drawing else ""
            definitions += [f'<g id="{row_id}">{drawing}</g>'] if drawing else []
            self._row_ids[row] = row_id
        return self._row_ids[row]

    def _get_style_class(self, ink: str, style: Style, definitions: list[str]) -> str:
        """Return the class of a style; add its rules to the definitions if it is new."""
        rules = [f"fill: {ink}"]
        rules += ["font-weight: bold"] if style.bold else []
        rules += ["text-decoration: underline"] if style.underline else []
        css = "; ".join(rules)
        if css not in self._style_classes:
            self._style_classes[css] = f"s{len(self._style_classes)}"
            definitions.append(f"<style>.{self._style_classes[css]} {{ {css} }}</style>")
        return self._style_classes[css]


def _format_columns(width_name: str, column: int, column_count: int) -> str:
    """Return the attributes of the left edge and of the width of some columns."""
    left, width = COLUMN_WIDTH * column, COLUMN_WIDTH * column_count
    return f'x="{left:.5g}" {width_name}="{width:.5g}"'


def _format_text(style_class: str, text: str) -> str:
    """Return the SVG text element of a row; blanks at its left become its position."""
    content = text.strip()
    columns = _format_columns("textLength", len(text) - len(text.lstrip()), len(content))
    # SVG merges plain spaces that follow each other.
    spaced = html.escape(content).replace("  ", 2 * NO_BREAK_SPACE)
    return f'<text class="{style_class}" {columns}>{spaced}</text>'


def _resolve_colors(style: Style) -> tuple[str, str]:
    """Return the colour of a style's text, and that of its background, '' if it is the window's."""
    ink = _resolve_color(style.color, SVG_EXPORT_THEME.foreground_color)
    paper = _resolve_color(style.bgcolor, SVG_EXPORT_THEME.background_color)
    if style.reverse:
        ink, paper = paper, ink
    paints_background = paper != SVG_EXPORT_THEME.background_color
    ink = blend_rgb(ink, paper, DIM_SHARE) if style.dim else ink
    return ink.hex, paper.hex if paints_background else ""


def _resolve_color(color: Color | None, default: ColorTriplet) -> ColorTriplet:
    """Return a colour as it is in pictures."""
    if color is None or color.is_default:
        return default
    return color.get_truecolor(SVG_EXPORT_THEME)

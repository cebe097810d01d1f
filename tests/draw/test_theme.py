"""The theme of drawings: each panel in each theme, and colours that are named in one place."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest
from rich.text import Text

import dmplay
from dmplay.draw import theme
from dmplay.draw.axes import Axis
from dmplay.draw.canvas import measure_text, to_ascii
from dmplay.draw.panel_text import draw_panel
from dmplay.draw.panels import (
    BarsPanel,
    BeliefMarks,
    BoardPanel,
    Box,
    GridPanel,
    HexPanel,
    Label,
    LinePanel,
    Panel,
    PlottedHex,
    PlottedTile,
    Polyline,
    Region,
    Series,
    ShapesPanel,
    TablePanel,
    TrianglePanel,
)
from dmplay.terminal.styles import COLOR_NAMES, THEME_PALETTES, to_ansi
from tests.support.glyphs import ASCII_CHARACTERS, GLYPHS

PACKAGE_FOLDER = Path(dmplay.__file__).parent
THEMES = ("default", "mono", "high-contrast", *THEME_PALETTES)
X, Y = Axis("x", 0.0, 4.0), Axis("y", 0.0, 2.0)
ENDS = np.array([0.0, 4.0])
PANELS: list[Panel] = [
    LinePanel(
        "lines", X, Y,
        [*(Series(f"series {n}", ENDS, np.array([n / 4, 2.0]), style=n) for n in range(6)),
         Series("thin", ENDS, ENDS / 4, is_thin=True)],
        [Region("low", 0.0, 2.0)], [(1.0, "now")],
    ),
    LinePanel("columns", X, Y, [Series("", np.arange(5.0), np.arange(5.0) / 2, "bars")]),
    BarsPanel("bars", ["a", "b"], [("prior", np.array([0.2, 0.8]))], marked_row=0),
    GridPanel("values", X, Y, np.arange(9.0).reshape(3, 3), "V", (), [(2.0, 1.0)], "mark"),
    GridPanel("actions", X, Y, np.eye(3), "", ["stay", "go"]),
    HexPanel("map", [PlottedHex((0, 0), -0.4, (0,)), PlottedHex((1, 0), 5.0, (), "+5", "gain"),
                     PlottedHex((2, 0), -5.0, (), "-5", "loss", is_marked=True)], "V"),
    TrianglePanel("beliefs", ["a", "b", "c"], np.eye(3), ["x", "y", "z"], "",
                  [BeliefMarks(np.array([0.2, 0.5, 0.3]))]),
    TrianglePanel("values", ["a", "b", "c"], np.eye(3), ["x", "y", "z"], "V"),
    TablePanel("table", "row", "", ["a"], ["c", "d"], [["1", "2"]], frozenset({(0, 1)}), "best"),
    BoardPanel("board", 2, [PlottedTile(0, 0, 2, "bold color(16) on color(230)", is_marked=True)]),
    ShapesPanel("shapes", X, Y, [Polyline([(0.0, 0.0), (4.0, 2.0)], "end"),
                                 Box(1.0, 0.0, 2.0, 1.0), Label("here", 3.0, 1.0, has_dot=True)]),
]  # fmt: skip
each_panel = pytest.mark.parametrize("panel", PANELS, ids=lambda p: f"{type(p).__name__} {p.title}")


@each_panel
def test_a_panel_shows_the_same_glyphs_in_each_theme_and_no_colour_in_mono(panel: Panel) -> None:
    for size in ((76, 20), (50, 12), (200, 58)):
        drawing = draw_panel(panel, *size)
        assert drawing
        assert measure_text(drawing)[0] <= size[0]
        assert set(drawing.plain) <= GLYPHS | ASCII_CHARACTERS | {"\n"}
        assert set(to_ascii(drawing).plain) <= ASCII_CHARACTERS | {"\n"}
        for name in THEMES:
            text = to_ansi(drawing, name)
            assert re.sub(r"\x1b\[[\d;]*m", "", text) == drawing.plain
            codes = re.findall(r"\x1b\[([\d;]*)m", re.sub(r"[34]8;5;\d+", "0", text))
            words = {word for code in codes for word in code.split(";")}
            assert name != "mono" or words <= {"", *"012347"}
            assert name not in THEME_PALETTES or not words & {str(30 + n) for n in range(8)}


def test_the_glyphs_of_fifty_names_differ() -> None:
    letters = theme.assign_letters(f"action {number}" for number in range(50))
    assert len({glyph for glyph, _ in letters.values()}) == 50


def test_series_and_levels_differ_without_colour_and_in_ascii() -> None:
    glyphs = [*theme.SERIES_GLYPHS, theme.THIN_GLYPH]
    assert len({to_ascii(Text(glyph)).plain for glyph in glyphs}) == len(glyphs)
    levels = [theme.choose_level(index / 8)[0] for index in range(8)]
    assert len({to_ascii(Text(level)).plain for level in levels}) == len(levels)
    letters = theme.assign_letters(["left", "right", "stay", "stop", "s"])
    assert [glyph for glyph, _ in letters.values()] == ["←", "→", "s", "t", "4"]


def test_only_the_theme_names_colours() -> None:
    pattern = re.compile(rf"^(bold |on )?({'|'.join(COLOR_NAMES)})( .*)?$")
    files = [*PACKAGE_FOLDER.glob("draw/*.py"), *PACKAGE_FOLDER.glob("views/*.py")]
    for path in [*files, *PACKAGE_FOLDER.glob("problems/*/view.py")]:
        strings = {
            node.value
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            if isinstance(node, ast.Constant) and isinstance(node.value, str)
        }
        named = sorted(filter(pattern.match, strings))
        assert not named or path.name == "theme.py", f"{path}: use a role of theme.py for {named}"

"""Tests of plots as text and as picture files."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from dmplay.core.arrays import Reals
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
    Plot,
    PlottedHex,
    PlottedTile,
    Polyline,
    Region,
    Series,
    Shape,
    ShapesPanel,
    TablePanel,
    TrianglePanel,
    make_value_axis,
)
from dmplay.draw.plot_text import draw_plot
from dmplay.errors import BadParameter
from dmplay.game.plot_kinds import PICTURE_FORMATS, list_book_figures
from dmplay.plots.report import PlotRequest, build_plot
from tests.support.glyphs import ASCII_CHARACTERS, GLYPHS
from tests.support.programs import run_dmplay

OTHER_REQUESTS = (
    PlotRequest("alpha-vectors", "crying-baby", methods="optimal,qmdp,fib", turns=3),
    PlotRequest("values", "hexworld", turns=2),
    PlotRequest("values", "machine-replacement", turns=4),
    PlotRequest("payoffs", "travelers-dilemma"),
    PlotRequest("returns", "catch", agent="optimal", compare="random", episodes=50),
    PlotRequest("belief", "transcripts/machine_replacement/a_threshold_repairs.dmt"),
)
REQUESTS = [*(PlotRequest(name) for name in list_book_figures()), *OTHER_REQUESTS]
each_request = pytest.mark.parametrize("request_", REQUESTS, ids=lambda r: f"{r.what} {r.subject}")
BELIEFS = Plot(
    "beliefs",
    [
        BarsPanel(
            "", ("sated", "hungry"),
            [("prior", np.array([0.25, 0.75])), ("likelihood", np.array([np.nan, 0.5]))],
            marked_row=1,
        )
    ],
)  # fmt: skip
DIAGONAL = Plot(
    "a line",
    [
        LinePanel(
            "",
            Axis("x", 0.0, 4.0),
            Axis("y", 0.0, 2.0),
            [Series("up", np.array([0.0, 4.0]), np.array([0.0, 2.0]))],
            [Region("low", 0.0, 1.0), Region("high", 1.0, 4.0)],
        )
    ],
    notes=["a note"],
)


@each_request
def test_a_plot_as_text_has_allowed_glyphs_and_fits(request_: PlotRequest) -> None:
    plot = build_plot(request_)
    for columns in (80, 200):
        text = draw_plot(plot, columns)
        assert {glyph for glyph in text.plain if not glyph.isascii()} <= GLYPHS | {"±"}
        assert measure_text(text)[0] <= min(columns, 100)
        ascii_ = to_ascii(text).plain.replace("±", "+-").replace("\n", "")
        assert set(ascii_) <= ASCII_CHARACTERS


def test_a_line_with_regions_is_drawn_as_text() -> None:
    rows = draw_plot(DIAGONAL, 40).plain.splitlines()
    assert rows[:3] == ["a line", "y", "2 ┤" + " " * 35 + "●●"]
    assert rows[16:19] == [
        "0 ┤●●",
        "  └┴─────────────────┴─────────────────┴",
        "   0                 2                 4",
    ]
    assert rows[20:] == ["x 0.000 to 1.000: low", "x 1.000 to 4.000: high", "● up", "a note"]


@pytest.mark.parametrize("kind", ["line", "points"])
def test_numbers_that_are_not_finite_are_gaps_in_a_plot(kind: Literal["line", "points"]) -> None:
    y = np.array([1.0, np.nan, 3.0, np.inf, 2.0])
    panel = LinePanel(
        "",
        Axis("turn", 0.0, 4.0),
        make_value_axis("return", y),
        [Series("", np.arange(5.0), y, kind)],
    )
    assert draw_plot(Plot("gaps", [panel]), 40).plain.count("●") == 3


def test_a_series_without_numbers_is_an_empty_plot() -> None:
    empty = np.zeros(0)
    panel = LinePanel(
        "", Axis("turn", 0.0, 4.0), make_value_axis("return", empty), [Series("a", empty, empty)]
    )
    assert draw_plot(Plot("none", [panel]), 40).plain.count("●") == 1  # of the legend


@pytest.mark.extra("plot")
def test_a_picture_of_a_series_of_one_number_has_a_marker() -> None:
    from dmplay.plots.picture_files import compose_figure, use_settings

    x, y = np.array([1.0]), np.array([2.0])
    panel = LinePanel("", Axis("turn", 0.0, 2.0), make_value_axis("return", y), [Series("a", x, y)])
    with use_settings():
        (axes,) = compose_figure(Plot("start", [panel])).axes
    assert axes.lines[0].get_marker() == "o"


def test_bars_are_drawn_in_eighths_of_a_row() -> None:
    series = Series("", np.array([1.0, 2.0]), np.array([1.0, 0.5]), "bars")
    panel = LinePanel("", Axis("turn", 0.5, 2.5), Axis("regret", 0.0, 1.0), [series])
    rows = draw_plot(Plot("bars", [panel]), 40).plain.splitlines()
    heights = [sum(row[column : column + 1] == "█" for row in rows) for column in (10, 30)]
    assert heights == [15, 7]
    assert "▄" in rows[9]


def test_a_grid_of_actions_has_one_letter_for_each() -> None:
    values = np.array([[0.0, 1.0], [2.0, np.nan]])
    panel = GridPanel(
        "", Axis("x", 0.0, 1.0), Axis("y", 0.0, 1.0), values, categories=("stay", "sell", "buy")
    )
    text = draw_plot(Plot("grid", [panel]), 40).plain
    assert "s stay   e sell   b buy" in text
    assert {letter for letter in "seb" if letter * 5 in text} == {"s", "e", "b"}


def test_a_table_stars_its_marked_cells() -> None:
    panel = TablePanel(
        "", "row", "column", ["a", "b"], ["c", "d"], [["1", "2"], ["3", "4"]],
        frozenset({(1, 0)}), "equilibrium",
    )  # fmt: skip
    assert draw_plot(Plot("game", [panel]), 40).plain == (
        "game\n     column\nrow  c    d\na    1    2\nb    3 *  4\n* equilibrium"
    )


@pytest.mark.parametrize("caption", ["", "* changed"])
def test_a_table_says_how_many_rows_it_leaves_out(caption: str) -> None:
    names = [f"state {number}" for number in range(30)]
    panel = TablePanel(
        "", "state", "", names, ["V"], [["1"]] * 30, frozenset({(0, 0)}), "best", caption=caption
    )
    drawing = draw_panel(panel, 20, 10)
    assert drawing
    lines = drawing.plain.split("\n")
    assert len(lines) <= 10
    assert lines[-1].startswith(f"{sum('state ' in line for line in lines[1:])} of 30 rows")
    whole = draw_panel(panel, 20, 40)
    assert whole
    assert "rows" not in whole.plain


def test_a_triangle_shows_the_best_action_near_each_corner() -> None:
    panel = TrianglePanel("", ("s0", "s1", "s2"), np.eye(3), ("top", "west", "east"))
    rows = draw_plot(Plot("triangle", [panel]), 60).plain.splitlines()
    assert rows[1].strip() == "P(s0) = 1"
    assert rows[4].split() == ["╱", "t", "╲"]
    assert rows[-4].split() == ["╱", *"wwwwwwww", *"eeeeeee", "╲"]
    assert rows[-2].split("  ")[0] == "P(s1) = 1"
    assert rows[-2].endswith("  P(s2) = 1")
    assert rows[-1] == "t top   w west   e east"


def test_a_triangle_marks_beliefs_and_shades_values() -> None:
    marks = [BeliefMarks(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), "past")]
    marks.append(BeliefMarks(np.array([0.0, 1.0, 0.0])))
    panel = TrianglePanel("", ("s0", "s1", "s2"), np.eye(3)[:1] * 8, ("a",), "value", marks)
    rows = draw_plot(Plot("triangle", [panel]), 60).plain.splitlines()
    assert rows[2].strip() == "·"
    assert rows[3].strip() == "╱█╲"
    assert set(rows[-4].strip()) == {*"╱▁╲"}
    assert (rows[-3][0], rows[-3][-1]) == ("●", "·")
    assert rows[-1] == "value: ▁ 0  █ 8"


def test_small_hexes_show_values_and_rewards_and_tell_that_arrows_are_missing() -> None:
    cells = [
        PlottedHex((0, 0), -0.31, (0,)),
        PlottedHex((1, 0), 4.04, (0, 3), is_changed=True),
        PlottedHex((2, 0), 5.0, (), "+5", "gain"),
        *(PlottedHex((q, 0), 10.0, (), "+10", "gain") for q in range(3, 8)),
    ]
    panel = HexPanel("", cells, "value")
    wide, small = (draw_plot(Plot("map", [panel]), width).plain for width in (60, 40))
    assert "│  →  │ → ←*│  ◆  │  ◆  │" in wide
    assert "│-0.31│ 4.04│  +5 │ +10 │" in wide
    assert "│-.3│4.0│ +5│+10│" in small
    assert small.splitlines()[-1] == "the best directions need 49 columns"


def test_bars_have_headings_a_mark_and_a_sign_for_an_unknown_number() -> None:
    assert draw_plot(BELIEFS, 40).plain.splitlines()[1:] == [
        "          prior           likelihood",
        "  sated   ██······ 0.250           -",
        "> hungry  ██████·· 0.750  ████···· 0.500",
    ]


def test_a_board_shows_where_tiles_slide_and_which_one_is_marked() -> None:
    tiles = [
        PlottedTile(0, 0, 2, end=(0, 1)),
        PlottedTile(1, 0, 16, end=(0, 0)),
        PlottedTile(1, 1, 8, is_marked=True),
    ]
    assert draw_plot(Plot("board", [BoardPanel("", 2, tiles)]), 40).plain.splitlines() == [
        "board",
        "┌────┬────┐",
        "│2 → │ ·  │",
        "├────┼────┤",
        "│16 ↑│[8] │",
        "└────┴────┘",
    ]


def test_shapes_are_drawn_in_the_units_of_their_axes() -> None:
    shapes: list[Shape] = [
        Polyline([(0.0, 0.0), (4.0, 0.0)], is_dashed=True),
        Polyline([(3.0, 0.5), (3.0, 2.0)], "both"),
        Box(0.0, 1.0, 1.0, 1.5),
        Label("point", 1.5, 2.0, has_dot=True),
        Label("edge", 4.0, 1.5, "left"),
    ]
    panel = ShapesPanel("", Axis("x", 0.0, 4.0), Axis("y", 0.0, 2.0), shapes, has_equal_scales=True)
    assert draw_plot(Plot("shapes", [panel]), 44).plain.splitlines() == [
        "shapes",
        "y",
        "2 ┤               ● point        ↑",
        "  │                              │",
        "  │▒▒▒▒▒▒▒▒▒▒▒                   │    edge",
        "  │▒▒▒▒▒▒▒▒▒▒▒                   │",
        "  │▒▒▒▒▒▒▒▒▒▒▒                   │",
        "1 ┤▒▒▒▒▒▒▒▒▒▒▒                   │",
        "  │                              │",
        "  │                              │",
        "  │                              ↓",
        "  │",
        "0 ┤·········································",
        "  └┴───────────────────┴───────────────────┴",
        "   0                   2                   4",
        "                       x",
    ]


@pytest.mark.extra("plot")
@each_request
def test_a_plot_is_drawn_as_a_picture_with_the_same_bytes_again(request_: PlotRequest) -> None:
    from dmplay.plots.picture_files import render_picture

    data = render_picture(build_plot(request_), "pdf")
    assert data.startswith(b"%PDF")
    assert data == render_picture(build_plot(request_), "pdf")


@pytest.mark.extra("plot")
def test_a_picture_has_the_format_of_its_name(tmp_path: Path) -> None:
    starts = {"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF"}
    assert list(starts) == list(PICTURE_FORMATS)
    for file_format, start in starts.items():
        name = f"start.{file_format.upper()}"
        result = run_dmplay(tmp_path, "plot", "F.16", "-o", name)
        assert (result.returncode, result.stdout) == (0, f"wrote {name}\n")
        assert (tmp_path / name).read_bytes().startswith(start)


@pytest.mark.extra("plot")
def test_a_picture_of_bars_has_their_numbers_and_headings() -> None:
    from dmplay.plots.picture_files import compose_figure, use_settings

    with use_settings():
        figure = compose_figure(BELIEFS)
    (axes,) = figure.axes
    assert [text.get_text() for text in axes.get_yticklabels()] == ["sated", "> hungry"]
    assert [text.get_text() for text in axes.texts] == [" 0.250", " 0.750", " -", " 0.500"]
    assert [text.get_text() for text in figure.legends[0].texts] == ["prior", "likelihood"]


@pytest.mark.extra("plot")
def test_a_picture_of_a_table_has_its_row_marks_and_its_caption() -> None:
    from dmplay.plots.picture_files import compose_figure, use_settings

    panel = TablePanel(
        "", "state", "", ["sated", "hungry"], ["value"], [["1"], ["2"]],
        row_marks=["*", " "], caption="* changed",
    )  # fmt: skip
    with use_settings():
        (axes,) = compose_figure(Plot("sweep", [panel])).axes
    x, y = zip(*(text.get_position() for text in axes.texts), strict=True)
    column = {text.get_text(): index for index, text in enumerate(axes.texts)}
    mark, label, caption = column["*"], column["sated"], column["* changed"]
    assert (x[mark] < x[label], y[mark]) == (True, y[label])
    assert max(axes.get_ylim()) > y[caption] > y[column["hungry"]]


@pytest.mark.extra("plot")
def test_a_picture_colours_a_whole_triangle_of_values() -> None:
    from matplotlib.tri import TriContourSet

    from dmplay.plots.picture_files import compose_figure, use_settings

    vectors = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.6, 0.6, 0.6]])
    panel = TrianglePanel("", ["a", "b", "c"], vectors, ["go", "stay", "ask"], "value")
    with use_settings():
        axes = compose_figure(Plot("values", [panel])).axes[0]
    (contours,) = (item for item in axes.collections if isinstance(item, TriContourSet))
    point = (0.6, 0.2)  # where the third vector is the best by far
    assert any(path.contains_point(point) for path in contours.get_paths())


@pytest.mark.extra("plot")
@pytest.mark.parametrize("values", [np.full((2, 3), np.nan), np.ones((1, 1)), np.ones((1, 3))])
def test_a_map_without_numbers_or_with_one_row_is_drawn(values: Reals) -> None:
    from dmplay.plots.picture_files import compose_figure, use_settings

    panel = GridPanel("", Axis("x", 0.0, 1.0), Axis("y", 0.0, 1.0), values, "V")
    with use_settings():
        axes = compose_figure(Plot("map", [panel])).axes[0]
    has_numbers = bool(np.isfinite(values).any())
    assert len(axes.images) == has_numbers
    assert ("V:" in draw_plot(Plot("map", [panel]), 40).plain) == has_numbers


@pytest.mark.extra("plot")
def test_a_picture_of_hexes_has_their_marks_and_the_caption() -> None:
    from dmplay.plots.picture_files import compose_figure, use_settings

    cells = [
        PlottedHex((0, 0), 1.0, is_changed=True),
        PlottedHex((1, 0), 2.0, is_marked=True),
        PlottedHex((2, 0), 3.0, is_changed=True, is_marked=True),
        PlottedHex((3, 0), 4.0),
    ]
    with use_settings():
        axes = compose_figure(Plot("sweep", [HexPanel("", cells, "V", "* changed")])).axes[0]
    texts = [text.get_text() for text in axes.texts if text.get_text()]
    assert texts == ["*", "*", "* changed"]
    outlined = [patch for patch in axes.patches if not patch.get_fill()]
    assert len(outlined) == 2


@pytest.mark.extra("plot")
def test_a_picture_has_no_date_and_no_small_text() -> None:
    import matplotlib
    from matplotlib.text import Text

    from dmplay.plots.picture_files import compose_figure, render_picture, use_settings

    assert b"<dc:date>" not in render_picture(DIAGONAL, "svg")
    assert b"/CreationDate" not in render_picture(DIAGONAL, "pdf")
    for name in list_book_figures():
        with use_settings():
            figure = compose_figure(build_plot(PlotRequest(name)))
        texts = [item for item in figure.findobj(Text) if isinstance(item, Text)]
        assert min(float(item.get_fontsize()) for item in texts) >= 9.0
        assert figure.get_figwidth() <= 6.5
    assert matplotlib.rcParams["svg.hashsalt"] is None  # the user's settings are as before


@pytest.mark.extra("plot")
def test_names_with_dollar_signs_and_foreign_scripts_are_drawn() -> None:
    from dmplay.plots.picture_files import render_picture

    panel = TablePanel("$x_1$ {", "row", "", ["漢"], ["$"], [["^2"]])
    assert render_picture(Plot("$\\frac$", [panel]), "svg").startswith(b"<?xml")


def test_only_an_svg_picture_is_written_without_matplotlib(monkeypatch: pytest.MonkeyPatch) -> None:
    from dmplay.plots.picture_files import check_matplotlib, render_picture

    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(BadParameter, match=r"install the extra plot: pip install 'dmplay\[plot\]'"):
        check_matplotlib("png")
    check_matplotlib("svg")
    picture = render_picture(BELIEFS, "svg").decode()
    assert picture.startswith("<svg")
    assert all(text in picture for text in ("sated", "0.750", "██████"))


def test_a_plot_in_the_terminal_does_not_load_matplotlib() -> None:
    code = (
        "import sys; from dmplay.__main__ import main\n"
        "sys.argv = ['dmplay', 'plot', 'F.13']\n"
        "try: main()\n"
        "except SystemExit: print('matplotlib' in sys.modules)"
    )
    completed = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert completed.stdout.endswith("\nFalse\n"), completed.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("hexworld", "plot: hexworld is a problem; try dmplay plot values hexworld"),
        ("valeus hexworld", "unknown plot 'valeus'; did you mean values"),
        ("F.17", "unknown plot 'F.17'; did you mean F.7"),
        ("values", "plot values: expected a PROBLEM, such as dmplay plot values hexworld"),
        ("belief", "plot belief: expected a FILE, such as dmplay plot belief game.dmt"),
        ("values hexwrld", "unknown problem 'hexwrld'"),
        ("values hexworld --set slip=2", "slip: got 2"),
        ("values hexworld --methods fib", "--methods: has no effect on plot values"),
        ("F.13 --turns 3", "--turns: has no effect on plot F.13"),
        ("F.2 catch", "plot F.2: got catch; the figure is about hexworld"),
        ("F.2 -o f.gif", "-o f.gif: expected a file name that ends in one of .svg, .png, .pdf"),
        ("F.2 -o f", "-o f: expected a file name that ends in one of .svg, .png, .pdf"),
        ("alpha-vectors crying-baby --methods pbvi", "unknown method 'pbvi'"),
        ("belief none.dmt", "none.dmt"),
        ("returns catch --agent nobody", "unknown agent 'nobody'"),
        ("-o f.svg", "plot: -o needs a plot, such as F.2; dmplay plot lists them"),
    ],
)
def test_a_misfit_is_one_line_and_exit_code_2(words: str, message: str, tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "plot", *words.split())
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.startswith("error: ")
    assert result.stderr.count("\n") == 1
    assert message in result.stderr


def test_the_list_names_every_plot_and_figure(tmp_path: Path) -> None:
    lines = run_dmplay(tmp_path, "plot").stdout.splitlines()
    assert lines[1].startswith("  values PROBLEM")
    assert [name for line in lines for name in re.findall(r"^  ([FT]\.\d+) ", line)] == [
        *list_book_figures()
    ]


@pytest.mark.extra("plot")
def test_a_picture_is_not_overwritten_without_force(tmp_path: Path) -> None:
    (tmp_path / "f.svg").write_text("mine")
    assert "exists" in run_dmplay(tmp_path, "plot", "F.16", "-o", "f.svg").stderr
    assert run_dmplay(tmp_path, "plot", "F.16", "-o", "f.svg", "--force").stdout == "wrote f.svg\n"
    assert (tmp_path / "f.svg").read_bytes().startswith(b"<?xml")

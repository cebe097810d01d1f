"""Tests of the book's figures, which are drawn from the problems and their solutions."""

from functools import cache
from pathlib import Path

import pytest
from rich.text import Text

from dmplay.errors import BadParameter, UnknownName
from dmplay.game.export_formats import check_extension_fits_format
from dmplay.output import svg_export
from dmplay.registry.builtin_names import problem_names
from dmplay.views.figures import registry, tables
from dmplay.views.toolkit.canvas import measure_text, to_ascii
from tests.support.glyphs import GLYPHS
from tests.support.user_problems import Vault


@cache
def draw_cached_figure(name: str) -> Text:
    """Draw a figure; it is cached, and tests must not modify it."""
    _, draw = registry.find_figure(name)
    return draw()


def draw_plain_figure(name: str) -> str:
    return draw_cached_figure(name).plain


def test_every_figure_of_the_appendix_is_available() -> None:
    assert list(registry.load_figures()) == [
        "F.2", "F.9", "F.10", "F.11", "F.12", "F.13", "F.14", "F.15", "F.16", "T.1", "T.2",
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["F.2", "f2", "figure F.2"])
def test_a_figure_is_found_by_several_spellings_of_its_name(name: str) -> None:
    assert registry.find_figure(name) == registry.load_figures()["F.2"]


def test_an_unknown_figure_is_rejected() -> None:
    with pytest.raises(UnknownName, match=r"unknown figure 'F.3'; did you mean"):
        registry.find_figure("F.3")


def test_a_file_extension_of_another_format_is_rejected(tmp_path: Path) -> None:
    for name in ("f.png", "f.PDF", "f.cast", "f.txt"):
        with pytest.raises(
            BadParameter, match=r"f\.\w+: the format is SVG; name the file \S+f\.svg"
        ):
            svg_export.draw_figure("T.2", tmp_path / name, svg=False)
    for name in ("f.svg", "F.2", "f"):
        svg_export.draw_figure("T.2", tmp_path / name, svg=False)
    assert {path.name for path in tmp_path.iterdir()} == {"f.svg", "F.2", "f"}
    with pytest.raises(BadParameter, match="the format is HTML; name the file g"):
        check_extension_fits_format(Path("g.svg"), "html")
    with pytest.raises(BadParameter, match=r"the format is JSON; name the file g\.json"):
        check_extension_fits_format(Path("g.csv"), "json")
    for name in ("g.csv", "g.txt", "g"):  # text formats accept .txt and no extension
        check_extension_fits_format(Path(name), "csv")


def test_a_blank_figure_name_is_rejected() -> None:
    with pytest.raises(UnknownName, match="unknown figure ' '"):
        registry.find_figure(" ")


@pytest.mark.parametrize("name", list(registry.load_figures()))
def test_a_figure_has_allowed_glyphs_an_ascii_form_and_an_svg_form(name: str) -> None:
    (title, draw), text = registry.find_figure(name), draw_cached_figure(name)
    assert {glyph for glyph in text.plain if not glyph.isascii()} <= GLYPHS
    assert to_ascii(text).plain.isascii()
    assert measure_text(text)[0] <= 110
    assert svg_export.text_to_svg(text, title).startswith("<svg")
    assert svg_export.text_to_svg(text, title) == svg_export.text_to_svg(draw(), title)


def list_names_in_table_f1() -> list[str]:
    rows = registry.find_figure("T.1")[1]().plain.splitlines()[1:]
    return [row.split()[0] for row in rows if row]


def test_table_f1_leaves_out_a_problem_that_is_not_from_the_appendix(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    names = list_names_in_table_f1()
    other_problem = f"{Vault.__module__}:{Vault.__name__}"
    monkeypatch.setattr(tables, "problem_names", lambda: [other_problem, *problem_names()])
    assert list_names_in_table_f1() == names


def test_table_f1_has_the_order_of_the_book() -> None:
    names = list_names_in_table_f1()
    assert names[:3] == ["hexworld", "2048", "cart-pole"]
    assert names[-2:] == ["multicaregiver-crying-baby", "collaborative-predator-prey"]


def test_figure_f2_has_the_values_of_the_line() -> None:
    assert draw_plain_figure("F.2").endswith(
        "│  →  │  →  │  →  │  →  │  →  │  →  │  ◆  │\n"
        "│ 2.37│ 3.22│ 4.21│ 5.36│ 6.68│ 8.22│ +10 │\n"
        "  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱\n"
    )


def test_figure_f9_has_its_climb_region_at_a_rising_aircraft() -> None:
    rows = draw_plain_figure("F.9").splitlines()
    level = [row[8:49] for row in rows[25:46]]
    rising = [row[56:97] for row in rows[25:46]]
    # At 5 m/s, advisories reach from 2 to 37 s. At 0 m/s, climbs above mirror descents below.
    columns = [t for t in range(41) if any(row[t] in "↑↓" for row in rising)]
    assert (min(columns), max(columns)) == (2, 37)
    assert max(t for t in range(41) if any(row[t] == "↑" for row in rising)) == 25
    swap = str.maketrans("↑↓", "↓↑")
    assert [row.translate(swap) for row in level[:10]] == level[:10:-1]


def test_figure_f10_draws_the_ten_step_and_infinite_horizon_functions() -> None:
    assert "(-9.69, -31.63)" in draw_plain_figure("F.10")
    assert "feed (-13.06, -23.06)" in draw_plain_figure("F.10")
    assert "ignore (-16.31, -38.25)" in draw_plain_figure("F.10")
    assert "feed (-19.67, -29.67)" in draw_plain_figure("F.10")


def test_figure_f11_has_two_regions_of_manufacture() -> None:
    rows = draw_plain_figure("F.11").splitlines()
    assert any("immmr" in row for row in rows)


def test_figure_f12_has_twenty_triangles() -> None:
    assert draw_plain_figure("F.12").count(" step") == 20


def test_figure_f16_has_the_predator_above_the_prey() -> None:
    rows = draw_plain_figure("F.16").splitlines()
    (predator,) = (n for n, row in enumerate(rows) if "│  P  │" in row)
    (prey,) = (n for n, row in enumerate(rows) if "│  o  │" in row)
    assert prey == predator + 6


def test_table_f2_equals_the_printed_table() -> None:
    words = [row.split() for row in draw_plain_figure("T.2").splitlines()]
    assert words[5][:6] == ["0.81", "0.18", "0.01", "1", "0", "0.6525"]
    assert words[7][:6] == ["0", "0", "1", "0.25", "0.75", "0"]

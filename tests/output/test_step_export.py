"""Exports of watched algorithms: picture, film and page."""

import json
import re
from pathlib import Path

import pytest

from dmplay.draw.options import DrawOptions
from dmplay.errors import BadParameter
from dmplay.game.watching import WatchedSteps, WatchTarget, load_watched_steps
from dmplay.output.step_export import MAX_FILM_STEPS, StepExport, export_algorithm_steps

SIZE = DrawOptions(80, 24)


def watch(iterations: int | None = 3) -> WatchedSteps:
    """Return the steps of value iteration on hex world."""
    return load_watched_steps("value-iteration", WatchTarget("hexworld"), iterations)


def export(format_name: str, step: int | None = None, iterations: int | None = 3) -> str:
    """Return an export as one text."""
    printout = export_algorithm_steps(
        watch(iterations), StepExport(format_name, SIZE, step), None, force=False
    )
    return "".join(printout.text_chunks)


def plain_text(svg: str) -> str:
    """Return the texts of an SVG, with blanks for its non-breaking spaces."""
    pieces = re.findall(r"<text[^>]*>(.*?)</text>", svg, re.DOTALL)
    return " ".join(pieces).replace("&#160;", " ")


def test_a_picture_shows_one_step_with_its_formula() -> None:
    svg = export("svg", step=2)
    assert svg.startswith("<svg")
    assert "value-iteration on hexworld: sweep 2 (step 3 of 4)" in plain_text(svg)
    assert "V(8,1) = -0.3 + 0.9 (0.7 x 10 + 0.3 x 0) = 6" in plain_text(svg)
    assert not re.search(r"(href|src)=|@font-face|url\(http", svg)


def test_a_picture_shows_the_last_step_by_default() -> None:
    assert "sweep 3 (step 4 of 4)" in plain_text(export("svg"))


def test_a_film_shows_each_step_once() -> None:
    film = export("film")
    assert re.findall(r"\(step (\d) of 4\)", plain_text(film)) == ["1", "2", "3", "4"]


def test_a_long_film_shows_evenly_spaced_steps() -> None:
    film = export("film", iterations=MAX_FILM_STEPS + 100)
    assert film.count("<g style=") == MAX_FILM_STEPS


def test_a_page_lists_all_steps_and_needs_no_network() -> None:
    page = export("html")
    items = re.findall(r"<li>(.*?)</li>", page)
    assert [item.split(".")[0] for item in items] == ["start", "sweep 1", "sweep 2", "sweep 3"]
    data = re.search(r'<script type="application/json" id="game">(.*?)</script>', page, re.DOTALL)
    assert data
    assert len(json.loads(data[1])["steps"]) == 4
    assert 'type="range" min="0" max="3" value="0"' in page
    assert not re.search(r"(src|href)=", page)


def test_a_page_opens_at_the_typed_step() -> None:
    assert 'value="2" aria-label="step"' in export("html", step=2)


def test_files_are_written_and_wrong_endings_refused(tmp_path: Path) -> None:
    file = tmp_path / "walk.svg"
    export_algorithm_steps(watch(), StepExport("svg", SIZE), file, force=False)
    assert file.read_text(encoding="utf-8").startswith("<svg")
    with pytest.raises(BadParameter, match=r"the format is HTML; name the file .*walk.html"):
        export_algorithm_steps(watch(), StepExport("html", SIZE), file, force=True)


def test_a_film_has_no_single_step() -> None:
    with pytest.raises(BadParameter, match="--step: a film shows all steps"):
        export("film", step=1)

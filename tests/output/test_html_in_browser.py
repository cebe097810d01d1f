"""Tests of the HTML pages of all problems in Chromium: axe-core, contrast, layout and the keyboard.

They need the program chromium, and axe-core from the package axe-core-python.
"""

import re
from collections.abc import Iterator
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

import pytest

from dmplay.draw.options import DrawOptions
from dmplay.game.playback import Playback
from dmplay.output.html_export import render_page
from dmplay.registry.builtin_names import name_to_stem, problem_names
from tests.support.browser import BrowserPage, needs_browser
from tests.support.document_examples import PROJECT_ROOT
from tests.support.games import record_game
from tests.support.user_problems import STYLED_SOURCE

pytestmark = [pytest.mark.slow, needs_browser]
needs_axe = pytest.mark.skipif(
    not find_spec("axe_core_python"), reason="needs the package axe-core-python"
)
every_problem = pytest.mark.parametrize("name", problem_names())
every_scheme = pytest.mark.parametrize("is_dark", [False, True], ids=["light", "dark"])
LARGE_OPTIONS = DrawOptions(80, 24, allow_large=True)
NARROW_COLUMNS = 400  # pixels of a phone
CONTROL_IDS = ["frame", "back", "play", "on", "slider", "log"]
MIN_CONTRAST = 4.5  # WCAG 2.2, 1.4.3

# Also for texts of box-drawing characters alone, which axe-core leaves out.
CONTRAST_SCRIPT = """(() => {
function rgb(text) { return text.match(/[0-9.]+/g).map(Number); }
function luminance(color) {
  const [r, g, b] = rgb(color).slice(0, 3).map((x) => x / 255)
    .map((x) => x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}
function background(part) {
  const color = getComputedStyle(part).backgroundColor;
  return rgb(color)[3] === 0 ? background(part.parentElement) : color;
}
return [...document.querySelectorAll("#board span, h1, p, dt, dd, li, figcaption span")]
  .map((part) => [luminance(getComputedStyle(part).color), luminance(background(part))])
  .map(([ink, paper]) => (Math.max(ink, paper) + 0.05) / (Math.min(ink, paper) + 0.05));
})()"""
OVERFLOW_SCRIPT = "document.documentElement.scrollWidth - window.innerWidth"
LABEL_HEIGHTS_SCRIPT = '[...document.querySelectorAll(".label")].map((label) => label.clientHeight)'
SAID_SCRIPT = 'document.getElementById("said").textContent'
CURRENT_ITEM_SCRIPT = 'document.querySelector("#log [aria-current]").textContent'
STEP_SCRIPT = "Number(document.body.dataset.step)"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[BrowserPage]:
    """Yield a page of one browser, which all tests of this file use in turn."""
    with BrowserPage(tmp_path_factory.mktemp("profile")) as browser_page:
        yield browser_page


def render_first_transcript(name: str) -> str:
    """Return the page of the problem's first recorded game, open at its start."""
    path = min((PROJECT_ROOT / "transcripts" / name_to_stem(name)).glob("*.dmt"))
    return "".join(render_page(Playback(path), None, LARGE_OPTIONS))


@needs_axe
@every_scheme
@every_problem
def test_axe_finds_no_fault_in_a_page(page: BrowserPage, name: str, *, is_dark: bool) -> None:
    axe = files("axe_core_python").joinpath("axe.min.js").read_text(encoding="utf-8")
    page.load(render_first_transcript(name), is_dark=is_dark)
    page.evaluate(f"{axe}; true")
    result = page.evaluate("axe.run()")
    violations = [
        (rule["id"], node["html"]) for rule in result["violations"] for node in rule["nodes"]
    ]
    assert violations == []
    assert "color-contrast" in [rule["id"] for rule in result["passes"]]


@every_scheme
@every_problem
def test_every_text_of_a_page_can_be_read(page: BrowserPage, name: str, *, is_dark: bool) -> None:
    page.load(render_first_transcript(name), is_dark=is_dark)
    assert min(page.evaluate(CONTRAST_SCRIPT)) >= MIN_CONTRAST
    assert max(page.evaluate(LABEL_HEIGHTS_SCRIPT), default=0) <= 20  # one line


@every_scheme
def test_the_player_s_own_piece_can_be_seen(page: BrowserPage, *, is_dark: bool) -> None:
    path = PROJECT_ROOT / "transcripts/predator_prey/chased_and_devoured.dmt"
    html = "".join(render_page(Playback(path), 2, LARGE_OPTIONS))
    assert "bold reverse yellow" in html
    page.load(html, is_dark=is_dark)
    assert min(page.evaluate(CONTRAST_SCRIPT)) >= MIN_CONTRAST


@every_problem
def test_a_page_is_not_wider_than_a_phone(page: BrowserPage, name: str) -> None:
    page.load(render_first_transcript(name), width=NARROW_COLUMNS)
    assert page.evaluate(OVERFLOW_SCRIPT) <= 0


def test_a_long_word_does_not_widen_a_page(page: BrowserPage, tmp_path: Path) -> None:
    word = "w" * 150  # 1,800 pixels
    source = STYLED_SOURCE.replace("PICTURE", "'x'").replace('"go"', f'"{word}"')
    source = source.replace("(Tabular):", f'(Tabular):\n    """{word}."""')
    (tmp_path / "styled.py").write_text(source)
    file = tmp_path / "g.dmt"
    record_game(file, f"{tmp_path}/styled.py", "random", turns=9)
    html = "".join(render_page(Playback(file, trusted=True), None, LARGE_OPTIONS))
    assert html.count(word) > 1
    page.load(html)
    assert page.evaluate(OVERFLOW_SCRIPT) <= 0


@every_problem
def test_the_keyboard_reaches_every_turn_and_every_control(page: BrowserPage, name: str) -> None:
    html = render_first_transcript(name)
    page.load(html)
    last = html.count("<li>") - 1
    assert page.evaluate(STEP_SCRIPT) == 0
    page.press("End")
    assert page.evaluate(STEP_SCRIPT) == last
    page.press("Home")
    for step in range(last + 1):
        assert page.evaluate(STEP_SCRIPT) == step
        assert page.evaluate(SAID_SCRIPT) == page.evaluate(CURRENT_ITEM_SCRIPT)
        page.press("ArrowRight")
    assert page.evaluate(STEP_SCRIPT) == last
    focused = []
    for _ in CONTROL_IDS:
        page.press("Tab")
        focused.append(page.evaluate("document.activeElement.id"))
        assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") != "none"
    assert focused == CONTROL_IDS


def test_the_buttons_work_with_enter_and_space(page: BrowserPage) -> None:
    page.load(render_first_transcript("hexworld"))
    page.press("End")
    last = page.evaluate(STEP_SCRIPT)
    page.press("Tab", "Tab", "Enter", " ")
    assert page.evaluate(STEP_SCRIPT) == last - 2
    page.press("Tab", " ")
    assert page.evaluate('document.getElementById("play").textContent') == "‖"
    page.press(" ", "Tab", "Enter")
    assert page.evaluate('document.getElementById("play").textContent') == "▷"
    assert page.evaluate(STEP_SCRIPT) == last - 1


def test_the_arrow_keys_scroll_a_board_that_is_wider_than_the_window(page: BrowserPage) -> None:
    page.load(render_first_transcript("hexworld"), width=NARROW_COLUMNS)
    page.press("End")
    last = page.evaluate(STEP_SCRIPT)
    page.press("Tab", "ArrowLeft")
    assert page.evaluate("document.activeElement.id") == "frame"
    assert page.evaluate(STEP_SCRIPT) == last
    page.press("Tab", "ArrowLeft")
    assert page.evaluate(STEP_SCRIPT) == last - 1


def test_a_page_shows_the_board_of_the_step(page: BrowserPage) -> None:
    path = PROJECT_ROOT / "transcripts/crying_baby/starve_then_feed.dmt"
    page.load("".join(render_page(Playback(path), None, LARGE_OPTIONS)))
    board = page.evaluate('document.getElementById("board").textContent')
    page.press("Home", "ArrowRight")
    assert re.match(r"turn 1\. ", page.evaluate(SAID_SCRIPT))
    first = page.evaluate('document.getElementById("board").textContent')
    page.load("".join(render_page(Playback(path), 1, LARGE_OPTIONS)))
    assert page.evaluate('document.getElementById("board").textContent') == first != board

"""Tests of the HTML page of a transcript: a single file with every turn and keyboard controls."""

import re
from pathlib import Path

import pytest

from dmplay.draw.options import DrawOptions
from dmplay.errors import BadParameter
from dmplay.game.playback import Playback
from dmplay.output.html_export import render_page
from tests.support.document_examples import PROJECT_ROOT, TIGER_SOURCE
from tests.support.games import record_game
from tests.support.user_problems import STYLED_SOURCE

CRYING_BABY_PATH = PROJECT_ROOT / "transcripts/crying_baby/starve_then_feed.dmt"
LARGE_OPTIONS = DrawOptions(80, 24, allow_large=True)
MAX_PAGE_BYTES = 300_000  # for a page of 100 turns


def test_a_page_loads_no_external_files_and_describes_every_turn() -> None:
    html = "".join(render_page(Playback(CRYING_BABY_PATH), None, LARGE_OPTIONS))
    assert not re.search(r'(src|href)="|url\(|import\s', html)
    game = Playback(CRYING_BABY_PATH)
    turns = [game.narrator.describe_turn(game.snapshot()) for _ in game.iter_agent_turns()]
    log = html[html.index("<ol") : html.index("</ol>")]
    assert [sentence for sentence in turns if f"<li>{sentence}</li>" not in log] == []
    assert "<figcaption>belief: " in html


def test_a_page_opens_at_the_start_or_at_a_valid_turn() -> None:
    assert "show(0);" in "".join(render_page(Playback(CRYING_BABY_PATH), None, LARGE_OPTIONS))
    assert "show(1);" in "".join(render_page(Playback(CRYING_BABY_PATH), 1, LARGE_OPTIONS))
    with pytest.raises(BadParameter, match="--at: got 99, the game has"):
        "".join(render_page(Playback(CRYING_BABY_PATH), 99, LARGE_OPTIONS))


def test_a_page_of_a_hundred_turns_is_small(tmp_path: Path) -> None:
    file = tmp_path / "g.dmt"
    record_game(file, "hexworld", "random", turns=100, settings=("rewards=[]",))
    html = "".join(render_page(Playback(file), None, DrawOptions(200, 60, allow_large=True)))
    assert html.count("<li>") == 101
    assert len(html.encode()) < MAX_PAGE_BYTES


def test_user_defined_names_are_escaped_in_a_page(tmp_path: Path) -> None:
    (tmp_path / "tiger.py").write_text(TIGER_SOURCE.replace("listen", "</script><b>$title"))
    file = tmp_path / "g.dmt"
    record_game(file, f"{tmp_path}/tiger.py:Tiger", "random", turns=9)
    html = "".join(render_page(Playback(file, trusted=True), None, LARGE_OPTIONS))
    assert "&lt;b&gt;&#36;title" in html
    assert "<b>" not in html
    assert html.count("</script>") == 2


@pytest.mark.parametrize(
    "picture",
    [
        """Text("x").join([Text(), Text("y", style='link http://a"><script>alert(1)</script>')])""",
        """Text.assemble(("x", 'red "><b>'), ("y", 'on_"><b>'))""",
        r"""'\x1b]8;;http://a"><script>alert(1)</script>\x1b\\\\x\x1b]8;;\x1b\\\\ y'""",
        """Text.assemble(("x y", Style(link='a"><b>', bold=True)))""",
        """Text("x y", spans=[(0, 1, "color(1)\\"onmouseover=alert(1)")])""",
    ],
    ids=["link style", "style words", "OSC 8 link", "Style object", "attribute"],
)
def test_styles_of_a_user_s_picture_are_no_markup(tmp_path: Path, picture: str) -> None:
    (tmp_path / "styled.py").write_text(STYLED_SOURCE.replace("PICTURE", picture))
    file = tmp_path / "g.dmt"
    record_game(file, f"{tmp_path}/styled.py", "random", turns=1)
    game = Playback(file, trusted=True)
    for html in ("".join(render_page(game, None, LARGE_OPTIONS)), game._repr_html_()):
        assert "alert(1)</script>" not in html
        assert "<b>" not in html
        assert "onmouseover" not in html
        assert "http://a" not in html
        classes = {
            name for text in re.findall(r'class=\\?"(.*?)\\?"', html) for name in text.split()
        }
        allowed = {
            "goal",
            "facts",
            "steps",
            "dmplay",
            "axis",
            "label",
            "plot",
            "now",
            "series",
            "bold",
            "red",
            "blue",
        }
        assert classes <= allowed


def test_everything_in_a_page_is_in_a_landmark_and_what_scrolls_can_be_focused() -> None:
    html = "".join(render_page(Playback(CRYING_BABY_PATH), None, LARGE_OPTIONS))
    body = html[html.index("<body>") : html.index("<script")]
    assert re.findall(r"^</?(\w+)>?", body, re.MULTILINE)[1] == "header"
    outside = re.sub(r"<(header|main)>.*?</\1>", "", body, flags=re.DOTALL)
    assert outside.split() == ["<body>"]
    for part in ('<ol id="log"', '<div id="frame"'):
        (tag,) = re.findall(f"{part}[^>]*>", html)
        assert 'tabindex="0"' in tag
        assert "aria-label=" in tag


def test_a_long_page_is_written_in_short_parts(tmp_path: Path) -> None:
    record_game(tmp_path / "g.dmt", "hexworld", "random", turns=300, settings=["rewards=[]"])
    game = Playback(tmp_path / "g.dmt")
    parts = [*render_page(game, None, LARGE_OPTIONS)]
    assert len(game.session.turns) == 300
    assert max(map(len, parts)) < len("".join(parts)) / 4


def test_the_labels_of_a_plot_are_not_stretched_with_it() -> None:
    page = "".join(render_page(Playback(CRYING_BABY_PATH), None, LARGE_OPTIONS))
    assert '<span class="label" style="top: ' in page
    assert "<text" not in page

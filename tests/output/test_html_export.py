"""Tests of the HTML page of a transcript: a single file with every turn and keyboard controls."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from dmplay.errors import BadParameter
from dmplay.game.playback import Playback
from dmplay.output.html_export import render_page
from dmplay.views.protocol import DrawOptions
from tests.support.document_examples import PROJECT_ROOT, TIGER_SOURCE
from tests.support.games import record_game

CRYING_BABY_PATH = PROJECT_ROOT / "transcripts/crying_baby/starve_then_feed.dmt"
LARGE_OPTIONS = DrawOptions(80, 24, allow_large=True)
BROWSER_PATH = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
MAX_PAGE_BYTES = 300_000  # for a page of 100 turns


def read_page_in_browser(file: Path, *keys: str, folder: Path) -> str:
    """Return the document of a page in a browser after these keys."""
    assert BROWSER_PATH
    script = "".join(
        f"document.dispatchEvent(new KeyboardEvent('keydown', {{key: '{key}'}}));" for key in keys
    )
    html = "".join(render_page(Playback(file), None, LARGE_OPTIONS))
    (folder / "page.html").write_text(
        html.replace("</body>", f"<script>{script}</script></body>"), encoding="utf-8"
    )
    completed = subprocess.run(
        [BROWSER_PATH, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom",
         f"--user-data-dir={folder / 'profile'}", (folder / "page.html").as_uri()],
        capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    return completed.stdout


@pytest.mark.slow
@pytest.mark.skipif(not BROWSER_PATH, reason="no browser here: apt-get install chromium")
def test_keys_step_through_the_game_in_a_browser(tmp_path: Path) -> None:
    last = read_page_in_browser(CRYING_BABY_PATH, folder=tmp_path)
    first = read_page_in_browser(CRYING_BABY_PATH, "Home", "ArrowRight", folder=tmp_path)
    assert re.search(r'<p id="said"[^>]*><strong>turn 1\. ', first)
    assert 'data-step="1"' in first
    assert 'data-step="1"' not in last
    board = re.search(r'<pre id="board"[^>]*>(.*?)</pre>', first, re.DOTALL)
    assert board
    assert board[1] not in last
    assert len(re.findall(r'<li aria-current="step">', first)) == 1


def test_a_page_loads_no_external_files_and_describes_every_turn() -> None:
    html = "".join(render_page(Playback(CRYING_BABY_PATH), None, LARGE_OPTIONS))
    assert not re.search(r'(src|href)="|url\(|import\s', html)
    game = Playback(CRYING_BABY_PATH)
    turns = [game.narrator.describe_turn(game.snapshot()) for _ in game.iter_agent_turns()]
    log = html[html.index("<ol") : html.index("</ol>")]
    assert [sentence for sentence in turns if f"<li>{sentence}</li>" not in log] == []
    assert "<figcaption>belief: " in html


def test_a_page_opens_at_a_valid_turn_only() -> None:
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


def test_a_long_page_is_written_in_short_parts(tmp_path: Path) -> None:
    record_game(tmp_path / "g.dmt", "hexworld", "random", turns=300, settings=["rewards=[]"])
    game = Playback(tmp_path / "g.dmt")
    parts = [*render_page(game, None, LARGE_OPTIONS)]
    assert len(game.session.turns) == 300
    assert max(map(len, parts)) < len("".join(parts)) / 4

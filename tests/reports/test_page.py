"""A recorded game as a page: one file, every turn in it, stepped through by keys."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from dmplay.errors import BadParameter
from dmplay.game.playback import Playback
from dmplay.reports.page import render_page
from dmplay.views.style import DrawOptions
from tests.support.blocks import ROOT, TIGER
from tests.support.games import recorded

BABY = ROOT / "transcripts/crying_baby/starve_then_feed.dmt"
LARGE = DrawOptions(80, 24, allow_large=True)
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
MOST = 300_000  # bytes of a page of a hundred turns


def opened(file: Path, *keys: str, folder: Path) -> str:
    """What stands in a browser after these keys, and after which step."""
    assert BROWSER
    pressed = "".join(
        f"document.dispatchEvent(new KeyboardEvent('keydown', {{key: '{key}'}}));" for key in keys
    )
    written = "".join(render_page(Playback(file), None, LARGE))
    (folder / "page.html").write_text(
        written.replace("</body>", f"<script>{pressed}</script></body>"), encoding="utf-8"
    )
    done = subprocess.run(
        [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom",
         f"--user-data-dir={folder / 'profile'}", (folder / "page.html").as_uri()],
        capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    return done.stdout


@pytest.mark.slow
@pytest.mark.skipif(not BROWSER, reason="no browser here: apt-get install chromium")
def test_keys_step_through_the_game_in_a_browser(tmp_path: Path) -> None:
    last = opened(BABY, folder=tmp_path)
    first = opened(BABY, "Home", "ArrowRight", folder=tmp_path)
    assert re.search(r'<p id="said"[^>]*><strong>turn 1\. ', first)
    assert 'data-step="1"' in first
    assert 'data-step="1"' not in last
    shown = re.search(r'<pre id="board"[^>]*>(.*?)</pre>', first, re.DOTALL)
    assert shown
    assert shown[1] not in last
    assert len(re.findall(r'<li aria-current="step">', first)) == 1


def test_a_page_needs_nothing_from_elsewhere_and_says_every_turn_in_words() -> None:
    written = "".join(render_page(Playback(BABY), None, LARGE))
    assert not re.search(r'(src|href)="|url\(|import\s', written)
    game = Playback(BABY)
    turns = [game.narrator.describe_turn(game.snapshot()) for _ in game.iter_agent_turns()]
    log = written[written.index("<ol") : written.index("</ol>")]
    assert [said for said in turns if f"<li>{said}</li>" not in log] == []
    assert "<figcaption>belief: " in written


def test_a_page_opens_at_a_turn_that_the_game_has() -> None:
    assert "show(1);" in "".join(render_page(Playback(BABY), 1, LARGE))
    with pytest.raises(BadParameter, match="--at: got 99, the game has"):
        "".join(render_page(Playback(BABY), 99, LARGE))


def test_a_page_of_a_hundred_turns_is_small(tmp_path: Path) -> None:
    file = tmp_path / "g.dmt"
    recorded(file, "hexworld", "random", turns=100, settings=("rewards=[]",))
    written = "".join(render_page(Playback(file), None, DrawOptions(200, 60, allow_large=True)))
    assert written.count("<li>") == 101
    assert len(written.encode()) < MOST


def test_what_a_stranger_named_is_no_markup_of_the_page(tmp_path: Path) -> None:
    (tmp_path / "tiger.py").write_text(TIGER.replace("listen", "</script><b>$title"))
    file = tmp_path / "g.dmt"
    recorded(file, f"{tmp_path}/tiger.py:Tiger", "random", turns=9)
    written = "".join(render_page(Playback(file, trusted=True), None, LARGE))
    assert "&lt;b&gt;&#36;title" in written
    assert "<b>" not in written
    assert written.count("</script>") == 2


def test_a_long_page_is_written_in_parts_none_of_which_is_long(tmp_path: Path) -> None:
    recorded(tmp_path / "g.dmt", "hexworld", "random", turns=300, settings=["rewards=[]"])
    game = Playback(tmp_path / "g.dmt")
    parts = [*render_page(game, None, LARGE)]
    assert len(game.session.turns) == 300
    assert max(map(len, parts)) < len("".join(parts)) / 4

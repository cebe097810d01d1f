"""Tests of the notebook display: the board of a game, without information hidden from the seat."""

import subprocess
import sys
from html.parser import HTMLParser

import pytest

import dmplay
from dmplay.core.session import Session
from dmplay.game.playback import Playback
from dmplay.registry.builtin_names import problem_names
from tests.support.document_examples import PROJECT_ROOT
from tests.support.games import make_session

HEXWORLD_PATH = PROJECT_ROOT / "transcripts/hexworld/optimal_walks_to_the_goal.dmt"
CRYING_BABY_PATH = PROJECT_ROOT / "transcripts/crying_baby/starve_then_feed.dmt"


class PageText(HTMLParser):
    """The text of an HTML page, without its styles."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.inside: list[str] = []
        self.text = ""
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag != "br":
            self.inside.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.inside.pop() == tag, "every tag is closed"

    def handle_data(self, data: str) -> None:
        if "style" not in self.inside:
            self.text += data


def render_both_formats(game: Session | Playback) -> tuple[str, str]:
    """Return the plain-text and the HTML display of a game."""
    bundle = game._repr_mimebundle_()
    assert bundle["text/html"] == game._repr_html_()
    return bundle["text/plain"], bundle["text/html"]


def test_a_board_is_shown_as_text_and_as_html_with_its_colours() -> None:
    game = make_session("2048", [0.0, 0.0, 0.0, 0.9], [0.0, 0.0])
    game.advance([1])
    plain, page = render_both_formats(game)
    assert plain.startswith("dmplay 2048  turn 1  score 0\n┌─────────┬")
    assert "│    2    │    4    │" in plain
    assert plain.endswith("\nlargest 4")
    page_text = PageText(page)
    assert not page_text.inside
    assert "│    2    │    4    │" in page_text.text
    assert 'class="bold c16 on-c255"' in page
    assert "prefers-color-scheme: dark" in page
    assert 'data-jp-theme-light="false"' in page


def test_a_hidden_state_is_not_shown_before_the_end() -> None:
    displays = set()
    for hungry in (0.1, 0.9):  # the uniform of the initial state
        game = make_session("crying-baby", [hungry], [0.5])
        displays.add(render_both_formats(game))
        assert "score" not in render_both_formats(game)[0]
        game.end("quit")
        displays.add(render_both_formats(game))
    assert len(displays) == 3, "one board before the end, two after it"


def test_no_board_is_shown_if_the_seats_have_different_observations() -> None:
    game = make_session("multicaregiver-crying-baby", [0.5], [0.9])
    line = "dmplay multicaregiver-crying-baby  turn {}. each seat has its own view: call view(seat)"
    assert render_both_formats(game)[0].startswith(line.format(0))
    game.advance([0, 1])
    plain, page = render_both_formats(game)
    assert plain.startswith(line.format(1))
    assert "crying" not in PageText(page).text.replace("crying-baby", "")


def test_the_seat_without_a_policy_is_shown() -> None:
    problem = dmplay.load_problem("multicaregiver-crying-baby")
    agent = dmplay.load_agent(problem, 0, "feed-when-crying")
    game = dmplay.Session(problem, dmplay.SeededUniforms(7), [agent, None])
    game.advance([None, 1])
    assert "as caregiver2 sees it" in render_both_formats(game)[0]


def test_a_playback_shows_its_current_turn_and_the_hidden_state() -> None:
    playback = Playback(HEXWORLD_PATH)
    before = render_both_formats(playback)[0]
    playback.play_agent_turn()
    assert before.startswith("dmplay hexworld  turn 0")
    assert render_both_formats(playback)[0].startswith("dmplay hexworld  turn 1")
    assert "true state" in render_both_formats(Playback(CRYING_BABY_PATH))[0]


def test_every_problem_can_be_displayed() -> None:
    for name in problem_names():
        plain, page = render_both_formats(
            dmplay.Session(dmplay.load_problem(name), dmplay.SeededUniforms(7))
        )
        assert plain.startswith(f"dmplay {name}  turn 0")
        assert not PageText(page).inside


@pytest.mark.slow
def test_a_session_does_not_import_rich_before_it_is_displayed() -> None:
    code = (
        "import sys, dmplay\n"
        "game = dmplay.Session(dmplay.load_problem('hexworld'), dmplay.SeededUniforms(7))\n"
        "before = 'rich' in sys.modules\n"
        "game._repr_html_()\n"
        "print(before, 'rich' in sys.modules)"
    )
    completed = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert completed.stdout == "False True\n"

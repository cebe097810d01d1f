"""A notebook shows a game as its board, and nothing that the seat before it may not know."""

import subprocess
import sys
from html.parser import HTMLParser

import pytest

import dmplay
from dmplay.finding.names import problem_names
from dmplay.game.playback import Playback
from dmplay.session import Session
from tests.support.blocks import ROOT
from tests.support.games import session

HEX = ROOT / "transcripts/hexworld/optimal_walks_to_the_goal.dmt"
BABY = ROOT / "transcripts/crying_baby/starve_then_feed.dmt"


class Words(HTMLParser):
    """The text of a page, without its styles."""

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


def shown(game: Session | Playback) -> tuple[str, str]:
    """Both forms of a game."""
    bundle = game._repr_mimebundle_()
    assert bundle["text/html"] == game._repr_html_()
    return bundle["text/plain"], bundle["text/html"]


def test_a_board_is_shown_as_text_and_as_html_with_its_colours() -> None:
    game = session("2048", [0.0, 0.0, 0.0, 0.9], [0.0, 0.0])
    game.advance([1])
    plain, page = shown(game)
    assert plain.startswith("dmplay 2048  turn 1  score 0\n┌─────────┬")
    assert "│    2    │    4    │" in plain
    assert plain.endswith("\nlargest 4")
    told = Words(page)
    assert not told.inside
    assert "│    2    │    4    │" in told.text
    assert 'class="bold c16 on-c255"' in page
    assert "prefers-color-scheme: dark" in page
    assert 'data-jp-theme-light="false"' in page


def test_what_is_hidden_stays_hidden_until_the_game_is_over() -> None:
    looks = set()
    for hungry in (0.1, 0.9):  # the draw of the first state
        game = session("crying-baby", [hungry], [0.5])
        looks.add(shown(game))
        assert "score" not in shown(game)[0]
        game.end("quit")
        looks.add(shown(game))
    assert len(looks) == 3, "one board before the end, two after it"


def test_of_several_who_see_different_things_nothing_is_shown() -> None:
    game = session("multicaregiver-crying-baby", [0.5], [0.9])
    told = "dmplay multicaregiver-crying-baby  turn {}. each seat sees something else: view(seat)"
    assert shown(game)[0].startswith(told.format(0))
    game.advance([0, 1])
    plain, page = shown(game)
    assert plain.startswith(told.format(1))
    assert "crying" not in Words(page).text.replace("crying-baby", "")


def test_the_seat_that_is_played_from_outside_is_shown() -> None:
    problem = dmplay.load_problem("multicaregiver-crying-baby")
    agent = dmplay.load_agent(problem, 0, "feed-when-crying")
    game = dmplay.Session(problem, dmplay.SeededUniforms(7), [agent, None])
    game.advance([None, 1])
    assert "as caregiver2 sees it" in shown(game)[0]


def test_a_recording_is_shown_where_it_stands_and_hides_nothing() -> None:
    walk = Playback(HEX)
    before = shown(walk)[0]
    walk.play_agent_turn()
    assert before.startswith("dmplay hexworld  turn 0")
    assert shown(walk)[0].startswith("dmplay hexworld  turn 1")
    assert "truly" in shown(Playback(BABY))[0]


def test_every_problem_is_shown() -> None:
    for name in problem_names():
        plain, page = shown(dmplay.Session(dmplay.load_problem(name), dmplay.SeededUniforms(7)))
        assert plain.startswith(f"dmplay {name}  turn 0")
        assert not Words(page).inside


@pytest.mark.slow
def test_a_session_loads_no_drawing_before_it_is_shown() -> None:
    code = (
        "import sys, dmplay\n"
        "game = dmplay.Session(dmplay.load_problem('hexworld'), dmplay.SeededUniforms(7))\n"
        "before = 'rich' in sys.modules\n"
        "game._repr_html_()\n"
        "print(before, 'rich' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False True\n"

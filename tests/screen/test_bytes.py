"""A key costs few bytes: what a terminal is sent after it, over a game of every problem."""

import io
from itertools import cycle, islice
from pathlib import Path
from statistics import median

import pytest

from dmplay.finding.names import problem_names
from dmplay.game.request import GameRequest
from dmplay.game.start import start_new_game
from dmplay.game.table import GameController
from dmplay.painting.painter import Painter
from dmplay.screen.press import handle_key
from dmplay.screen.screen import PlayScreen
from dmplay.screen.shown import KEY_HINT_TURNS
from dmplay.terminal import Terminal

MOST = 300  # bytes of a key, in the median
MANY = 40  # keys
KEYS: dict[str, tuple[str, ...]] = {
    "2048": ("left", "down"),
    "cart-pole": ("left", "right"),
    "catch": ("6", "0", "enter", "4", "0", "enter"),
    "collaborative-predator-prey": (*"lunhby",),
    "collision-avoidance": ("space", "space", "k", "space", "space", "j"),
    "crying-baby": (*"fsi",),
    "hexworld": (*"hlhl",),
    "machine-replacement": (*"meir",),
    "mountain-car": ("left", "right", "right"),
    "multicaregiver-crying-baby": (*"fsi",),
    "predator-prey": (*"lunhby",),
    "prisoners-dilemma": (*"cdd",),
    "rock-paper-scissors": (*"rps",),
    "simple-regulator": ("-", "2", "enter", "1", "enter"),
    "travelers-dilemma": ("9", "8", "enter", "9", "5", "enter"),
}


class Counted(Painter):
    """A painter of 80 columns and 24 rows, whose bytes are counted."""

    def get_size(self) -> tuple[int, int]:
        """Always the same."""
        return (80, 24)


@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize("name", problem_names())
def test_half_of_all_keys_cost_no_more_than_is_allowed(name: str, tmp_path: Path) -> None:
    game = start_new_game(GameRequest(name, seed=8, turns=2 * MANY, record_path=tmp_path / "g.dmt"))
    paper = io.StringIO()
    painter = Counted(paper, "default", erases_with_color=True)
    screen = PlayScreen(GameController(game), Terminal(True, "", True, True, False, motion=False))
    screen.paint(painter)
    spent = []
    for key in islice(cycle(KEYS[name]), MANY):
        before = paper.tell()
        handle_key(screen, key)
        screen.paint(painter)
        spent.append(len(paper.getvalue()[before:].encode()))
    assert median(spent[KEY_HINT_TURNS + 1 :]) <= MOST, "once the board names no keys"

"""Tests that a key press sends few bytes to the terminal, in a game of every problem."""

import io
from itertools import cycle, islice
from pathlib import Path
from statistics import median

import pytest

from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.registry.builtin_names import problem_names
from dmplay.rendering.painter import Painter
from dmplay.screen.frame_state import KEY_HINT_TURNS
from dmplay.screen.key_handlers import handle_key
from dmplay.screen.play_screen import PlayScreen
from dmplay.terminal_capabilities import Terminal

MAX_MEDIAN_BYTES = 300  # sent after a key press
KEY_COUNT = 40
KEYS_BY_PROBLEM: dict[str, tuple[str, ...]] = {
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


class FixedSizePainter(Painter):
    """A painter of 80 columns and 24 rows."""

    def get_size(self) -> tuple[int, int]:
        """Return the fixed size."""
        return (80, 24)


@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize("name", problem_names())
def test_the_median_key_press_sends_at_most_the_allowed_bytes(name: str, tmp_path: Path) -> None:
    game = start_new_game(
        GameRequest(name, seed=8, turns=2 * KEY_COUNT, record_path=tmp_path / "g.dmt")
    )
    stream = io.StringIO()
    painter = FixedSizePainter(stream, "default", erases_with_color=True)
    screen = PlayScreen(GameController(game), Terminal(True, "", True, True, False, motion=False))
    screen.paint(painter)
    byte_counts = []
    for key in islice(cycle(KEYS_BY_PROBLEM[name]), KEY_COUNT):
        start = stream.tell()
        handle_key(screen, key)
        screen.paint(painter)
        byte_counts.append(len(stream.getvalue()[start:].encode()))
    assert median(byte_counts[KEY_HINT_TURNS + 1 :]) <= MAX_MEDIAN_BYTES, (
        "once the board names no keys"
    )

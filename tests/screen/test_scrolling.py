"""The log, the debrief and pages go back and on: keys where they play nothing, and the wheel."""

import itertools
import re

import pytest

from dmplay.game.game import Game
from dmplay.game.table import GameController
from dmplay.painting.painter import ENABLE_INPUT_REPORTS
from dmplay.screen.frame import compose_frame
from dmplay.screen.press import handle_key
from dmplay.screen.screen import PlayScreen
from dmplay.screen.shown import Viewport
from dmplay.terminal import Terminal
from tests.support.screens import SEQUENCES, game, play

UP, DOWN = "\x1b[<64;10;10M", "\x1b[<65;10;10M"
SEQUENCES |= {"s-pageup": "\x1b[5;2~", "s-pagedown": "\x1b[6;2~", "wheelup": UP, "wheeldown": DOWN}


def over(size: tuple[int, int]) -> PlayScreen:
    """A whole game of twenty turns, on a screen that was painted."""
    shown = PlayScreen(GameController(game("crying-baby")), Terminal(True, "", True, True, False))
    shown._viewport = Viewport(*size)
    for key in "fsifsifsifsifsifsifs":
        handle_key(shown, key)
    assert shown.game.session.over
    return shown


def rows(shown: PlayScreen) -> list[str]:
    return compose_frame(shown.game, shown._viewport, shown.frame_state, shown.log).plain.split(
        "\n"
    )


@pytest.mark.parametrize("size", [(80, 24), (50, 14), (100, 24)])
def test_every_line_of_the_debrief_can_be_read(size: tuple[int, int]) -> None:
    shown = over(size)
    read = []
    handle_key(shown, "home")
    for _ in range(60):
        read += rows(shown)
        if not shown.scroll_offset:
            break
        handle_key(shown, "wheel down")
    told = " ".join(" ".join(row.split()) for row in read)
    for turn in range(1, 21):
        assert f"turn {turn}. " in told
    assert shown.scroll_offset == 0
    assert "over: " in " ".join(rows(shown))


def test_the_last_rows_tell_where_they_are() -> None:
    shown = over((80, 24))
    (where,) = re.findall(r"rows (\d+)-(\d+) of (\d+): PgUp PgDn Home End", "\n".join(rows(shown)))
    assert where[1] == where[2]
    for key in ("home", "pageup", "wheel up"):
        handle_key(shown, key)
        assert f"rows 1-{int(where[1]) - int(where[0]) + 1} of {where[2]}" in "\n".join(rows(shown))
    handle_key(shown, "pagedown")
    assert "rows 9-" in "\n".join(rows(shown)), "what went past the first row is not to be undone"
    handle_key(shown, "end")
    assert f"rows {where[0]}-{where[1]} of {where[2]}" in "\n".join(rows(shown))


def turns(played: Game) -> int:
    return len(played.session.turns)


def test_a_key_that_plays_scrolls_with_shift() -> None:
    played = game("hexworld", parameters={"rewards": []})
    shown = play(played, *"hlhlhlhlhlhl", "s-pageup", "s-pagedown", "pageup", size=(80, 20))
    before, back, on, _ = shown.frames[-4:]
    assert re.search(r"rows \d+-\d+ of \d+: PgUp", back)
    assert on == before
    assert turns(played) == 13


def test_a_turn_brings_the_end_of_the_log_back() -> None:
    played = game("hexworld", parameters={"rewards": []})
    shown = play(played, *"hlhlhlhlhlhl", "s-pageup", "h", size=(80, 20))
    assert "turn 13. " in shown.last
    assert "PgUp" not in shown.last


def test_the_wheel_scrolls_and_plays_nothing() -> None:
    played = game("2048", seed=1)
    shown = play(played, *("left", "down") * 7, "wheelup", "wheelup", "wheeldown", size=(80, 24))
    assert ENABLE_INPUT_REPORTS in shown.written
    before, back, *_ = shown.frames[-4:]
    assert "PgUp PgDn" in back
    assert "PgUp PgDn" not in before
    played = game("2048", seed=1)
    play(played, "wheelup", "wheeldown")
    assert turns(played) == 0


def test_a_page_goes_back_as_well_as_on() -> None:
    keys = ("?", "pagedown", "pageup", "end", "home", "wheelup", "wheeldown", "space", "space")
    shown = play(game("hexworld"), *keys, size=(80, 16))
    parts = [re.search(r"part (\d) of \d", frame) for frame in shown.frames]
    assert [part and part[1] for part in parts] == [None, *"12131123", None]


# The log has its place


def test_the_log_stands_at_the_right_from_a_hundred_columns_on() -> None:
    for width, column in ((99, 1), (100, 63), (120, 83)):
        shown = play(game("hexworld"), "l", size=(width, 30)).last.split("\n")
        (row,) = (row for row in shown if "turn 1. " in row)
        assert row.index("turn 1. ") == column


def test_a_board_with_the_log_at_the_right_is_no_smaller() -> None:
    ends = {"collision-avoidance": "descend", "cart-pole": "┤", "mountain-car": "┤"}
    for name, end in ends.items():
        both = (play(game(name), size=size).last.split("\n")[:-1] for size in ((80, 30), (100, 30)))
        below, right = (max(row.find(end) for row in rows) for rows in both)
        assert right >= below, name


def test_which_rows_are_shown_is_told_whole_in_a_narrow_column() -> None:
    shown = play(game("mountain-car"), *["l"] * 36, "pageup", size=(100, 30)).last
    assert re.search(r" rows \d+-\d+ of \d+: PgUp( PgDn( Home End)?)?$", shown, re.MULTILINE)


def test_a_log_below_the_board_has_eight_rows() -> None:
    played = game("2048", seed=1)
    shown = play(played, *("left", "down", "right", "down") * 6, size=(70, 40)).last
    assert shown.count("\n turn ") <= 8
    assert shown.count(" turn ") >= 4


def test_most_turns_write_one_row_more_of_a_log_at_the_right() -> None:
    shown = play(game("hexworld", parameters={"rewards": []}), *"hl" * 20, size=(120, 24))
    tops = [frame.split("\n")[12][63:] for frame in shown.frames]
    moved = sum(one != other for one, other in itertools.pairwise(tops))
    assert moved <= 20


@pytest.mark.parametrize("size", [(100, 8), (100, 12), (120, 9)])
def test_a_wide_screen_of_few_rows_has_its_log_below(size: tuple[int, int]) -> None:
    shown = play(game("hexworld"), "l", size=size).last.split("\n")
    assert len(shown) == size[1]
    assert any("turn 1. " in row for row in shown)


@pytest.mark.parametrize("width", [50, 80, 120])
def test_a_message_is_told_once(width: int) -> None:
    played = game("2048")
    shown = play(played, "left", "left", size=(width, 24)).last
    assert shown.count("is not legal now") == 1
    assert "expected one of" in " ".join(shown.split())

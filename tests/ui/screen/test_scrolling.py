"""Tests of scrolling the log, the review and pages by keys and by the mouse wheel."""

import itertools
import re

import pytest

from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.painter import ENABLE_INPUT_REPORTS
from dmplay.ui.screen.frame import compose_frame, split_pages
from dmplay.ui.screen.frame_state import Viewport
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.log_rows import list_record_lines
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.screen.text_wrapping import wrap_lines
from tests.support.screens import KEY_SEQUENCES, make_game, play_keys

WHEEL_UP, WHEEL_DOWN = "\x1b[<64;10;10M", "\x1b[<65;10;10M"
KEY_SEQUENCES |= {
    "s-pageup": "\x1b[5;2~",
    "s-pagedown": "\x1b[6;2~",
    "wheelup": WHEEL_UP,
    "wheeldown": WHEEL_DOWN,
}


def play_twenty_turns(size: tuple[int, int]) -> PlayScreen:
    """Play a whole game of twenty turns on a screen of this size."""
    play_screen = PlayScreen(
        GameController(make_game("crying-baby")), Terminal(True, "", True, True, False)
    )
    play_screen._viewport = Viewport(*size)
    for key in "fsifsifsifsifsifsifs":
        handle_key(play_screen, key)
    assert play_screen.game.session.over
    return play_screen


def compose_rows(play_screen: PlayScreen) -> list[str]:
    return compose_frame(
        play_screen.game, play_screen._viewport, play_screen.frame_state, play_screen.log
    ).plain.split("\n")


@pytest.mark.parametrize("size", [(80, 24), (50, 14), (100, 24)])
@pytest.mark.parametrize("key", ["pagedown", "space"])
def test_the_pages_after_the_end_show_every_row_exactly_once(
    size: tuple[int, int], key: str
) -> None:
    play_screen = play_twenty_turns(size)
    handle_key(play_screen, "pageup")
    page_count = len(split_pages(play_screen._viewport, play_screen.frame_state))
    page_rows = list[str]()
    for page in range(1, page_count + 1):
        rows = compose_rows(play_screen)[1:-2]
        assert f"page {page} of {page_count}" in rows[-1]
        page_rows += rows[:-1]
        if page < page_count:
            handle_key(play_screen, key)
    expected = wrap_lines(
        list_record_lines(play_screen.game, play_screen.log), play_screen._viewport
    )
    assert [row.rstrip() for row in page_rows if row.strip()] == [
        row.rstrip() for row in expected if row.strip()
    ]


@pytest.mark.parametrize("size", [(80, 24), (50, 14), (100, 24)])
def test_the_result_stays_on_screen_after_every_page(size: tuple[int, int]) -> None:
    play_screen = play_twenty_turns(size)
    before = compose_rows(play_screen)
    assert "over: the baby went hungry for " in "\n".join(before)
    for key in ("pageup", "pagedown", "home", "end", "wheel up"):
        handle_key(play_screen, key)
        assert re.search(r"page \d+ of \d+", "\n".join(compose_rows(play_screen)))
        handle_key(play_screen, "escape")
        assert compose_rows(play_screen) == before


def test_the_pages_of_the_log_in_a_game_leave_no_row_out() -> None:
    play_screen = PlayScreen(
        GameController(make_game("hexworld", parameters={"rewards": []})),
        Terminal(True, "", True, True, False),
    )
    play_screen._viewport = Viewport(80, 24)
    for key in "hl" * 20:
        handle_key(play_screen, key)
    seen_turns = list[str]()
    for _ in range(60):
        rows = compose_rows(play_screen)
        seen_turns = re.findall(r"^ turn (\d+)\. ", "\n".join(rows), re.MULTILINE) + seen_turns
        offset = play_screen.scroll_offset
        handle_key(play_screen, "s-pageup")
        if play_screen.scroll_offset == offset:
            break
    assert {*map(int, seen_turns)} == {*range(1, 41)}
    for _ in range(60):
        handle_key(play_screen, "s-pagedown")
    assert play_screen.scroll_offset == 0


def count_turns(game: Game) -> int:
    return len(game.session.turns)


def test_a_key_with_an_action_scrolls_when_shift_is_pressed() -> None:
    current_game = make_game("hexworld", parameters={"rewards": []})
    result = play_keys(
        current_game, *"hlhlhlhlhlhl", "s-pageup", "s-pagedown", "pageup", size=(80, 20)
    )
    before, back, forward, _ = result.frames[-4:]
    assert re.search(r"rows \d+-\d+ of \d+: Shift-PgUp", back)
    assert forward == before
    assert count_turns(current_game) == 13


def test_a_turn_scrolls_to_the_end_of_the_log() -> None:
    current_game = make_game("hexworld", parameters={"rewards": []})
    result = play_keys(current_game, *"hlhlhlhlhlhl", "s-pageup", "h", size=(80, 20))
    assert "turn 13. " in result.last
    assert "PgUp" not in result.last


def test_the_wheel_scrolls_and_plays_nothing() -> None:
    current_game = make_game("2048", seed=1)
    result = play_keys(
        current_game, *("left", "down") * 7, "wheelup", "wheelup", "wheeldown", size=(80, 24)
    )
    assert ENABLE_INPUT_REPORTS in result.written
    before, back, *_ = result.frames[-4:]
    assert "Shift-PgUp Shift-PgDn" in back
    assert "Shift-PgUp" not in before
    current_game = make_game("2048", seed=1)
    play_keys(current_game, "wheelup", "wheeldown")
    assert count_turns(current_game) == 0


def test_a_page_scrolls_back_and_forward() -> None:
    keys = ("?", "pagedown", "pageup", "end", "home", "wheelup", "wheeldown", *["space"] * 3)
    result = play_keys(make_game("hexworld"), *keys, size=(80, 16))
    parts = [re.search(r"page (\d) of \d", frame) for frame in result.frames]
    assert [part and part[1] for part in parts] == [None, *"121411234", None]


# Position of the log


def test_the_log_is_on_the_right_from_100_columns() -> None:
    for width, column in ((99, 1), (100, 63), (120, 83)):
        lines = play_keys(make_game("hexworld"), "l", size=(width, 30)).last.split("\n")
        (row,) = (row for row in lines if "turn 1. " in row)
        assert row.index("turn 1. ") == column


def test_a_log_on_the_right_does_not_shrink_the_board() -> None:
    ends = {"collision-avoidance": "descend", "cart-pole": "┤", "mountain-car": "┤"}
    for name, end in ends.items():
        layouts = (
            play_keys(make_game(name), size=size).last.split("\n")[:-1]
            for size in ((80, 30), (100, 30))
        )
        below, right = (max(row.find(end) for row in rows) for rows in layouts)
        assert right >= below, name


def test_the_scroll_position_fits_a_narrow_column() -> None:
    screen_text = play_keys(make_game("mountain-car"), *["l"] * 36, "pageup", size=(100, 30)).last
    assert re.search(r" rows \d+-\d+ of \d+(: Shift-PgUp Shift-PgDn)?$", screen_text, re.MULTILINE)


def test_a_log_below_the_board_has_at_most_eight_rows() -> None:
    current_game = make_game("2048", seed=1)
    screen_text = play_keys(
        current_game, *("left", "down", "right", "down") * 6, size=(70, 40)
    ).last
    assert screen_text.count("\n turn ") <= 8
    assert screen_text.count(" turn ") >= 4


def test_a_log_on_the_right_moves_in_at_most_half_of_the_turns() -> None:
    result = play_keys(
        make_game("hexworld", parameters={"rewards": []}), *"hl" * 20, size=(120, 24)
    )
    tops = [frame.split("\n")[12][63:] for frame in result.frames]
    change_count = sum(before != after for before, after in itertools.pairwise(tops))
    assert change_count <= 20


@pytest.mark.parametrize("size", [(100, 8), (100, 12), (120, 9)])
def test_a_wide_screen_of_few_rows_has_its_log_below(size: tuple[int, int]) -> None:
    lines = play_keys(make_game("hexworld"), "l", size=size).last.split("\n")
    assert len(lines) == size[1]
    assert any("turn 1. " in row for row in lines)


@pytest.mark.parametrize("width", [50, 80, 120])
def test_a_message_is_shown_once(width: int) -> None:
    current_game = make_game("2048")
    screen_text = play_keys(current_game, "left", "left", size=(width, 24)).last
    assert screen_text.count("moves no tile") == 1
    assert "expected one of" in " ".join(screen_text.split())


def test_the_footer_of_a_page_names_the_keys_of_the_page() -> None:
    frames = play_keys(make_game("hexworld"), "?", "escape", size=(40, 12)).frames
    assert frames[1].split("\n")[-1].strip() == "Space next  Esc close"
    assert "Esc close" not in frames[2]


def test_a_message_on_an_illegal_key_begins_with_the_action() -> None:
    current_game = make_game("2048")
    message = play_keys(current_game, "left", "left").last.split("\n")[-2]
    assert message.startswith(" left moves no tile; expected one of ")


def test_where_page_up_changes_the_number_the_help_page_names_another_key() -> None:
    game = make_game("travelers-dilemma", "human", "level-k")
    page = " ".join(play_keys(game, "?", size=(120, 60)).last.split())
    assert "Shift-PgUp scroll scroll the log (PgUp alone changes the number)" in page
    assert "100 Enter plays it" in " ".join(play_keys(game, *"96", "enter", "pageup").last.split())

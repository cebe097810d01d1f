"""Tests of the marks of a hint on the screen: board, keys and panel, until the next turn."""

import numpy as np
import pytest

from dmplay.game.game_series import GameController
from dmplay.terminal.capabilities import Terminal
from dmplay.ui.screen.footer import format_footer
from dmplay.ui.screen.frame_state import FrameState, Viewport
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.modes import Mode
from dmplay.ui.screen.play_screen import PlayScreen
from tests.support.screens import make_game, play_keys


def make_screen(name: str, *seats: str) -> PlayScreen:
    return PlayScreen(
        GameController(make_game(name, *seats)), Terminal(True, "", True, True, False)
    )


def test_a_hint_ranks_the_keys_by_regret() -> None:
    *_, message, row = play_keys(make_game("crying-baby"), "tab").last.split("\n")
    assert message == " hint: press f (feed), by optimal (20 turns left)"
    assert row.startswith(" f=feed best  s=sing █-2.54  i=ignore █-2.60  ")


@pytest.mark.parametrize(
    ("width", "row"),
    [
        (120, " n=se best  b=sw ▄-0.77  l=e ▄-0.78  h=w █-1.51  u=ne █-1.57  y=nw █-1.69  "),
        (88, " n=se best  b=sw -0.77  l=e -0.78  h=w -1.51  u=ne -1.57  y=nw -1.69  ? help"),
        (80, " n=se best  b=sw  l=e  h=w  u=ne  y=nw  Tab why  ? help  q quit"),
        (50, " n best  b ▄  l ▄  h █  u █  y █  ? help  q quit"),
    ],
)
def test_a_narrow_ranked_footer_drops_bars_then_numbers_then_labels_but_never_help(
    width: int, row: str
) -> None:
    play_screen = make_screen("hexworld")
    handle_key(play_screen, "tab")
    assert format_footer(
        play_screen.game, Viewport(width, 24), play_screen.frame_state
    ).plain.startswith(row)


def test_the_panel_shows_action_values_after_a_hint() -> None:
    rows = play_keys(make_game("hexworld"), "tab").last.split("\n")
    heading_index = next(number for number, row in enumerate(rows) if row.endswith("values"))
    assert [row.split()[-2:] for row in rows[heading_index + 1 : heading_index + 4]] == [
        ["se", "7.04"], ["sw", "6.28"], ["e", "6.27"],
    ]  # fmt: skip
    assert "7.04" not in "".join(rows[:heading_index] + rows[heading_index + 2 :])


def test_hint_marks_stay_until_the_next_turn() -> None:
    play_screen = make_screen("hexworld")
    has_hint = []
    for key in ("e", "tab", "L", "n", "backspace", "n", "y", "tab"):
        handle_key(play_screen, key)
        has_hint.append(play_screen.frame_state.hint is not None)
    # After undo the turn is the same, and so is its hint.
    assert has_hint == [False, True, True, False, True, False, False, True]


def test_a_second_tab_explains_the_hint_as_y_does() -> None:
    by_tab, by_y = make_screen("hexworld"), make_screen("hexworld")
    for screen, keys in ((by_tab, ("tab", "tab")), (by_y, ("Y",))):
        for key in keys:
            handle_key(screen, key)
    assert by_tab.page_rows == by_y.page_rows
    assert by_tab.page_rows[0].startswith("why se in the state (7,2)")


@pytest.mark.parametrize(
    ("key", "turns", "mode"),
    [
        ("n", 1, Mode.BOARD),
        ("W", 0, Mode.LOOKAHEAD),
        ("?", 0, Mode.PAGE),
        *((key, 0, Mode.BOARD) for key in ("tab", "escape", "space", "enter", "q")),
    ],
)
def test_a_key_that_closes_the_reasons_also_acts_but_those_that_leave_only_close(
    key: str, turns: int, mode: Mode
) -> None:
    screen = make_screen("hexworld")
    for pressed in ("tab", "tab", key):
        handle_key(screen, pressed)
    assert (len(screen.game.session.turns), screen.modes.display_mode) == (turns, mode)


def test_a_long_hint_leaves_its_assumptions_to_the_reasons_and_names_close_actions() -> None:
    screen = make_screen("collaborative-predator-prey:sighted", "human", "sweep")
    handle_key(screen, "tab")
    assert ": no real difference, by qmdp (50 turns left, with sweep, why lists" in screen.message
    handle_key(screen, "tab")
    assert "as if you see all positions" in " ".join(screen.page_rows)


def test_ratings_that_differ_by_a_small_share_are_nearly_equal() -> None:
    screen = make_screen("2048")
    handle_key(screen, "Y")
    assert "20 less than left, which is nearly equal." in " ".join(screen.page_rows)


def test_of_two_equal_estimates_either_action_is_fine() -> None:
    screen = make_screen("cart-pole")
    handle_key(screen, "Y")
    assert "By these values, either action is fine." in screen.page_rows


def test_the_marks_show_the_regret_of_each_action() -> None:
    play_screen = make_screen("hexworld")
    handle_key(play_screen, "tab")
    assert play_screen.frame_state.hint is not None
    values, regret = play_screen.frame_state.hint.values, play_screen.frame_state.hint.regrets
    assert values is not None
    assert regret is not None
    assert regret.tolist() == (values.q.max() - values.q).tolist()


def test_an_illegal_action_has_no_regret() -> None:
    play_screen = make_screen("2048")
    for key in ("left", "tab"):
        handle_key(play_screen, key)
    hint = play_screen.frame_state.hint
    assert hint is not None
    assert hint.regrets is not None
    mask = play_screen.game.session.legal_actions_mask(0)
    assert mask is not None
    assert not mask.all()
    assert (np.isnan(hint.regrets) == ~mask).all()


def test_nothing_is_marked_if_the_hint_provider_has_no_values() -> None:
    play_screen = make_screen("simple-regulator")
    handle_key(play_screen, "tab")
    assert play_screen.message.startswith("hint: ")
    assert play_screen.frame_state.hint is not None
    assert play_screen.frame_state.hint.regrets is None
    assert "hint" in play_screen.render_upper(Viewport(80, 24)).plain


@pytest.mark.parametrize("name", ["travelers-dilemma", "predator-prey", "2048", "cart-pole"])
@pytest.mark.parametrize("width", [50, 80])
def test_the_help_and_quit_keys_are_always_shown(name: str, width: int) -> None:
    assert format_footer(make_game(name), Viewport(width, 14), FrameState()).plain.endswith(
        ("q quit", ": command")
    )


def test_a_forecast_hides_the_regrets_on_the_map() -> None:
    hint, forecast = (
        play_keys(make_game("hexworld"), *keys).last for keys in (["tab"], ["tab", "W", "n"])
    )
    assert "-0.77" in hint
    assert "if you go SE: chance of each hex" in forecast
    assert "│b 0.15" in forecast or "0.15│" in forecast
    assert "-1.51" not in forecast.split("exact values")[0]


def test_a_hint_is_not_drawn_as_a_typed_number() -> None:
    hint, typed = (
        play_keys(make_game("catch"), *keys).last for keys in (["tab"], ["tab", "6", "0"])
    )
    assert "→" not in hint.split("type a throw")[0]
    assert "→60←" in typed


@pytest.mark.parametrize(("name", "is_listed"), [("hexworld", True), ("2048", False)])
def test_the_help_page_lists_the_quiz_only_if_values_are_exact(name: str, is_listed: bool) -> None:
    page = play_keys(make_game(name), "?", size=(120, 60)).last
    assert ("a quiz on your worst turns" in page) == is_listed


def test_the_help_page_names_the_agents_of_hints_and_of_the_result() -> None:
    page = play_keys(make_game("2048"), "?", size=(120, 60)).last
    _, _, rows = page.partition("agents named in hints and in the result\n")
    assert [row.split()[0] for row in rows.split("\n")[:3]] == ["expectimax", "corner", "random"]

"""What a hint marks on the screen: board, keys and panel, up to the next move."""

import numpy as np
import pytest

from dmplay.game.table import GameController
from dmplay.screen.footer import format_footer
from dmplay.screen.press import handle_key
from dmplay.screen.screen import PlayScreen
from dmplay.screen.shown import FrameState, Viewport
from dmplay.terminal import Terminal
from tests.support.screens import game, play


def screen(name: str, *seats: str) -> PlayScreen:
    return PlayScreen(GameController(game(name, *seats)), Terminal(True, "", True, True, False))


def test_a_hint_ranks_the_keys_by_what_each_action_loses() -> None:
    *_, message, row = play(game("crying-baby"), "tab").last.split("\n")
    assert message == " hint (optimal): feed"
    assert row.startswith(" f feed best  s sing █-2.54  i ignore █-2.60  ")


@pytest.mark.parametrize(
    ("width", "row"),
    [
        (120, " n se best  b sw ▄-0.77  l e ▄-0.78  h w █-1.51  u ne █-1.57  y nw █-1.69  "),
        (80, " n best  b ▄-0.77  l ▄-0.78  h █-1.51  u █-1.57  y █-1.69  ? help  q quit"),
        (50, " n best  b ▄  l ▄  h █  u █  y █  ? help  q quit"),
    ],
)
def test_a_ranked_row_of_keys_leaves_out_names_then_numbers_never_help(
    width: int, row: str
) -> None:
    shown = screen("hexworld")
    handle_key(shown, "tab")
    assert format_footer(shown.game, Viewport(width, 24), shown.frame_state).plain.startswith(row)


def test_a_panel_tells_the_values_once_a_hint_was_given() -> None:
    rows = play(game("hexworld"), "tab").last.split("\n")
    at = next(number for number, row in enumerate(rows) if row.endswith("worth"))
    assert [row.split()[-2:] for row in rows[at + 1 : at + 4]] == [
        ["se", "7.04"], ["sw", "6.28"], ["e", "6.27"],
    ]  # fmt: skip
    assert "7.04" not in "".join(rows[:at] + rows[at + 2 :])


def test_the_marks_of_a_hint_stay_until_the_next_move() -> None:
    shown = screen("hexworld")
    marked = []
    for key in ("e", "tab", "L", "n", "backspace", "n", "y", "tab"):
        handle_key(shown, key)
        marked.append(shown.frame_state.hint is not None)
    # A turn taken back is the same turn, and the same hint.
    assert marked == [False, True, True, False, True, False, False, True]


def test_what_is_marked_is_what_each_action_loses_against_the_best() -> None:
    shown = screen("hexworld")
    handle_key(shown, "tab")
    assert shown.frame_state.hint is not None
    values, regret = shown.frame_state.hint.values, shown.frame_state.hint.regrets
    assert values is not None
    assert regret is not None
    assert regret.tolist() == (values.max() - values).tolist()


def test_an_action_that_is_not_legal_has_no_regret() -> None:
    shown = screen("2048")
    for key in ("left", "tab"):
        handle_key(shown, key)
    given = shown.frame_state.hint
    assert given is not None
    assert given.regrets is not None
    legal = shown.game.session.legal_actions_mask(0)
    assert legal is not None
    assert not legal.all()
    assert (np.isnan(given.regrets) == ~legal).all()


def test_nothing_is_marked_where_the_adviser_knows_no_values() -> None:
    shown = screen("simple-regulator")
    handle_key(shown, "tab")
    assert shown.message.startswith("hint (")
    assert shown.frame_state.hint is not None
    assert shown.frame_state.hint.regrets is None
    assert "hint" in shown.render_upper(Viewport(80, 24)).plain


@pytest.mark.parametrize("name", ["travelers-dilemma", "predator-prey", "2048", "cart-pole"])
@pytest.mark.parametrize("width", [50, 80])
def test_the_keys_for_help_and_quit_never_vanish(name: str, width: int) -> None:
    assert format_footer(game(name), Viewport(width, 14), FrameState()).plain.endswith(
        ("q quit", ": command")
    )

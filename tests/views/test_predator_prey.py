import dataclasses
from functools import partial

import numpy as np

import dmplay
from dmplay.draw.hex_map import SECOND_PLAYER_KEYS
from dmplay.draw.options import DrawOptions, Overlay
from dmplay.views.protocol import fit_board, load_view_module
from tests.support import games

predator_prey = load_view_module(dmplay.load_problem("predator-prey"))

make_view_after = partial(games.make_view_after, "predator-prey")


def test_the_map_at_the_start_with_keys() -> None:
    board = fit_board(predator_prey, make_view_after(), DrawOptions(80, 24, show_keys=True)).plain
    assert (
        board
        == """\
    ╱   ╲ ╱   ╲ ╱   ╲
   │     │  h  │  @  │
   │     │     │     │
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│     │ ░░░ │  b  │ ░░░ │     │     │
│     │ ░░░ │     │ ░░░ │     │     │
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │     │     │  o  │     │     │
   │     │     │     │     │     │
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱"""
    )


def test_an_overlay_shows_your_value_on_each_hex_for_the_current_prey_hex() -> None:
    view = make_view_after()
    policy = dmplay.load_agent(view.problem, 0, "best-response:to=flee")
    states = view.problem.enumerate_states()
    values = policy.action_values(policy.initial_memory(states))
    assert values is not None
    board = fit_board(
        predator_prey, view, DrawOptions(80, 24, overlay=Overlay("values", values))
    ).plain
    assert (
        board
        == """\
    ╱   ╲ ╱   ╲ ╱   ╲
   │     │     │  @  │
   │-8.48│-8.16│     │
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│     │ ░░░ │     │ ░░░ │     │     │
│-8.48│ ░░░ │-7.54│ ░░░ │-8.16│-8.41│
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │     │     │  o  │     │     │
   │-8.16│-7.54│     │-7.62│-8.16│
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱"""
    )
    prey, state_lists = view.observation[1], [list(map(int, state)) for state in states]
    index = state_lists.index([view.problem.hexes.index((0, 0)), int(prey)])  # type: ignore[attr-defined]
    assert f"{values[index].max():.2f}" == "-8.16"


def test_several_agents_on_one_hex() -> None:
    board = fit_board(
        predator_prey,
        make_view_after("e e e e e", seed=3, predators=2, prey=3),
        DrawOptions(80, 24, ascii=True),
    ).plain
    assert (
        board
        == r"""
    /   \ /   \ /   \
   |     |     |  o3 |
   |     |     |     |
 /   \ /   \ /   \ /     /   \ /   \
|     | %%% |  o2 | %%% |     |  *  |
|     | %%% |     | %%% |     | @o1 |
  \ /   \ /   \ /   \ /   \ /   \ /
   |     |     |  B  |     |     |
   |     |     |     |     |     |
     \ /   \ /   \ /   \ /   \ /"""[1:]
    )


def test_the_key_that_leads_to_the_prey_is_drawn_below_it() -> None:
    rows = fit_board(
        predator_prey, make_view_after("sw e"), DrawOptions(80, 24, show_keys=True)
    ).plain.split("\n")
    assert rows[7:9] == ["   │     │  b  │  o  │     │     │", "   │     │     │  n  │     │     │"]


def test_the_glyphs_of_a_crowded_hex_are_truncated() -> None:
    view = make_view_after(seed=434, predators=2, prey=3)
    crowded_view = dataclasses.replace(view, observations=(np.array([2, 2, 2, 2, 2]),))
    assert "│@Bo1…│" in fit_board(predator_prey, crowded_view, DrawOptions(80, 24)).plain
    assert ("* (1,2)", "A B o1 o2 o3") in predator_prey.panel_rows(crowded_view)
    assert predator_prey.describe_situation(crowded_view).startswith(
        "at (1,2), you are predator1. you have the prey: any action eats it."
    )


def test_the_panel_shows_both_scores_and_constant_glyphs() -> None:
    view = make_view_after(seed=1)
    predator_view = dataclasses.replace(
        view,
        observations=(np.array([9, 9]), np.array([9, 0]), np.array([8, 0])),
        actions=(0, 3),
        joint_actions=(np.array([0, 3]), np.array([3, 0])),
        rewards=(1.0, -1.0),
    )
    facts = dict(predator_prey.panel_rows(predator_view))
    assert facts.items() >= {
        "A you": "(1,0)", "o prey": "(-1,2)", "score A": "0.1", "score o": "-100",
        "slip": "0.15 each side", "discount": "0.90 (gamma)",
    }.items()  # fmt: skip
    prey_view = dataclasses.replace(predator_view, seat=1, actions=(3, 0), rewards=(-100.0, 0.0))
    facts = dict(predator_prey.panel_rows(prey_view))
    assert facts.items() >= {
        "A predator": "(1,0)", "o you": "(-1,2)", "score A": "0.1", "score o": "-100",
    }.items()  # fmt: skip


def test_a_capture_is_described_to_both_sides() -> None:
    view = make_view_after(seed=1)
    predator_view = dataclasses.replace(
        view,
        observations=(np.array([9, 9]), np.array([9, 0])),
        actions=(0,),
        joint_actions=(np.array([0, 3]),),
    )
    assert predator_prey.describe_turn(predator_view) == (
        "chose E, ate the prey, stayed at (2,0). prey chose W, was caught, reappeared at (-1,2)."
    )
    prey_view = dataclasses.replace(predator_view, seat=1, actions=(3,))
    assert predator_prey.describe_turn(prey_view) == (
        "chose W, was caught, reappeared at (-1,2). predator chose E, ate the prey, "
        "stayed at (2,0)."
    )


def test_the_compact_map_as_the_prey_sees_it() -> None:
    board = fit_board(
        predator_prey, make_view_after("sw e", seat=1), DrawOptions(40, 8, show_keys=True)
    ).plain
    assert (
        board
        == """\
   ╱ ╲ ╱ ╲ ╱ ╲
  │   │   │   │
 ╱ ╲ ╱ ╲ ╱ ╲ ╱   ╱ ╲ ╱ ╲
│   │ ░ │ A │ ░ │   │   │
 ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱
  │   │ h │ @ │ l │   │
   ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱"""
    )


def test_the_dot_map() -> None:
    board = fit_board(predator_prey, make_view_after(), DrawOptions(40, 6, ascii=True)).plain
    assert (
        board
        == """\
   .   .   @
 .       .       .   .
   .   .   o   .   ."""
    )


def test_the_description_is_relative_to_the_hex_of_the_player() -> None:
    assert predator_prey.describe_situation(make_view_after()) == (
        "at (1,2), you are predator. E wall. NE wall. NW wall. W (0,2) free. SW (1,1) free. "
        "SE wall. prey at (2,0): 2 steps."
    )
    assert (
        predator_prey.describe_turn(make_view_after("sw e"))
        == "chose SW, moved SW to (1,1). prey chose E, slipped, bumped, stayed at (2,0)."
    )


def test_every_agent_has_a_score() -> None:
    problem = dmplay.load_problem("predator-prey", predators=2)
    game = dmplay.Session(problem, dmplay.SeededUniforms(7))
    for _ in range(4):
        game.advance([0, 3, 0])
    scores = {
        name: score for name, score in predator_prey.panel_rows(game.view(1)) if "score" in name
    }
    expected = zip(("A", "B", "o"), game.returns(), strict=True)
    assert scores == {f"score {mark}": f"{total:.4g}" for mark, total in expected}


def test_a_key_letter_differs_from_the_glyph_of_the_predator() -> None:
    keys_by_label = {label: key for key, label in SECOND_PLAYER_KEYS.items()}
    board = fit_board(
        predator_prey,
        make_view_after(seat=1),
        DrawOptions(80, 24, show_keys=True, keys_by_action=keys_by_label),
    ).plain
    assert [board.count(mark) for mark in ("  A  ", "  a  ")] == [1, 1]

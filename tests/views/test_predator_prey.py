import dataclasses
from functools import partial

import numpy as np

import dmplay
from dmplay.views.hexgrid import SECOND_PLAYER_KEYS
from dmplay.views.style import DrawOptions, Overlay, fit_board, load_view_module
from tests.support import games

predator_prey = load_view_module(dmplay.load_problem("predator-prey"))

after = partial(games.after, "predator-prey")


def test_the_hunt_at_its_start_with_the_keys() -> None:
    drawn = fit_board(predator_prey, after(), DrawOptions(80, 24, show_keys=True)).plain
    assert (
        drawn
        == """\
    ╱   ╲ ╱   ╲ ╱   ╲
   │     │  h  │  @  │
   │     │     │     │
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│     │     │  b  │     │     │     │
│     │     │     │     │     │     │
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │     │     │  o  │     │     │
   │     │     │     │     │     │
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱"""
    )


def test_an_overlay_is_of_you_on_each_hex_with_the_prey_where_it_is() -> None:
    view = after()
    best = dmplay.load_agent(view.problem, 0, "best-response:to=flee")
    states = view.problem.enumerate_states()
    values = best.action_values(best.initial_memory(states))
    assert values is not None
    drawn = fit_board(
        predator_prey, view, DrawOptions(80, 24, overlay=Overlay("values", values))
    ).plain
    assert (
        drawn
        == """\
    ╱   ╲ ╱   ╲ ╱   ╲
   │     │     │  @  │
   │-8.48│-8.16│     │
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│     │     │     │     │     │     │
│-8.48│     │-7.54│     │-8.16│-8.41│
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │     │     │  o  │     │     │
   │-8.16│-7.54│     │-7.62│-8.16│
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱"""
    )
    prey, there = view.observation[1], [list(map(int, state)) for state in states]
    moved = there.index([view.problem.hexes.index((0, 0)), int(prey)])  # type: ignore[attr-defined]
    assert f"{values[moved].max():.2f}" == "-8.16"


def test_several_on_one_hex() -> None:
    drawn = fit_board(
        predator_prey,
        after("e e e e e", seed=3, predators=2, prey=3),
        DrawOptions(80, 24, ascii=True),
    ).plain
    assert (
        drawn
        == r"""
    /   \ /   \ /   \
   |     |     |  o3 |
   |     |     |     |
 /   \ /   \ /   \ /     /   \ /   \
|     |     |  o2 |     |     |  *  |
|     |     |     |     |     | @o1 |
  \ /   \ /   \ /   \ /   \ /   \ /
   |     |     |  B  |     |     |
   |     |     |     |     |     |
     \ /   \ /   \ /   \ /   \ /"""[1:]
    )


def test_the_key_that_leads_to_the_prey_stands_below_it() -> None:
    rows = fit_board(predator_prey, after("sw e"), DrawOptions(80, 24, show_keys=True)).plain.split(
        "\n"
    )
    assert rows[7:9] == ["   │     │  b  │  o  │     │     │", "   │     │     │  n  │     │     │"]


def test_more_on_one_hex_than_fit_are_cut_short() -> None:
    view = after(seed=434, predators=2, prey=3)
    crowded = dataclasses.replace(view, observations=(np.array([2, 2, 2, 2, 2]),))
    assert "│@Bo1…│" in fit_board(predator_prey, crowded, DrawOptions(80, 24)).plain
    assert ("* (1,2)", "A B o1 o2 o3") in predator_prey.panel_rows(crowded)
    assert predator_prey.describe_situation(crowded).startswith(
        "at (1,2), you are predator1. you feed: any action stays here."
    )


def test_the_panel_has_both_scores_and_the_glyphs_that_never_change() -> None:
    view = after(seed=1)
    fed = dataclasses.replace(
        view,
        observations=(np.array([9, 9]), np.array([9, 0]), np.array([8, 0])),
        actions=(0, 3),
        joint_actions=(np.array([0, 3]), np.array([3, 0])),
        rewards=(1.0, -1.0),
    )
    facts = dict(predator_prey.panel_rows(fed))
    assert facts.items() >= {
        "A you": "(1,0)", "o prey": "(-1,2)", "score A": "0.1", "score o": "-100",
        "slips aside": "0.15 each", "discount": "0.90 (gamma)",
    }.items()  # fmt: skip
    eaten = dataclasses.replace(fed, seat=1, actions=(3, 0), rewards=(-100.0, 0.0))
    facts = dict(predator_prey.panel_rows(eaten))
    assert facts.items() >= {
        "A predator": "(1,0)", "o you": "(-1,2)", "score A": "0.1", "score o": "-100",
    }.items()  # fmt: skip


def test_a_capture_is_told_to_both_sides() -> None:
    view = after(seed=1)
    together = dataclasses.replace(
        view,
        observations=(np.array([9, 9]), np.array([9, 0])),
        actions=(0,),
        joint_actions=(np.array([0, 3]),),
    )
    assert predator_prey.describe_turn(together) == (
        "at (2,0). chose E, fed, stayed. prey chose W, was devoured, born again at (-1,2)."
    )
    eaten = dataclasses.replace(together, seat=1, actions=(3,))
    assert predator_prey.describe_turn(eaten) == (
        "at (-1,2). chose W, was devoured, born again. predator chose E, fed, stayed at (2,0)."
    )


def test_the_hunt_compact_as_the_prey_sees_it() -> None:
    drawn = fit_board(
        predator_prey, after("sw e", seat=1), DrawOptions(40, 8, show_keys=True)
    ).plain
    assert (
        drawn
        == """\
   ╱ ╲ ╱ ╲ ╱ ╲
  │   │   │   │
 ╱ ╲ ╱ ╲ ╱ ╲ ╱   ╱ ╲ ╱ ╲
│   │   │ A │   │   │   │
 ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱
  │   │ h │ @ │ l │   │
   ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱"""
    )


def test_the_hunt_in_dots() -> None:
    drawn = fit_board(predator_prey, after(), DrawOptions(40, 6, ascii=True)).plain
    assert (
        drawn
        == """\
   .   .   @
 .       .       .   .
   .   .   o   .   ."""
    )


def test_the_hunt_is_told_from_where_one_stands() -> None:
    assert predator_prey.describe_situation(after()) == (
        "at (1,2), you are predator. E wall. NE wall. NW wall. W (0,2) free. SW (1,1) free. "
        "SE wall. prey at (2,0): 2 steps."
    )
    assert (
        predator_prey.describe_turn(after("sw e"))
        == "at (1,1). chose SW, moved SW. prey chose E, bumped, stayed at (2,0)."
    )


def test_each_of_many_has_a_score() -> None:
    problem = dmplay.load_problem("predator-prey", predators=2)
    game = dmplay.Session(problem, dmplay.SeededUniforms(7))
    for _ in range(4):
        game.advance([0, 3, 0])
    scores = {
        name: told for name, told in predator_prey.panel_rows(game.view(1)) if "score" in name
    }
    each = zip(("A", "B", "o"), game.returns(), strict=True)
    assert scores == {f"score {mark}": f"{total:.4g}" for mark, total in each}


def test_the_other_predator_is_no_key_of_the_board() -> None:
    left = {label: key for key, label in SECOND_PLAYER_KEYS.items()}
    shown = fit_board(
        predator_prey, after(seat=1), DrawOptions(80, 24, show_keys=True, keys_by_action=left)
    ).plain
    assert [shown.count(mark) for mark in ("  A  ", "  a  ")] == [1, 1]

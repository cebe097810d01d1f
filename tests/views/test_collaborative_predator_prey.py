from dataclasses import replace
from functools import partial

import numpy as np

import dmplay
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.draw.options import DrawOptions
from dmplay.views.protocol import fit_board, load_view_module
from tests.support import games

collaborative_predator_prey = load_view_module(dmplay.load_problem("collaborative-predator-prey"))

make_view_after = partial(games.make_view_after, "collaborative-predator-prey")


def test_the_belief_of_a_blind_predator() -> None:
    board = fit_board(
        collaborative_predator_prey, make_view_after("e w", "ne w"), DrawOptions(80, 24)
    ).plain
    assert (
        board
        == """\
    ╱   ╲ ╱   ╲ ╱   ╲
   │o▁ 9%│o▁ 8%│o▁ 6%│
   │@▁ 9%│@▁ 7%│@▂22%│
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│o▁10%│ ░░░ │o▁ 9%│ ░░░ │o▁ 8%│o▁ 6%│
│@▁ 3%│ ░░░ │@▁ 6%│ ░░░ │@▁10%│@▃28%│
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │o▁ 9%│o▁10%│o▁ 9%│o▁ 8%│o▁ 8%│
   │@▁ 3%│@▁ 1%│@▁ 6%│@▁ 2%│@▁ 3%│
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
sensed nothing. o prey, @ you"""
    )


def test_the_belief_in_ascii_with_the_true_state() -> None:
    board = fit_board(
        collaborative_predator_prey,
        make_view_after("e w", "ne w"),
        DrawOptions(80, 24, ascii=True, revealed_state=np.array([3, 4, 5])),
    ).plain
    assert (
        board
        == r"""
    /   \ /   \ /   \
   |o  9%|o  8%|o  6%|
   |@  9%|@  7%|@ 22%|
 /   \ /   \ /   \ /     /   \ /   \
|o 10%| %%% |o  9%| %%% |o  8%|o  6%|
|@  3%| %%% |@  6%| %%% |@ 10%|@ 28%|
  \ /   \ /   \ /   \ /   \ /   \ /
   |o  9%|o 10%|o  9%|o  8%|o  8%|
   |@  3%|@  1%|@  6%|@  2%|@  3%|
     \ /   \ /   \ /   \ /   \ /
sensed nothing. o prey, @ you
true positions: predator1 (-1,1), predator2 (1,1), prey (3,1)"""[1:]
    )


def test_the_belief_on_a_compact_map() -> None:
    board = fit_board(
        collaborative_predator_prey, make_view_after("e w", "ne w", seat=1), DrawOptions(40, 8)
    ).plain
    assert (
        board
        == """\
   ╱ ╲ ╱ ╲ ╱ ╲
  │11▂│10▁│11▁│
 ╱ ╲ ╱ ╲ ╱ ╲ ╱   ╱ ╲ ╱ ╲
│ 5▁│ ░ │ 8▁│ ░ │ 4▁│ 9▁│
 ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱
  │11▂│ 9▁│12▁│ 5▁│ 5▁│
   ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱ ╲ ╱
sensed nothing. % prey, bar: you"""
    )


def test_the_belief_on_a_dot_map() -> None:
    board = fit_board(
        collaborative_predator_prey, make_view_after("e w", "ne w"), DrawOptions(40, 6, ascii=True)
    ).plain
    assert (
        board
        == """\
   9_  8_  6.
10_      9_      8_  6:
   9_ 10_  9_  8_  8_
sensed nothing. % prey, bar: you"""
    )


def test_a_sighted_predator_sees_its_keys() -> None:
    board = fit_board(
        collaborative_predator_prey,
        make_view_after("e w", sighted=True),
        DrawOptions(80, 24, show_keys=True),
    ).plain
    assert (
        board
        == """\
    ╱   ╲ ╱   ╲ ╱   ╲
   │o▁11%│o▂16%│o▁ 9%│
   │     │     │     │
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│o▂15%│ ░░░ │     │ ░░░ │o▂15%│o▁ 9%│
│     │ ░░░ │  y  │ ░░░ │     │     │
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │o▁10%│     │     │     │o▂15%│
   │     │  h  │@100%│  l  │     │
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
sensed nothing (2,0). o prey, @ you"""
    )


def test_a_team_too_large_for_a_belief() -> None:
    board = fit_board(
        collaborative_predator_prey, make_view_after("e w e", predators=3), DrawOptions(80, 24)
    ).plain
    assert (
        board
        == """\
    ╱   ╲ ╱   ╲ ╱   ╲
   │     │     │     │
   │     │     │     │
 ╱   ╲ ╱   ╲ ╱   ╲ ╱     ╱   ╲ ╱   ╲
│     │ ░░░ │     │ ░░░ │     │     │
│     │ ░░░ │     │ ░░░ │     │     │
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
   │     │     │     │     │     │
   │     │     │     │     │     │
     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱
sensed nothing. belief: not shown"""
    )


def test_the_reward_is_hidden_until_the_game_ends() -> None:
    game = dmplay.Session(
        dmplay.load_problem("collaborative-predator-prey"), dmplay.SeededUniforms(5)
    )
    game.advance([0, 3])
    assert ("reward", "hidden") in collaborative_predator_prey.panel_rows(game.view(0))
    game.end("quit")
    assert ("reward", "10") in collaborative_predator_prey.panel_rows(game.view(0))


def test_the_description_for_a_blind_predator_lists_the_likeliest_hexes() -> None:
    assert collaborative_predator_prey.describe_turn(make_view_after("e w")) == (
        "chose E, sensed no prey on your hex or beside it. likeliest prey hex: (-1,1) (10%). "
        "your likeliest hex: (4,1) (16%)."
    )
    assert collaborative_predator_prey.describe_situation(make_view_after("e w", sighted=True)) == (
        "sensed no prey on (2,0) or beside it. likeliest prey hexes: (0,2) (16%), (-1,1) (15%), "
        "(3,1) (15%), (4,0) (15%). your likeliest hexes: (2,0) (100%). at (2,0). E (3,0) prey 0%. "
        "NE wall. NW (1,1) prey 0%. W (1,0) prey 0%. SW wall. SE wall. predator2 is hidden; "
        "the belief assumes uniformly random actions."
    )
    description = collaborative_predator_prey.describe_situation(
        make_view_after("e w e", predators=3)
    )
    assert description.endswith("the belief is not shown.")


def test_without_a_belief_a_sighted_predator_sees_its_own_hex() -> None:
    view = replace(make_view_after("e w", sighted=True), beliefs=None)
    for height in (24, 12):
        options = DrawOptions(80, height, allow_large=True, show_coordinates=True)
        board = fit_board(collaborative_predator_prey, view, options).plain
        assert board.count("@") == 1
    assert board.endswith("sensed nothing (2,0). belief: not shown")
    assert collaborative_predator_prey.describe_situation(view) == (
        "sensed no prey on (2,0) or beside it. at (2,0). E (3,0) floor. NE wall. NW (1,1) floor. "
        "W (1,0) floor. SW wall. SE wall. the belief is not shown."
    )


def test_a_catch_that_the_own_hexes_show_is_reported_and_no_other() -> None:
    reported, caught = {0.0: 0, 0.3: 0}, {0.0: 0, 0.3: 0}
    for slip in reported:
        problem = dmplay.load_problem("collaborative-predator-prey:circle", sighted=True, slip=slip)
        for seed in range(20):
            session = Session(problem, SeededUniforms(seed), turn_limit=10)
            for turn in range(10):
                before = session.state
                session.advance([(seed + turn) % 6, (3 * turn) % 6])
                is_reported = "stayed (caught)" in collaborative_predator_prey.describe_turn(
                    session.view(0)
                )
                is_caught = before[0] == before[2]
                assert is_caught or not is_reported
                reported[slip] += is_reported
                caught[slip] += is_caught
    # A bump, or on the ring any slip, may also end on the own hex.
    assert reported[0.3] == 0 < reported[0.0] < caught[0.0]

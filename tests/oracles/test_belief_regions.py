import numpy as np
import pytest

from dmplay.core.arrays import Reals
from dmplay.errors import BadParameter
from dmplay.problems.machine_replacement.rules import MachineReplacement
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage
from tests.oracles.belief_regions import find_pieces

MANUFACTURE_ACTION = 0


def make_stage(vectors: Reals, roots: list[int]) -> AlphaVectorStage:
    return AlphaVectorStage((), vectors, np.eye(max(roots) + 1, dtype=bool)[roots])


CORNER_BELIEFS = np.eye(3)


def test_three_equal_regions_meet_in_the_middle() -> None:
    (piece,) = find_pieces(make_stage(CORNER_BELIEFS, [0, 1, 2]), 1)
    assert piece.share == pytest.approx(1 / 3)
    assert piece.cells == (1,)
    expected_outline = [[0, 0.5, 0.5], [0, 1, 0], [1 / 3, 1 / 3, 1 / 3], [0.5, 0.5, 0]]
    np.testing.assert_allclose(
        sorted(piece.outline.tolist()), np.array(expected_outline), atol=1e-12
    )


def test_cells_of_one_action_are_one_piece_whose_outline_bends_only_at_its_corners() -> None:
    (piece,) = find_pieces(make_stage(CORNER_BELIEFS, [0, 0, 0]), 0)
    assert piece.share == pytest.approx(1)
    assert piece.cells == (0, 1, 2)
    np.testing.assert_allclose(sorted(piece.outline.tolist()), CORNER_BELIEFS[::-1], atol=1e-12)


def test_an_action_best_in_two_corners_has_two_pieces() -> None:
    middle = np.vstack([CORNER_BELIEFS, [0.7, 0.7, 0.7]])
    result = find_pieces(make_stage(middle, [0, 1, 0, 1]), 0)
    assert [piece.cells for piece in result] == [(0,), (2,)]
    assert not result[0].touches & result[1].touches
    assert [piece.share for piece in result] == pytest.approx([0.09, 0.09])


def test_pieces_that_share_a_single_point_are_separate() -> None:
    vectors = np.vstack([CORNER_BELIEFS, [0.5, 0.5, 0.5]])
    result = find_pieces(make_stage(vectors, [0, 0, 0, 1]), 0)
    assert len(result) == 3
    assert len(result[0].touches & result[1].touches) == 1


def test_an_action_that_is_nowhere_best_has_no_piece() -> None:
    assert find_pieces(AlphaVectorStage((), CORNER_BELIEFS, np.array([[True, False]] * 3)), 1) == []


def test_the_pieces_of_all_actions_cover_the_triangle() -> None:
    machine = MachineReplacement()
    for stage in exact_pomdp.solve_finite_horizon(machine.tables, 1.0, 20)[1::3]:
        shares = [piece.share for a in range(4) for piece in find_pieces(stage, a)]
        assert sum(shares) == pytest.approx(1, abs=1e-9)


def test_manufacture_has_two_pieces_fourteen_turns_before_the_end() -> None:
    machine = MachineReplacement()
    last_stage = exact_pomdp.solve_finite_horizon(machine.tables, 1.0, 14)[-1]
    main, small = find_pieces(last_stage, MANUFACTURE_ACTION)
    assert small.share == pytest.approx(0.0073042520578980395, abs=1e-12)
    assert len(small.outline) == 4
    assert not main.touches & small.touches


def test_a_problem_without_three_states_raises_an_error() -> None:
    with pytest.raises(BadParameter, match="got 2 states"):
        find_pieces(make_stage(np.eye(2), [0, 1]), 0)

import numpy as np
import pytest

from dmplay.chance import Reals
from dmplay.errors import BadParameter
from dmplay.problems.machine_replacement import MachineReplacement
from dmplay.solvers import alpha_vectors
from dmplay.solvers.alpha_vectors import AlphaVectorStage
from tests.oracles.regions import pieces

MANUFACTURE = 0


def stage(vectors: Reals, roots: list[int]) -> AlphaVectorStage:
    return AlphaVectorStage((), vectors, np.eye(max(roots) + 1, dtype=bool)[roots])


CORNERS = np.eye(3)


def test_three_equal_thirds_meet_in_the_middle() -> None:
    (one,) = pieces(stage(CORNERS, [0, 1, 2]), 1)
    assert one.share == pytest.approx(1 / 3)
    assert one.cells == (1,)
    wanted = [[0, 0.5, 0.5], [0, 1, 0], [1 / 3, 1 / 3, 1 / 3], [0.5, 0.5, 0]]
    np.testing.assert_allclose(sorted(one.outline.tolist()), np.array(wanted), atol=1e-12)


def test_cells_of_one_action_are_one_piece_whose_outline_bends_only_at_its_corners() -> None:
    (one,) = pieces(stage(CORNERS, [0, 0, 0]), 0)
    assert one.share == pytest.approx(1)
    assert one.cells == (0, 1, 2)
    np.testing.assert_allclose(sorted(one.outline.tolist()), CORNERS[::-1], atol=1e-12)


def test_an_action_best_in_two_corners_has_two_pieces() -> None:
    middle = np.vstack([CORNERS, [0.7, 0.7, 0.7]])
    found = pieces(stage(middle, [0, 1, 0, 1]), 0)
    assert [one.cells for one in found] == [(0,), (2,)]
    assert not found[0].touches & found[1].touches
    assert [one.share for one in found] == pytest.approx([0.09, 0.09])


def test_pieces_that_meet_in_a_point_are_two() -> None:
    touching = np.vstack([CORNERS, [0.5, 0.5, 0.5]])
    found = pieces(stage(touching, [0, 0, 0, 1]), 0)
    assert len(found) == 3
    assert len(found[0].touches & found[1].touches) == 1


def test_an_action_that_is_nowhere_best_has_no_piece() -> None:
    assert pieces(AlphaVectorStage((), CORNERS, np.array([[True, False]] * 3)), 1) == []


def test_the_triangle_is_shared_out() -> None:
    machine = MachineReplacement()
    for one in alpha_vectors.solve_finite_horizon(machine.tables, 1.0, 20)[1::3]:
        shares = [piece.share for a in range(4) for piece in pieces(one, a)]
        assert sum(shares) == pytest.approx(1, abs=1e-9)


def test_manufacture_has_two_pieces_fourteen_turns_before_the_end() -> None:
    machine = MachineReplacement()
    found = alpha_vectors.solve_finite_horizon(machine.tables, 1.0, 14)[-1]
    main, small = pieces(found, MANUFACTURE)
    assert small.share == pytest.approx(0.0073042520578980395, abs=1e-12)
    assert len(small.outline) == 4
    assert not main.touches & small.touches


def test_other_numbers_of_states_have_no_triangle() -> None:
    with pytest.raises(BadParameter, match="got 2 states"):
        pieces(stage(np.eye(2), [0, 1]), 0)

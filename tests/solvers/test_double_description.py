from itertools import combinations

import numpy as np
import pytest

from dmplay.core.arrays import Reals
from dmplay.solvers.double_description import Cone, cut_cone, find_facets, make_simplicial_cone

ORTHANT = make_simplicial_cone(np.eye(3))


def normalize_rays(cone: Cone) -> list[list[float]]:
    """Return the rays, scaled to sum 1 and sorted."""
    scaled = cone.rays / cone.rays.sum(axis=1, keepdims=True)
    return sorted((np.round(scaled, 9) + 0.0).tolist())


def enumerate_corners(normals: Reals) -> list[list[float]]:
    """Return the corners of {x >= 0, sum 1, normals @ x >= 0}, where enough borders meet."""
    size = normals.shape[1]
    borders = np.vstack([np.eye(size), normals])
    corners = set()
    for subset in combinations(borders, size - 1):
        system = np.vstack([subset, np.ones(size)])
        if abs(np.linalg.det(system)) > 1e-9:
            x = np.linalg.solve(system, np.eye(size)[-1])
            if (borders @ x >= -1e-9).all():
                corners.add(tuple(np.round(x, 9) + 0.0))
    return sorted(map(list, corners))


def test_a_cut_through_a_corner_adds_one_ray() -> None:
    cone = cut_cone(ORTHANT, np.array([1.0, -1.0, 0.0]))
    assert normalize_rays(cone) == [[0.0, 0.0, 1.0], [0.5, 0.5, 0.0], [1.0, 0.0, 0.0]]


def test_a_cut_that_takes_a_corner_off_adds_two_rays() -> None:
    cone = cut_cone(ORTHANT, np.array([1.0, 1.0, -1.0]))
    assert normalize_rays(cone) == [
        [0.0, 0.5, 0.5],
        [0.0, 1.0, 0.0],
        [0.5, 0.0, 0.5],
        [1.0, 0.0, 0.0],
    ]


def test_a_cut_that_misses_the_cone_is_redundant() -> None:
    cone = cut_cone(ORTHANT, np.array([1.0, 1.0, 0.0]))
    assert normalize_rays(cone) == normalize_rays(ORTHANT)
    assert find_facets(cone).tolist() == [True, True, True, False]


def test_a_border_that_a_later_cut_makes_redundant_is_not_a_facet() -> None:
    weak, strong = np.array([1.0, -1.0, 0.0]), np.array([1.0, -2.0, 0.0])
    assert find_facets(cut_cone(cut_cone(ORTHANT, weak), strong)).tolist() == [
        False,
        True,
        True,
        False,
        True,
    ]


def test_a_cut_that_excludes_the_orthant_leaves_no_rays() -> None:
    assert len(cut_cone(ORTHANT, -np.ones(3)).rays) == 0


def test_opposite_cuts_leave_a_flat_cone() -> None:
    normal = np.array([1.0, -1.0, 0.0])
    assert normalize_rays(cut_cone(cut_cone(ORTHANT, normal), -normal)) == [
        [0.0, 0.0, 1.0],
        [0.5, 0.5, 0.0],
    ]


@pytest.mark.parametrize("seed", range(30))
def test_random_cuts_leave_the_enumerated_corners(seed: int) -> None:
    rng = np.random.default_rng(seed)
    size, cut_count = int(rng.integers(2, 6)), int(rng.integers(1, 7))
    normals = rng.normal(size=(cut_count, size)) + 0.3
    if seed % 2:
        normals = np.round(normals)  # degenerate: corners lie on more borders than necessary
    cone = make_simplicial_cone(np.eye(size))
    for normal in normals:
        cone = cut_cone(cone, normal)
    assert normalize_rays(cone) == enumerate_corners(normals)

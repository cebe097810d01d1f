from itertools import combinations

import numpy as np
import pytest

from dmplay.chance import Reals
from dmplay.solvers.double_description import Cone, cut_cone, find_facets, make_simplicial_cone

ORTHANT = make_simplicial_cone(np.eye(3))


def points(cone: Cone) -> list[list[float]]:
    """The rays where their sum is 1, in order."""
    scaled = cone.rays / cone.rays.sum(axis=1, keepdims=True)
    return sorted((np.round(scaled, 9) + 0.0).tolist())


def by_enumeration(normals: Reals) -> list[list[float]]:
    """The corners of {x >= 0, sum 1, normals @ x >= 0}: wherever borders meet in one point."""
    size = normals.shape[1]
    borders = np.vstack([np.eye(size), normals])
    found = set()
    for some in combinations(borders, size - 1):
        system = np.vstack([some, np.ones(size)])
        if abs(np.linalg.det(system)) > 1e-9:
            x = np.linalg.solve(system, np.eye(size)[-1])
            if (borders @ x >= -1e-9).all():
                found.add(tuple(np.round(x, 9) + 0.0))
    return sorted(map(list, found))


def test_a_cut_through_a_corner_adds_one_ray() -> None:
    cone = cut_cone(ORTHANT, np.array([1.0, -1.0, 0.0]))
    assert points(cone) == [[0.0, 0.0, 1.0], [0.5, 0.5, 0.0], [1.0, 0.0, 0.0]]


def test_a_cut_that_takes_a_corner_off_adds_two_rays() -> None:
    cone = cut_cone(ORTHANT, np.array([1.0, 1.0, -1.0]))
    assert points(cone) == [[0.0, 0.5, 0.5], [0.0, 1.0, 0.0], [0.5, 0.0, 0.5], [1.0, 0.0, 0.0]]


def test_a_cut_beside_the_cone_keeps_it_and_is_not_needed() -> None:
    cone = cut_cone(ORTHANT, np.array([1.0, 1.0, 0.0]))
    assert points(cone) == points(ORTHANT)
    assert find_facets(cone).tolist() == [True, True, True, False]


def test_a_border_made_superfluous_by_a_later_cut_is_not_needed() -> None:
    weak, strong = np.array([1.0, -1.0, 0.0]), np.array([1.0, -2.0, 0.0])
    assert find_facets(cut_cone(cut_cone(ORTHANT, weak), strong)).tolist() == [
        False,
        True,
        True,
        False,
        True,
    ]


def test_nothing_is_left_beyond_the_orthant() -> None:
    assert len(cut_cone(ORTHANT, -np.ones(3)).rays) == 0


def test_opposite_cuts_leave_a_flat_cone() -> None:
    normal = np.array([1.0, -1.0, 0.0])
    assert points(cut_cone(cut_cone(ORTHANT, normal), -normal)) == [
        [0.0, 0.0, 1.0],
        [0.5, 0.5, 0.0],
    ]


@pytest.mark.parametrize("seed", range(30))
def test_random_cuts_leave_the_corners_that_enumeration_finds(seed: int) -> None:
    random = np.random.default_rng(seed)
    size, many = int(random.integers(2, 6)), int(random.integers(1, 7))
    normals = random.normal(size=(many, size)) + 0.3
    if seed % 2:
        normals = np.round(normals)  # many corners on more borders than they need
    cone = make_simplicial_cone(np.eye(size))
    for normal in normals:
        cone = cut_cone(cone, normal)
    assert points(cone) == by_enumeration(normals)

"""What the everyday run leaves out, how many examples are tried, and what is sought coarsely."""

import gc
import os
import sys
from collections.abc import Iterator

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # a second thread only waits: systems are small

import pytest
from hypothesis import settings
from hypothesis.internal.conjecture import providers
from hypothesis.internal.constants_ast import Constants

from dmplay.policies import cart_pole, mountain_car
from dmplay.solutions import reals
from dmplay.solvers.grid_iteration import RectangularGrid

gc.set_threshold(5_000, 9_999)  # old things are looked through at the end
providers._get_local_constants = Constants  # what is tried is not what is loaded
settings.register_profile("same", derandomize=True, deadline=None, database=None, max_examples=25)
settings.load_profile("same")

LONG = (
    "collaborative-predator-prey", "collab/",  # each turn carries a belief over 1,728 states
    "collision/nmac", "mountaincar/policy_steps",  # many long games
)  # fmt: skip


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks the tests of what takes as long as all others together."""
    for item in items:
        if any(one in item.name for one in LONG):
            item.add_marker(pytest.mark.slow)


def pytest_collection_finish() -> None:
    """What stays to the end is not looked through again."""
    gc.freeze()


@pytest.hookimpl(trylast=True)
def pytest_unconfigure() -> None:
    """What pytest looked through at the end is not looked through again."""
    gc.freeze()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol() -> Iterator[None]:
    """The folders that a test loaded files from are looked into no more."""
    before = [*sys.path]
    try:
        return (yield)
    finally:
        sys.path[:] = before


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """The car's optimum is sought on few points, and a pole pushed few turns ahead.

    It is for what is true of however many.
    """
    grid = RectangularGrid(mountain_car.VALUE_GRID.low, mountain_car.VALUE_GRID.high, (61, 47))
    for module in (mountain_car, reals):
        monkeypatch.setattr(module, "VALUE_GRID", grid)
    monkeypatch.setattr(cart_pole, "LOOKAHEAD_TURNS", 4)

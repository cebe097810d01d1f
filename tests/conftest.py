"""Settings of the test run: slow tests, the number of Hypothesis examples, the user's folders."""

import os
import sys
import tempfile
from collections.abc import Iterator

# the linear systems are small, so that a second thread only waits
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import settings

from dmplay.problems.cart_pole import agents as cart_pole
from dmplay.problems.mountain_car import agents as mountain_car
from dmplay.solvers.mdp.grid_value_iteration import RectangularGrid
from tests.support.extras import is_extra_installed

settings.register_profile("same", derandomize=True, deadline=None, database=None, max_examples=25)
settings.load_profile("same")

collect_ignore_glob = ["transcript/older_drawings/*"]  # drawings of an older version differ
SLOW_TEST_NAMES = (
    "collaborative-predator-prey", "collab/",  # each turn updates a belief over 1,728 states
    "collision/nmac", "mountaincar/policy_steps",  # many long games
)  # fmt: skip


USER_FOLDERS = pytest.StashKey[tempfile.TemporaryDirectory[str]]()


def pytest_configure(config: pytest.Config) -> None:
    """Use empty folders for settings, records and saved games, not those of who runs the tests."""
    config.stash[USER_FOLDERS] = folder = tempfile.TemporaryDirectory()
    for name in ("CONFIG", "STATE", "CACHE"):
        os.environ[f"XDG_{name}_HOME"] = f"{folder.name}/{name.lower()}"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests that take as long as all others together as slow.

    Skip those that need an extra which is not installed.
    """
    for item in items:
        if any(part in item.name for part in SLOW_TEST_NAMES):
            item.add_marker(pytest.mark.slow)
        extras = {name for marker in item.iter_markers("extra") for name in marker.args}
        missing = sorted(name for name in extras if not is_extra_installed(name))
        if missing:
            item.add_marker(pytest.mark.skip(reason=f"needs the extra {' and '.join(missing)}"))


def pytest_unconfigure(config: pytest.Config) -> None:
    """Remove the user's folders."""
    config.stash[USER_FOLDERS].cleanup()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol() -> Iterator[None]:
    """Restore `sys.path` after each test, because loading a file adds its folder."""
    before = [*sys.path]
    try:
        return (yield)
    finally:
        sys.path[:] = before


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Solve mountain car on a coarse grid and search cart-pole few turns ahead.

    Use it for tests that hold at any resolution.
    """
    grid = RectangularGrid(mountain_car.VALUE_GRID.low, mountain_car.VALUE_GRID.high, (61, 47))
    monkeypatch.setattr(mountain_car, "VALUE_GRID", grid)
    monkeypatch.setattr(cart_pole, "LOOKAHEAD_TURNS", 4)

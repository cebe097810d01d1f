"""What the everyday run leaves out, beside what says so itself."""

import pytest

LONG = "collaborative-predator-prey"  # each turn carries a belief over 1,728 states


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks the tests of the one problem that takes as long as all others together."""
    for item in items:
        if LONG in item.name:
            item.add_marker(pytest.mark.slow)

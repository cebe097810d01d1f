"""What the everyday run leaves out, beside what says so itself."""

import pytest

LONG = (
    "collaborative-predator-prey", "collab/",  # each turn carries a belief over 1,728 states
    "collision/nmac", "mountaincar/policy_steps",  # many long games
)  # fmt: skip


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks the tests of what takes as long as all others together."""
    for item in items:
        if any(one in item.name for one in LONG):
            item.add_marker(pytest.mark.slow)

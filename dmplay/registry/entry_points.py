"""Problems that installed packages register by entry points."""

import sys
from functools import lru_cache

ENTRY_POINT_GROUP = "dmplay.problems"


def entry_point_targets() -> dict[str, str]:
    """Return the target of each entry point by name, `MODULE` or `MODULE:PROBLEM`, not imported."""
    return _scan_entry_points(tuple(sys.path))


@lru_cache(maxsize=1)
def _scan_entry_points(path: tuple[str, ...]) -> dict[str, str]:
    """Return the entry points on an import path, cached because scanning is slow."""
    from importlib.metadata import entry_points

    return {point.name: point.value for point in entry_points(group=ENTRY_POINT_GROUP)}

"""Problems that packages offer by entry points."""

import sys
from functools import lru_cache

ENTRY_POINT_GROUP = "dmplay.problems"


def entry_point_targets() -> dict[str, str]:
    """Their names, and what each points to, `MODULE` or `MODULE:PROBLEM`, which is not imported."""
    return _scan_entry_points(tuple(sys.path))


@lru_cache(maxsize=1)
def _scan_entry_points(path: tuple[str, ...]) -> dict[str, str]:
    """Those that lie on a path; to look for them takes time."""
    from importlib.metadata import entry_points

    return {point.name: point.value for point in entry_points(group=ENTRY_POINT_GROUP)}

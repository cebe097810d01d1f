"""Problems that packages offer by entry points."""

import sys
from functools import lru_cache

GROUP = "dmplay.problems"


def installed() -> dict[str, str]:
    """Their names, and what each points to, `MODULE` or `MODULE:PROBLEM`, which is not imported."""
    return _found(tuple(sys.path))


@lru_cache(maxsize=1)
def _found(path: tuple[str, ...]) -> dict[str, str]:
    """Those that lie on a path; to look for them takes time."""
    from importlib.metadata import entry_points

    return {point.name: point.value for point in entry_points(group=GROUP)}

"""The optional extras of the package, and whether they are installed."""

from importlib.util import find_spec

MODULES_OF_EXTRAS = {
    "axelrod": ["axelrod"],
    "dask": ["distributed"],
    "gymnasium": ["gymnasium"],
    "mcp": ["mcp"],
    "openspiel": ["pyspiel"],
    "pandas": ["pandas"],
    "pettingzoo": ["pettingzoo", "pygame"],
    "plot": ["matplotlib"],
    "polars": ["polars"],
}


def is_extra_installed(name: str) -> bool:
    """Return whether the modules of an extra can be imported."""
    return all(find_spec(module) is not None for module in MODULES_OF_EXTRAS[name])

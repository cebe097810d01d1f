"""What a name finds outside of dmplay: a module or a Python file, and what is in it."""

from collections.abc import Mapping
from importlib.util import find_spec
from types import ModuleType
from typing import Any

from dmplay.errors import BadParameter, UnknownName
from dmplay.finding import code
from dmplay.finding.ways import CODE


def is_outside(name: str) -> bool:
    """Whether a name points into a file or a module."""
    base, colon, _ = name.partition(":")
    return base.endswith(CODE) or bool(colon) and ("/" in base or "." in base or _importable(base))


def _importable(base: str) -> bool:
    try:
        return base.isidentifier() and find_spec(base) is not None
    except (ImportError, ValueError):
        return False


def module(place: str) -> ModuleType:
    """The module that a path or a dotted name is."""
    return code.of_file(place) if place.endswith(CODE) else code.of_name(place)


def attribute(name: str) -> Any:
    """What a name `MODULE:ATTRIBUTE` or `FILE.py:ATTRIBUTE` points to."""
    place, _, wanted = name.partition(":")
    return within(module(place), wanted, place)


def within(found: ModuleType, wanted: str, place: str, more: Mapping[str, Any] = {}) -> Any:
    """What a module calls so, or what else goes by that name."""
    if not hasattr(found, wanted) and wanted not in more:
        public = [one for one in vars(found) if not one.startswith("_")]
        raise UnknownName("attribute", wanted, [*more, *public], where=place)
    return more[wanted] if wanted in more else getattr(found, wanted)

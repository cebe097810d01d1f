"""What a name finds outside of dmplay: a module or a Python file, and what is in it."""

import inspect
from types import ModuleType
from typing import Any

from dmplay.errors import BadParameter, UnknownName
from dmplay.finding import code
from dmplay.finding.ways import names_python_file


def may_name_code(name: str) -> bool:
    """Whether a name points into a file or a module."""
    return names_python_file(name) or ":" in name


def names_module(name: str) -> bool:
    """Whether a name points into a module that can be imported."""
    base, colon, _ = name.partition(":")
    return bool(colon) and ("." in base or "/" in base or code.is_importable(base))


def load_named_module(name: str) -> ModuleType:
    """The module that a name points into: a path or a dotted name before the colon."""
    place = name.partition(":")[0]
    return (
        code.load_module_from_file(place)
        if names_python_file(place)
        else code.load_module_by_name(place, name)
    )


def load_named_attribute(name: str) -> Any:
    """What a name `MODULE:ATTRIBUTE` or `FILE.py:ATTRIBUTE` points to."""
    place, _, wanted = name.partition(":")
    found = load_named_module(name)
    if hasattr(found, wanted):
        return getattr(found, wanted)
    public = {one: thing for one, thing in vars(found).items() if not one.startswith("_")}
    own = [one for one, thing in public.items() if inspect.getmodule(thing) is found]
    known = own or [*public]
    if wanted or not known:
        raise UnknownName("attribute", wanted, known, error_prefix=place)
    raise BadParameter(f"{place}: got a file alone, expected a name in it, as {place}:{known[-1]}")

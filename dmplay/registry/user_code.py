"""User code by name: a module or a Python file, and an attribute in it."""

import inspect
from types import ModuleType
from typing import Any

from dmplay.errors import BadParameter, UnknownName
from dmplay.registry import module_loader
from dmplay.registry.problem_name_kinds import names_folder, names_python_file


def may_name_code(name: str) -> bool:
    """Return whether a name may point into a Python file or a module."""
    return names_python_file(name) or ":" in name


def names_module(name: str) -> bool:
    """Return whether a name points into a module that can be imported."""
    base, colon, _ = name.partition(":")
    return bool(colon) and ("." in base or "/" in base or module_loader.is_importable(base))


def load_named_module(name: str) -> ModuleType:
    """Return the module that a name points into: a path or a dotted name before the colon."""
    source = name.partition(":")[0]
    if names_folder(source):
        return module_loader.load_module_from_folder(source)
    if names_python_file(source):
        return module_loader.load_module_from_file(source)
    return module_loader.load_module_by_name(source, name)


def load_named_attribute(name: str) -> Any:
    """Return the object that `MODULE:ATTRIBUTE` or `FILE.py:ATTRIBUTE` names."""
    source, _, attribute_name = name.partition(":")
    user_module = load_named_module(name)
    if hasattr(user_module, attribute_name):
        return getattr(user_module, attribute_name)
    public = {key: value for key, value in vars(user_module).items() if not key.startswith("_")}
    is_defined = {key: inspect.getmodule(value) is user_module for key, value in public.items()}
    valid_names = [key for key in public if is_defined[key]] or [*public]
    if attribute_name or not valid_names:
        raise UnknownName("attribute", attribute_name, valid_names, error_prefix=source)
    expected = f"expected the name of an object in it, such as {source}:{valid_names[-1]}"
    raise BadParameter(f"{source}: {expected}")

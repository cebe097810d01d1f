"""What a name finds outside of dmplay: an attribute of a module, or of a Python file."""

import importlib
import importlib.util
from pathlib import Path
from typing import Any

from dmplay.errors import BadParameter, UnknownName


def is_outside(name: str) -> bool:
    """Whether a name points into a file or a module by path."""
    base, colon, _ = name.partition(":")
    return bool(colon) and (base.endswith(".py") or "/" in base or "." in base)


def attribute(name: str) -> Any:
    """What a name `MODULE:ATTRIBUTE` or `FILE.py:ATTRIBUTE` points to."""
    place, _, wanted = name.partition(":")
    if place.endswith(".py"):
        file = Path(place)
        if not file.is_file():
            raise BadParameter(f"no such file: {place}")
        spec = importlib.util.spec_from_file_location(file.stem, file)
        if spec is None or spec.loader is None:
            raise BadParameter(f"cannot load {place}")
        module = importlib.util.module_from_spec(spec)
        try:
            spec.loader.exec_module(module)
        except SyntaxError as error:
            raise BadParameter(f"{error.filename}:{error.lineno}: {error.msg}") from None
    elif not all(map(str.isidentifier, place.split("."))):
        raise BadParameter(f"no module {place!r} for {name!r}")
    else:
        try:
            module = importlib.import_module(place)
        except ModuleNotFoundError as error:
            raise BadParameter(f"no module {error.name!r} for {name!r}") from None
    if not hasattr(module, wanted):
        public = [one for one in vars(module) if not one.startswith("_")]
        raise UnknownName("attribute", wanted, public, where=place)
    return getattr(module, wanted)

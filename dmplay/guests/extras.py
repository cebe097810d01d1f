"""What is asked of another library by name: the library, and `NAME(KEY=VALUE,...)` in it."""

import json
import re
from importlib import import_module
from types import ModuleType
from typing import NamedTuple

from dmplay.errors import BadParameter

CALL_PATTERN = re.compile(r"(?P<name>[^()]+)(\((?P<given>.*)\))?")
ARGUMENT_SEPARATOR = re.compile(r",(?![^\[]*\])")  # no comma of a list
LIBRARY_ERRORS = (
    ArithmeticError, AssertionError, AttributeError, ImportError, LookupError, OSError,
    RuntimeError, TypeError, ValueError,
)  # fmt: skip # what other libraries raise


class LibraryCall(NamedTuple):
    """A name in a library, and what it is given."""

    name: str
    arguments: dict[str, object]


def import_library(module: str, extra: str, problem_name: str) -> ModuleType:
    """The library that a name needs; raises BadParameter with the extra that installs it."""
    try:
        return import_module(module)
    except ModuleNotFoundError:
        cure = f"install the extra {extra}: pip install 'dmplay[{extra}]'"
        raise BadParameter(f"{problem_name}: {cure}") from None


def format_library_version(package: str) -> str:
    """A library and its version."""
    from importlib.metadata import version  # it takes as long to load as the rest of the start

    return f"{package} {version(package)}"


def parse_library_call(text: str) -> LibraryCall:
    """What a text `NAME(KEY=VALUE,...)` asks for."""
    found = CALL_PATTERN.fullmatch(text)
    if not found:
        raise BadParameter(f"got {text!r}, expected a name, or NAME(KEY=VALUE,...)")
    given = {}
    for pair in filter(None, ARGUMENT_SEPARATOR.split(found["given"] or "")):
        key, equals, value = pair.partition("=")
        if not equals:
            raise BadParameter(f"{found['name']}: got {pair!r}, expected KEY=VALUE")
        given[key.strip()] = _parse_value(value.strip())
    return LibraryCall(found["name"], given)


def _parse_value(text: str) -> object:
    try:
        return json.loads(text.lower() if text in ("True", "False") else text)
    except ValueError:
        return text


def summarize_error(error: BaseException) -> str:
    """What an error says, in a line."""
    told = " ".join(str(error).split("\n")[0].split())
    return told or type(error).__name__

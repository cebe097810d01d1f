"""Helpers for optional libraries: import, version, errors, and calls `NAME(KEY=VALUE,...)`."""

import json
import re
from importlib import import_module
from types import ModuleType
from typing import NamedTuple

from dmplay.errors import BadParameter

CALL_PATTERN = re.compile(r"(?P<name>[^()]+)(\((?P<given>.*)\))?")
ARGUMENT_SEPARATOR = re.compile(r",(?![^\[]*\])")  # a comma that is not inside a list
LIBRARY_ERRORS = (
    ArithmeticError, AssertionError, AttributeError, ImportError, LookupError, OSError,
    RuntimeError, TypeError, ValueError,
)  # fmt: skip # exceptions that other libraries raise


class LibraryCall(NamedTuple):
    """A name in a library, and its arguments."""

    name: str
    arguments: dict[str, object]


def import_library(module: str, extra: str, problem_name: str) -> ModuleType:
    """Return the imported library; raise BadParameter with the extra that installs it.

    `problem_name` is the problem that needs the library, for the message.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError:
        remedy = f"install the extra {extra}: pip install 'dmplay[{extra}]'"
        raise BadParameter(f"{problem_name}: {remedy}") from None


def format_library_version(package: str) -> str:
    """Return a package's name and installed version in one string."""
    from importlib.metadata import version  # Importing it takes as long as the rest of the start.

    return f"{package} {version(package)}"


def parse_library_call(text: str) -> LibraryCall:
    """Return the name and arguments in a text `NAME(KEY=VALUE,...)`.

    Raises BadParameter if the text has another form.
    """
    match = CALL_PATTERN.fullmatch(text)
    if not match:
        raise BadParameter(f"got {text!r}, expected a name, or NAME(KEY=VALUE,...)")
    arguments = {}
    for pair in filter(None, ARGUMENT_SEPARATOR.split(match["given"] or "")):
        key, equals, value = pair.partition("=")
        if not equals:
            raise BadParameter(f"{match['name']}: got {pair!r}, expected KEY=VALUE")
        arguments[key.strip()] = _parse_json_or_text(value.strip())
    return LibraryCall(match["name"], arguments)


def _parse_json_or_text(text: str) -> object:
    """Return the JSON value of a text, or the text itself if it is not JSON."""
    try:
        return json.loads(text.lower() if text in ("True", "False") else text)
    except ValueError:
        return text


def summarize_error(error: BaseException) -> str:
    """Return the first line of an error's message, or its type if there is none."""
    message = " ".join(str(error).split("\n")[0].split())
    return message or type(error).__name__

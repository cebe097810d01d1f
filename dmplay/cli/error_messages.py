"""Format errors in command-line arguments as one-line messages."""

import os
import re
from typing import Any

import typer

from dmplay.core.user_code_locations import replace_modules_by_files
from dmplay.errors import DmplayError, UnknownName, clip_message

# click.UsageError, wherever typer keeps its copy of click
USAGE_ERROR: type[Exception] = typer.BadParameter.__mro__[1]
EXTRA_ARGUMENT = "unexpected extra argument"
# how click ends a message that has suggestions
SUGGESTION_PATTERN = re.compile(r"(?: \(Possible options: |\. Did you mean )(.+?)[)?]$")
CHOICE_PATTERN = re.compile(r"(?:Value error, )?'(.*)' is not one of (.*)", re.DOTALL)
VALUE_PATTERN = re.compile(r"Option '(.+?)' (requires an argument|does not take a value)")


def format_error(error: Exception) -> str:
    """Return an error as one line, clipped in its middle if it is long."""
    return clip_message(replace_modules_by_files(_format_whole_error(error)))


def _format_whole_error(error: Exception) -> str:
    """Return the full one-line message of an error.

    The messages of dmplay's own errors stay as they are. A message of click gets our form: lower
    case first, no full stop, then the suggestions or the `--help` to read.
    """
    if isinstance(error, DmplayError):
        return str(error)
    context, parameter = getattr(error, "ctx", None), getattr(error, "param", None)
    if isinstance(error, typer.BadParameter) and parameter and error.message:
        return _describe_wrong_value(error.message, context, parameter)
    message = getattr(error, "format_message", lambda: str(error))().rstrip(".")
    if option := VALUE_PATTERN.match(message):
        is_missing = option[2].startswith("requires")
        return f"{option[1]}: expected {'a' if is_missing else 'no'} value"
    if EXTRA_ARGUMENT in message:
        extra_words = message.partition(EXTRA_ARGUMENT)[2].partition(" (")[2].removesuffix(")")
        message = _describe_swallowed_option(context) or f"unexpected argument {extra_words!r}"
    suggestions = SUGGESTION_PATTERN.search(message)
    command_path = getattr(context, "command_path", "dmplay")
    advice = f"see {command_path} --help"
    if suggestions:
        message = message[: suggestions.start()]
        advice = f"did you mean {suggestions[1].replace(', ', ' or ')}?".replace("'", "")
    return f"{message[:1].lower()}{message[1:]}; {advice}"


def _describe_swallowed_option(context: Any) -> str:
    """Return the message for an option that took the next option as its value, or ''.

    In that case click reports an extra argument, which hides the real mistake.
    """
    for name, value in context.params.items():
        if isinstance(value, str) and value.startswith("--"):
            return f"--{name}: got {value!r}, expected a value"
    return ""


def _describe_wrong_value(message: str, context: Any, parameter: Any) -> str:
    """Return the message for a wrong value, after the option or the variable that has it."""
    name = max(parameter.opts, key=len)
    if getattr(context.get_parameter_source(parameter.name), "name", "") == "ENVIRONMENT":
        name = parameter.envvar or f"{context.auto_envvar_prefix}_{parameter.name.upper()}"
    if choice := CHOICE_PATTERN.match(message):
        choices = re.findall(r"'(.+?)'", choice[2])
        return str(UnknownName("value", choice[1], choices, error_prefix=name))
    if "valid boolean" in message:  # worded differently by each Typer
        message = f"got {os.environ.get(name, '')!r}, expected true or false"
    return f"{name}: {message}"

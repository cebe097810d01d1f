"""Format errors in command-line arguments as one-line messages."""

import re
from typing import Any

import typer

from dmplay.errors import DmplayError, clip_message

# click.UsageError, wherever typer keeps its copy of click
USAGE_ERROR: type[Exception] = typer.BadParameter.__mro__[1]
EXTRA_ARGUMENT = "unexpected extra argument"
# how click ends a message that has suggestions
SUGGESTION_PATTERN = re.compile(r"(?: \(Possible options: |\. Did you mean )(.+?)[)?]$")
PYDANTIC_PREFIX = "Value error, "  # before the message for a choice, from Typer 0.29 on
BOOLEAN_PATTERN = re.compile(r"[^:]*\bvalid boolean\b.*")  # worded differently by each Typer


def format_error(error: Exception) -> str:
    """Return an error as one line, clipped in its middle if it is long."""
    return clip_message(_describe_error(error))


def _describe_error(error: Exception) -> str:
    """Return the full one-line message of an error.

    The messages of dmplay's own errors stay as they are. A message of click gets our form: lower
    case first, no full stop, then the suggestions or the `--help` to read.
    """
    if isinstance(error, DmplayError):
        return str(error)
    message = getattr(error, "format_message", lambda: str(error))().rstrip(".")
    message = BOOLEAN_PATTERN.sub(" expected true or false", message.replace(PYDANTIC_PREFIX, ""))
    context, parameter = getattr(error, "ctx", None), getattr(error, "param", None)
    prefix = _variable_prefix(context, parameter) if context and parameter else ""
    if EXTRA_ARGUMENT in message:
        extra_words = message.partition(EXTRA_ARGUMENT)[2].partition(" (")[2].removesuffix(")")
        message = _describe_missing_value(context) or f"unexpected argument {extra_words!r}"
    suggestions = SUGGESTION_PATTERN.search(message)
    command_path = getattr(context, "command_path", "dmplay")
    advice = f"see {command_path} --help"
    if suggestions:
        message = message[: suggestions.start()]
        advice = f"did you mean {suggestions[1].replace(', ', ' or ')}?".replace("'", "")
    return f"{prefix}{message[:1].lower()}{message[1:]}; {advice}"


def _describe_missing_value(context: Any) -> str:
    """Return the message for an option that took the next option as its value, or ''.

    In that case click reports an extra argument, which hides the real mistake.
    """
    for name, value in context.params.items():
        if isinstance(value, str) and value.startswith("--"):
            return f"--{name}: got {value!r}, expected a value"
    return ""


def _variable_prefix(context: Any, option: Any) -> str:
    """Return the name of the environment variable that set an option as 'NAME: ', or ''."""
    source = context.get_parameter_source(option.name)
    if source is None or source.name != "ENVIRONMENT":
        return ""
    return f"{option.envvar or f'{context.auto_envvar_prefix}_{option.name.upper()}'}: "

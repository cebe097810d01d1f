"""What is wrong with words of the command line, in a sentence."""

import re
from typing import Any

import typer

from dmplay.errors import DmplayError

USAGE_ERROR: type[Exception] = typer.BadParameter.__mro__[1]  # click's, wherever typer keeps it
EXTRA_ARGUMENT = "unexpected extra argument"
MAX_CHARACTERS = 2000  # characters of a sentence
SUGGESTION_PATTERN = re.compile(r"(?: \(Possible options: |\. Did you mean )(.+?)[)?]$")  # click's
PLAIN_TYPE_NAMES = {  # click's names of kinds, the longer first, in plain words
    "int range": "whole number", "float range": "number", "int": "whole number", "float": "number",
}  # fmt: skip


def format_error(error: Exception) -> str:
    """An error in one line, the middle of a very long one left out."""
    told = _describe_error(error)
    return (
        told
        if len(told) <= MAX_CHARACTERS
        else f"{told[: MAX_CHARACTERS // 2]} ... {told[-MAX_CHARACTERS // 2 :]}"
    )


def _describe_error(error: Exception) -> str:
    """An error in one line; click's in our form, lower case first and without a full stop."""
    if isinstance(error, DmplayError):
        return str(error)
    message = getattr(error, "format_message", lambda: str(error))().rstrip(".")
    for kind, plain in PLAIN_TYPE_NAMES.items():
        message = message.replace(f"valid {kind}", plain)
    context, option = getattr(error, "ctx", None), getattr(error, "param", None)
    variable = _variable_prefix(context, option) if context and option else ""
    if EXTRA_ARGUMENT in message:
        extra = message.partition(EXTRA_ARGUMENT)[2].partition(" (")[2].removesuffix(")")
        message = (
            _describe_missing_value(context) or f"got {extra!r} besides, expected no more words"
        )
    guess = SUGGESTION_PATTERN.search(message)
    where = getattr(context, "command_path", "dmplay")
    after = f"see {where} --help"
    if guess:
        message = message[: guess.start()]
        after = f"did you mean {guess[1].replace(', ', ' or ')}?".replace("'", "")
    return f"{variable}{message[:1].lower()}{message[1:]}; {after}"


def _describe_missing_value(context: Any) -> str:
    """The option that took the next option for its value, if one did; the rest is then too much."""
    taken = ((name, value) for name, value in context.params.items() if isinstance(value, str))
    wrong = next(((name, value) for name, value in taken if value.startswith("--")), None)
    return f"--{wrong[0]}: got {wrong[1]!r}, expected a value" if wrong else ""


def _variable_prefix(context: Any, option: Any) -> str:
    """The variable that gave an option its value, to stand before what is wrong with it."""
    source = context.get_parameter_source(option.name)
    if source is None or source.name != "ENVIRONMENT":
        return ""
    return f"{option.envvar or f'{context.auto_envvar_prefix}_{option.name.upper()}'}: "

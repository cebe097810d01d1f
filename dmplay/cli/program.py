"""The command line as a function: words in, what it prints out."""

import contextlib
import io
from collections.abc import Sequence
from typing import Any

import typer

from dmplay.errors import BadParameter, DmplayError

USAGE: type[Exception] = typer.BadParameter.__mro__[1]  # click's, wherever typer keeps it
ABORTED: type[Exception] = typer.Abort  # Ctrl-C


def program(commands: Any, words: Sequence[str], table: object) -> str:
    """What `commands`, click's, print for these words; games they set up are put on the table."""
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        try:
            commands([*words], standalone_mode=False, prog_name="dmplay", obj=table)
        except USAGE as error:
            raise BadParameter(sentence(error)) from None
    return printed.getvalue().rstrip("\n")


def sentence(error: Exception) -> str:
    """An error in one line; click's in our form, lower case first and without a full stop."""
    if isinstance(error, DmplayError):
        return str(error)
    message = getattr(error, "format_message", lambda: str(error))().rstrip(".")
    where = getattr(getattr(error, "ctx", None), "command_path", "dmplay")
    return f"{message[:1].lower()}{message[1:]}; see {where} --help"

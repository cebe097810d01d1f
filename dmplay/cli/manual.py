"""The manual page, `man dmplay`, from the same text as the help of the commands.

`python -m dmplay.cli.manual > dmplay/cli/dmplay.1` makes it anew.
"""

import inspect
from collections.abc import Iterator
from typing import Any

from dmplay import __version__
from dmplay.cli.app import root_command

VERBATIM_MARK = "\b"  # begins a paragraph whose lines stay as they are
UNSTATED_DEFAULTS: tuple[object, ...] = (
    None,
    False,
    True,
    "",
    [],
)  # defaults that go without saying
FINAL_SECTIONS = r"""
.SH FILES
.TP
.I $XDG_CONFIG_HOME/dmplay/config.toml\fR, \fI./dmplay.toml
settings, the folder's over the user's
.TP
.I $XDG_STATE_HOME/dmplay/
games that were not recorded elsewhere, best and last games, and what was typed
.TP
.I $XDG_CACHE_HOME/dmplay/
solutions
.SH EXIT STATUS
.TP
.B 0
done; a lost game is one too
.TP
.B 1
the system refused, as a full disk does
.TP
.B 2
a word, a setting or a file that is wrong, or an illegal action in a pipe
.TP
.B 3
a transcript that does not verify
.TP
.BR 129 ", " 130 ", " 143
hung up, interrupted, terminated
"""


def format_man_page() -> str:
    """The page, as `man` reads it."""
    program = root_command()
    title, *described = _split_paragraphs(program.help)
    lines = [
        f'.TH DMPLAY 1 "" "dmplay {__version__}"',
        ".SH NAME",
        f"dmplay {_escape_roff('-')} {title[0].rstrip('.')}",
        ".SH SYNOPSIS",
        ".B dmplay",
        "[PROBLEM | COMMAND] [OPTION...]",
        ".SH DESCRIPTION",
        *_paragraph_lines(described),
        ".SH COMMANDS",
        *(line for name in program.commands for line in _command_lines(program, name, "dmplay")),
        ".SH ENVIRONMENT",
        *_variable_lines(program),
    ]
    return "\n".join(lines) + FINAL_SECTIONS


def _command_lines(group: Any, name: str, parent: str) -> Iterator[str]:
    """A command or, if it is a group, each of its own."""
    command = group.commands[name]
    path = f"{parent} {name}"
    arguments = [
        _format_parameter(one) for one in command.params if one.param_type_name == "argument"
    ]
    inner = getattr(command, "commands", ())
    ends = ["COMMAND" if inner else "[OPTION...]"]
    yield f".SS {_escape_roff(' '.join([path, *arguments, *ends]))}"
    yield from _paragraph_lines(_split_paragraphs(command.help))
    for one in command.params:
        told = (
            one.help if one.default in UNSTATED_DEFAULTS else f"{one.help} (default {one.default})"
        )
        yield from (".TP", f".B {_escape_roff(_format_parameter(one))}", _escape_roff(told))
    for name_ in inner:
        yield from _command_lines(command, name_, path)


def _format_parameter(parameter: Any) -> str:
    """An argument or option as it is written."""
    word = parameter.metavar or parameter.name.rstrip("_").upper()
    if parameter.param_type_name == "argument":
        return word if parameter.required else f"[{word}]"
    names = ", ".join(sorted([*parameter.opts, *parameter.secondary_opts], key=len))
    return names if parameter.is_flag else f"{names} {word}"


def _split_paragraphs(text: str) -> list[list[str]]:
    return [paragraph.split("\n") for paragraph in inspect.cleandoc(text).split("\n\n")]


def _paragraph_lines(paragraphs: list[list[str]]) -> Iterator[str]:
    for lines in paragraphs:
        yield ".PP"
        if lines[0] == VERBATIM_MARK:
            yield from (".nf", *map(_escape_roff, lines[1:]), ".fi")
        else:
            yield from map(_escape_roff, lines)


def _escape_roff(line: str) -> str:
    """A line in which nothing is an order to the printer."""
    told = line.replace("\\", r"\e").replace("-", r"\-").replace("'", r"\(aq")
    return rf"\&{told}" if told.startswith((".", "\\(aq", " ")) else told


def _variable_lines(program: Any) -> Iterator[str]:
    """The variables that set an option of several commands."""
    named = {
        one.envvar: max(one.opts, key=len)
        for command in program.commands.values()
        for one in command.params
        if isinstance(getattr(one, "envvar", None), str)
    }
    for name, option in sorted(named.items()):
        yield from (".TP", f".B {name}", f"sets {_escape_roff(option)}")
    yield from (".TP", ".B DMPLAY_PLAY_SEED", "and its like set an option of one command")
    yield from (".TP", ".B NO_COLOR", "no colour, whatever the terminal can")
    yield from (".TP", ".B ACCESSIBLE", "lines, not the full screen")


if __name__ == "__main__":
    print(format_man_page(), end="")

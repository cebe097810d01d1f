"""The manual page, `man dmplay`, generated from the help of the commands.

`python -m dmplay.cli.man_page > dmplay/cli/dmplay.1` writes it.
"""

import inspect
from collections.abc import Iterator
from typing import Any

from dmplay import __version__
from dmplay.cli.app import root_command

VERBATIM_MARK = "\b"  # first line of a paragraph whose line breaks are preserved
UNSTATED_DEFAULTS: tuple[object, ...] = (
    None,
    False,
    True,
    "",
    [],
)  # defaults that are not stated
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
    """Return the manual page in roff format."""
    program = root_command()
    title, *description = _split_paragraphs(program.help)
    lines = [
        f'.TH DMPLAY 1 "" "dmplay {__version__}"',
        ".SH NAME",
        f"dmplay {_escape_roff('-')} {title[0].rstrip('.')}",
        ".SH SYNOPSIS",
        ".B dmplay",
        "[PROBLEM | COMMAND] [OPTION...]",
        ".SH DESCRIPTION",
        *_paragraph_lines(description),
        ".SH COMMANDS",
        *(line for name in program.commands for line in _command_lines(program, name, "dmplay")),
        ".SH ENVIRONMENT",
        *_variable_lines(program),
    ]
    return "\n".join(lines) + FINAL_SECTIONS


def _command_lines(group: Any, name: str, parent: str) -> Iterator[str]:
    """Yield the lines of a command with its parameters, followed by those of its subcommands."""
    command = group.commands[name]
    path = f"{parent} {name}"
    arguments = [
        _format_parameter(parameter)
        for parameter in command.params
        if parameter.param_type_name == "argument"
    ]
    subcommands = getattr(command, "commands", ())
    last_words = ["COMMAND" if subcommands else "[OPTION...]"]
    yield f".SS {_escape_roff(' '.join([path, *arguments, *last_words]))}"
    yield from _paragraph_lines(_split_paragraphs(command.help))
    for parameter in command.params:
        help_text = (
            parameter.help
            if parameter.default in UNSTATED_DEFAULTS
            else f"{parameter.help} (default {parameter.default})"
        )
        yield from (
            ".TP",
            f".B {_escape_roff(_format_parameter(parameter))}",
            _escape_roff(help_text),
        )
    for subcommand in subcommands:
        yield from _command_lines(command, subcommand, path)


def _format_parameter(parameter: Any) -> str:
    """Return an argument or option as it is written in a synopsis."""
    metavar = parameter.metavar or parameter.name.rstrip("_").upper()
    if parameter.param_type_name == "argument":
        return metavar if parameter.required else f"[{metavar}]"
    names = ", ".join(sorted([*parameter.opts, *parameter.secondary_opts], key=len))
    return names if parameter.is_flag else f"{names} {metavar}"


def _split_paragraphs(text: str) -> list[list[str]]:
    """Return the paragraphs of a help text as lists of lines."""
    return [paragraph.split("\n") for paragraph in inspect.cleandoc(text).split("\n\n")]


def _paragraph_lines(paragraphs: list[list[str]]) -> Iterator[str]:
    """Yield the roff lines of paragraphs; marked paragraphs keep their line breaks."""
    for lines in paragraphs:
        yield ".PP"
        if lines[0] == VERBATIM_MARK:
            yield from (".nf", *map(_escape_roff, lines[1:]), ".fi")
        else:
            yield from map(_escape_roff, lines)


def _escape_roff(line: str) -> str:
    """Return a line with all roff control characters escaped."""
    escaped = line.replace("\\", r"\e").replace("-", r"\-").replace("'", r"\(aq")
    return rf"\&{escaped}" if escaped.startswith((".", "\\(aq", " ")) else escaped


def _variable_lines(program: Any) -> Iterator[str]:
    """Yield the lines on environment variables, including those that set shared options."""
    option_by_variable = {
        parameter.envvar: max(parameter.opts, key=len)
        for command in program.commands.values()
        for parameter in command.params
        if isinstance(getattr(parameter, "envvar", None), str)
    }
    for name, option in sorted(option_by_variable.items()):
        yield from (".TP", f".B {name}", f"sets {_escape_roff(option)}")
    yield from (".TP", ".B DMPLAY_PLAY_SEED", "and its like set an option of one command")
    yield from (".TP", ".B NO_COLOR", "no colour, whatever the terminal can")
    yield from (".TP", ".B ACCESSIBLE", "lines, not the full screen")


if __name__ == "__main__":
    print(format_man_page(), end="")

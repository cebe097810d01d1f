"""The manual page, `man dmplay`, from the same text as the help of the commands.

`python -m dmplay.cli.manual > dmplay/cli/dmplay.1` makes it anew.
"""

import inspect
from collections.abc import Iterator
from typing import Any

from dmplay import __version__
from dmplay.cli.app import root

VERBATIM = "\b"  # begins a paragraph whose lines stay as they are
PLAIN: tuple[object, ...] = (None, False, True, "", [])  # defaults that go without saying
ENDING = r"""
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


def page() -> str:
    """The page, as `man` reads it."""
    program = root()
    title, *described = _paragraphs(program.help)
    lines = [
        f'.TH DMPLAY 1 "" "dmplay {__version__}"',
        ".SH NAME",
        f"dmplay {_plain('-')} {title[0].rstrip('.')}",
        ".SH SYNOPSIS",
        ".B dmplay",
        "[PROBLEM | COMMAND] [OPTION...]",
        ".SH DESCRIPTION",
        *_told(described),
        ".SH COMMANDS",
        *(line for name in program.commands for line in _command(program, name, "dmplay")),
        ".SH ENVIRONMENT",
        *_variables(program),
    ]
    return "\n".join(lines) + ENDING


def _command(group: Any, name: str, parent: str) -> Iterator[str]:
    """A command or, if it is a group, each of its own."""
    command = group.commands[name]
    path = f"{parent} {name}"
    arguments = [_named(one) for one in command.params if one.param_type_name == "argument"]
    inner = getattr(command, "commands", ())
    ends = ["COMMAND" if inner else "[OPTION...]"]
    yield f".SS {_plain(' '.join([path, *arguments, *ends]))}"
    yield from _told(_paragraphs(command.help))
    for one in command.params:
        told = one.help if one.default in PLAIN else f"{one.help} (default {one.default})"
        yield from (".TP", f".B {_plain(_named(one))}", _plain(told))
    for name_ in inner:
        yield from _command(command, name_, path)


def _named(one: Any) -> str:
    """An argument or option as it is written."""
    word = one.metavar or one.name.rstrip("_").upper()
    if one.param_type_name == "argument":
        return word if one.required else f"[{word}]"
    names = ", ".join(sorted([*one.opts, *one.secondary_opts], key=len))
    return names if one.is_flag else f"{names} {word}"


def _paragraphs(text: str) -> list[list[str]]:
    return [paragraph.split("\n") for paragraph in inspect.cleandoc(text).split("\n\n")]


def _told(paragraphs: list[list[str]]) -> Iterator[str]:
    for lines in paragraphs:
        yield ".PP"
        if lines[0] == VERBATIM:
            yield from (".nf", *map(_plain, lines[1:]), ".fi")
        else:
            yield from map(_plain, lines)


def _plain(line: str) -> str:
    """A line in which nothing is an order to the printer."""
    told = line.replace("\\", r"\e").replace("-", r"\-").replace("'", r"\(aq")
    return rf"\&{told}" if told.startswith((".", "\\(aq", " ")) else told


def _variables(program: Any) -> Iterator[str]:
    """The variables that set an option of several commands."""
    named = {
        one.envvar: max(one.opts, key=len)
        for command in program.commands.values()
        for one in command.params
        if isinstance(getattr(one, "envvar", None), str)
    }
    for name, option in sorted(named.items()):
        yield from (".TP", f".B {name}", f"sets {_plain(option)}")
    yield from (".TP", ".B DMPLAY_PLAY_SEED", "and its like set an option of one command")
    yield from (".TP", ".B NO_COLOR", "no colour, whatever the terminal can")
    yield from (".TP", ".B ACCESSIBLE", "lines, not the full screen")


if __name__ == "__main__":
    print(page(), end="")

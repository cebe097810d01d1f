"""What the words of the command line come to, done: a game is played, a report told."""

import sys
from collections.abc import Sequence
from typing import Any

import typer

from dmplay.cli import config
from dmplay.cli.app import app
from dmplay.cli.sentence import USAGE, sentence
from dmplay.errors import BadParameter
from dmplay.game.errand import Conversation, Errand, Sitting, Told
from dmplay.game.table import Table
from dmplay.terminal import here
from dmplay.words.commands import is_command


def do(errand: Errand | Conversation) -> int:
    """Plays a game that is wanted, or tells a report; the exit code."""
    if isinstance(errand, Told):
        return _tell(errand)
    from dmplay import front  # the front ends are of no use to a report

    if isinstance(errand, Sitting):
        return front.sit(_table(), errand)
    return front.converse(_table(), errand)


def _tell(report: Told) -> int:
    if report.errors:
        print(report.errors, file=sys.stderr)
    if isinstance(report.text, str):
        told = report.text
    else:
        from dmplay.reports.drawing import shown

        told = shown(report.text, here(report.wishes))
    if report.paged:
        from dmplay.reports.pager import page

        page(told, here(report.wishes))
    elif told:
        print(told)
    return report.code


def _table() -> Table:
    """A table with what the command line and files add to it."""
    for name in config.aliases():
        if is_command(name):
            raise BadParameter(f"aliases.{name}: {name} is a command; give another name")
    return Table(program=understood, aliases=config.aliases())


def understood(words: Sequence[str]) -> Errand:
    """What the command line makes of these words: an errand, or the help of a command."""
    commands: Any = typer.main.get_command(app)
    name, *rest = words
    if {"-h", "--help"} & {*rest}:
        command = commands.commands[name]
        root = typer.Context(commands, info_name="dmplay")
        return Told(command.get_help(typer.Context(command, info_name=name, parent=root)))
    try:
        errand: Errand = commands([*words], standalone_mode=False, prog_name="dmplay")
    except USAGE as error:
        raise BadParameter(sentence(error)) from None
    return errand

"""What the words of the command line come to, done: a game is played, a report printed."""

import sys
from collections.abc import Sequence

import typer

from dmplay import records
from dmplay.cli import config
from dmplay.cli.app import root
from dmplay.cli.sentence import USAGE, sentence
from dmplay.errors import BadParameter
from dmplay.game.errand import Errand, Hosting, Printout, Service, Sitting
from dmplay.game.table import Table
from dmplay.terminal import Terminal, clean, here
from dmplay.words.commands import is_command


def do(errand: Errand) -> int:
    """Plays a game that is wanted, or prints a report; the exit code."""
    match errand:
        case str():
            return _print(Printout(errand))
        case Printout():
            return _print(errand)
        case Service():
            from dmplay.cli.service import speaks

            return speaks(*errand)
        case Hosting():
            from dmplay.cli.service import host

            return host(errand)
    from dmplay import front  # the front ends are of no use to a report

    if isinstance(errand, Sitting):
        return front.sit(_table(), errand)
    return front.converse(_table(), errand)


def _print(report: Printout) -> int:
    if report.errors:
        print(clean(report.errors), file=sys.stderr)
    terminal = here(report.wishes)
    text = _shown(report, terminal)
    if report.paged:
        from dmplay.reports.pager import page

        page(text, terminal, words=isinstance(report.text, str))
    elif text:
        print(text)
    end = "\n"
    for part in report.parts:
        sys.stdout.write(clean(part))
        end = part[-1:] or end
    print(end="" if end == "\n" else "\n")
    return report.code


def _shown(report: Printout, terminal: Terminal) -> str:
    if isinstance(report.text, str):
        return clean(report.text)
    from dmplay.reports.drawing import shown

    return shown(report.text, terminal)


def _table() -> Table:
    """A table with what the command line and files add to it."""
    for name in config.aliases():
        if is_command(name):
            raise BadParameter(f"aliases.{name}: {name} is a command; give another name")
    return Table(program=understood, aliases=config.aliases(), ends=records.noted)


def understood(words: Sequence[str]) -> Sitting | str:
    """What the command line makes of these words: a game, or text without colour."""
    commands = root()
    name, *rest = words
    if {"-h", "--help"} & {*rest}:
        command = commands.commands[name]
        above = typer.Context(commands, info_name="dmplay")
        return str(command.get_help(typer.Context(command, info_name=name, parent=above)))
    try:
        errand: Sitting | Printout | str = commands(
            [*words], standalone_mode=False, prog_name="dmplay"
        )
    except USAGE as error:
        raise BadParameter(sentence(error)) from None
    if isinstance(errand, Printout):
        if errand.parts:
            return clean("".join(errand.parts)).removesuffix("\n")
        return _shown(errand, here(errand.wishes)._replace(color=False)).rstrip("\n")
    return errand

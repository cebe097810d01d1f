"""The command line as a process: its words, exit codes, and answers to a shell that completes."""

import contextlib
import io
import os
import sys
from typing import cast

import typer

from dmplay.cli.app import root
from dmplay.cli.group import rejoined
from dmplay.cli.sentence import USAGE, sentence
from dmplay.errors import DmplayError
from dmplay.finding.typed import whole

COMPLETING = "_DMPLAY_COMPLETE"  # set by a shell that asks what can follow
NAMED = "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION"  # has typer take a shell by its name
SCRIPTS = ("--install-completion", "--show-completion")
OPEN = {"=": "VALUE", ":": "VALUE", "/": "..."}  # endings after which a word goes on
USAGE_CODE, REFUSED_CODE = 2, 1  # what was said is wrong, or the system cannot do it
UNREAD = 1  # typer's code where nobody reads the help


def run() -> int:
    """Runs the command line; errors become one line and an exit code."""
    for size in ("LINES", "COLUMNS"):  # which libraries read too, and trust
        if not whole(os.environ.get(size, "")):
            os.environ.pop(size, None)
    if COMPLETING in os.environ:
        return _complete()
    alone = len(sys.argv) == 1
    if alone:
        if not _spoken_to():
            return _no_words()
        sys.argv.append("shell")
    if sys.argv[1] in SCRIPTS and len(sys.argv) > 2:
        os.environ[NAMED] = "1"
        root.cache_clear()  # it is read when the commands are made
    try:
        return _done(alone=alone)
    except (DmplayError, USAGE) as error:
        from dmplay.terminal import clean

        print(f"error: {clean(sentence(error))}", file=sys.stderr)
        return REFUSED_CODE if isinstance(error, OSError) else USAGE_CODE
    except typer.Abort:  # Ctrl-C
        raise KeyboardInterrupt from None
    except Exception as error:  # of code that is not ours: a problem or an agent that was brought
        from dmplay.places import blamed
        from dmplay.terminal import clean

        told = "" if os.environ.get("DMPLAY_DEBUG") else blamed(error)
        if not told:
            raise
        print(f"error: {clean(told)}; --debug shows all", file=sys.stderr)
        return USAGE_CODE


def _done(*, alone: bool) -> int:
    """Does what the words say, and without any shows the gallery; the exit code."""
    try:
        errand = root()(standalone_mode=False, prog_name="dmplay")
    except SystemExit as left:
        if left.code != UNREAD:
            raise  # a signal's
        raise BrokenPipeError from None
    if isinstance(errand, int):  # of help
        return errand
    from dmplay.cli.errands import do

    return do(errand._replace(gallery=True) if alone else errand)


def _complete() -> int:
    """Answers a shell that asks what can follow."""
    kept, bash = "", os.environ[COMPLETING] == "complete_bash"
    if bash:
        words = os.environ.get("COMP_WORDS", "").replace(" ", "\n").split("\n")
        joined, at, kept = rejoined(words, whole(os.environ.get("COMP_CWORD", "")) or 0)
        os.environ |= {"COMP_WORDS": "\n".join(joined), "COMP_CWORD": str(at)}
    with contextlib.redirect_stdout(io.StringIO()) as found, contextlib.suppress(SystemExit):
        root()(prog_name="dmplay")
    lines = [line.removeprefix(kept) for line in found.getvalue().split("\n") if line]
    print(*(_for_bash(lines) if bash else lines), sep="\n")
    return 0


def _for_bash(lines: list[str]) -> list[str]:
    """What bash puts in as it stands: blanks escaped, and no blank after a word that goes on.

    It ends a word with a blank unless there are two that begin alike.
    """
    lines = [line.replace(" ", "\\ ") for line in lines]
    if len(lines) == 1 and lines[0][-1:] in OPEN:
        lines.append(lines[0] + OPEN[lines[0][-1]])
    return lines


def _spoken_to() -> bool:
    """Whether somebody types, or a script waits on the standard input."""
    if sys.stdin.isatty():
        return sys.stdout.isatty()
    return bool(cast(io.BufferedReader, sys.stdin.buffer).peek(1))


def _no_words() -> int:
    """Help, as an error."""
    sys.argv.append("--help")
    with contextlib.redirect_stdout(sys.stderr):
        root()(standalone_mode=False, prog_name="dmplay")
    return USAGE_CODE

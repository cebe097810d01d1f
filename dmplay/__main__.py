"""The way in: answers --version at once, everything else through the command line."""

import gc
import io
import os
import signal
import sys
from types import TracebackType

from dmplay.signals import WHOLE

RUNTIME_CODE, USAGE_CODE, GONE_CODE, INTERRUPT_CODE, PIPE_CODE = 1, 2, 129, 130, 141
ALONE = "OPENBLAS_DEFAULT_NUM_THREADS"  # of which more wait for one another, and cost as they wait
SELDOM = 20_000, 20, 20  # a game keeps what it makes: to look for garbage finds none


def main() -> None:
    """Runs dmplay; the exit code is 0, 1, 2, 3, or 128 and a signal."""
    try:
        signal.signal(signal.SIGINT, WHOLE)
        code = _ran()
        WHOLE.settle()
    except KeyboardInterrupt:
        code = INTERRUPT_CODE
    try:
        _let_go()
    except KeyboardInterrupt:
        code = INTERRUPT_CODE
    sys.exit(code)


def _ran() -> int:
    """Runs dmplay, and says in one line what the system refuses; the exit code."""
    try:
        _open_streams()
        gc.set_threshold(*SELDOM)
        os.environ.setdefault(ALONE, "1")
        code = _run()
        sys.stdout.flush()
    except BrokenPipeError:
        return PIPE_CODE
    except OSError as error:
        return _refused(error)
    except SystemExit as error:
        return _left(error)
    return code


def _run() -> int:
    """Answers for the version, or leaves the rest to the command line; the exit code."""
    if sys.argv[1:2] == ["--version"]:
        from dmplay import __version__

        print(f"dmplay {__version__}")
        return 0
    if "--debug" in sys.argv:
        sys.argv.remove("--debug")
        os.environ["DMPLAY_DEBUG"] = "1"
    if not os.environ.get("DMPLAY_DEBUG"):
        sys.excepthook = _unexpected
    from dmplay.cli.entry import run

    return run()


def _refused(error: OSError) -> int:
    """One line for what the system refuses; if nobody can read it, the terminal is gone."""
    from dmplay.terminal import clean

    where = f"{error.filename}: " if error.filename else ""
    try:
        print(clean(f"error: {where}{error.strerror or error}"), file=sys.stderr)
    except OSError:
        return GONE_CODE
    return RUNTIME_CODE


def _left(error: SystemExit) -> int:
    """One line where a problem or an agent that was brought ends the program; else it ends."""
    from dmplay.places import left
    from dmplay.terminal import clean

    told = left(error)
    if not told:
        raise error
    print(clean(f"error: {told}; only dmplay may end the program"), file=sys.stderr)
    return USAGE_CODE


def _open_streams() -> None:
    """Puts the null device where a stream is closed, so that no file takes its number."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115 - for good
    for stream in (sys.stdin, sys.stdout):  # what is no text, or cannot be shown, is an escape
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _let_go() -> None:
    """What a stream cannot take must not be tried again at exit."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _unexpected(
    kind: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """One line for a fault of dmplay itself, and the file that tells the rest."""
    import contextlib
    import tempfile
    import traceback

    told = "".join(traceback.format_exception(kind, error, trace))
    where = "no log can be written"
    with (
        contextlib.suppress(OSError),
        tempfile.NamedTemporaryFile(
            "w", prefix="dmplay-", suffix=".log", delete=False, encoding="utf-8"
        ) as log,
    ):
        log.write(told)
        log.flush()
        where = f"{log.name} tells where"
    print(f"error: unexpected {kind.__name__}; {where}, --debug shows it", file=sys.stderr)


if __name__ == "__main__":
    main()

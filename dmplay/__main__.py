"""The way in: answers --version at once, everything else through the command line."""

import gc
import io
import os
import signal
import sys
from types import TracebackType

from dmplay.signals import TURN_GATE

RUNTIME_CODE, USAGE_CODE, TERMINAL_LOST_CODE, INTERRUPT_CODE, PIPE_CODE = 1, 2, 129, 130, 141
BLAS_THREADS_VARIABLE = (
    "OPENBLAS_DEFAULT_NUM_THREADS"  # of which more wait for one another, and cost as they wait
)
GC_THRESHOLDS = 20_000, 20, 20  # a game keeps what it makes: to look for garbage finds none


def main() -> None:
    """Runs dmplay; the exit code is 0, 1, 2, 3, or 128 and a signal."""
    try:
        signal.signal(signal.SIGINT, TURN_GATE)
        code = _run_and_report()
        TURN_GATE.raise_postponed()
    except KeyboardInterrupt:
        code = INTERRUPT_CODE
    try:
        _flush_or_discard_output()
    except KeyboardInterrupt:
        code = INTERRUPT_CODE
    sys.exit(code)


def _run_and_report() -> int:
    """Runs dmplay, and says in one line what the system refuses; the exit code."""
    try:
        _open_streams()
        gc.set_threshold(*GC_THRESHOLDS)
        os.environ.setdefault(BLAS_THREADS_VARIABLE, "1")
        code = _dispatch()
        sys.stdout.flush()
    except BrokenPipeError:
        return PIPE_CODE
    except OSError as error:
        return _report_os_error(error)
    except SystemExit as error:
        return _report_system_exit(error)
    return code


def _dispatch() -> int:
    """Answers for the version, or leaves the rest to the command line; the exit code."""
    if sys.argv[1:2] == ["--version"]:
        from dmplay import __version__

        print(f"dmplay {__version__}")
        return 0
    if "--debug" in sys.argv:
        sys.argv.remove("--debug")
        os.environ["DMPLAY_DEBUG"] = "1"
    if not os.environ.get("DMPLAY_DEBUG"):
        sys.excepthook = _report_unexpected_error
    from dmplay.cli.entry import run_command_line

    return run_command_line()


def _report_os_error(error: OSError) -> int:
    """One line for what the system refuses; if nobody can read it, the terminal is gone."""
    from dmplay.terminal import escape_unprintable

    where = f"{error.filename}: " if error.filename else ""
    try:
        print(escape_unprintable(f"error: {where}{error.strerror or error}"), file=sys.stderr)
    except OSError:
        return TERMINAL_LOST_CODE
    return RUNTIME_CODE


def _report_system_exit(error: SystemExit) -> int:
    """One line where a problem or an agent that was brought ends the program; else it ends."""
    from dmplay.places import describe_exit_location
    from dmplay.terminal import escape_unprintable

    told = describe_exit_location(error)
    if not told:
        raise error
    print(escape_unprintable(f"error: {told}; only dmplay may end the program"), file=sys.stderr)
    return USAGE_CODE


def _open_streams() -> None:
    """Puts the null device where a stream is closed, so that no file takes its number."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115 - for good
    for stream in (sys.stdin, sys.stdout):  # what is no text, or cannot be shown, is an escape
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _flush_or_discard_output() -> None:
    """What a stream cannot take must not be tried again at exit."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _report_unexpected_error(
    error_type: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """One line for a fault of dmplay itself, and the file that tells the rest."""
    import contextlib
    import tempfile
    import traceback

    told = "".join(traceback.format_exception(error_type, error, trace))
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
    print(f"error: unexpected {error_type.__name__}; {where}, --debug shows it", file=sys.stderr)


if __name__ == "__main__":
    main()

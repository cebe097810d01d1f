"""The program's entry point: prints the version at once, else runs the command line."""

import contextlib
import errno
import gc
import io
import os
import signal
import sys
from types import FrameType, TracebackType

from dmplay.terminal.output_streams import open_output_streams

RUNTIME_CODE, USAGE_CODE, TERMINAL_LOST_CODE, INTERRUPT_CODE, PIPE_CODE = 1, 2, 129, 130, 141
# OpenBLAS threads that wait for one another cost more time than they save
BLAS_THREADS_VARIABLE = "OPENBLAS_DEFAULT_NUM_THREADS"
THREAD_SECONDS = 1.0  # seconds that threads have to end after the program is done
# A game keeps most objects that it creates, so frequent collections find no garbage.
GC_THRESHOLDS = 20_000, 20, 20


def main() -> None:
    """Run dmplay and exit with code 0, 1, 2, 3, or 128 plus a signal number."""
    try:
        signal.signal(signal.SIGINT, _interrupt)  # a parent may have ignored it
        sys.unraisablehook = _repeat_ignored_interrupt
        code = _run_and_report()
    except KeyboardInterrupt:
        code = INTERRUPT_CODE
    try:
        code = _flush_or_discard_output(code)
        _exit_despite_threads(code)
    except KeyboardInterrupt:
        code = INTERRUPT_CODE
    if not sys.flags.inspect:  # With `python -i`, a session follows.
        sys.exit(code)


def _interrupt(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, later if NumPy is being imported, whose compiled code drops it."""
    while frame:
        is_module = frame.f_code.co_name == "<module>"
        if is_module and frame.f_globals["__name__"].partition(".")[0] == "numpy":
            _interrupt_soon()
            return
        frame = frame.f_back
    raise KeyboardInterrupt


def _interrupt_soon() -> None:
    """Interrupt the program again after a moment."""
    import _thread
    import threading

    try:
        threading.Timer(0.05, _thread.interrupt_main).start()
    except KeyboardInterrupt:  # on a busy machine it comes while the timer is started
        _interrupt_soon()


def _repeat_ignored_interrupt(unraisable: "sys.UnraisableHookArgs") -> None:
    """Interrupt again if Python ignored Ctrl-C, as it does in a callback of an import."""
    if unraisable.exc_type is KeyboardInterrupt:
        _interrupt_soon()
    else:
        sys.__unraisablehook__(unraisable)


def _run_and_report() -> int:
    """Run dmplay, report an error of the system in one line, and return the exit code."""
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
    """Print the version, or hand the arguments to the command line; return the exit code.

    The option `--debug` is removed from the arguments and sets DMPLAY_DEBUG; without either, an
    unexpected error is written to a log file.
    """
    if sys.argv[1:2] == ["--version"]:
        from dmplay import __version__

        print(f"dmplay {__version__}")
        return 0
    if not os.path.isdir(os.path.dirname(__file__)):
        print(
            "error: dmplay cannot run from a zip archive; install it, or unpack the archive",
            file=sys.stderr,
        )
        return USAGE_CODE
    if "--debug" in sys.argv:
        sys.argv.remove("--debug")
        os.environ["DMPLAY_DEBUG"] = "1"
    if not (os.environ.get("DMPLAY_DEBUG") or sys.flags.inspect):
        sys.excepthook = _report_unexpected_error
    from dmplay.cli.main import run_command_line

    return run_command_line()


def _report_os_error(error: OSError) -> int:
    """Print an error of the system in one line, clipped if it is long; return the exit code.

    The code is USAGE_CODE if a file name is too long, which only its writer can change, and
    TERMINAL_LOST_CODE if the terminal is gone.
    """
    from dmplay.core.text import escape_unprintable
    from dmplay.errors import clip_message

    file_prefix = f"{error.filename}: " if error.filename else ""
    is_closed = error.errno == errno.EBADF and not file_prefix
    reason = "standard output is closed" if is_closed else error.strerror or error
    message = clip_message(f"{file_prefix}{reason}")
    try:
        print(f"error: {escape_unprintable(message)}", file=sys.stderr)
    except OSError:
        return TERMINAL_LOST_CODE
    return USAGE_CODE if error.errno == errno.ENAMETOOLONG else RUNTIME_CODE


def _report_system_exit(error: SystemExit) -> int:
    """Report a SystemExit raised by user-defined code and return the usage error code.

    If dmplay raised it, for a signal, return its code.
    """
    from dmplay.core.text import escape_unprintable
    from dmplay.core.user_code_locations import describe_user_exit

    message = describe_user_exit(error)
    if not message and isinstance(error.code, int):
        return error.code
    if not message:
        raise error
    print(escape_unprintable(f"error: {message}"), file=sys.stderr)
    return USAGE_CODE


def _open_streams() -> None:
    """Replace unusable standard streams by the null device and escape undecodable characters.

    Without the null device, the next file that is opened would get the number of a closed stream.
    Output to a closed stream fails, and errors are dropped. `nohup` opens the standard input so
    that it cannot be read.
    """
    for name, mode, flags in (
        ("stdin", "r", os.O_RDONLY), ("stdout", "w", os.O_RDONLY), ("stderr", "w", os.O_WRONLY)
    ):  # fmt: skip
        if getattr(sys, name) is None:
            device = os.open(os.devnull, flags)
            stream = open(device, mode, encoding="utf-8", closefd=False)  # noqa: SIM115 - for good
            setattr(sys, name, stream)
    with contextlib.suppress(ImportError, OSError, ValueError):  # on Windows; not a file
        import fcntl

        descriptor = sys.stdin.fileno()
        if fcntl.fcntl(descriptor, fcntl.F_GETFL) & os.O_WRONLY:
            os.dup2(os.open(os.devnull, os.O_RDONLY), descriptor)
    # Bytes that are not text, and characters that the terminal cannot encode, become escapes.
    for stream in (sys.stdin, sys.stdout):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    open_output_streams()


def _flush_or_discard_output(code: int) -> int:
    """Flush the output streams, and discard their output if they cannot be written.

    Otherwise Python would try to flush the same stream again at exit. Return the exit code, which
    is not 0 if output was lost.
    """
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError as error:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
            code = code or (PIPE_CODE if isinstance(error, BrokenPipeError) else RUNTIME_CODE)
    return code


def _exit_despite_threads(code: int) -> None:
    """Exit if threads of user-defined code still run, for which Python would wait forever.

    They have THREAD_SECONDS to end by themselves.
    """
    if "threading" not in sys.modules:
        return
    import atexit
    import threading
    import time

    end_time = time.monotonic() + THREAD_SECONDS
    running = [thread for thread in threading.enumerate() if not thread.daemon]
    running.remove(threading.main_thread())
    for thread in running:
        thread.join(max(0.0, end_time - time.monotonic()))
    names = [thread.name for thread in running if thread.is_alive()]
    if names:
        print(
            f"exited while threads of user code were still running: {', '.join(names)}",
            file=sys.stderr,
        )
        atexit._run_exitfuncs()
        os._exit(_flush_or_discard_output(code))


def _report_unexpected_error(
    error_type: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """Report an unexpected error in one line and write its traceback to a temporary log file."""
    import contextlib
    import tempfile
    import traceback

    traceback_text = "".join(traceback.format_exception(error_type, error, trace))
    log_note = "the traceback could not be saved"
    with (
        contextlib.suppress(OSError),
        tempfile.NamedTemporaryFile(
            "w", prefix="dmplay-", suffix=".log", delete=False, encoding="utf-8"
        ) as log,
    ):
        log.write(traceback_text)
        log.flush()
        log_note = f"the traceback is in {log.name}"
    print(
        f"error: unexpected {error_type.__name__}; {log_note}; --debug prints it", file=sys.stderr
    )


if __name__ == "__main__":
    main()

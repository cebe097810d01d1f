"""Start the program in a process that is forked from one which has already loaded the program.

This saves most of the start. The process reads and writes files, or a pseudo-terminal.
"""

import fcntl
import multiprocessing
import os
import signal
import sys
import termios
from collections.abc import Callable, Mapping, Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path
from threading import Lock

from dmplay.__main__ import main
from dmplay.cli.commands import COMMANDS, build_command

PROGRAM_TIMEOUT_SECONDS = 60.0  # timeout of a program that does not exit
PRELOADED_MODULES = (
    "dmplay.cli.main", "dmplay.game.playback", "dmplay.agents.search",
    "dmplay.ui.shell.interactive_shell", "dmplay.ui.gallery.gallery",
    "dmplay.ui.screen.play_screen", "importlib.metadata", "numpy.ma", "numpy.random",
)  # fmt: skip
for name in COMMANDS:  # before the server forks
    build_command(name)
FORK_SERVER = multiprocessing.get_context("forkserver")
FORK_SERVER.set_forkserver_preload(["__main__", __name__, *PRELOADED_MODULES])
PROCESS_LOCK = Lock()  # starting a process also polls all others, which is not thread-safe
ProgramWrapper = Callable[[Callable[[], None]], None]
ProgramProcess = multiprocessing.context.ForkServerProcess


def restore_signal_handlers() -> None:
    """Restore the handlers of signals that a parent process may have ignored, for example nohup."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)


def run_unwrapped(program: Callable[[], None]) -> None:
    """Run a program directly."""
    program()


def start_with_files(
    words: Sequence[str],
    folder: Path,
    environment: Mapping[str, str],
    streams: Sequence[Path],
    around: ProgramWrapper = run_unwrapped,
) -> ProgramProcess:
    """Start the program with these files as its streams, called through `around`."""
    return _start_process(_run_with_files, words, folder, environment, streams, around)


def start_in_terminal(
    words: Sequence[str], folder: Path, environment: Mapping[str, str], terminal_name: str
) -> ProgramProcess:
    """Start the program in a terminal, which is the device of this name."""
    reader, writer = FORK_SERVER.Pipe(duplex=False)
    with reader, writer:
        arguments = words, folder, environment, terminal_name, writer
        program = _start_process(_run_in_terminal, *arguments)
        reader.recv()  # it has opened the terminal
    return program


def ends_within(program: ProgramProcess, seconds: float) -> bool:
    """Return whether a program ends within this time; leave its exit code for `wait_for_exit`."""
    return bool(wait([program.sentinel], seconds))


def wait_for_exit(program: ProgramProcess) -> int:
    """Wait for a program to end; return its exit code, or a signal as a negative number."""
    ends_within(program, PROGRAM_TIMEOUT_SECONDS)
    with PROCESS_LOCK:
        program.join(0)
        program.kill()
        program.join()
        assert program.exitcode is not None
        return program.exitcode


def _start_process(target: Callable[..., None], *arguments: object) -> ProgramProcess:
    program = FORK_SERVER.Process(target=target, args=arguments)
    with PROCESS_LOCK:
        program.start()
    return program


def _run_with_files(
    words: Sequence[str],
    folder: Path,
    environment: Mapping[str, str],
    streams: Sequence[Path],
    around: ProgramWrapper,
) -> None:
    """Run the program in this process, with these files as its standard streams."""
    os.chdir(folder)
    files = [os.open(path, os.O_RDWR | os.O_CREAT) for path in streams]
    _run_program(words, environment, files, around)


def _run_in_terminal(
    words: Sequence[str],
    folder: Path,
    environment: Mapping[str, str],
    terminal_name: str,
    opened: Connection,
) -> None:
    """Run the program in this process, which becomes the leader of a session in a terminal."""
    os.setsid()
    os.chdir(folder)
    terminal = os.open(terminal_name, os.O_RDWR)
    fcntl.ioctl(terminal, termios.TIOCSCTTY, 0)
    with opened:
        opened.send(None)
    _run_program(words, environment, [terminal] * 3, run_unwrapped)


def _run_program(
    words: Sequence[str],
    environment: Mapping[str, str],
    files: Sequence[int],
    around: ProgramWrapper,
) -> None:
    """Run the program with this environment and these open files as its standard streams."""
    restore_signal_handlers()
    os.environ.clear()
    os.environ.update(environment)
    for number, file in enumerate(files):
        os.dup2(file, number)
    for file in {*files} - {0, 1, 2}:
        os.close(file)
    encoding = os.environ.get("PYTHONIOENCODING")
    sys.stdin, sys.stdout, sys.stderr = (
        open(number, mode, encoding=encoding, closefd=False)  # noqa: SIM115 - as Python opens them
        for number, mode in enumerate("rww")
    )
    sys.argv = ["dmplay", *words]
    try:
        around(main)
    except Exception as error:
        sys.excepthook(type(error), error, error.__traceback__)
        sys.exit(1)

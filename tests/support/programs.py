"""The program in a process of its own, without a terminal.

The process begins as a copy of one that has loaded the program, which is most of a start's work.
"""

import ctypes
import multiprocessing
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from multiprocessing.connection import wait
from pathlib import Path
from subprocess import CompletedProcess
from threading import Lock

from dmplay.__main__ import main
from dmplay.cli.app import root_command
from tests.support.terminals import DMPLAY, clean_environment, mind_signals

NOTHING: Mapping[str, str] = {}
NOBODY = 4242  # a user without a name
PATIENCE = 60.0  # seconds until a program that does not end is a failure
LOADED = (
    "dmplay.cli.entry", "dmplay.game.playback", "dmplay.policies.search", "dmplay.prompt",
    "dmplay.screen.screen", "importlib.metadata", "numpy.ma", "numpy.random",
)  # fmt: skip
root_command()  # is made before there are copies
COPIES = multiprocessing.get_context("forkserver")
COPIES.set_forkserver_preload(["__main__", __name__, *LOADED])
ALONE = Lock()  # whoever starts a program asks how all have ended, which one may ask at a time
Around = Callable[[Callable[[], None]], None]
Program = multiprocessing.context.ForkServerProcess


def alone(program: Callable[[], None]) -> None:
    """Runs a program with nothing around it."""
    program()


def run(folder: Path, *words: str, stdin: str | None = "", **env: str) -> CompletedProcess[str]:
    """Runs dmplay in a folder with its own state; None is the null device."""
    return _run(words, folder, stdin, clean_environment(folder, **env))


def within(
    around: Around, folder: Path, *words: str, stdin: str | None = ""
) -> CompletedProcess[str]:
    """The same, with this around the program."""
    return _run(words, folder, stdin, clean_environment(folder), around)


def homeless(*words: str, stdin: str = "") -> CompletedProcess[str]:
    """Runs dmplay as a user without a name or a home."""
    world = clean_environment(Path("/"), HOME="", XDG_STATE_HOME="")
    return _run(words, Path("/"), stdin, world, _nameless)


def unprivileged(program: Callable[[], None]) -> None:
    """Runs a program that permissions bind, whoever runs the tests."""
    give_up_privileges()
    program()


def give_up_privileges() -> None:
    """Leaves this process what its user may do, and root no more than others."""
    version, nothing = 0x20080522, (ctypes.c_uint32 * 6)()
    header = (ctypes.c_uint32 * 2)(version, 0)
    assert ctypes.CDLL(None).capset(header, nothing) == 0


@dataclass(frozen=True)
class Small:
    """Runs a program on a disk that holds files of so many bytes."""

    size: int

    def __call__(self, program: Callable[[], None]) -> None:
        sys.dont_write_bytecode = True  # which would be cut, and read ever after
        resource.setrlimit(resource.RLIMIT_FSIZE, (self.size, self.size))
        program()


def _nameless(program: Callable[[], None]) -> None:
    os.setreuid(NOBODY, -1)  # what it may read stays
    program()


def _run(
    words: Sequence[str],
    folder: Path,
    stdin: str | None,
    world: Mapping[str, str],
    around: Around = alone,
) -> CompletedProcess[str]:
    with tempfile.TemporaryDirectory() as place:
        streams = [Path(place, name) for name in ("stdin", "stdout", "stderr")]
        streams[0].write_text(stdin or "", encoding="utf-8", errors="surrogateescape")
        if stdin is None:
            streams[0] = Path(os.devnull)
        code = ended(_started(words, folder, world, streams, around))
        return CompletedProcess(words, code, *(each.read_text() for each in streams[1:]))


def started(
    folder: Path,
    *words: str,
    streams: Sequence[Path] = (Path(os.devnull),) * 3,
    around: Around = alone,
    **env: str,
) -> Program:
    """Starts dmplay in a folder with its own state, between these files."""
    return _started(words, folder, clean_environment(folder, **env), streams, around)


def _started(*what: object) -> Program:
    program = COPIES.Process(target=_play, args=what)
    with ALONE:
        program.start()
    return program


def over(program: Program, seconds: float) -> bool:
    """Whether a program ends within so many seconds; nobody learns how, as others may ask too."""
    return bool(wait([program.sentinel], seconds))


def ended(program: Program) -> int:
    """Waits for the end: the exit code, or a signal as a negative number."""
    over(program, PATIENCE)
    with ALONE:
        program.join(0)
        program.kill()
        program.join()
        assert program.exitcode is not None
        return program.exitcode


def fresh(
    *words: str,
    folder: Path,
    typed: str = "",
    disk: int | None = None,
    env: Mapping[str, str] = NOTHING,
) -> CompletedProcess[str]:
    """The program from its very start: in another language, or where a disk is small."""

    world = clean_environment(folder, **env)
    if disk is not None:
        world["PYTHONDONTWRITEBYTECODE"] = "1"  # it would be cut, and read ever after

    def small() -> None:
        if disk is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (disk, disk))

    return subprocess.run(
        [*DMPLAY, *words],
        input=typed,
        capture_output=True,
        text=True,
        env=world,
        cwd=folder,
        timeout=PATIENCE,
        check=False,
        preexec_fn=small,
    )


def shell(line: str, folder: Path) -> CompletedProcess[str]:
    """A line of bash in which `dmplay` is the program."""
    quoted = f'dmplay() {{ "{sys.executable}" -m dmplay "$@"; }}; {line}'
    return subprocess.run(
        ["bash", "-c", quoted],
        capture_output=True,
        text=True,
        env=clean_environment(folder),
        cwd=folder,
        timeout=PATIENCE,
        check=False,
    )


def _play(
    words: Sequence[str],
    folder: Path,
    world: Mapping[str, str],
    streams: Sequence[Path],
    around: Around,
) -> None:
    """Is the program, in this folder and environment, between these streams."""
    mind_signals()
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(world)
    for number, path in enumerate(streams):
        os.dup2(os.open(path, os.O_RDWR | os.O_CREAT), number)
    encoding = os.environ.get("PYTHONIOENCODING")
    sys.stdin, sys.stdout, sys.stderr = (
        os.fdopen(number, mode, encoding=encoding) for number, mode in enumerate("rww")
    )
    sys.argv = ["dmplay", *words]
    try:
        around(main)
    except Exception as error:
        sys.excepthook(type(error), error, error.__traceback__)
        sys.exit(1)


def loaded(code: str, never: set[str], env: Mapping[str, str] = NOTHING) -> set[str]:
    """Which of these modules a fresh interpreter has loaded that has run some code."""
    told = f"\nimport sys\nprint(*sorted({never!r} & set(sys.modules)))"
    words, world = [sys.executable, "-c", code + told], os.environ | env
    done = subprocess.run(words, capture_output=True, text=True, check=True, env=world)
    return {*done.stdout.splitlines()[-1].split()}

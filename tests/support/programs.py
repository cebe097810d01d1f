"""Run the program in a separate process, without a terminal."""

import ctypes
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from subprocess import CompletedProcess

from tests.support.fork_server import (
    PROGRAM_TIMEOUT_SECONDS,
    ProgramProcess,
    ProgramWrapper,
    run_unwrapped,
    start_with_files,
    wait_for_exit,
)
from tests.support.terminals import DMPLAY_COMMAND, clean_environment

NO_VARIABLES: Mapping[str, str] = {}
UNNAMED_USER_ID = 4242  # id of a user without an account


def run_dmplay(
    folder: Path, *words: str, stdin: str | None = "", **env: str
) -> CompletedProcess[str]:
    """Run dmplay in a folder that also holds its state; a `stdin` of None is the null device."""
    return _run_in_process(words, folder, stdin, clean_environment(folder, **env))


def run_wrapped(
    around: ProgramWrapper, folder: Path, *words: str, stdin: str | None = ""
) -> CompletedProcess[str]:
    """Run dmplay in a folder, with the program called through `around`."""
    return _run_in_process(words, folder, stdin, clean_environment(folder), around)


def run_without_home(*words: str, stdin: str = "") -> CompletedProcess[str]:
    """Run dmplay as a user without a name or a home folder."""
    environment = clean_environment(Path("/"), HOME="", XDG_STATE_HOME="")
    return _run_in_process(words, Path("/"), stdin, environment, _run_as_unnamed_user)


def run_unprivileged(program: Callable[[], None]) -> None:
    """Run a program with file permissions enforced, even when root runs the tests."""
    give_up_privileges()
    program()


def give_up_privileges() -> None:
    """Drop all capabilities of this process, so that root has no more rights than other users."""
    version, nothing = 0x20080522, (ctypes.c_uint32 * 6)()
    header = (ctypes.c_uint32 * 2)(version, 0)
    assert ctypes.CDLL(None).capset(header, nothing) == 0


@dataclass(frozen=True)
class SmallDisk:
    """A wrapper that runs a program with a limit on the size of its files, in bytes."""

    size: int

    def __call__(self, program: Callable[[], None]) -> None:
        # bytecode files would be truncated, and later runs would read them
        sys.dont_write_bytecode = True
        resource.setrlimit(resource.RLIMIT_FSIZE, (self.size, self.size))
        program()


def _run_as_unnamed_user(program: Callable[[], None]) -> None:
    os.setreuid(UNNAMED_USER_ID, -1)  # the effective user keeps its read permissions
    program()


def _run_in_process(
    words: Sequence[str],
    folder: Path,
    stdin: str | None,
    environment: Mapping[str, str],
    around: ProgramWrapper = run_unwrapped,
) -> CompletedProcess[str]:
    with tempfile.TemporaryDirectory() as temporary:
        streams = [Path(temporary, name) for name in ("stdin", "stdout", "stderr")]
        streams[0].write_text(stdin or "", encoding="utf-8", errors="surrogateescape")
        if stdin is None:
            streams[0] = Path(os.devnull)
        code = wait_for_exit(start_with_files(words, folder, environment, streams, around))
        return CompletedProcess(words, code, *(stream.read_text() for stream in streams[1:]))


def start_dmplay(
    folder: Path,
    *words: str,
    streams: Sequence[Path] = (Path(os.devnull),) * 3,
    around: ProgramWrapper = run_unwrapped,
    **env: str,
) -> ProgramProcess:
    """Start dmplay in a folder that also holds its state, with these files as its streams."""
    return start_with_files(words, folder, clean_environment(folder, **env), streams, around)


def run_fresh_interpreter(
    *words: str,
    folder: Path,
    typed: str = "",
    disk: int | None = None,
    env: Mapping[str, str] = NO_VARIABLES,
) -> CompletedProcess[str]:
    """Run dmplay in a new interpreter, for example in another locale or on a small disk."""

    environment = clean_environment(folder, **env)
    if disk is not None:
        # bytecode files would be truncated, and later runs would read them
        environment["PYTHONDONTWRITEBYTECODE"] = "1"

    def small() -> None:
        if disk is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (disk, disk))

    return subprocess.run(
        [*DMPLAY_COMMAND, *words],
        input=typed,
        capture_output=True,
        text=True,
        env=environment,
        cwd=folder,
        timeout=PROGRAM_TIMEOUT_SECONDS,
        check=False,
        preexec_fn=small,
    )


def run_shell_line(line: str, folder: Path) -> CompletedProcess[str]:
    """Run a line of bash in which `dmplay` is the program."""
    quoted = f'dmplay() {{ "{sys.executable}" -m dmplay "$@"; }}; {line}'
    return subprocess.run(
        ["bash", "-c", quoted],
        capture_output=True,
        text=True,
        env=clean_environment(folder),
        cwd=folder,
        timeout=PROGRAM_TIMEOUT_SECONDS,
        check=False,
    )


def list_loaded_modules(
    code: str, never: set[str], env: Mapping[str, str] = NO_VARIABLES
) -> set[str]:
    """Return the modules of `never` that a new interpreter has loaded after running this code."""
    report = f"\nimport sys\nprint(*sorted({never!r} & set(sys.modules)))"
    command, environment = [sys.executable, "-c", code + report], os.environ | env
    process = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    return {*process.stdout.splitlines()[-1].split()}

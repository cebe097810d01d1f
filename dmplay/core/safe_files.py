"""Safe access to files: no endless reads, no unwanted overwrites, and atomic writes."""

import contextlib
import errno
import os
import re
import stat
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import ModuleType

from dmplay.core.standard_output import STDOUT_DESCRIPTORS
from dmplay.errors import BadParameter, DiskFull, DmplayError

# files that the caller has opened, for example a shell for <(...)
OPEN_FILES_FOLDER = Path("/dev/fd")
INPUT_DEVICES, OUTPUT_DEVICES = ("/dev/stdin", "/dev/null"), ("/dev/stdout", "/dev/null")
# permissions for the owner only, and for everyone; the umask may remove some
PRIVATE_FILE_MODE, SHARED_FILE_MODE = 0o600, 0o666
DISK_FULL_ERRNOS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # error numbers of a full disk
# the absolute paths of the files that the running command has read; no set if none is running
_SOURCES: list[set[str]] = []
DRAFT_PREFIX = ".dmplay-"  # how the names of unfinished files begin
DRAFT_NAME = re.compile(rf"{re.escape(DRAFT_PREFIX)}[0-9a-f]{{16}}\.tmp")  # the complete names


def user_folder(env: Mapping[str, str], variable: str, *names: str) -> Path:
    """Return the dmplay folder in one of the user's XDG base directories.

    The environment variable names the base directory if its value is an absolute path, as the
    specification demands; else it is the path `names` in the home folder. Without a home folder,
    the result is a path that cannot exist.
    """
    configured = Path(env.get(variable, ""))
    try:
        return (configured if configured.is_absolute() else Path.home().joinpath(*names)) / "dmplay"
    except RuntimeError:
        return Path(os.devnull, "no home", "dmplay")


MAX_FILE_BYTES = 64 * 2**20  # maximum bytes of a file that is read
WRITE_BUFFER_BYTES = 2**18  # bytes written at once


def is_output_device(path: Path) -> bool:
    """Return whether a path is a device that is written in place, such as /dev/stdout."""
    return str(path) in OUTPUT_DEVICES


def resolve_stdout_path(path: Path) -> Path:
    """Return a path; for /dev/stdout, that of the descriptor to which dmplay prints.

    Raise OSError if that is closed.
    """
    if str(path) == "/dev/stdout" and STDOUT_DESCRIPTORS:
        os.write(STDOUT_DESCRIPTORS[-1], b"")
        return OPEN_FILES_FOLDER / str(STDOUT_DESCRIPTORS[-1])
    return path


def read_bytes(path: Path, max_bytes: int | None = None) -> bytes:
    """Return the bytes of a file; raise OSError if it may be endless or is too large."""
    max_bytes = max_bytes or MAX_FILE_BYTES
    if str(path) not in INPUT_DEVICES and path.parent != OPEN_FILES_FOLDER:
        refuse_endless_file(path)
    with path.open("rb") as file:
        register_input_file(path)
        data = file.read(min(WRITE_BUFFER_BYTES, max_bytes + 1))
        if len(data) == WRITE_BUFFER_BYTES:  # A buffer for the limit costs 60 us for a small file.
            data += file.read(max_bytes + 1 - len(data))
    if len(data) > max_bytes:
        megabytes = max_bytes // 2**20
        limit = f"{megabytes} MB" if megabytes else f"{max_bytes // 2**10} kB"
        raise OSError(errno.EFBIG, f"larger than {limit}", str(path))
    return data


def refuse_endless_file(path: Path) -> None:
    """Raise OSError if a path is a FIFO, a socket or a device, which may be endless."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise OSError(errno.EINVAL, "a FIFO, a socket or a device, not a file", str(path))


def default_file_mode() -> int:
    """Return the mode of a new file that everyone may read, as far as the umask allows."""
    mask = os.umask(0o077)
    os.umask(mask)
    return 0o644 & ~mask


def is_locked_elsewhere(descriptor: int) -> bool:
    """Return whether another program has locked this open file; if not, lock it until closed."""
    try:
        import fcntl
    except ImportError:  # fcntl does not exist on every system
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:  # Any other error means a file system without locks.
        return isinstance(error, BlockingIOError)
    return False


def is_game_running(path: Path) -> bool:
    """Return whether another program is playing the game that is recorded in a file."""
    with path.open("rb") as file:
        return is_locked_elsewhere(file.fileno())


def check_writable(path: Path, *, force: bool, continues: bool = False) -> None:
    """Raise an error if a path cannot be written, or not without losing data.

    Raise FileExistsError for a folder or a file that is not empty, unless `force` is set, and
    BadParameter for a symbolic link, the file of a running game or a file that dmplay reads. The
    latter and an existing file are right if the text `continues` it.
    """
    refuse_endless_file(path)
    if not (force or continues) and path.exists() and (path.is_dir() or path.stat().st_size):
        raise FileExistsError
    if path.is_file() and is_game_running(path):
        raise BadParameter(f"{path}: this game is running, here or in another dmplay process")
    if not continues:
        refuse_input_file(path)
    if path.is_symlink():
        raise BadParameter(f"{path} is a symbolic link; give the path of the file itself")


@contextlib.contextmanager
def exclusive_lock(path: Path) -> Iterator[None]:
    """Run the block while this process alone holds a lock file, where the system has locks."""
    handle = os.open(path, os.O_RDWR | os.O_CREAT, PRIVATE_FILE_MODE)
    try:
        with contextlib.suppress(ImportError, OSError):
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


@contextlib.contextmanager
def track_input_files() -> Iterator[None]:
    """Run the block, a command, with `refuse_input_file` for the files that it reads.

    A program that uses dmplay may write a file that it read before.
    """
    _SOURCES.append(set())
    try:
        yield
    finally:
        _SOURCES.pop()


def register_input_file(path: str | Path) -> None:
    """Remember that a command reads a file, so that `refuse_input_file` refuses to write it."""
    for paths in _SOURCES[-1:]:
        paths.add(os.path.abspath(path))


def forget_input_files() -> None:
    """Forget which files were read, before another command."""
    for paths in _SOURCES:
        paths.clear()


def refuse_input_file(path: Path) -> None:
    """Raise BadParameter if a path is a file that dmplay reads, under whatever name.

    These are the files given to `register_input_file`, and the files of all imported modules.
    """
    if not (_SOURCES and path.is_file()):
        return
    modules = [vars(module) for module in [*sys.modules.values()] if isinstance(module, ModuleType)]
    files = _SOURCES[-1].union(filter(None, (module.get("__file__") for module in modules)))
    if any(os.path.exists(source) and os.path.samefile(path, source) for source in files):
        raise BadParameter(f"{path} is a file that dmplay reads; give another path")


def write_file(
    path: Path,
    text: Iterable[str],
    *,
    force: bool = False,
    continues: bool = False,
    private: bool = False,
) -> None:
    """Write a text file in UTF-8, as `write_bytes` does."""
    data = (part.encode() for part in text)
    write_bytes(path, data, force=force, continues=continues, private=private)


def write_bytes(
    path: Path,
    data: Iterable[bytes],
    *,
    force: bool = False,
    continues: bool = False,
    private: bool = False,
) -> None:
    """Write a file in one step: a reader finds no file, the old one or the complete new one.

    Only the owner may read a new file that is `private`. Raise BadParameter if the file exists and
    `force` is not set, if dmplay reads it, or if it cannot be written, and DiskFull if the disk is
    full. A file that the text `continues`, such as one of state, may exist and be read.
    """
    try:
        if is_output_device(path):
            with resolve_stdout_path(path).open("wb") as file:
                file.writelines(data)
        else:
            check_writable(path, force=force, continues=continues)
            _write_atomically(path, data, PRIVATE_FILE_MODE if private else SHARED_FILE_MODE)
    except FileExistsError:
        raise BadParameter(f"{path} exists; give another name or use --force") from None
    except OSError as error:
        raise _write_error(path, error) from None


def read_complete_lines(path: Path) -> Iterator[str]:
    """Yield the complete lines of a growing file of any length, without an incomplete last line."""
    refuse_endless_file(path)
    with path.open(encoding="utf-8", errors="replace", newline="\n") as file:
        yield from (row for row in file if row.endswith("\n"))


def write_at_offset(path: Path, offset: int, text: str) -> int:
    """Replace a file from `offset` on by text, completely or not at all; return its new size."""
    data = remaining = memoryview(text.encode())
    try:
        with path.open("r+b", buffering=0) as file:
            file.truncate(offset)
            file.seek(offset)
            try:
                while remaining:
                    remaining = remaining[file.write(remaining) :]
            except OSError:
                file.truncate(offset)
                raise
    except OSError as error:
        raise _write_error(path, error) from None
    return offset + len(data)


def _write_error(path: Path, error: OSError) -> DmplayError:
    """Return the error for a file that cannot be written: DiskFull, or BadParameter."""
    error_type = DiskFull if error.errno in DISK_FULL_ERRNOS else BadParameter
    return error_type(f"cannot write {path}: {error.strerror}")


def _write_atomically(path: Path, data: Iterable[bytes], mode: int) -> None:
    """Write a draft next to the file and then move it to its place."""
    _remove_stale_drafts(path.parent)
    draft_path = path.with_name(f"{DRAFT_PREFIX}{os.urandom(8).hex()}.tmp")
    handle, open_name = _open_draft(draft_path, mode)
    has_name = open_name == str(draft_path)
    try:
        with open(handle, "wb", WRITE_BUFFER_BYTES) as file:
            # The lock keeps other writes from removing this draft as a leftover.
            is_locked_elsewhere(handle)
            file.writelines(data)
            file.flush()
            exists = path.exists()
            if exists:
                os.chmod(open_name, path.stat().st_mode & 0o777)
            if not has_name:  # A link fails if a file has appeared there in the meantime.
                os.link(open_name, draft_path if exists else path, src_dir_fd=handle)
        if has_name or exists:
            os.replace(draft_path, path)
    finally:
        draft_path.unlink(missing_ok=True)


def _remove_stale_drafts(folder: Path) -> None:
    """Remove the drafts that killed processes of this user left in a folder."""
    with contextlib.suppress(OSError):
        for path in folder.glob(f"{DRAFT_PREFIX}*.tmp"):
            if DRAFT_NAME.fullmatch(path.name) and _is_stale_draft(path):
                path.unlink(missing_ok=True)


def _is_stale_draft(path: Path) -> bool:
    """Return whether a path is a regular file of this user that no other program has locked."""
    with contextlib.suppress(AttributeError, OSError):
        # Without O_NONBLOCK, opening a FIFO would wait for a writer.
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW)
        try:
            status = os.fstat(handle)
            is_own_file = stat.S_ISREG(status.st_mode) and status.st_uid == os.geteuid()
            return is_own_file and not is_locked_elsewhere(handle)
        finally:
            os.close(handle)
    return False


def _open_draft(draft_path: Path, mode: int) -> tuple[int, str]:
    """Open a draft and return its descriptor and its name.

    Where the system supports it, the file has no directory entry, so that a killed process leaves
    nothing behind.
    """
    with contextlib.suppress(AttributeError, OSError):
        handle = os.open(draft_path.parent, os.O_TMPFILE | os.O_WRONLY, mode)
        return handle, f"/proc/self/fd/{handle}"
    return os.open(draft_path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), str(draft_path)

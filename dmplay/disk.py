"""Files: only what has an end is read, nothing is overwritten unasked, a write is whole or none."""

import contextlib
import errno
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from dmplay.errors import BadParameter, DiskFull, DmplayError

OPEN_FILES_FOLDER = Path("/dev/fd")  # what the caller has opened, as a shell does for <(...)
INPUT_DEVICES, OUTPUT_DEVICES = ("/dev/stdin", "/dev/null"), ("/dev/stdout", "/dev/null")
PRIVATE_FILE_MODE, SHARED_FILE_MODE = (
    0o600,
    0o666,
)  # who may read and write a file, as far as the umask lets them
DISK_FULL_ERRNOS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # how a system says that a disk is
DRAFT_PREFIX = ".dmplay-"  # how the name begins of what is not whole yet


def user_folder(env: Mapping[str, str], variable: str, *names: str) -> Path:
    """The user's folder of a kind, by the base directory specification; without a home, none.

    By that a path which is not absolute is none.
    """
    told = Path(env.get(variable, ""))
    try:
        return (told if told.is_absolute() else Path.home().joinpath(*names)) / "dmplay"
    except RuntimeError:
        return Path(os.devnull, "no home", "dmplay")


MAX_FILE_BYTES = 64 * 2**20  # bytes of a file that is read
WRITE_BUFFER_BYTES = 2**18  # bytes that are written at once


def is_output_device(path: Path) -> bool:
    """Whether a path is a device that is written as it stands."""
    return str(path) in OUTPUT_DEVICES


def read_bytes(path: Path) -> bytes:
    """What stands in a file; raises OSError for what may have no end, or is too large."""
    if str(path) not in INPUT_DEVICES and path.parent != OPEN_FILES_FOLDER:
        _refuse_endless_file(path)
    with path.open("rb") as file:
        read = file.read(MAX_FILE_BYTES + 1)
    if len(read) > MAX_FILE_BYTES:
        raise OSError(errno.EFBIG, f"larger than {MAX_FILE_BYTES // 2**20} MB", str(path))
    return read


def _refuse_endless_file(path: Path) -> None:
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise OSError(errno.EINVAL, "a FIFO, a socket or a device, not a file", str(path))


def default_file_mode() -> int:
    """The mode of a new file that everybody may read whom the umask lets."""
    mask = os.umask(0o077)
    os.umask(mask)
    return 0o644 & ~mask


def is_locked_elsewhere(descriptor: int) -> bool:
    """Whether another program writes this open file; if not, nobody else can until it is closed."""
    try:
        import fcntl
    except ImportError:  # not on every system
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:  # another error is a file system without locks
        return isinstance(error, BlockingIOError)
    return False


def is_game_running(path: Path) -> bool:
    """Whether a file is that of a game somebody plays now."""
    with path.open("rb") as file:
        return is_locked_elsewhere(file.fileno())


def check_writable(path: Path, *, force: bool) -> None:
    """Refuses a name that cannot be written, or not without loss; an empty file is none."""
    _refuse_endless_file(path)
    if not force and path.exists() and (path.is_dir() or path.stat().st_size):
        raise FileExistsError
    if path.is_symlink():
        raise BadParameter(f"{path} is a link; name the file itself")
    if path.is_file() and is_game_running(path):
        raise BadParameter(f"{path}: somebody plays this game now")


@contextlib.contextmanager
def exclusive_lock(path: Path) -> Iterator[None]:
    """Waits, by this lock file, until no other program is in here, where the system can tell."""
    handle = os.open(path, os.O_RDWR | os.O_CREAT, PRIVATE_FILE_MODE)
    try:
        with contextlib.suppress(ImportError, OSError):
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def check_not_source(path: Path, source: str | Path) -> None:
    """Refuses to write onto the file that is read, under whatever name."""
    if path.exists() and path.samefile(source):
        raise BadParameter(f"{path}: it is the transcript that is read")


def write_file(
    path: Path, text: Iterable[str], *, force: bool = False, private: bool = False
) -> None:
    """Writes a file in one step: a reader sees nothing, the old file or the whole new one.

    A new one that is private nobody else may read.
    """
    try:
        if is_output_device(path):
            with path.open("w", encoding="utf-8", newline="\n") as file:
                file.writelines(text)
        else:
            check_writable(path, force=force)
            _write_atomically(path, text, PRIVATE_FILE_MODE if private else SHARED_FILE_MODE)
    except FileExistsError:
        raise BadParameter(f"{path} exists; give another name, or --force") from None
    except OSError as error:
        raise _write_error(path, error) from None


def read_complete_lines(path: Path) -> Iterator[str]:
    """The whole lines of a file that grows, however long it is; a torn last one is none."""
    _refuse_endless_file(path)
    with path.open(encoding="utf-8", errors="replace", newline="\n") as file:
        yield from (row for row in file if row.endswith("\n"))


def write_at_offset(path: Path, offset: int, text: str) -> int:
    """Puts text, all or none, behind the first bytes of a file; how many there are then."""
    raw = left = memoryview(text.encode())
    try:
        with path.open("r+b", buffering=0) as file:
            file.truncate(offset)
            file.seek(offset)
            try:
                while left:
                    left = left[file.write(left) :]
            except OSError:
                file.truncate(offset)
                raise
    except OSError as error:
        raise _write_error(path, error) from None
    return offset + len(raw)


def _write_error(path: Path, error: OSError) -> DmplayError:
    """Why a file cannot be written: the disk is full, or it is none to write."""
    kind = DiskFull if error.errno in DISK_FULL_ERRNOS else BadParameter
    return kind(f"cannot write {path}: {error.strerror}")


def _write_atomically(path: Path, text: Iterable[str], mode: int) -> None:
    """Writes beside the file, and then puts the whole in its place."""
    _remove_stale_drafts(path.parent)
    spare = path.with_name(f"{DRAFT_PREFIX}{os.urandom(8).hex()}.tmp")
    handle, name = _open_draft(spare, mode)
    named = name == str(spare)
    try:
        with open(handle, "w", WRITE_BUFFER_BYTES, encoding="utf-8", newline="\n") as file:
            is_locked_elsewhere(handle)  # locks it: no other write takes it for one that was left
            file.writelines(text)
            file.flush()
            there = path.exists()
            if there:
                os.chmod(name, path.stat().st_mode & 0o777)
            if not named:  # a link refuses what has come to be there
                os.link(name, spare if there else path, src_dir_fd=handle)
        if named or there:
            os.replace(spare, path)
    finally:
        spare.unlink(missing_ok=True)


def _remove_stale_drafts(folder: Path) -> None:
    """Removes the drafts that killed writes left in a folder."""
    with contextlib.suppress(OSError):
        for left in folder.glob(f"{DRAFT_PREFIX}*.tmp"):
            if not is_game_running(left):
                left.unlink(missing_ok=True)


def _open_draft(draft_path: Path, mode: int) -> tuple[int, str]:
    """An open file and its name: one that a kill leaves nothing of where the system can."""
    with contextlib.suppress(AttributeError, OSError):
        handle = os.open(draft_path.parent, os.O_TMPFILE | os.O_WRONLY, mode)
        return handle, f"/proc/self/fd/{handle}"
    return os.open(draft_path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), str(draft_path)

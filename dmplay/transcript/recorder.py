"""Writing a transcript as the game goes: a block a turn, each one write."""

import contextlib
import errno
import hashlib
import os
from pathlib import Path

from dmplay import disk
from dmplay.errors import BadParameter
from dmplay.session import Session
from dmplay.transcript.format import (
    FrameRenderer,
    TurnFormatter,
    append_frame,
    format_end_block,
    format_lines,
    join_block,
    shorten_digest,
    strip_notes,
)
from dmplay.transcript.header import Header, collect_header_facts
from dmplay.transcript.seal import RESUMABLE_END_REASONS


class Recorder:
    """The open transcript of a session; after `end` nothing more is written.

    Where the disk refuses, `fault` says why, and what is missing is tried again with the next
    turn: the file never holds half a turn, and the game goes on. Where states are hidden, nobody
    else may read the file before the end.
    """

    is_private = False  # whether it stays its owner's alone

    def __init__(self, path: Path, session: Session, frame: FrameRenderer | None = None) -> None:
        self.path = path
        self.session = session
        self.frame = frame
        self._formatter = TurnFormatter(session)
        self.write_error: OSError | None = None
        self._pending = b""
        self._digest = hashlib.sha256()
        self._size = 0
        self._file = -1

    @classmethod
    def create(
        cls,
        path: Path,
        header: Header,
        session: Session,
        *,
        frame: FrameRenderer | None = None,
        force: bool = False,
    ) -> "Recorder":
        """A new file with the header and the opening; refuses one that exists without `force`."""
        recorder = cls(path, session, frame)
        device = disk.is_output_device(path)
        try:
            if not device:
                disk.check_writable(path, force=force)
            how = os.O_APPEND if device else 0 if path.exists() else os.O_EXCL
            mode = disk.PRIVATE_FILE_MODE if session.problem.partially_observable else 0o644
            recorder._file = os.open(path, os.O_WRONLY | os.O_CREAT | how, mode)
            recorder._lock_file()
            recorder._set_file_mode(disk.PRIVATE_FILE_MODE)
            if not device:
                os.ftruncate(recorder._file, 0)
        except FileExistsError:
            raise BadParameter(f"{path} exists; give another name, or --force") from None
        except OSError as error:
            raise BadParameter(f"cannot write {path}: {error.strerror}") from None
        recorder.write_turn(join_block(format_lines(collect_header_facts(header))))
        return recorder

    @classmethod
    def resume(
        cls, path: Path, content: str, session: Session, frame: FrameRenderer | None = None
    ) -> "Recorder":
        """The file cut to `content`, its whole blocks, and open for more."""
        recorder = cls(path, session, frame)
        try:
            recorder._file = os.open(path, os.O_WRONLY)
            recorder._lock_file()
            recorder._set_file_mode(disk.PRIVATE_FILE_MODE)
            raw = content.encode()
            os.ftruncate(recorder._file, len(raw))
            os.lseek(recorder._file, 0, os.SEEK_END)
        except OSError as error:
            raise BadParameter(f"cannot write {path}: {error.strerror}") from None
        recorder._size = len(raw)
        recorder._digest.update(strip_notes(content).encode())
        return recorder

    def _lock_file(self) -> None:
        """Keeps other programs from writing the same file, where the system can."""
        if not disk.is_output_device(self.path) and disk.is_locked_elsewhere(self._file):
            self.close()
            raise BadParameter(f"{self.path}: somebody plays this game now")

    def _set_file_mode(self, mode: int) -> None:
        """Says who may read the file, where what stands in it is hidden."""
        if self.session.problem.partially_observable and not disk.is_output_device(self.path):
            with contextlib.suppress(OSError):  # not on every file system
                os.fchmod(self._file, mode)

    def write_turn(self, header: str = "") -> None:
        """Writes the last turn; the opening, with the header before it, in one."""
        rows = self._formatter.format_turn()
        self._append_block(
            header
            + join_block(append_frame(rows, self.frame(self.session)) if self.frame else rows)
        )

    def write_event(self, key: str, value: object) -> None:
        """Writes an undo of so many turns, the number of a reroll, or who was helped how often."""
        self._append_block(join_block(format_lines({key: value})))

    def write_note(self, row: str) -> None:
        """Writes a note, which no checksum counts."""
        self._append_bytes(f"{row}\n".encode())

    def write_end(self, notes: str = "") -> None:
        """Writes the end line, and notes, and closes the file; a second end is none."""
        if self._file < 0:
            return
        self._append_bytes(
            "\n".join(
                [*format_end_block(self.session, shorten_digest(self._digest)), notes]
            ).encode()
        )
        own = self.is_private or self.session.end_reason in RESUMABLE_END_REASONS
        self._set_file_mode(disk.PRIVATE_FILE_MODE if own else disk.default_file_mode())
        self.close()

    @property
    def is_saved(self) -> bool:
        """Whether its file has all that was played, to be read again."""
        return self.write_error is None and not disk.is_output_device(self.path)

    @property
    def is_open(self) -> bool:
        """Whether there is more to come."""
        return self._file >= 0

    def close(self) -> None:
        """Closes the file as it is: without an end line it stays unfinished."""
        if self._file >= 0:
            os.close(self._file)
        self._file = -1

    def _append_block(self, block: str) -> None:
        """Appends a block, of which the checksum counts every line."""
        new = block.encode()
        self._digest.update(new)
        self._append_bytes(new)

    def _append_bytes(self, data: bytes) -> None:
        """Appends lines in one write, with what an earlier one left; all of it or nothing."""
        self._pending = raw = self._pending + data
        try:
            if os.write(self._file, raw) < len(raw):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            self.write_error = error
            with contextlib.suppress(OSError):  # a device has no length
                os.ftruncate(self._file, self._size)
                os.lseek(self._file, self._size, os.SEEK_SET)
        else:
            self.write_error = None
            self._size += len(raw)
            self._pending = b""

"""The writer of a transcript during a game; each block is a single write."""

import contextlib
import errno
import hashlib
import os
from pathlib import Path

from dmplay.core import safe_files
from dmplay.core.session import Session
from dmplay.errors import BadParameter
from dmplay.transcript.concealment import RESUMABLE_END_REASONS
from dmplay.transcript.format import (
    FrameRenderer,
    TurnFormatter,
    format_end_block,
    format_lines,
    format_with_frame,
    join_block,
    shorten_digest,
    strip_notes,
)
from dmplay.transcript.header import Header, collect_header_facts

RESERVED_SHARE = 64  # 1/64 of the maximum file size is not used for turns


class Recorder:
    """The open transcript of a session; after `write_end`, nothing more is written.

    If the disk fails, `write_error` is the reason, and the missing text is written with the next
    turn: the file never contains half a turn, and the game continues. The same is true of a file
    that another program takes away; if it was removed or emptied, all of its text is written again.
    If states are hidden, only the owner may read the file before the end.
    """

    is_private = False  # True if only the owner may read the file after the end

    def __init__(self, path: Path, session: Session, frame: FrameRenderer | None = None) -> None:
        self.path = path
        self.session = session
        self.frame = frame
        self._formatter = TurnFormatter(session)
        self.write_error: OSError | None = None
        self._is_error_reported = False  # whether the last notice was about an error
        self._was_restored = False  # whether the file was written again since the last notice
        self._written = bytearray()  # the bytes of the file, which another program may remove
        self._pending = b""
        self._digest = hashlib.sha256()
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
        """Return the recorder of a new file with the header and the start.

        Raises BadParameter if the file exists and `force` is False, or if it cannot be written.
        """
        recorder = cls(path, session, frame)
        is_device = safe_files.is_output_device(path)
        try:
            if not is_device:
                safe_files.check_writable(path, force=force)
            flags = os.O_APPEND if is_device else 0 if path.exists() else os.O_EXCL
            recorder._open_new_file(flags)
            recorder._lock_file()
            recorder._set_file_mode(safe_files.PRIVATE_FILE_MODE)
            if not is_device:
                os.ftruncate(recorder._file, 0)
        except FileExistsError:
            raise BadParameter(f"{path} exists; give another name or use --force") from None
        except OSError as error:
            raise BadParameter(f"cannot write {path}: {error.strerror}") from None
        recorder.write_turn(join_block(format_lines(collect_header_facts(header))))
        return recorder

    @classmethod
    def resume(
        cls, path: Path, content: str, session: Session, frame: FrameRenderer | None = None
    ) -> "Recorder":
        """Return the recorder of an existing file, cut to `content`, its complete blocks."""
        recorder = cls(path, session, frame)
        try:
            recorder._file = os.open(path, os.O_WRONLY)
            recorder._lock_file()
            recorder._set_file_mode(safe_files.PRIVATE_FILE_MODE)
            raw = content.encode()
            os.ftruncate(recorder._file, len(raw))
            os.lseek(recorder._file, 0, os.SEEK_END)
        except OSError as error:
            raise BadParameter(f"cannot write {path}: {error.strerror}") from None
        recorder._written += raw
        recorder._digest.update(strip_notes(content).encode())
        return recorder

    def _open_new_file(self, flags: int) -> None:
        """Open the path for writing, and create a file whose mode suits its problem."""
        is_private = self.session.problem.partially_observable
        mode = safe_files.PRIVATE_FILE_MODE if is_private else 0o644
        path = safe_files.resolve_stdout_path(self.path)
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | flags, mode)

    def _lock_file(self) -> None:
        """Lock the file if the system can; raise BadParameter if another program plays the game."""
        if not safe_files.is_output_device(self.path) and safe_files.is_locked_elsewhere(
            self._file
        ):
            self.close()
            raise BadParameter(
                f"{self.path}: this game is running, here or in another dmplay process"
            )

    def _set_file_mode(self, mode: int) -> None:
        """Set the permissions of the file, if its problem has hidden states."""
        if self.session.problem.partially_observable and not safe_files.is_output_device(self.path):
            with contextlib.suppress(OSError):  # Some file systems have no permissions.
                os.fchmod(self._file, mode)

    def write_turn(self, header: str = "") -> None:
        """Write the last turn; or the header and the start, in one write."""
        rows = self._formatter.format_turn()
        self._append_block(
            header
            + join_block(format_with_frame(rows, self.frame(self.session)) if self.frame else rows)
        )

    def write_event(self, key: str, value: object) -> None:
        """Write an undo (its turns), a reroll (its number) or `help` (hint counts by seat)."""
        self._append_block(join_block(format_lines({key: value})))

    def write_note(self, row: str) -> None:
        """Write a note, which the checksum does not cover."""
        self._append_bytes(f"{row}\n".encode())

    def write_end(self, notes: str = "", *, reason: str | None = None) -> None:
        """Write the end line and notes, and close the file; do nothing if it is closed.

        `reason` is given for a game that is paused and not over.
        """
        if self._file < 0:
            return
        end_block = format_end_block(self.session, shorten_digest(self._digest), reason)
        self._append_bytes("\n".join([*end_block, notes]).encode())
        end_reason = reason or self.session.end_reason
        is_private = self.is_private or end_reason in RESUMABLE_END_REASONS
        self._set_file_mode(
            safe_files.PRIVATE_FILE_MODE if is_private else safe_files.default_file_mode()
        )
        self.close()

    @property
    def is_full(self) -> bool:
        """True if there is no space for another turn in a file that can be read again.

        The space that is left is for the end, and for turns that are taken back.
        """
        max_bytes = safe_files.MAX_FILE_BYTES
        return len(self._written) + len(self._pending) > max_bytes - max_bytes // RESERVED_SHARE

    @property
    def is_saved(self) -> bool:
        """True if the file contains all that was played, and can be read again."""
        return self.write_error is None and not safe_files.is_output_device(self.path)

    @property
    def content(self) -> str:
        """The text that the file contains."""
        return self._written.decode()

    @property
    def content_with_end(self) -> str:
        """The text that the file contains, or would contain if it were closed now."""
        if not self.is_open:
            return self.content
        end_block = format_end_block(self.session, shorten_digest(self._digest), None)
        return self.content + "\n".join([*end_block, ""])

    def pop_write_notice(self) -> str:
        """Return one line if writing began to fail, or works again, since the last call; else ''.

        An error that is gone before this call is not mentioned, because nothing is missing.
        """
        is_failing = self.write_error is not None
        was_restored, self._was_restored = self._was_restored, False
        if was_restored and not is_failing and not self._is_error_reported:
            return (
                f"{self.path} was removed or emptied; dmplay wrote it again, and nothing is missing"
            )
        if is_failing is self._is_error_reported:
            return ""
        self._is_error_reported = is_failing
        return (
            f"{self.describe_write_error()}; the game continues, and dmplay tries again each turn"
            if is_failing
            else f"{self.path} can be written again, and nothing is missing"
        )

    def describe_write_error(self) -> str:
        """Return the path and the reason of the error; '' if there is none."""
        return f"cannot write {self.path}: {self.write_error.strerror}" if self.write_error else ""

    @property
    def is_open(self) -> bool:
        """True until the file is closed."""
        return self._file >= 0

    def close(self) -> None:
        """Close the file without an end line, so that it stays unfinished."""
        if self._file >= 0:
            os.close(self._file)
        self._file = -1

    def _append_block(self, block: str) -> None:
        """Append a block, all of whose lines the checksum covers."""
        data = block.encode()
        self._digest.update(data)
        self._append_bytes(data)

    def _append_bytes(self, data: bytes) -> None:
        """Append data and any that earlier failed, in one write: all of it or nothing."""
        self._pending += data
        try:
            self._restore_lost_file()
        except OSError as error:  # The file of another program must not be truncated.
            self.write_error = error
            return
        try:
            if os.write(self._file, self._pending) < len(self._pending):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            self.write_error = error
            with contextlib.suppress(OSError):  # A device cannot be truncated.
                os.ftruncate(self._file, len(self._written))
                os.lseek(self._file, len(self._written), os.SEEK_SET)
        else:
            self.write_error = None
            self._written += self._pending
            self._pending = b""

    def _restore_lost_file(self) -> None:
        """Prepare a file that was removed or emptied to be written again from its beginning.

        Raise OSError if that is impossible, if the path is another file or a folder now, or if
        another program changed the text.
        """
        if safe_files.is_output_device(self.path):
            return
        status = os.fstat(self._file)
        try:
            is_same_file = os.path.samestat(os.stat(self.path), status)
        except FileNotFoundError:
            old_file = self._file
            self._open_new_file(os.O_EXCL)
            os.close(old_file)
            safe_files.is_locked_elsewhere(self._file)  # locks the new file
            self._rewrite_from_beginning()
            return
        if not is_same_file:
            raise OSError(errno.EEXIST, "another file or folder has this path now")
        if status.st_size not in (0, len(self._written)):
            raise OSError(errno.EBUSY, "another program changed it")
        if not status.st_size and self._written:
            os.lseek(self._file, 0, os.SEEK_SET)
            self._rewrite_from_beginning()

    def _rewrite_from_beginning(self) -> None:
        """Let the next write begin with the text that the file contained."""
        self._pending = bytes(self._written) + self._pending
        self._written.clear()
        self._was_restored = True

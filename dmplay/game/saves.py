"""Saved games in the state folder, up to a total size.

A game is saved here if no other file is given for it. Its file name begins with a number, which
orders the games even if the clock was set back.
"""

import contextlib
import errno
import os
import re
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from itertools import count
from pathlib import Path
from typing import NamedTuple

from dmplay.core import safe_files
from dmplay.core.text import format_count
from dmplay.errors import BadParameter, DmplayError, clip_message
from dmplay.transcript.external_players import MODEL_PLAYER
from dmplay.transcript.format import NATURAL_END_REASONS, compute_checksum, format_end_block
from dmplay.transcript.reader import Transcript, TranscriptOutline, read_outline, read_transcript
from dmplay.transcript.recorder import Recorder

BYTES_PER_MEGABYTE = 1_000_000
KEPT_SHARE = 0.9  # share of the maximum size that is left after saves were deleted
PROTECTED_SECONDS = 24 * 60 * 60  # age in seconds up to which a save is never deleted
NUMBER_PATTERN = re.compile(r"(?!\d{8}-\d{6}-)(\d+)-")  # older versions wrote date and time
PROTECTION_RULE = (
    "dmplay never deletes a game of the last 24 hours, a running game, the newest game or any game "
    "newer than one of these"
)
MAX_END_BYTES = 4096  # read of the end of a save; a longer end line is read with the whole file
END_REASON_PATTERN = re.compile(r'end: \{"reason": "([^"]*)", .*\}$')
STDIN_PATH, STDOUT_PATH = Path("/dev/stdin"), Path("/dev/stdout")


class SaveRemoval(NamedTuple):
    """The saves that were deleted to make room, and the maximum size if that was not enough."""

    removed_count: int = 0
    exceeded_megabytes: float = 0  # 0 if the saves that are left fit into the maximum size

    def followed_by(self, later: "SaveRemoval") -> "SaveRemoval":
        """Return this removal and a later one as one."""
        return SaveRemoval(
            self.removed_count + later.removed_count,
            later.exceeded_megabytes or self.exceeded_megabytes,
        )

    def __str__(self) -> str:
        """Return the removal in one line; '' if nothing was deleted and the saves fit."""
        deleted = f"deleted {format_count(self.removed_count, 'older saved game')}"
        parts = (
            [f"{deleted} to make room; --keep MB raises the limit"] if self.removed_count else []
        )
        if self.exceeded_megabytes:
            size = f"more than {self.exceeded_megabytes:g} MB"
            parts.append(f"saved games take {size}, because {PROTECTION_RULE}")
        return "; ".join(parts)


def resolve_dash_to_stream(path: Path, stream: Path) -> Path:
    """Return the path, or the given standard stream if the path is `-`."""
    return stream if str(path) == "-" else path


def load_transcript(
    path: Path, reader: Callable[[Path], Transcript] = read_transcript
) -> Transcript:
    """Return the transcript in a file; `-` is the standard input.

    Raise BadParameter if the file cannot be read.
    """
    try:
        return reader(resolve_dash_to_stream(path, STDIN_PATH))
    except OSError as error:
        raise BadParameter(f"{path}: {error.strerror}") from None


def saves_folder(env: Mapping[str, str]) -> Path:
    """Return `$XDG_STATE_HOME/dmplay/games`, by the XDG base directory specification."""
    return safe_files.user_folder(env, "XDG_STATE_HOME", ".local", "state") / "games"


def create_save(problem: str) -> Path | None:
    """Create an empty, private save file for a new game and return its path.

    Return None, after a single warning, if the folder cannot be written.
    """
    save_folder = saves_folder(os.environ)
    if not prepare_folder(save_folder):
        return None
    try:
        return create_game_file(save_folder, problem)
    except OSError as error:
        _warn_not_saved(f"{save_folder}: {error.strerror}")
        return None


def create_game_file(game_folder: Path, problem: str) -> Path:
    """Create an empty, private transcript file with a unique name in a folder; return its path.

    The name is made of a number, the next one in this folder, and the problem.
    """
    safe_name = problem.strip("./").replace(":", "-").replace("/", "-")
    last_number = max((_parse_save_number(path) for path in game_folder.glob("*.dmt")), default=0)
    for number in count(last_number + 1):
        path = game_folder / f"{number:06}-{safe_name}.dmt"
        with contextlib.suppress(FileExistsError):
            os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
            break
    return path


def _parse_save_number(path: Path) -> int:
    """Return the number in the name of a save; 0 if it has none."""
    match = NUMBER_PATTERN.match(path.name)
    return int(match[1]) if match else 0


def list_saves() -> list[Path]:
    """Return the files in the folder of saved games, newest first."""
    # A FIFO would never end, and only a regular file can be a save.
    paths = filter(Path.is_file, saves_folder(os.environ).glob("*.dmt"))
    return sorted(paths, key=lambda path: (_parse_save_number(path), path.name), reverse=True)


def remove_old_saves(max_megabytes: float) -> SaveRemoval:
    """Delete the oldest saves, by number, if all of them together are larger than this.

    A game that is running, that was played within the last 24 hours or that has the greatest number
    is not deleted, and nor is any newer one, so that no number is used twice. Games of people and
    games of language models are each deleted only down to half of the size.
    """
    if not prepare_folder(saves_folder(os.environ)):
        return SaveRemoval()
    statuses = {path: status for path in list_saves() if (status := _get_file_status(path))}
    total_bytes = sum(status.st_size for status in statuses.values())
    max_bytes = max_megabytes * BYTES_PER_MEGABYTE
    if total_bytes <= max_bytes:
        return SaveRemoval()
    kept_bytes = KEPT_SHARE * max_bytes
    model_seat = f'"{MODEL_PLAYER}"'.encode()
    is_of_model = {
        path: model_seat in _find_line_with_prefix(path, b"seats: ") for path in statuses
    }
    bytes_by_kind = Counter[bool]()
    for path, status in statuses.items():
        bytes_by_kind[is_of_model[path]] += status.st_size
    removed_count = 0
    protected_kinds = set[bool]()  # kinds whose oldest game that is left is protected
    newest_path = next(iter(statuses))
    for path, status in reversed(statuses.items()):
        kind, is_recent = is_of_model[path], time.time() - status.st_mtime < PROTECTED_SECONDS
        if bytes_by_kind.total() <= kept_bytes:
            break
        if kind in protected_kinds or bytes_by_kind[kind] <= kept_bytes / 2:
            continue
        if is_recent or path == newest_path or safe_files.is_game_running(path):
            protected_kinds.add(kind)
            continue
        with contextlib.suppress(OSError):  # Another process may have deleted it.
            path.unlink()
            bytes_by_kind[kind] -= status.st_size
            removed_count += 1
    is_exceeded = bytes_by_kind.total() > max_bytes
    return SaveRemoval(removed_count, max_megabytes if is_exceeded else 0)


def _get_file_status(path: Path) -> os.stat_result | None:
    """Return the size and times of a file; None if another process has deleted it."""
    with contextlib.suppress(OSError):
        return path.stat()
    return None


def _find_line_with_prefix(path: Path, prefix: bytes) -> bytes:
    """Return the first line of a file that starts with the prefix; b"" if there is none."""
    try:
        with path.open("rb") as file:
            return next((line for line in file if line.startswith(prefix)), b"")
    except OSError:
        return b""


@cache  # so that the warning is printed once
def prepare_folder(games_folder: Path) -> bool:
    """Create a folder for games, private to its owner; return whether it is writable.

    If it is not, a warning is printed.
    """
    try:
        games_folder.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(OSError):
            for directory in (games_folder.parent, games_folder):
                directory.chmod(directory.stat().st_mode & 0o700)
        if not os.access(games_folder, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        has_no_home = games_folder.is_relative_to(os.devnull)
        reason = "no home folder; set HOME" if has_no_home else f"{games_folder}: {error.strerror}"
        _warn_not_saved(reason)
        return False
    return True


def _warn_not_saved(reason: str) -> None:
    """Print a warning that the game is not saved."""
    print(clip_message(f"warning: this game is not saved: {reason}"), file=sys.stderr)


def is_first_run() -> bool:
    """Return whether dmplay starts for the first time here, and remember that it started.

    A player with saved games has started it before. If that cannot be remembered, return False.
    """
    state_folder = saves_folder(os.environ).parent
    try:
        state_folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        os.close(os.open(state_folder / "started", os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
    except OSError:
        return False
    return not list_saves()


def shell_history_path() -> Path | None:
    """Return the file with the lines typed in the shell; None if it cannot be written."""
    save_folder = saves_folder(os.environ)
    file = save_folder.parent / "history"
    is_writable = prepare_folder(save_folder) and (not file.exists() or os.access(file, os.W_OK))
    return file if is_writable else None


def choose_free_path(path: Path) -> Path:
    """Return a path that does not exist: this one, or with a number, such as `game-2.svg`."""
    names = (path.with_stem(f"{path.stem}-{number}") for number in count(2))
    return next(filter(lambda name: not name.exists(), names)) if path.exists() else path


def copy_transcript(recorder: Recorder, path: Path) -> None:
    """Copy a transcript as written so far, with an end block if the game is over.

    The copy is private if the game is unfinished and partially observable.
    """
    content = recorder.content
    if recorder.session.over and recorder.is_open:
        content += "\n".join([*format_end_block(recorder.session, compute_checksum(content)), ""])
    is_unfinished = recorder.is_open and not recorder.session.over
    safe_files.write_file(
        path, [content], private=is_unfinished and recorder.session.problem.partially_observable
    )


def is_save(path: Path) -> bool:
    """Return whether a file is in the folder of saved games."""
    return path.parent == saves_folder(os.environ)


def remove_unplayed_save(recorder: Recorder) -> bool:
    """Delete a saved game without turns; return whether it was deleted.

    A save whose transcript could not be written is not deleted.
    """
    if not is_save(recorder.path) or recorder.write_error:
        return False
    if _find_line_with_prefix(recorder.path, b"turn: 1\n"):  # even if the turn was undone later
        return False
    recorder.path.unlink(missing_ok=True)
    return True


def iter_saves() -> Iterator[TranscriptOutline]:
    """Yield the outlines of readable saved games, newest first; each file is read when needed."""
    return iter_outlines(list_saves())


def iter_outlines(paths: Iterable[Path]) -> Iterator[TranscriptOutline]:
    """Yield the outlines of the transcripts in these files; files without a start are omitted."""
    for path in paths:
        with contextlib.suppress(DmplayError, OSError):
            outline = read_outline(path)
            if outline.has_start:
                yield outline


def iter_unfinished_saves() -> Iterator[TranscriptOutline]:
    """Yield the saved games of people that can be resumed, newest first.

    These have at least one turn, no end or one chosen by the player, and are not running now.
    """
    for outline in iter_outlines(path for path in list_saves() if not _ends_naturally(path)):
        is_of_people = MODEL_PLAYER not in outline.header.seats.values()
        if (
            is_of_people
            and not outline.has_natural_end
            and outline.turns
            and not safe_files.is_game_running(Path(outline.path))
        ):
            yield outline


def _ends_naturally(path: Path) -> bool:
    """Return whether the last line of a save says so; only the end of the file is read."""
    try:
        with path.open("rb") as file:
            file.seek(-min(path.stat().st_size, MAX_END_BYTES), os.SEEK_END)
            last_line = file.read().rstrip(b"\n").rpartition(b"\n")[2].decode(errors="replace")
    except OSError:
        return False
    reason = END_REASON_PATTERN.match(last_line)
    return reason is not None and reason[1] in NATURAL_END_REASONS


def find_latest_unfinished() -> Path:
    """Return the path of the newest unfinished save; raise BadParameter if there is none."""
    for outline in iter_unfinished_saves():
        return Path(outline.path)
    save_folder = saves_folder(os.environ)
    raise BadParameter(f"no unfinished game in {save_folder}; name a file: dmplay resume FILE")

"""Saved games in the state folder: the last 20 of people and the last 20 of language models.

A game is saved here if no other file is given for it.
"""

import contextlib
import errno
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from itertools import count
from pathlib import Path

from dmplay import safe_files
from dmplay.errors import BadParameter, DmplayError
from dmplay.transcript.format import MODEL_PLAYER, compute_checksum, format_end_block
from dmplay.transcript.reader import Transcript, read_transcript
from dmplay.transcript.recorder import Recorder

MAX_SAVES = 20
NEW_FILE_SECONDS = 60  # seconds for which the file of a new game may be empty
STDIN_PATH, STDOUT_PATH = Path("/dev/stdin"), Path("/dev/stdout")


def resolve_dash(path: Path, stream: Path) -> Path:
    """Return the path, or the given standard stream if the path is `-`."""
    return stream if str(path) == "-" else path


def load_transcript(
    path: Path, reader: Callable[[Path], Transcript] = read_transcript
) -> Transcript:
    """Return the transcript in a file; `-` is the standard input.

    Raise BadParameter if the file cannot be read.
    """
    try:
        return reader(resolve_dash(path, STDIN_PATH))
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

    The name is made of the date, the time and the problem.
    """
    safe_name = problem.lstrip("./").replace(":", "-").replace("/", "-")
    stem = f"{time.strftime('%Y%m%d-%H%M%S')}-{safe_name}"
    for number in count():
        path = game_folder / f"{stem}{f'-{number}' if number else ''}.dmt"
        with contextlib.suppress(FileExistsError):
            os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
            break
    return path


def remove_old_saves() -> int:
    """Delete saves without turns and all but the newest 19 of people and of models, each.

    Files of running games, and empty files of the last 60 seconds, are not deleted. Return the
    number of deleted saves that had turns.
    """
    save_folder, removed_count = saves_folder(os.environ), 0
    if not prepare_folder(save_folder):
        return 0
    # A FIFO would never end, and only a regular file can be a save.
    paths = sorted(filter(Path.is_file, save_folder.glob("*.dmt")), key=_age_key)
    empty_saves = [path for path in paths if not _has_turns(path)]
    nonempty_saves = [path for path in paths if path not in empty_saves]
    model_saves = [path for path in nonempty_saves if _has_model_seat(path)]
    person_saves = [path for path in nonempty_saves if path not in model_saves]
    for path in [*empty_saves, *person_saves[: -(MAX_SAVES - 1)], *model_saves[: -(MAX_SAVES - 1)]]:
        with contextlib.suppress(OSError):
            status = path.stat()
            is_new = not status.st_size and time.time() - status.st_mtime < NEW_FILE_SECONDS
            if (
                is_new
                or safe_files.is_game_running(path)
                or (path in empty_saves and _has_turns(path))
            ):
                continue  # A turn may have been played since the folder was listed.
            path.unlink()
            removed_count += path not in empty_saves
    return removed_count


def _has_turns(path: Path) -> bool:
    """Return whether a save contains a turn, even if it was undone later."""
    return bool(_find_line(path, b"turn: 1\n"))


def _has_model_seat(path: Path) -> bool:
    """Return whether a language model plays in a saved game."""
    return f'"{MODEL_PLAYER}"'.encode() in _find_line(path, b"seats: ")


def _find_line(path: Path, prefix: bytes) -> bytes:
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
        reason = "no home; set HOME" if has_no_home else f"{games_folder}: {error.strerror}"
        _warn_not_saved(reason)
        return False
    return True


def _warn_not_saved(reason: str) -> None:
    """Print a warning that the game is not saved."""
    print(f"warning: this game is not kept: {reason}", file=sys.stderr)


def shell_history_path() -> Path | None:
    """Return the file with the lines typed in the shell; None if it cannot be written."""
    save_folder = saves_folder(os.environ)
    file = save_folder.parent / "history"
    is_writable = prepare_folder(save_folder) and (not file.exists() or os.access(file, os.W_OK))
    return file if is_writable else None


def copy_transcript(recorder: Recorder, path: Path) -> None:
    """Copy a transcript as written so far, with an end block if the game is over.

    The copy is private if the game is unfinished and partially observable.
    """
    content = recorder.path.read_text(encoding="utf-8")
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
    if not is_save(recorder.path) or recorder.write_error or _has_turns(recorder.path):
        return False
    recorder.path.unlink(missing_ok=True)
    return True


def iter_saves() -> Iterator[Transcript]:
    """Yield the transcripts of readable saved games, newest first."""
    for path in sorted(saves_folder(os.environ).glob("*.dmt"), key=_age_key, reverse=True):
        with contextlib.suppress(DmplayError, OSError):
            yield read_transcript(path)


def iter_unfinished_saves() -> Iterator[Transcript]:
    """Yield the saved games of people that can be resumed, newest first.

    These have at least one turn, no end or one chosen by the player, and are not running now.
    """
    for transcript in iter_saves():
        path, is_unfinished = (
            Path(transcript.path),
            transcript.end_block is None or transcript.player_end_reason,
        )
        is_of_people = MODEL_PLAYER not in transcript.header.seats.values()
        if (
            is_of_people
            and is_unfinished
            and _has_turns(path)
            and not safe_files.is_game_running(path)
        ):
            yield transcript


def find_latest_unfinished() -> Path:
    """Return the path of the newest unfinished save; raise BadParameter if there is none."""
    for transcript in iter_unfinished_saves():
        return Path(transcript.path)
    save_folder = saves_folder(os.environ)
    raise BadParameter(f"no unfinished game in {save_folder}; name a file: dmplay resume FILE")


def _age_key(path: Path) -> tuple[float, str]:
    """Return the sort key of a save: its modification time (0 if it no longer exists) and name."""
    with contextlib.suppress(OSError):  # another process may have deleted it
        return path.stat().st_mtime, path.name
    return 0.0, path.name

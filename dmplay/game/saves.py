"""Where games without a file of their own are kept: the last twenty, in the state folder.

And the last twenty of language models.
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

from dmplay import disk
from dmplay.errors import BadParameter, DmplayError
from dmplay.transcript.format import MODEL_PLAYER, compute_checksum, format_end_block
from dmplay.transcript.reading import Transcript, read_transcript
from dmplay.transcript.recorder import Recorder

MAX_SAVES = 20
NEW_FILE_SECONDS = 60  # seconds in which the file of a game that begins may be empty
STDIN_PATH, STDOUT_PATH = Path("/dev/stdin"), Path("/dev/stdout")


def resolve_dash(path: Path, stream: Path) -> Path:
    """The path, or for `-` the standard input or output."""
    return stream if str(path) == "-" else path


def load_transcript(
    path: Path, reader: Callable[[Path], Transcript] = read_transcript
) -> Transcript:
    """The transcript in a file, `-` for the standard input; or BadParameter where none is read."""
    try:
        return reader(resolve_dash(path, STDIN_PATH))
    except OSError as error:
        raise BadParameter(f"{path}: {error.strerror}") from None


def saves_folder(env: Mapping[str, str]) -> Path:
    """`$XDG_STATE_HOME/dmplay/games`, by the base directory specification."""
    return disk.user_folder(env, "XDG_STATE_HOME", ".local", "state") / "games"


def create_save(problem: str) -> Path | None:
    """An empty file for a new game that others cannot read; None, with one warning, where none
    can be had.
    """
    place = saves_folder(os.environ)
    if not prepare_folder(place):
        return None
    try:
        return create_game_file(place, problem)
    except OSError as error:
        _warn_not_saved(f"{place}: {error.strerror}")
        return None


def create_game_file(game_folder: Path, problem: str) -> Path:
    """A new empty file for a game in a folder, which others cannot read."""
    plain = problem.lstrip("./").replace(":", "-").replace("/", "-")
    stem = f"{time.strftime('%Y%m%d-%H%M%S')}-{plain}"
    for number in count():
        path = game_folder / f"{stem}{f'-{number}' if number else ''}.dmt"
        with contextlib.suppress(FileExistsError):
            os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
            break
    return path


def remove_old_saves() -> int:
    """Removes games of no turns, and of the others all but the last, but none that is played; how
    many of the others.
    """
    place, removed = saves_folder(os.environ), 0
    if not prepare_folder(place):
        return 0
    old = sorted(place.glob("*.dmt"), key=_age_key)
    empty = [path for path in old if not _has_turns(path)]
    real = [path for path in old if path not in empty]
    models = [path for path in real if _has_model_seat(path)]
    people = [path for path in real if path not in models]
    for path in [*empty, *people[: -(MAX_SAVES - 1)], *models[: -(MAX_SAVES - 1)]]:
        with contextlib.suppress(OSError):
            told = path.stat()
            begins = not told.st_size and time.time() - told.st_mtime < NEW_FILE_SECONDS
            if begins or disk.is_game_running(path) or (path in empty and _has_turns(path)):
                continue  # it may have been played, and left, since it was listed
            path.unlink()
            removed += path not in empty
    return removed


def _has_turns(path: Path) -> bool:
    """Whether a turn was played in a kept game, though it may have been taken back."""
    return bool(_find_line(path, b"turn: 1\n"))


def _has_model_seat(path: Path) -> bool:
    """Whether a language model sits in a kept game."""
    return f'"{MODEL_PLAYER}"'.encode() in _find_line(path, b"seats: ")


def _find_line(path: Path, prefix: bytes) -> bytes:
    """The first line of a kept game that begins so; none where there is none."""
    try:
        with path.open("rb") as file:
            return next((line for line in file if line.startswith(prefix)), b"")
    except OSError:
        return b""


@cache  # one warning
def prepare_folder(games_folder: Path) -> bool:
    """Whether games can be kept in a folder; a warning where not."""
    try:
        games_folder.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(OSError):
            for own in (games_folder.parent, games_folder):
                own.chmod(own.stat().st_mode & 0o700)
        if not os.access(games_folder, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        homeless = games_folder.is_relative_to(os.devnull)
        why = "no home; set HOME" if homeless else f"{games_folder}: {error.strerror}"
        _warn_not_saved(why)
        return False
    return True


def _warn_not_saved(reason: str) -> None:
    print(f"warning: this game is not kept: {reason}", file=sys.stderr)


def shell_history_path() -> Path | None:
    """The file of lines typed in the shell; None where it cannot be written."""
    place = saves_folder(os.environ)
    file = place.parent / "history"
    able = prepare_folder(place) and (not file.exists() or os.access(file, os.W_OK))
    return file if able else None


def copy_transcript(recorder: Recorder, path: Path) -> None:
    """Copies a transcript as it is so far; with its end line where the game is over."""
    content = recorder.path.read_text(encoding="utf-8")
    if recorder.session.over and recorder.is_open:
        content += "\n".join([*format_end_block(recorder.session, compute_checksum(content)), ""])
    unfinished = recorder.is_open and not recorder.session.over
    disk.write_file(
        path, [content], private=unfinished and recorder.session.problem.partially_observable
    )


def is_save(path: Path) -> bool:
    """Whether a file is that of a game kept in the state folder."""
    return path.parent == saves_folder(os.environ)


def remove_unplayed_save(recorder: Recorder) -> bool:
    """Removes a kept game in which nothing was done; whether it was one."""
    if not is_save(recorder.path) or recorder.write_error or _has_turns(recorder.path):
        return False
    recorder.path.unlink(missing_ok=True)
    return True


def iter_saves() -> Iterator[Transcript]:
    """The games in the state folder that can be read, the last first."""
    for path in sorted(saves_folder(os.environ).glob("*.dmt"), key=_age_key, reverse=True):
        with contextlib.suppress(DmplayError, OSError):
            yield read_transcript(path)


def iter_unfinished_saves() -> Iterator[Transcript]:
    """The games that have no end, or that the person in it left, the last first."""
    for transcript in iter_saves():
        path, left = (
            Path(transcript.path),
            transcript.end_block is None or transcript.player_end_reason,
        )
        ours = MODEL_PLAYER not in transcript.header.seats.values()
        if ours and left and _has_turns(path) and not disk.is_game_running(path):
            yield transcript


def find_latest_unfinished() -> Path:
    """The last of them; raises BadParameter where there is none."""
    for transcript in iter_unfinished_saves():
        return Path(transcript.path)
    place = saves_folder(os.environ)
    raise BadParameter(f"no unfinished game in {place}; name a file: dmplay resume FILE")


def _age_key(path: Path) -> tuple[float, str]:
    with contextlib.suppress(OSError):  # another program may have removed it
        return path.stat().st_mtime, path.name
    return 0.0, path.name

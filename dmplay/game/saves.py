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
from dmplay.transcript.format import MODEL, checksum, closing
from dmplay.transcript.reading import Transcript, read
from dmplay.transcript.recorder import Recorder

KEPT = 20
NEW = 60  # seconds in which the file of a game that begins may be empty
INPUT, OUTPUT = Path("/dev/stdin"), Path("/dev/stdout")


def standard(path: Path, stream: Path) -> Path:
    """The path, or for `-` the standard input or output."""
    return stream if str(path) == "-" else path


def readable(path: Path, how: Callable[[Path], Transcript] = read) -> Transcript:
    """The transcript in a file, `-` for the standard input; or BadParameter where none is read."""
    try:
        return how(standard(path, INPUT))
    except OSError as error:
        raise BadParameter(f"{path}: {error.strerror}") from None


def folder(env: Mapping[str, str]) -> Path:
    """`$XDG_STATE_HOME/dmplay/games`, by the base directory specification."""
    return disk.user_folder(env, "XDG_STATE_HOME", ".local", "state") / "games"


def new(problem: str) -> Path | None:
    """An empty file for a new game that others cannot read; None, with one warning, where none
    can be had.
    """
    place = folder(os.environ)
    if not ready(place):
        return None
    try:
        return free(place, problem)
    except OSError as error:
        _not_kept(f"{place}: {error.strerror}")
        return None


def free(place: Path, problem: str) -> Path:
    """A new empty file for a game in a folder, which others cannot read."""
    plain = problem.lstrip("./").replace(":", "-").replace("/", "-")
    stem = f"{time.strftime('%Y%m%d-%H%M%S')}-{plain}"
    for number in count():
        path = place / f"{stem}{f'-{number}' if number else ''}.dmt"
        with contextlib.suppress(FileExistsError):
            os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
            break
    return path


def cleared() -> int:
    """Removes games of no turns, and of the others all but the last, but none that is played; how
    many of the others.
    """
    place, removed = folder(os.environ), 0
    if not ready(place):
        return 0
    old = sorted(place.glob("*.dmt"), key=_age)
    empty = [path for path in old if not _has_turns(path)]
    real = [path for path in old if path not in empty]
    models = [path for path in real if _is_models(path)]
    people = [path for path in real if path not in models]
    for path in [*empty, *people[: -(KEPT - 1)], *models[: -(KEPT - 1)]]:
        with contextlib.suppress(OSError):
            told = path.stat()
            begins = not told.st_size and time.time() - told.st_mtime < NEW
            if begins or disk.in_play(path) or (path in empty and _has_turns(path)):
                continue  # it may have been played, and left, since it was listed
            path.unlink()
            removed += path not in empty
    return removed


def _has_turns(path: Path) -> bool:
    """Whether a turn was played in a kept game, though it may have been taken back."""
    return bool(_line(path, b"turn: 1\n"))


def _is_models(path: Path) -> bool:
    """Whether a language model sits in a kept game."""
    return f'"{MODEL}"'.encode() in _line(path, b"seats: ")


def _line(path: Path, beginning: bytes) -> bytes:
    """The first line of a kept game that begins so; none where there is none."""
    try:
        with path.open("rb") as file:
            return next((line for line in file if line.startswith(beginning)), b"")
    except OSError:
        return b""


@cache  # one warning
def ready(place: Path) -> bool:
    """Whether games can be kept in a folder; a warning where not."""
    try:
        place.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(OSError):
            for own in (place.parent, place):
                own.chmod(own.stat().st_mode & 0o700)
        if not os.access(place, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        homeless = place.is_relative_to(os.devnull)
        why = "no home; set HOME" if homeless else f"{place}: {error.strerror}"
        _not_kept(why)
        return False
    return True


def _not_kept(why: str) -> None:
    print(f"warning: this game is not kept: {why}", file=sys.stderr)


def history() -> Path | None:
    """The file of lines typed in the shell; None where it cannot be written."""
    place = folder(os.environ)
    file = place.parent / "history"
    able = ready(place) and (not file.exists() or os.access(file, os.W_OK))
    return file if able else None


def copied(recorder: Recorder, path: Path) -> None:
    """Copies a transcript as it is so far; with its end line where the game is over."""
    content = recorder.path.read_text(encoding="utf-8")
    if recorder.session.over and recorder.open:
        content += "\n".join([*closing(recorder.session, checksum(content)), ""])
    unfinished = recorder.open and not recorder.session.over
    disk.write(path, [content], private=unfinished and recorder.session.problem.hidden)


def keeps(path: Path) -> bool:
    """Whether a file is that of a game kept in the state folder."""
    return path.parent == folder(os.environ)


def dropped(recorder: Recorder) -> bool:
    """Removes a kept game in which nothing was done; whether it was one."""
    if not keeps(recorder.path) or recorder.fault or _has_turns(recorder.path):
        return False
    recorder.path.unlink(missing_ok=True)
    return True


def kept() -> Iterator[Transcript]:
    """The games in the state folder that can be read, the last first."""
    for path in sorted(folder(os.environ).glob("*.dmt"), key=_age, reverse=True):
        with contextlib.suppress(DmplayError, OSError):
            yield read(path)


def unfinished() -> Iterator[Transcript]:
    """The games that have no end, or that the person in it left, the last first."""
    for transcript in kept():
        path, left = Path(transcript.path), transcript.end is None or transcript.chosen
        ours = MODEL not in transcript.header.seats.values()
        if ours and left and _has_turns(path) and not disk.in_play(path):
            yield transcript


def latest_unfinished() -> Path:
    """The last of them; raises BadParameter where there is none."""
    for transcript in unfinished():
        return Path(transcript.path)
    place = folder(os.environ)
    raise BadParameter(f"no unfinished game in {place}; name a file: dmplay resume FILE")


def _age(path: Path) -> tuple[float, str]:
    with contextlib.suppress(OSError):  # another program may have removed it
        return path.stat().st_mtime, path.name
    return 0.0, path.name

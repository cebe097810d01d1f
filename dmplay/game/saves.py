"""Where games without a file of their own are kept: the last twenty, in the state folder."""

import contextlib
import errno
import os
import sys
import time
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from dmplay.errors import BadParameter, DmplayError
from dmplay.transcript.reading import Transcript, read
from dmplay.transcript.recorder import Recorder, played

KEPT = 20
INPUT, OUTPUT = Path("/dev/stdin"), Path("/dev/stdout")


def standard(path: Path, stream: Path) -> Path:
    """The path, or for `-` the standard input or output."""
    return stream if str(path) == "-" else path


def readable(path: Path) -> Transcript:
    """The transcript in a file, `-` for the standard input; or BadParameter where none is read."""
    try:
        return read(standard(path, INPUT))
    except OSError as error:
        raise BadParameter(f"{path}: {error.strerror}") from None


def folder(env: Mapping[str, str]) -> Path:
    """`$XDG_STATE_HOME/dmplay/games`, by the base directory specification."""
    state = env.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(state) / "dmplay" / "games"


def new(problem: str) -> Path | None:
    """A path for a new game, old ones cleared; None, with one warning, where none can be had."""
    place = folder(os.environ)
    if not ready(place):
        return None
    for old in sorted(place.glob("*.dmt"), key=_age)[: -(KEPT - 1)]:
        with contextlib.suppress(OSError):
            old.unlink()
    stem = f"{time.strftime('%Y%m%d-%H%M%S')}-{problem.replace(':', '-').replace('/', '-')}"
    names = (place / f"{stem}{f'-{n}' if n else ''}.dmt" for n in range(10_000))
    return next(path for path in names if not path.exists())


@cache  # one warning
def ready(place: Path) -> bool:
    """Whether games can be kept in a folder; a warning where not."""
    try:
        place.mkdir(parents=True, exist_ok=True)
        if not os.access(place, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        print(f"warning: this game is not kept: {place}: {error.strerror}", file=sys.stderr)
        return False
    return True


def history() -> Path | None:
    """The file of lines typed in the shell; None where it cannot be written."""
    place = folder(os.environ)
    file = place.parent / "history"
    able = ready(place) and (not file.exists() or os.access(file, os.W_OK))
    return file if able else None


def copied(recorder: Recorder, path: Path) -> None:
    """Copies a transcript as it is so far; with its end line where the game is over."""
    content = recorder.path.read_text(encoding="utf-8")
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(content)
    except FileExistsError:
        raise BadParameter(f"{path} exists; give another name") from None
    except OSError as error:
        raise BadParameter(f"cannot write {path}: {error.strerror}") from None
    if recorder.session.over and recorder.open:
        Recorder.resume(path, content, recorder.session).end()


def dropped(recorder: Recorder) -> bool:
    """Removes a kept game in which nothing was done; whether it was one."""
    kept = recorder.path.parent == folder(os.environ) and recorder.path.is_file()
    if not kept or "\nturn: 1\n" in recorder.path.read_text(encoding="utf-8"):
        return False
    recorder.path.unlink()
    return True


def latest_unfinished() -> Path:
    """The last game that has no end, or that its player left."""
    place = folder(os.environ)
    for path in sorted(place.glob("*.dmt"), key=_age, reverse=True):
        try:
            transcript = read(path)
        except (DmplayError, OSError):
            continue
        if (transcript.end is None or transcript.chosen) and not _played(path):
            return path
    raise BadParameter(f"no unfinished game in {place}; name a file: dmplay resume FILE")


def _played(path: Path) -> bool:
    with path.open("rb") as file:
        return played(file.fileno())


def _age(path: Path) -> tuple[float, str]:
    return path.stat().st_mtime, path.name

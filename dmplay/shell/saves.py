"""Where games without a file of their own are kept: the last twenty, in the state folder."""

import os
import sys
import time
from collections.abc import Mapping
from pathlib import Path

from dmplay.errors import BadParameter, DmplayError

KEPT = 20


def folder(env: Mapping[str, str]) -> Path:
    """`$XDG_STATE_HOME/dmplay/games`, by the base directory specification."""
    state = env.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(state) / "dmplay" / "games"


def new(problem: str) -> Path | None:
    """A path for a new game, old ones cleared; None, with one warning, where none can be had."""
    place = folder(os.environ)
    try:
        place.mkdir(parents=True, exist_ok=True)
        for old in sorted(place.glob("*.dmt"), key=_age)[: -(KEPT - 1)]:
            old.unlink()
    except OSError as error:
        print(f"warning: this game is not kept: {place}: {error.strerror}", file=sys.stderr)
        return None
    stem = f"{time.strftime('%Y%m%d-%H%M%S')}-{problem.replace(':', '-').replace('/', '-')}"
    names = (place / f"{stem}{f'-{n}' if n else ''}.dmt" for n in range(10_000))
    return next(path for path in names if not path.exists())


def latest_unfinished() -> Path:
    """The last game that has no end, or that its player left."""
    from dmplay.transcript.reading import read
    from dmplay.transcript.verify import CHOSEN, reason

    place = folder(os.environ)
    for path in sorted(place.glob("*.dmt"), key=_age, reverse=True):
        try:
            transcript = read(path)
        except (DmplayError, OSError):
            continue
        if transcript.end is None or reason(transcript.end) in CHOSEN:
            return path
    raise BadParameter(f"no unfinished game in {place}; name a file: dmplay resume FILE")


def _age(path: Path) -> tuple[float, str]:
    return path.stat().st_mtime, path.name

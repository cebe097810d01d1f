"""Problems in files: `FILE.pomdp`, `.mdp`, `.dpomdp`, `.nfg`, `.efg`."""

import hashlib
from functools import lru_cache
from pathlib import Path

from dmplay import disk
from dmplay.core import Problem
from dmplay.errors import BadParameter, TooMuch
from dmplay.finding import guests
from dmplay.finding.ways import Found

DIGITS = 16  # of a hash, by which two files are told apart


def find(name: str) -> Found:
    """The problem that a file holds; its origin is the file's hash."""
    path = Path(name)
    try:
        raw = disk.content(path)
    except OSError as error:
        raise BadParameter(f"{name}: {error.strerror}") from None
    origin = f"sha256:{hashlib.sha256(raw).hexdigest()[:DIGITS]}"
    if path.suffix.lower() == ".efg":  # which OpenSpiel reads
        found = guests.find(f"openspiel:efg_game(filename={name})")
        return Found(name, found.problem, f"{origin}, {found.origin}")
    try:
        return Found(name, _read(name, raw), origin)
    except TooMuch as error:
        raise BadParameter(f"{name}: {error}") from None


@lru_cache(maxsize=2)
def _read(name: str, raw: bytes) -> Problem:
    """The problem of a file of this content, read once."""
    from dmplay.files import gambit, markov  # not needed where none is played

    suffix = Path(name).suffix.lower()
    if suffix == ".nfg":
        return gambit.read(name, raw)
    return markov.read(name, raw, team=suffix == ".dpomdp")

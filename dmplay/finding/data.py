"""Problems in files: `FILE.pomdp`, `.mdp`, `.dpomdp`, `.nfg`, `.efg`."""

import hashlib
from functools import lru_cache
from pathlib import Path

from dmplay import disk
from dmplay.core import Problem
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.finding import guests
from dmplay.finding.ways import LookupResult

HASH_DIGITS = 16  # digits of a hash that identifies a file


def load_data_problem(name: str) -> LookupResult:
    """Return the problem in a data file; its origin is the file's hash."""
    path = Path(name)
    try:
        raw = disk.read_bytes(path)
    except OSError as error:
        raise BadParameter(f"{name}: {error.strerror}") from None
    origin = f"sha256:{hashlib.sha256(raw).hexdigest()[:HASH_DIGITS]}"
    if path.suffix.lower() == ".efg":  # read by OpenSpiel
        result = guests.load_external_problem(f"openspiel:efg_game(filename={name})")
        return LookupResult(name, result.problem, f"{origin}, {result.origin}")
    try:
        return LookupResult(name, _parse_problem(name, raw), origin)
    except BudgetExceeded as error:
        raise BadParameter(f"{name}: {error}") from None


@lru_cache(maxsize=2)
def _parse_problem(name: str, raw: bytes) -> Problem:
    """Return the problem in a file of this content, which is parsed once."""
    from dmplay.files import gambit, markov  # imported only if such a file is read

    suffix = Path(name).suffix.lower()
    if suffix == ".nfg":
        return gambit.read_nfg(name, raw)
    return markov.read_markov_file(name, raw, team=suffix == ".dpomdp")

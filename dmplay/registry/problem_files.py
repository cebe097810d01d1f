"""Problems in files: `FILE.pomdp`, `.mdp`, `.dpomdp`, `.nfg`, `.efg`."""

from functools import lru_cache
from pathlib import Path

from dmplay.core import safe_files
from dmplay.core.problem import Problem
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.registry import library_problems
from dmplay.registry.problem_name_kinds import LookupResult

HASH_DIGITS = 16  # digits of a hash that identifies a file


def load_data_problem(name: str) -> LookupResult:
    """Return the problem in a data file, with its hash; raise BadParameter if it is invalid."""
    path = Path(name)
    try:
        raw = safe_files.read_bytes(path)
    except OSError as error:
        raise BadParameter(f"{name}: {error.strerror}") from None
    import hashlib  # takes several ms, and few commands read a file

    origin = f"sha256:{hashlib.sha256(raw).hexdigest()[:HASH_DIGITS]}"
    if path.suffix.lower() == ".efg":  # read by OpenSpiel
        result = library_problems.load_library_problem(f"openspiel:efg_game(filename={name})")
        return LookupResult(name, result.problem, f"{origin}, {result.origin}")
    try:
        return LookupResult(name, _parse_problem(name, raw), origin)
    except BudgetExceeded as error:
        raise BadParameter(f"{name}: {error}") from None


@lru_cache(maxsize=2)
def _parse_problem(name: str, raw: bytes) -> Problem:
    """Return the problem in a file of this content, which is parsed once."""
    from dmplay.formats import cassandra, gambit_nfg  # imported only if such a file is read

    suffix = Path(name).suffix.lower()
    if suffix == ".nfg":
        return gambit_nfg.read_nfg(name, raw)
    return cassandra.read_markov_file(name, raw, team=suffix == ".dpomdp")

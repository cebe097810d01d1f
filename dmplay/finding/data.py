"""Problems in files: `FILE.pomdp`, `.mdp`, `.dpomdp`, `.nfg`, `.efg`."""

from dmplay.errors import BadParameter
from dmplay.finding.ways import Found


def find(name: str) -> Found:
    """The problem that a file holds; its origin is the file's hash."""
    raise BadParameter(f"{name}: cannot be read yet")

"""Problems of other libraries: `gymnasium:ID`, `pettingzoo:ID`, `openspiel:GAME(ARGUMENTS)`."""

from dmplay.errors import BadParameter
from dmplay.finding.ways import Found

LIBRARIES = ("gymnasium", "pettingzoo", "openspiel")


def takes(name: str) -> bool:
    """Whether a name is that of a problem of another library."""
    library, colon, _ = name.partition(":")
    return bool(colon) and library in LIBRARIES


def find(name: str) -> Found:
    """The problem of this name; its origin is the library's version."""
    library = name.partition(":")[0]
    raise BadParameter(f"{name}: install the extra {library}: pip install 'dmplay[{library}]'")

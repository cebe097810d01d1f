"""Problems of other libraries: `gymnasium:ID`, `pettingzoo:ID`, `openspiel:GAME(ARGUMENTS)`."""

from importlib import import_module

from dmplay.errors import BadParameter
from dmplay.finding.ways import Found
from dmplay.guests.extras import origin

LIBRARIES = {  # by the word before the colon, the package that is asked
    "gymnasium": "gymnasium",
    "pettingzoo": "pettingzoo",
    "openspiel": "open-spiel",
}


def takes(name: str) -> bool:
    """Whether a name is that of a problem of another library."""
    library, colon, _ = name.partition(":")
    return bool(colon) and library in LIBRARIES


def names(word: str) -> list[str]:
    """The problems of the library before the colon; none where it is not installed."""
    library = word.partition(":")[0]
    try:
        known: list[str] = import_module(f"dmplay.guests.{library}").names()
    except BadParameter:
        return []
    return [f"{library}:{name}" for name in known]


def find(name: str) -> Found:
    """The problem of this name; its origin is the library's version."""
    library = name.partition(":")[0]
    problem = import_module(f"dmplay.guests.{library}").find(name)
    return Found(name, problem, origin(LIBRARIES[library]))

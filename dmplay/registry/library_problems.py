"""Problems of other libraries: `gymnasium:ID`, `pettingzoo:ID`, `openspiel:GAME(ARGUMENTS)`."""

from importlib import import_module

from dmplay.errors import BadParameter
from dmplay.registry.problem_name_kinds import LookupResult

LIBRARY_PACKAGES = {  # package of each library, by the word before the colon
    "gymnasium": "gymnasium",
    "pettingzoo": "pettingzoo",
    "openspiel": "open-spiel",
}


def names_external_problem(name: str) -> bool:
    """Return whether a name is that of a problem of another library."""
    library, colon, _ = name.partition(":")
    return bool(colon) and library in LIBRARY_PACKAGES


def list_external_problems(word: str) -> list[str]:
    """Return the names of the problems of the library before the colon.

    The list is empty if the library is not installed.
    """
    library = word.partition(":")[0]
    try:
        library_names: list[str] = import_module(f"dmplay.external.{library}").list_problem_names()
    except BadParameter:
        return []
    return [f"{library}:{name}" for name in library_names]


def load_library_problem(name: str) -> LookupResult:
    """Return the problem of this name; its origin is the library's version."""
    from dmplay.external.optional_libraries import format_library_version

    library = name.partition(":")[0]
    problem = import_module(f"dmplay.external.{library}").load_problem(name)
    return LookupResult(name, problem, format_library_version(LIBRARY_PACKAGES[library]))

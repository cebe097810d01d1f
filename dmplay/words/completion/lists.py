"""Names that can be typed next, those of problems without an import of one."""

import os
from pathlib import Path

from dmplay.finding.names import problem_names

LIST_FILTERS = ("MDP", "POMDP", "simple", "Markov", "POMG", "Dec-POMDP", "games")
MAX_SEEDS = 20  # of games played before


def complete_problems(word: str = "") -> list[str]:
    """The problems, those that are installed too; once a name stands before a colon, its variants,
    or what the library of this name has.

    No code but our own, and that of the library, is run for them.
    """
    base, colon, _ = word.partition(":")
    if colon and base in problem_names():
        from dmplay.finding import problems

        return [f"{base}:{variant}" for variant in problems.load_variants(base) if variant]
    if colon:
        from dmplay.finding import guests

        if guests.names_external_problem(word):
            return guests.list_external_problems(word)
    from dmplay.finding.installed import entry_point_targets

    return [*problem_names(), *sorted(entry_point_targets())]


def list_figures() -> list[str]:
    """The figures and tables of the book."""
    from dmplay.figures import every

    return [*every.load_figures()]


def complete_transcripts(word: str = "") -> list[str]:
    """The transcripts and folders that a path can go on to."""
    folder = Path(word).parent if word and not word.endswith("/") else Path(word or ".")
    try:
        found = sorted(folder.iterdir())
    except OSError:
        return []
    names = [f"{path}/" if path.is_dir() else str(path) for path in found]
    return [name for name in names if name.endswith((".dmt", "/")) and not name.startswith(".")]


def list_saved_seeds() -> list[str]:
    """The seeds of the games that are kept, the last first; not of what people still play."""
    from dmplay.game.saves import saves_folder
    from dmplay.transcript.format import EXTERNAL_PLAYERS

    found: dict[str, None] = {}
    for path in sorted(saves_folder(os.environ).glob("*.dmt"), reverse=True)[:MAX_SEEDS]:
        header, _, turns = path.read_text(encoding="utf-8", errors="replace").partition("\n\n")
        if any(f'"{who}"' in header for who in EXTERNAL_PLAYERS) and "\nend: " not in turns:
            continue
        for line in header.splitlines():
            key, _, value = line.partition(": ")
            if key == "seed":
                found[value] = None
    return [*found]

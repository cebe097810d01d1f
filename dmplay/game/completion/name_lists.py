"""Completions of names; those of problems are listed without importing a problem."""

from pathlib import Path

from dmplay.game.plot_kinds import PLOT_KINDS, list_book_figures
from dmplay.registry.builtin_names import problem_names

LIST_FILTERS = ("MDP", "POMDP", "simple", "Markov", "POMG", "Dec-POMDP", "games")
MAX_SEEDS = 20  # maximum number of saved games that are searched


def complete_problems(word: str = "") -> list[str]:
    """Return all problems, also installed ones; after `NAME:`, the variants of that problem.

    After the name of an external library and a colon, return its environments. Only code of dmplay
    and of that library is run.
    """
    base, colon, _ = word.partition(":")
    if colon and base in problem_names():
        from dmplay.registry import problems

        return [f"{base}:{variant}" for variant in problems.load_variants(base) if variant]
    if colon:
        from dmplay.registry import library_problems

        if library_problems.names_external_problem(word):
            return library_problems.list_external_problems(word)
    from dmplay.registry.entry_points import entry_point_targets

    return [*problem_names(), *sorted(entry_point_targets())]


def list_plots() -> list[str]:
    """Return the kinds of plots and the figures of the book."""
    return [*PLOT_KINDS, *list_book_figures()]


def complete_prediction_kinds(word: str = "") -> list[str]:
    """Return the kinds of predictions that a game can ask for."""
    from dmplay.game.predictions import PREDICTION_KINDS

    return [*PREDICTION_KINDS]


def list_algorithms() -> list[str]:
    """Return the names of the algorithms that can be watched."""
    from dmplay.algorithms.registry import load_algorithms

    return [*load_algorithms()]


def list_learners() -> list[str]:
    """Return the names of the learning algorithms."""
    from dmplay.algorithms.registry import load_learners

    return [*load_learners()]


def complete_transcripts(word: str = "") -> list[str]:
    """Return the transcripts and folders in the folder of a partial path, without hidden ones."""
    folder = Path(word).parent if word and not word.endswith("/") else Path(word or ".")
    try:
        entries = sorted(folder.iterdir())
    except OSError:
        return []
    names = [f"{path}/" if path.is_dir() else str(path) for path in entries]
    return [name for name in names if name.endswith((".dmt", "/")) and not name.startswith(".")]


def list_saved_seeds() -> list[str]:
    """Return the seeds of the newest 20 saves, newest first.

    Games that a person or a language model has not finished are omitted, because their seeds are
    not to be disclosed.
    """
    from dmplay.game.saves import list_saves
    from dmplay.transcript.external_players import EXTERNAL_PLAYERS

    seeds_in_order: dict[str, None] = {}
    for path in list_saves()[:MAX_SEEDS]:
        header, _, body = path.read_text(encoding="utf-8", errors="replace").partition("\n\n")
        if any(f'"{player}"' in header for player in EXTERNAL_PLAYERS) and "\nend: " not in body:
            continue
        for line in header.splitlines():
            key, _, value = line.partition(": ")
            if key == "seed" and value.isdecimal():
                seeds_in_order[value] = None
    return [*seeds_in_order]

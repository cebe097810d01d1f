"""Completion at the prompt and in the screen's command row."""

from collections.abc import Callable, Iterable

from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document

from dmplay.finding.topics import topics
from dmplay.game.formats import FORMATS
from dmplay.game.table import Table
from dmplay.words.commands import COMMANDS, TOPICS
from dmplay.words.completion import lists
from dmplay.words.completion.problem import agents, parameters, seats

OPTIONS = (
    "--variant", "--set", "--seed", "--episode", "--agent", "--vs", "--seat", "--ghost", "--turns",
    "--record", "--frames", "--force", "--reveal", "--strict", "--strict=hints", "--keys",
    "--player", "--assignment", "--trust",
)  # fmt: skip
EXPORT = (
    *(f"--{name}" for name in FORMATS), "--at", "--hint", "--width", "--height", "--ascii",
    "--output", "--force", "--peek", "--trust",
)  # fmt: skip


class Candidates(Completer):
    """What can stand where the cursor is; the fuzzy completer takes away the word under it."""

    def __init__(self, table: Table) -> None:
        self._table = table

    def get_completions(self, document: Document, event: CompleteEvent) -> Iterable[Completion]:
        """All candidates, the completer around this one chooses; none that tell what is hidden."""
        if self._table.secret:
            return []
        before = document.text_before_cursor.rpartition(";")[2]
        return map(Completion, candidates(self._table, before))


def candidates(table: Table, before: str) -> list[str]:
    """The words that can follow what stands before the cursor, the one under it left out."""
    words = before.split()
    if not words:
        begun = [] if table.playing else lists.problems()
        return [*actions(table), *(one.name for one in COMMANDS), *table.aliases, *begun]
    command, *rest = words
    last = rest[-1] if rest else ""
    if command == "play" or (not table.playing and command in lists.problems()):
        return _options(rest if command == "play" else words, last)
    if command in ("info", "agents", "solve"):
        return [] if rest else _specs()
    if command in ("load", "replay", "save", "export", "resume"):
        files = [] if rest else lists.transcripts()
        return [*files, *EXPORT] if command == "export" else files
    simple: dict[str, Callable[[], list[str]]] = {
        "act": lambda: actions(table),
        "agent": lambda: _seats(table, rest),
        "set": lambda: [] if rest else [name.rstrip("=") for name in _parameters(table)],
        "seed": lambda: [*_own_seed(table), *lists.seeds()],
        "figure": lists.figures,
        "guide": lambda: [*topics()],
        "list": lambda: [*lists.KINDS],
        "help": lambda: [*TOPICS, *(one.name for one in COMMANDS)],
    }
    return simple[command]() if command in simple else []


def actions(table: Table) -> list[str]:
    """The labels of the actions of the one who chooses."""
    if not table.playing:
        return []
    return [*table.game.session.labels(table.game.watcher)]


def _specs() -> list[str]:
    """Every problem and every variant."""
    names = lists.problems()
    return names + [spec for name in names for spec in lists.problems(f"{name}:")]


def _options(rest: list[str], last: str) -> list[str]:
    """What can follow `play`: a problem, its options and their values."""
    if not rest:
        return _specs()
    values = {
        "--agent": agents, "--vs": agents, "--ghost": agents, "--seat": _seated,
        "--set": parameters,
    }  # fmt: skip
    if last in values:
        return values[last](rest[0])
    return lists.seeds() if last == "--seed" else [*OPTIONS]


def _seated(problem: str) -> list[str]:
    """Every seat with everyone who can play there."""
    return [seat + agent for seat in seats(problem) for agent in agents(problem)]


def _own_seed(table: Table) -> list[str]:
    return [str(table.game.seed)] if table.playing and table.game.shows_seed else []


def _parameters(table: Table) -> list[str]:
    return parameters(table.game.name) if table.playing else []


def _seats(table: Table, rest: list[str]) -> list[str]:
    if not table.playing or len(rest) > 1:
        return []
    game = table.game
    return agents(game.name) if rest else [*game.problem.agents]

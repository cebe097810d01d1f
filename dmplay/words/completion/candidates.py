"""Completion at the prompt and in the screen's command row."""

from collections.abc import Callable, Iterable

from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document

from dmplay.finding.topics import list_topics
from dmplay.game.formats import EXPORT_FORMATS
from dmplay.game.table import GameController
from dmplay.words.commands import COMMANDS, COMMANDS_BY_TOPIC
from dmplay.words.completion import lists
from dmplay.words.completion.problem import complete_agents, complete_seats, list_parameters

PLAY_OPTIONS = (
    "--variant", "--set", "--seed", "--episode", "--agent", "--vs", "--seat", "--ghost", "--turns",
    "--record", "--frames", "--force", "--reveal", "--strict", "--strict=hints", "--keys",
    "--player", "--assignment", "--trust",
)  # fmt: skip
EXPORT_OPTIONS = (
    *(f"--{name}" for name in EXPORT_FORMATS), "--at", "--hint", "--width", "--height", "--ascii",
    "--output", "--force", "--peek", "--trust",
)  # fmt: skip


class CommandCompleter(Completer):
    """What can stand where the cursor is; the fuzzy completer takes away the word under it."""

    def __init__(self, controller: GameController) -> None:
        self._controller = controller

    def get_completions(self, document: Document, event: CompleteEvent) -> Iterable[Completion]:
        """All candidates, the completer around this one chooses; none that tell what is hidden."""
        if self._controller.is_input_hidden:
            return []
        before = document.text_before_cursor.rpartition(";")[2]
        return map(Completion, complete_line(self._controller, before))


def complete_line(controller: GameController, text_before_cursor: str) -> list[str]:
    """The words that can follow what stands before the cursor, the one under it left out."""
    words = text_before_cursor.split()
    if not words:
        begun = [] if controller.has_game else lists.complete_problems()
        return [
            *list_actions(controller),
            *(one.name for one in COMMANDS),
            *controller.aliases,
            *begun,
        ]
    command, *rest = words
    last = rest[-1] if rest else ""
    if command == "play" or (not controller.has_game and command in lists.complete_problems()):
        return _complete_play_options(rest if command == "play" else words, last)
    if command in ("info", "agents", "solve"):
        return [] if rest else _list_problem_specs()
    if command in ("load", "replay", "save", "export", "resume"):
        files = [] if rest else lists.complete_transcripts()
        return [*files, *EXPORT_OPTIONS] if command == "export" else files
    simple: dict[str, Callable[[], list[str]]] = {
        "act": lambda: list_actions(controller),
        "agent": lambda: _complete_agent_arguments(controller, rest),
        "set": lambda: (
            [] if rest else [name.rstrip("=") for name in _list_current_parameters(controller)]
        ),
        "seed": lambda: [*_list_current_seed(controller), *lists.list_saved_seeds()],
        "figure": lists.list_figures,
        "guide": lambda: [*list_topics()],
        "list": lambda: [*lists.LIST_FILTERS],
        "help": lambda: [*COMMANDS_BY_TOPIC, *(one.name for one in COMMANDS)],
    }
    return simple[command]() if command in simple else []


def list_actions(controller: GameController) -> list[str]:
    """The labels of the actions of the one who chooses."""
    if not controller.has_game:
        return []
    return [*controller.game.session.action_labels(controller.game.viewing_seat)]


def _list_problem_specs() -> list[str]:
    """Every problem and every variant."""
    names = lists.complete_problems()
    return names + [spec for name in names for spec in lists.complete_problems(f"{name}:")]


def _complete_play_options(arguments: list[str], last_word: str) -> list[str]:
    """What can follow `play`: a problem, its options and their values."""
    if not arguments:
        return _list_problem_specs()
    values = {
        "--agent": complete_agents, "--vs": complete_agents, "--ghost": complete_agents, "--seat": _list_seat_assignments,
        "--set": list_parameters,
    }  # fmt: skip
    if last_word in values:
        return values[last_word](arguments[0])
    return lists.list_saved_seeds() if last_word == "--seed" else [*PLAY_OPTIONS]


def _list_seat_assignments(problem: str) -> list[str]:
    """Every seat with everyone who can play there."""
    return [seat + agent for seat in complete_seats(problem) for agent in complete_agents(problem)]


def _list_current_seed(controller: GameController) -> list[str]:
    return (
        [str(controller.game.seed)]
        if controller.has_game and controller.game.is_seed_visible
        else []
    )


def _list_current_parameters(controller: GameController) -> list[str]:
    return list_parameters(controller.game.problem_name) if controller.has_game else []


def _complete_agent_arguments(controller: GameController, arguments: list[str]) -> list[str]:
    if not controller.has_game or len(arguments) > 1:
        return []
    game = controller.game
    return complete_agents(game.problem_name) if arguments else [*game.problem.agents]

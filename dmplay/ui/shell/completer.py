"""Completion of commands at the prompt and in the screen's command row."""

from collections.abc import Callable, Iterable

from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document

from dmplay.game.completion import name_lists
from dmplay.game.completion.agents_seats_and_parameters import (
    complete_agents,
    complete_seats,
    list_parameters,
)
from dmplay.game.export_formats import EXPORT_FORMATS
from dmplay.game.game_series import GameController
from dmplay.guide.topics import list_topics
from dmplay.tutor.lesson_list import list_builtin_words
from dmplay.ui.shell.commands import COMMANDS, COMMANDS_BY_TOPIC

COMMAND_BREAKS = frozenset(";#")  # `;` begins another command, `#` a comment
PLAY_OPTIONS = (
    "--variant", "--set", "--seed", "--episode", "--agent", "--vs", "--seat", "--ghost",
    "--predict", "--state-belief", "--turns", "--record", "--keep", "--frames", "--force",
    "--reveal", "--strict",
    "--strict=hints", "--keys",
    "--player", "--assignment", "--trust",
)  # fmt: skip
EXPORT_OPTIONS = (
    *(f"--{name}" for name in EXPORT_FORMATS), "--at", "--hint", "--width", "--height", "--ascii",
    "--output", "--force", "--meta", "--peek", "--review", "--trust",
)  # fmt: skip


class CommandCompleter(Completer):
    """A completer of shell commands, to be wrapped by a fuzzy completer that filters them."""

    def __init__(self, controller: GameController) -> None:
        self._controller = controller

    def get_completions(self, document: Document, event: CompleteEvent) -> Iterable[Completion]:
        """Return all words that can follow, unfiltered; none while typed input is hidden."""
        if self._controller.is_input_hidden:
            return []
        command_text = document.text_before_cursor.rpartition(";")[2]
        words = complete_line(self._controller, command_text)
        return [Completion(word) for word in words if _is_within_a_command(word)]


def _is_within_a_command(word: str) -> bool:
    """Return whether a word, typed as it is, neither ends its command nor begins a comment."""
    return word.isprintable() and COMMAND_BREAKS.isdisjoint(word)


def complete_line(controller: GameController, text_before_cursor: str) -> list[str]:
    """Return the words that can come next; `text_before_cursor` excludes the partial word."""
    words = text_before_cursor.split()
    if not words:
        problem_names = [] if controller.has_game else name_lists.complete_problems()
        names = (entry.name for entry in COMMANDS)
        return [*list_actions(controller), *names, *controller.aliases, *problem_names]
    command, *arguments = words
    last_word = arguments[-1] if arguments else ""
    if command == "play" or (not controller.has_game and command in name_lists.complete_problems()):
        return _complete_play_options(arguments if command == "play" else words, last_word)
    if command in ("info", "agents", "solve"):
        return [] if arguments else _list_problem_specs()
    if command in ("load", "replay", "save", "export", "resume"):
        files = [] if arguments else name_lists.complete_transcripts()
        return [*files, *EXPORT_OPTIONS] if command == "export" else files
    completers: dict[str, Callable[[], list[str]]] = {
        "act": lambda: list_actions(controller),
        "whatif": lambda: list_actions(controller),
        "why": lambda: list_actions(controller),
        "agent": lambda: _complete_agent_arguments(controller, arguments),
        "assume": lambda: _complete_agent_arguments(controller, arguments),
        "seat": lambda: (
            _list_seat_assignments(controller.game.problem_name) if controller.has_game else []
        ),
        "set": lambda: (
            [] if arguments else [name.rstrip("=") for name in _list_current_parameters(controller)]
        ),
        "seed": lambda: [*_list_current_seed(controller), *name_lists.list_saved_seeds()],
        "plot": lambda: (
            name_lists.list_plots() if not arguments else name_lists.complete_problems()
        ),
        "guide": lambda: [*list_topics()],
        "learn": lambda: [] if arguments else list_builtin_words(),
        "watch": lambda: [] if arguments else name_lists.list_algorithms(),
        "list": lambda: [*name_lists.LIST_FILTERS],
        "help": lambda: [*COMMANDS_BY_TOPIC, *(entry.name for entry in COMMANDS)],
    }
    return completers[command]() if command in completers else []


def list_actions(controller: GameController) -> list[str]:
    """Return the action labels of the seat that chooses; [] without a game."""
    if not controller.has_game:
        return []
    return [*controller.game.session.action_labels(controller.game.viewing_seat)]


def _list_problem_specs() -> list[str]:
    """Return all problems and all their variants."""
    names = name_lists.complete_problems()
    return names + [spec for name in names for spec in name_lists.complete_problems(f"{name}:")]


def _complete_play_options(arguments: list[str], last_word: str) -> list[str]:
    """Return the completions of `play`: a problem, an option, or a value of the last option."""
    if not arguments:
        return _list_problem_specs()
    values: dict[str, Callable[[str], list[str]]] = {
        "--agent": complete_agents,
        "--vs": complete_agents,
        "--ghost": complete_agents,
        "--seat": _list_seat_assignments,
        "--set": list_parameters,
        "--predict": name_lists.complete_prediction_kinds,
    }
    if last_word in values:
        return values[last_word](arguments[0])
    return name_lists.list_saved_seeds() if last_word == "--seed" else [*PLAY_OPTIONS]


def _list_seat_assignments(problem: str) -> list[str]:
    """Return every `SEAT=AGENT` setting of a problem."""
    return [seat + agent for seat in complete_seats(problem) for agent in complete_agents(problem)]


def _list_current_seed(controller: GameController) -> list[str]:
    """Return the seed of the current game if it may be shown."""
    is_visible = controller.has_game and controller.game.is_seed_visible
    return [str(controller.game.seed)] if is_visible else []


def _list_current_parameters(controller: GameController) -> list[str]:
    """Return the parameters of the current problem as `NAME=`; [] without a game."""
    return list_parameters(controller.game.problem_name) if controller.has_game else []


def _complete_agent_arguments(controller: GameController, arguments: list[str]) -> list[str]:
    """Return the completions of `agent` and `assume`: a seat, then an agent."""
    if not controller.has_game or len(arguments) > 1:
        return []
    game = controller.game
    return complete_agents(game.problem_name) if arguments else [*game.problem.agents]

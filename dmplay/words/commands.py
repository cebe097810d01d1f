"""The commands: one table that typed words, keys, help, completion and the key row all read."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from typing import NamedTuple

from dmplay.errors import BadParameter, IllegalAction, UnknownName
from dmplay.finding.names import problem_names
from dmplay.finding.problems import is_problem_name
from dmplay.game.answer import format_reply
from dmplay.game.game import Game
from dmplay.game.request import split_words
from dmplay.game.table import GameController
from dmplay.keys.keymap import KEY_SYMBOLS
from dmplay.words import game_commands as of_game
from dmplay.words import table_commands as of_table
from dmplay.words.lesson import lesson_lines

CommandFunction = Callable[[GameController, str], str]
INVALID_TEXT = re.compile(r"[\x00\ud800-\udfff]")  # NUL, and halves of characters
SYNONYMS = {"value": "values", "exit": "quit", "resume": "load"}
SHORT_NAMES = {"q": "quit", "?": "help"}  # which actions may be called too


class PlayerQuit(Exception):
    """The player leaves the game, with an exit code."""

    def __init__(self, exit_code: int = 0) -> None:
        super().__init__(exit_code)
        self.exit_code = exit_code


class Command(NamedTuple):
    """A command: its name and argument, what it does, its key on the screen."""

    name: str
    argument_help: str
    help: str
    run: CommandFunction
    key: str = ""  # as prompt-toolkit names it
    key_label: str = ""  # as the key row names it


def _bind_to_game(run: Callable[[Game, str], str]) -> CommandFunction:
    """A command of the game that is played."""
    return lambda table, argument: run(table.game, argument)


def _bind_to_cli(name: str) -> CommandFunction:
    """A command of the command line."""
    return lambda table, argument: table.run_cli_words([name, *split_words(argument)])


def _bind_problem_to_cli(name: str, *, pass_parameters: bool = False) -> CommandFunction:
    """A command of the command line about a problem, the one that is played if none is named.

    That one with its parameters, where the command takes them.
    """

    def run(controller: GameController, argument: str) -> str:
        words = split_words(argument)
        named = words and (not words[0].startswith("-") or any(map(is_problem_name, words)))
        if named or not controller.has_game:
            return controller.run_cli_words([name, *words])
        told = controller.game.settings if pass_parameters else []
        more = [word for one in told for word in ("--set", one)]
        return controller.run_cli_words([name, controller.game.problem_name, *more, *words])

    return run


@contextmanager
def conceal_choice_errors(controller: GameController) -> Iterator[None]:
    """Tells nothing of a choice that cannot be played, where another person may look on."""
    try:
        yield
    except (UnknownName, BadParameter, IllegalAction):
        if not controller.is_input_hidden:
            raise
        told = "that cannot be played; help and legal tell what can be typed"
        raise BadParameter(told) from None


def _play_typed_action(controller: GameController, argument: str) -> str:
    """Plays an action."""
    with conceal_choice_errors(controller):
        return _play_action(controller, argument)


def _play_action(controller: GameController, argument: str) -> str:
    game = controller.game
    try:
        action = game.keyboard.parse_action(game.view(), argument)
    except UnknownName:
        known = game.session.action_labels(game.viewing_seat)
        word, _, rest = argument.partition(" ")
        if not word or (rest and word.lower() in known):
            told = f"act: got {argument!r}, expected one action; ';' stands between several"
            raise BadParameter(told if rest else "act: expected an action") from None
        near = get_close_matches(word.lower(), known, cutoff=0.5)  # an action before a command
        names = known if near else [*known, *(command.name for command in COMMANDS)]
        raise UnknownName("action", word, names) from None
    if game.choose(action):
        return game.narrator.describe_turn(game.snapshot())
    if game.session.over:
        return ""
    assert game.choosing_seat is not None
    return f"chosen. {game.problem.agents[game.choosing_seat]} is next."


def _preview_action(controller: GameController, argument: str) -> str:
    """What an action may bring, of a choice that another may not know."""
    with conceal_choice_errors(controller):
        return of_game.preview_typed_action(controller.game, argument)


def _show_keys(controller: GameController, argument: str) -> str:
    game = controller.game
    legal = game.keyboard.list_actions_with_keys(game.view())
    actions = ", ".join(f"{label} {key}".strip() for key, label, _ in legal)
    commands = ", ".join(f"{c.name} {c.key_label}" for c in COMMANDS if c.key)
    return f"keys: {actions}. {commands}."


def _quit(controller: GameController, argument: str) -> str:
    raise PlayerQuit


def _show_help(controller: GameController, argument: str) -> str:
    if argument.lower() in COMMANDS_BY_TOPIC:
        return format_reply([*map(_format_command_help, COMMANDS_BY_TOPIC[argument.lower()])])
    if _is_action_name(controller, argument):
        return f"{argument}: an action; its name alone plays it"
    if argument.partition(":")[0] in problem_names():
        return f"{argument}: a problem; play {argument} begins it, info {argument} tells of it"
    if argument:
        return _format_command_help(find_command(argument, [*COMMANDS_BY_TOPIC]))
    rows = [*lesson_lines(controller.game), ""] if controller.has_game else []
    rows += ["an action is played by its name. help tells more of a command, or of a topic:"]
    rows += [
        f"{topic}: {', '.join(command.name for command in commands)}"
        for topic, commands in COMMANDS_BY_TOPIC.items()
    ]
    return format_reply(rows)


def format_help_page(game: Game, screen_keys: Sequence[tuple[str, str, str]]) -> list[str]:
    """The problem, the keys that play, a screen's own and those of commands; commands without one.

    Of a key: how it is shown, its name, what it does.
    """
    legal = game.keyboard.list_actions_with_keys(game.view())[:10]
    actions = [f"{KEY_SYMBOLS.get(key, key)} {label}".strip() for key, label, _ in legal]
    keys = [(c.key_label, f"{c.name} {c.argument_help}".strip(), c.help) for c in COMMANDS if c.key]
    others = [command.name for command in COMMANDS if not command.key]
    return [
        *lesson_lines(game),
        "",
        f"actions: {',  '.join(actions) or 'a number, and Enter'}",
        "keys",
        *(f"  {shown:<7} {name:<14} {help_}" for shown, name, help_ in [*screen_keys, *keys]),
        f"commands, typed after ':'  {' '.join(others)}",
    ]


def _format_command_help(command: Command) -> str:
    return f"{f'{command.name} {command.argument_help}'.strip()}: {command.help}"


COMMANDS_BY_TOPIC: Mapping[str, tuple[Command, ...]] = {
    "turns": (
        Command("act", "ACTION", "play an action; its name alone does too", _play_typed_action),
        Command(
            "hint",
            "",
            "what a good player would do here",
            _bind_to_game(of_game.show_hint),
            "tab",
            "Tab",
        ),
        Command(
            "undo",
            "[N]",
            "take back the last turn, or N",
            _bind_to_game(of_game.undo_turns),
            "backspace",
            "Bksp",
        ),
        Command(
            "redo",
            "[N]",
            "play again what was taken back",
            _bind_to_game(of_game.redo_turns),
            "c-r",
            "Ctrl-R",
        ),
        Command(
            "reroll",
            "",
            "the last turn under other dice; recorded so",
            _bind_to_game(of_game.reroll_turn),
        ),
        Command(
            "look",
            "",
            "the situation in sentences",
            _bind_to_game(of_game.show_situation),
            "L",
            "L",
        ),
        Command(
            "legal", "", "the actions that can be played", _bind_to_game(of_game.show_legal_actions)
        ),
        Command(
            "belief", "", "the probability of each hidden state", _bind_to_game(of_game.show_belief)
        ),
        Command("state", "", "the state in one line", _bind_to_game(of_game.show_state)),
        Command("values", "", "what each action is worth", _bind_to_game(of_game.show_values)),
        Command("whatif", "ACTION", "what an action may bring", _preview_action, key_label="W"),
        Command(
            "policy", "", "the action of a good player", _bind_to_game(of_game.show_best_action)
        ),
        Command("step", "[N]", "a turn of agents, or N", _bind_to_game(of_game.step_turns)),
        Command("auto", "[N]", "all turns of agents, or N", _bind_to_game(of_game.autoplay_turns)),
    ),
    "games": (
        Command(
            "play",
            "PROBLEM ...",
            "begin a game, with the options of dmplay play",
            of_table.play_problem,
        ),
        Command(
            "new",
            "",
            "again, with fresh dice",
            lambda table, _: table.restart_with_new_seed(),
            "N",
            "N",
        ),
        Command(
            "restart", "", "again, under the same dice", lambda table, _: table.restart(), "R", "R"
        ),
        Command("seed", "[N]", "again, under these dice", of_table.restart_with_seed),
        Command(
            "agent",
            "[SEAT] [NAME]",
            "again, under the same dice, with NAME in a seat",
            of_table.seat_agent,
        ),
        Command(
            "set",
            "[NAME] [VALUE]",
            "again, under the same dice, with another parameter",
            of_table.set_parameter,
        ),
        Command("screen", "", "the game on the full screen", of_table.open_screen),
    ),
    "files": (
        Command("save", "[FILE]", "copy the transcript so far", of_table.save_transcript, "S", "S"),
        Command(
            "transcript",
            "",
            "where it is, and its last turn",
            _bind_to_game(of_game.show_transcript),
            "T",
            "T",
        ),
        Command("load", "[FILE]", "go on with a recorded game", of_table.resume_transcript),
        Command("replay", "FILE", "look at a recorded game", of_table.replay_transcript),
        Command(
            "review", "", "what each of your moves was worth", _bind_to_game(of_game.show_review)
        ),
        Command(
            "branch",
            "[TURN]",
            "play on from a turn, in a file of its own",
            of_table.branch_from_turn,
        ),
        Command("export", "[FILE] --svg ...", "write a game in another form", of_table.export_game),
    ),
    "book": (
        Command("list", "[KIND]", "the problems", _bind_to_cli("list")),
        Command("records", "", "your best games, and your last", _bind_to_cli("records")),
        Command("info", "[PROBLEM]", "all about a problem", _bind_problem_to_cli("info")),
        Command("agents", "[PROBLEM]", "who can play it", _bind_problem_to_cli("agents")),
        Command(
            "solve",
            "[PROBLEM]",
            "its values or equilibria",
            _bind_problem_to_cli("solve", pass_parameters=True),
        ),
        Command("figure", "[NAME]", "a figure of the book", _bind_to_cli("figure")),
        Command("guide", "[TOPIC]", "how to play, and bring your own", _bind_to_cli("guide")),
    ),
    "shell": (
        Command("keys", "", "which key does what", _show_keys),
        Command("help", "[TOPIC]", "the commands; those of a topic, or one", _show_help, "?", "?"),
        Command("quit", "", "leave; the transcript is kept", _quit, "q", "q"),
    ),
}
COMMANDS = tuple(command for topic in COMMANDS_BY_TOPIC.values() for command in topic)
COMMANDS_BY_NAME = {command.name: command for command in COMMANDS}
COMMANDS_BY_NAME |= {
    other: COMMANDS_BY_NAME[name] for other, name in (SYNONYMS | SHORT_NAMES).items()
}


def find_command(name: str, topics: Sequence[str] = ()) -> Command:
    """The command of this name; an unknown one may have meant a topic too."""
    if not is_command(name):
        raise UnknownName("command", name, [*topics, *(command.name for command in COMMANDS)])
    return COMMANDS_BY_NAME[name.lower()]


def is_command(word: str) -> bool:
    """Whether a word is the name of a command."""
    return word.lower() in COMMANDS_BY_NAME


def split_commands(line: str) -> list[str]:
    """The commands of a line, or of several that were pasted: `;` stands between, `#` comments."""
    told = (part for row in line.splitlines() for part in row.partition("#")[0].split(";"))
    return [part for part in map(str.strip, told) if part]


def iter_commands_until_handover(controller: GameController, line: str) -> Iterator[str]:
    """The commands of a typed line, up to where another person chooses who sees other things."""
    for part in split_commands(line):
        if controller.awaiting_handover:
            return
        yield part


def run_line(controller: GameController, line: str) -> str:
    """Does what one typed line says, an action, a command or an alias; tells what came of it.

    An action's name wins over all others, a problem's name begins it where no game is played;
    `act NAME` always plays.
    """
    if INVALID_TEXT.search(line):
        raise BadParameter(f"got {line!r}, expected text")
    word, _, rest = line.strip().partition(" ")
    if word not in controller.aliases or _is_action_name(controller, word):
        return _run_unaliased_line(controller, line)
    told = [
        _run_unaliased_line(controller, part)
        for part in split_commands(f"{controller.aliases[word]} {rest}")
    ]
    return format_reply([*filter(None, told)])


def _run_unaliased_line(controller: GameController, line: str) -> str:
    """Does a line in which no alias stands."""
    word, _, argument = line.strip().partition(" ")
    if is_command(word) and not _is_action_name(controller, word):
        return _run_command(find_command(word), controller, argument.strip())
    if not controller.has_game:
        if not is_problem_name(word):
            raise UnknownName("command", word, [*(c.name for c in COMMANDS), *problem_names()])
        return of_table.play_problem(controller, line)
    return _play_typed_action(controller, line.strip())


def _run_command(command: Command, controller: GameController, argument: str) -> str:
    """Does a command; what it does not take is not left unsaid."""
    if argument and not command.argument_help:
        raise BadParameter(f"{command.name}: got {argument!r}, expected nothing after it")
    return command.run(controller, argument)


def _is_action_name(controller: GameController, word: str) -> bool:
    if not controller.has_game:
        return False
    return word.lower() in map(
        str.lower, controller.game.session.action_labels(controller.game.viewing_seat)
    )

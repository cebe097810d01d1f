"""The shell commands: one table used by typed lines, keys, help, completion and the key row."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from typing import NamedTuple

from dmplay.errors import BadParameter, IllegalAction, UnknownName
from dmplay.game.command_reply import DataReply, make_reply
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.key_bindings import KEY_SYMBOLS
from dmplay.game.launch_requests import split_shell_words
from dmplay.game.player_records import can_earn_medal
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problems import is_problem_name
from dmplay.ui.shell import game_commands as of_game
from dmplay.ui.shell import game_management_commands
from dmplay.ui.shell.help_introduction import lesson_lines, list_advising_agents

CommandFunction = Callable[[GameController, str], str]
MAX_LINE_CHARS = 100_000  # maximum characters of a typed or piped line
INVALID_TEXT = re.compile(r"[\x00\ud800-\udfff]")  # NUL and unpaired surrogates
MIN_LISTED_NUMBERS = 2  # actions; of fewer numbers no step is shown
SYNONYMS = {"value": "values", "exit": "quit", "resume": "load"}
COMMANDS_BEFORE_ANSWER = ("undo", "quit", "look", "legal")  # they show nothing of the answer
SHORT_NAMES = {"q": "quit", "?": "help"}  # single characters that can also be action names


class PlayerQuit(Exception):
    """The exception raised when the player quits, with an exit code."""

    def __init__(self, exit_code: int = 0) -> None:
        super().__init__(exit_code)
        self.exit_code = exit_code


class Command(NamedTuple):
    """A shell command: its name and argument, help text, function and key."""

    name: str
    argument_help: str
    help: str
    run: CommandFunction
    key: str = ""  # in prompt_toolkit's notation
    key_label: str = ""  # as displayed in the key row
    key_help: str = ""  # help text of the key, if the key cannot have the argument


def _bind_to_game(run: Callable[[Game, str], str]) -> CommandFunction:
    """Return a command function that calls a function with the current game."""
    return lambda controller, argument: run(controller.game, argument)


def _bind_to_cli(name: str) -> CommandFunction:
    """Return a command function that runs a command of the command line."""
    return lambda controller, argument: controller.run_command_words(
        [name, *split_shell_words(argument)]
    )


def _bind_problem_to_cli(name: str, *, pass_parameters: bool = False) -> CommandFunction:
    """Return a command function that runs a command-line command on a problem.

    The problem is the current one if none is typed; `--set` options add its parameters if
    `pass_parameters` is true.
    """

    def run(controller: GameController, argument: str) -> str:
        """Run the command with the typed words, or with the current problem before them."""
        words = split_shell_words(argument)
        is_problem_typed = words and (
            not words[0].startswith("-") or any(map(is_problem_name, words))
        )
        if is_problem_typed or not controller.has_game:
            return controller.run_command_words([name, *words])
        typed_names = {word.removeprefix("--set=").partition("=")[0] for word in words}
        settings = controller.game.settings if pass_parameters else []
        unchanged = [
            setting for setting in settings if setting.partition("=")[0] not in typed_names
        ]
        options = [word for setting in unchanged for word in ("--set", setting)]
        return controller.run_command_words([name, controller.game.problem_name, *options, *words])

    return run


@contextmanager
def conceal_choice_errors(controller: GameController) -> Iterator[None]:
    """Run the block with a general message for invalid choices while several people type.

    The message of UnknownName, BadParameter or IllegalAction could reveal the choice.
    """
    try:
        yield
    except (UnknownName, BadParameter, IllegalAction):
        if not controller.is_input_hidden:
            raise
        message = "not a legal action; type legal to list the legal actions, or help"
        raise BadParameter(message) from None


def _play_typed_action(controller: GameController, argument: str) -> str:
    """Play a typed action; error messages do not reveal it to other people."""
    with conceal_choice_errors(controller):
        return _play_action(controller, argument)


def _play_action(controller: GameController, argument: str) -> str:
    """Play a typed action; return the report of the turn, or the next person to choose.

    Return '' if the game ends without the turn. Raise UnknownName with similar names for an unknown
    action.
    """
    game = controller.game
    if game.open_question:
        raise BadParameter(f"got {argument!r}, expected a prediction first: {game.open_question}")
    try:
        action = game.keyboard.parse_action(game.view(), argument)
    except UnknownName:
        labels = game.session.action_labels(game.viewing_seat)
        word, _, remainder = argument.partition(" ")
        if not word or (remainder and word.lower() in labels):
            message = f"act: got {argument!r}, expected one action; separate several with ';'"
            raise BadParameter(message if remainder else "act: expected an action") from None
        # Suggest command names only if no action has a similar name.
        similar = get_close_matches(word.lower(), labels, cutoff=0.5)
        names = labels if similar else [*labels, *(command.name for command in COMMANDS)]
        raise UnknownName("action", word, names) from None
    if game.ask_for_prediction(action):
        return _format_question(game)
    return _choose_action(game, action)


def _choose_action(game: Game, action: float) -> str:
    """Choose an action; return the turn's report or the next person; '' if the game is over."""
    if game.choose(action):
        return game.narrator.describe_turn(game.snapshot())
    if game.session.over:
        return ""
    assert game.choosing_seat is not None
    return f"chosen. {game.problem.agents[game.choosing_seat]} chooses next."


def _preview_action(controller: GameController, argument: str) -> str:
    """Return the possible outcomes of a typed action; error messages do not reveal it."""
    with conceal_choice_errors(controller):
        return of_game.preview_typed_action(controller.game, argument)


def _explain_action(controller: GameController, argument: str) -> str:
    """Explain the suggested or a typed action; error messages do not reveal it."""
    with conceal_choice_errors(controller):
        return of_game.explain_action(controller.game, argument)


def _show_keys(controller: GameController, argument: str) -> str:
    """Return the keys of actions and of commands as one line."""
    game = controller.game
    action_keys = game.keyboard.list_actions_with_keys(game.view())
    actions = ", ".join(f"{label} {key}".strip() for key, label, _ in action_keys)
    if game.keyboard.is_number_entry(game.viewing_seat):
        actions = _describe_number_entry(game)
    commands = ", ".join(f"{c.name} {c.key_label}" for c in COMMANDS if c.key)
    return f"keys: {actions}. {commands}."


def _quit(controller: GameController, argument: str) -> str:
    """Raise PlayerQuit."""
    raise PlayerQuit


def _show_help(controller: GameController, argument: str) -> str:
    """Return help on a topic, action, problem or command; by default a lesson and all topics."""
    if argument.lower() in COMMANDS_BY_TOPIC:
        return make_reply([*map(_format_command_help, COMMANDS_BY_TOPIC[argument.lower()])])
    if _is_action_name(controller, argument):
        return f"{argument}: an action; type its name to play it"
    if argument.partition(":")[0] in problem_names():
        return f"{argument}: a problem; play {argument} starts it, info {argument} describes it"
    if argument:
        return _format_command_help(find_command(argument, [*COMMANDS_BY_TOPIC]))
    rows = [*lesson_lines(controller.game), ""] if controller.has_game else []
    rows += ["type the name of an action to play it. help NAME explains a command or a topic:"]
    rows += [
        f"{topic}: {', '.join(command.name for command in commands)}"
        for topic, commands in COMMANDS_BY_TOPIC.items()
    ]
    return make_reply(rows)


BOOK_NOTE = "The sections are those of the book Algorithms for Decision Making."
HELP_COST = (
    "After a hint, an overlay, a what-if or an undo, a game counts for no medal and no record."
)
FIRST_LISTED = {"hint", "undo", "watch"}  # commands whose keys the help page lists first


def format_help_page(game: Game, screen_keys: Sequence[tuple[str, str, str]]) -> list[str]:
    """Return the rows of the help page: problem, players, actions, and keys.

    `screen_keys` are (displayed key, name, help) of the screen's own keys.
    """
    action_keys = game.keyboard.list_actions_with_keys(game.view())[:10]
    actions = [
        f"{KEY_SYMBOLS.get(key, key)} = {label}" if key else label for key, label, _ in action_keys
    ]
    actions_text = ",  ".join(actions)
    if game.keyboard.is_number_entry(game.viewing_seat):
        actions_text = _describe_number_entry(game)
    with_key = [command for command in COMMANDS if command.key]
    first = [_describe_key(command) for command in with_key if command.name in FIRST_LISTED]
    others = [_describe_key(command) for command in with_key if command.name not in FIRST_LISTED]
    agents = list_advising_agents(game)
    return [
        *lesson_lines(game, shows_map=True),
        *(
            f"{agent} is played by {name}{rule and f', which {rule}'}."
            for agent, name, rule in game.other_players
        ),
        "",
        f"actions: {actions_text}",
        "keys (press Shift for a capital letter)",
        *(
            f"  {displayed_key:<10}  {name:<11}   {help_}"
            for displayed_key, name, help_ in [*first, *screen_keys, *others]
        ),
        *[HELP_COST] * can_earn_medal(game),
        *["agents named in hints and in the result"] * bool(agents),
        *(f"  {name:<11}   {summary}" for name, summary in agents),
        *[f"  {'':<11}   {BOOK_NOTE}"] * any("section" in summary for _, summary in agents),
        "The key : opens a line for more commands; the command help lists them.",
    ]


def _describe_key(command: Command) -> tuple[str, str, str]:
    """Return the key of a command, its name, and its help."""
    return command.key_label, command.name, command.key_help or command.help


def _describe_number_entry(game: Game) -> str:
    """Return the numbers that are actions, in words, and how to play one."""
    labels = game.problem.actions[game.viewing_seat].labels
    start = "" if not labels else f"{labels[0]} to {labels[-1]}; "
    if len(labels) > MIN_LISTED_NUMBERS and int(labels[1]) - int(labels[0]) > 1:
        step = int(labels[1]) - int(labels[0])
        start = f"{labels[0]} to {labels[-1]} in steps of {step}; "
    change = "; the arrow keys change it" if game.keyboard.number_steps else ""
    return f"{start}type a number, then Enter{change}"


def _format_command_help(command: Command) -> str:
    """Return a command with its argument and help text as one line."""
    return f"{f'{command.name} {command.argument_help}'.strip()}: {command.help}"


COMMANDS_BY_TOPIC: Mapping[str, tuple[Command, ...]] = {
    "turns": (
        Command("act", "ACTION", "play an action; its name alone also plays it",
                _play_typed_action),
        Command("hint", "", "show the suggested action, and the action values if known",
                _bind_to_game(of_game.show_hint), "tab", "Tab",
                "show the suggested action; Tab again explains it"),
        Command("undo", "[N]", "undo the last turn, or N turns", _bind_to_game(of_game.undo_turns),
                "backspace", "Bksp", "undo the last turn"),
        Command("redo", "[N]", "play an undone turn again, or N turns",
                _bind_to_game(of_game.redo_turns), "c-r", "Ctrl-R", "play an undone turn again"),
        Command("reroll", "", "play the last turn again with new random numbers (recorded)",
                _bind_to_game(of_game.reroll_turn)),
        Command("look", "", "describe the situation in sentences",
                _bind_to_game(of_game.show_situation), "L", "L"),
        Command("legal", "", "list the legal actions", _bind_to_game(of_game.show_legal_actions)),
        Command("belief", "", "show the probability of each hidden state",
                _bind_to_game(of_game.show_belief)),
        Command("state", "", "show the state in one line", _bind_to_game(of_game.show_state)),
        Command("values", "", "show the value of each action", _bind_to_game(of_game.show_values)),
        Command(
            "whatif",
            "ACTION",
            "show the possible outcomes of an action",
            _preview_action,
            key_label="W",
        ),
        Command("why", "[ACTION]",
                "explain the suggested action in numbers, or compare ACTION with it",
                _explain_action, "Y", "Y", "explain the suggested action in numbers"),
        Command("assume", "[SEAT] [AGENT]", "give advice as if AGENT played another seat",
                _bind_to_game(of_game.assume_player)),
        Command("watch", "[NAME]", "watch an algorithm step by step; NAME selects it",
                game_management_commands.watch_algorithm, "G", "G",
                "watch an algorithm step by step"),
        Command("policy", "", "show the suggested action without the values",
                _bind_to_game(of_game.show_best_action)),
        Command("step", "[N]", "let the agents play one turn, or N turns",
                _bind_to_game(of_game.step_turns)),
        Command("auto", "[N]", "let the agents play to the end, or N turns",
                _bind_to_game(of_game.autoplay_turns)),
    ),
    "games": (
        Command("play", "PROBLEM ...", "start a game; takes the options of dmplay play",
                game_management_commands.play_problem),
        Command("new", "", "start a new game with another seed",
                lambda table, _: table.restart_with_new_seed(), "N", "N"),
        Command("restart", "", "start the same game again, with the same seed",
                lambda table, _: table.restart(), "R", "R"),
        Command("seed", "[N]", "start the game again with seed N, or show the seed",
                game_management_commands.restart_with_seed),
        Command("agent", "[SEAT] [NAME]",
                "start again with player NAME in a seat, or list the players",
                game_management_commands.seat_agent),
        Command("set", "[NAME] [VALUE]", "start again with another value, or list the parameters",
                game_management_commands.set_parameter),
        Command("screen", "", "show the game on the full screen",
                game_management_commands.open_screen),
    ),
    "files": (
        Command("save", "[FILE]", "copy the transcript to FILE, or show its path",
                game_management_commands.save_transcript, "S", "S", "show where the game is saved"),
        Command("transcript", "", "show the path of the transcript and its last turn",
                _bind_to_game(of_game.show_transcript), "T", "T"),
        Command("load", "[FILE]", "resume the game in FILE, or the newest game you left",
                game_management_commands.resume_transcript),
        Command("replay", "FILE", "open a recorded game as a replay",
                game_management_commands.replay_transcript),
        Command("review", "", "after the game, show the regret of each of your actions",
                _bind_to_game(of_game.show_review)),
        Command("branch", "[TURN]", "start a new game from a turn, in a new file",
                game_management_commands.branch_from_turn),
        Command("seat", "NAME=PLAYER",
                "give a seat to human or to an agent from now on, in a new file",
                game_management_commands.change_seats),
        Command("export", "[FILE] --svg ...", "export a game as a picture, a table or data",
                game_management_commands.export_game),
    ),
    "problems": (
        Command("list", "[KIND]", "list the problems", _bind_to_cli("list")),
        Command("records", "", "show your records and your latest results",
                _bind_to_cli("records")),
        Command("info", "[PROBLEM]", "describe a problem", _bind_problem_to_cli("info")),
        Command("agents", "[PROBLEM]", "list the agents of a problem",
                _bind_problem_to_cli("agents")),
        Command("solve", "[PROBLEM]", "compute the values or equilibria of a problem",
                _bind_problem_to_cli("solve", pass_parameters=True)),
        Command("plot", "[WHAT] [PROBLEM]",
                "plot values, policies, payoffs and figures of the book", _bind_to_cli("plot")),
        Command("guide", "[TOPIC]", "show a page of the guide", _bind_to_cli("guide")),
        Command("learn", "[LESSON]", "run a lesson, such as first; or list all lessons",
                _bind_to_cli("learn")),
    ),
    "shell": (
        Command("keys", "", "list the keys", _show_keys),
        Command("help", "[TOPIC]", "explain the game and its keys, or a command or topic",
                _show_help, "?", "?", "explain the game and its keys"),
        Command("quit", "", "quit; a recorded game stays saved", _quit, "q", "q"),
    ),
}  # fmt: skip
COMMANDS = tuple(command for topic in COMMANDS_BY_TOPIC.values() for command in topic)
COMMANDS_BY_NAME = {command.name: command for command in COMMANDS}
COMMANDS_BY_NAME |= {
    other: COMMANDS_BY_NAME[name] for other, name in (SYNONYMS | SHORT_NAMES).items()
}


def find_command(name: str, topics: Sequence[str] = ()) -> Command:
    """Return the command with this name or synonym; raise UnknownName if there is none.

    The error also suggests the given topics.
    """
    if not is_command(name):
        raise UnknownName("command", name, [*topics, *(command.name for command in COMMANDS)])
    return COMMANDS_BY_NAME[name.lower()]


def is_command(word: str) -> bool:
    """Return whether a word is the name or synonym of a command, in any case."""
    return word.lower() in COMMANDS_BY_NAME


def split_commands(line: str) -> list[str]:
    """Split text into commands at `;` and line ends, without `#` comments and empty commands.

    Raise BadParameter if the text is longer than MAX_LINE_CHARS.
    """
    char_count = len(line.rstrip("\n"))
    if char_count > MAX_LINE_CHARS:
        raise BadParameter(
            f"got a line of {char_count} characters, expected at most {MAX_LINE_CHARS}"
        )
    pieces = (part for row in line.splitlines() for part in row.partition("#")[0].split(";"))
    return [part for part in map(str.strip, pieces) if part]


def iter_commands_until_handover(controller: GameController, line: str) -> Iterator[str]:
    """Yield the commands of a typed line until another person must take over the terminal."""
    for part in list_commands(controller, line):
        if controller.awaiting_handover:
            return
        yield part


def _format_question(game: Game) -> str:
    """Return the question that waits for a prediction, also as data."""
    assert game.predictor is not None
    data = {"kind": game.predictor.kind, "question": game.open_question}
    return DataReply(game.open_question, "predict", data)


def take_prediction_report(game: Game) -> str:
    """Return the score of the last prediction, also as data; '' if it was reported before."""
    scored = game.pop_scored_prediction()
    return DataReply(scored.text, "prediction", scored.data) if scored else ""


def list_commands(controller: GameController, line: str) -> list[str]:
    """Return the commands of a line; an empty line is one too if a question waits for an answer."""
    is_asked = controller.has_game and bool(controller.game.open_question)
    return split_commands(line) or [""] * is_asked


def run_line(controller: GameController, line: str) -> str:
    """Run one typed line (an action, a command or an alias) and return the reply.

    Names of actions take precedence over all others, and `act NAME` always plays. The name of a
    problem starts it if there is no current game.
    """
    if INVALID_TEXT.search(line):
        raise BadParameter(f"got {line!r}, expected text")
    if controller.has_game and controller.game.open_question:
        return _run_line_before_answer(controller, line.strip())
    word, _, arguments = line.strip().partition(" ")
    if word not in controller.aliases or _is_action_name(controller, word):
        return _run_unaliased_line(controller, line)
    replies = [
        _run_unaliased_line(controller, part)
        for part in split_commands(f"{controller.aliases[word]} {arguments}")
    ]
    return make_reply([*filter(None, replies)])


def _run_line_before_answer(controller: GameController, line: str) -> str:
    """Run a line while a question waits: a prediction, or one of a few commands.

    The others could show the answer.
    """
    if line.lower() in SYNONYMS | SHORT_NAMES:
        line = (SYNONYMS | SHORT_NAMES)[line.lower()]
    if line.lower() == "help":
        return _format_question(controller.game)
    if line.lower() in COMMANDS_BEFORE_ANSWER:
        return _run_command(find_command(line), controller, "")
    assert controller.game.predictor is not None
    return _choose_action(controller.game, controller.game.predictor.answer(line))


def _run_unaliased_line(controller: GameController, line: str) -> str:
    """Run one line without aliases: a command, a problem to play, or an action."""
    word, _, argument = line.strip().partition(" ")
    if is_command(word) and not _is_action_name(controller, word):
        return _run_command(find_command(word), controller, argument.strip())
    if not controller.has_game:
        if not is_problem_name(word):
            raise UnknownName("command", word, [*(c.name for c in COMMANDS), *problem_names()])
        return game_management_commands.play_problem(controller, line)
    return _play_typed_action(controller, line.strip())


def _run_command(command: Command, controller: GameController, argument: str) -> str:
    """Run a command; raise BadParameter for an argument that it does not take."""
    if argument and not command.argument_help:
        raise BadParameter(f"{command.name}: got {argument!r}, expected no argument")
    return command.run(controller, argument)


def _is_action_name(controller: GameController, word: str) -> bool:
    """Return whether a word is an action's name in the current game, in any case."""
    if not controller.has_game:
        return False
    return word.lower() in map(
        str.lower, controller.game.session.action_labels(controller.game.viewing_seat)
    )

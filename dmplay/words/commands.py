"""The commands: one table that typed words, keys, help, completion and the key row all read."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from typing import NamedTuple

from dmplay.errors import BadParameter, IllegalAction, UnknownName
from dmplay.finding.names import problem_names
from dmplay.finding.problems import is_name
from dmplay.game.answer import answer
from dmplay.game.game import Game
from dmplay.game.request import words_of
from dmplay.game.table import Table
from dmplay.keys.keymap import SHOWN
from dmplay.words import game_commands as of_game
from dmplay.words import table_commands as of_table
from dmplay.words.lesson import lesson

Run = Callable[[Table, str], str]
NO_TEXT = re.compile(r"[\x00\ud800-\udfff]")  # NUL, and halves of characters
SYNONYMS = {"value": "values", "exit": "quit", "resume": "load"}
SHORT = {"q": "quit", "?": "help"}  # which actions may be called too


class Leave(Exception):
    """The player leaves the game, with an exit code."""

    def __init__(self, code: int = 0) -> None:
        super().__init__(code)
        self.code = code


class Command(NamedTuple):
    """A command: its name and argument, what it does, its key on the screen."""

    name: str
    argument: str
    help: str
    run: Run
    key: str = ""  # as prompt-toolkit names it
    shown: str = ""  # as the key row names it


def _game(run: Callable[[Game, str], str]) -> Run:
    """A command of the game that is played."""
    return lambda table, argument: run(table.game, argument)


def _outer(name: str) -> Run:
    """A command of the command line."""
    return lambda table, argument: table.ask([name, *words_of(argument)])


def _about(name: str, *, set_: bool = False) -> Run:
    """A command of the command line about a problem, the one that is played if none is named.

    That one with its parameters, where the command takes them.
    """

    def run(table: Table, argument: str) -> str:
        words = words_of(argument)
        named = words and (not words[0].startswith("-") or any(map(is_name, words)))
        if named or not table.playing:
            return table.ask([name, *words])
        told = table.game.settings if set_ else []
        more = [word for one in told for word in ("--set", one)]
        return table.ask([name, table.game.name, *more, *words])

    return run


@contextmanager
def veiled(table: Table) -> Iterator[None]:
    """Tells nothing of a choice that cannot be played, where another person may look on."""
    try:
        yield
    except (UnknownName, BadParameter, IllegalAction):
        if not table.secret:
            raise
        told = "that cannot be played; help and legal tell what can be typed"
        raise BadParameter(told) from None


def _act(table: Table, argument: str) -> str:
    """Plays an action."""
    with veiled(table):
        return _played(table, argument)


def _played(table: Table, argument: str) -> str:
    game = table.game
    try:
        action = game.keyboard.read(game.view(), argument)
    except UnknownName:
        known = game.session.labels(game.watcher)
        word, _, rest = argument.partition(" ")
        if not word or (rest and word.lower() in known):
            told = f"act: got {argument!r}, expected one action; ';' stands between several"
            raise BadParameter(told if rest else "act: expected an action") from None
        near = get_close_matches(word.lower(), known, cutoff=0.5)  # an action before a command
        names = known if near else [*known, *(command.name for command in COMMANDS)]
        raise UnknownName("action", word, names) from None
    if game.choose(action):
        return game.account.said(game.moment())
    if game.session.over:
        return ""
    assert game.waiting is not None
    return f"chosen. {game.problem.agents[game.waiting]} is next."


def _whatif(table: Table, argument: str) -> str:
    """What an action may bring, of a choice that another may not know."""
    with veiled(table):
        return of_game.whatif(table.game, argument)


def _keys(table: Table, argument: str) -> str:
    game = table.game
    legal = game.keyboard.legal(game.view())
    actions = ", ".join(f"{label} {key}".strip() for key, label, _ in legal)
    commands = ", ".join(f"{c.name} {c.shown}" for c in COMMANDS if c.key)
    return f"keys: {actions}. {commands}."


def _quit(table: Table, argument: str) -> str:
    raise Leave


def _help(table: Table, argument: str) -> str:
    if argument.lower() in TOPICS:
        return answer([*map(_line, TOPICS[argument.lower()])])
    if _names_action(table, argument):
        return f"{argument}: an action; its name alone plays it"
    if argument.partition(":")[0] in problem_names():
        return f"{argument}: a problem; play {argument} begins it, info {argument} tells of it"
    if argument:
        return _line(named(argument, [*TOPICS]))
    rows = [*lesson(table.game), ""] if table.playing else []
    rows += ["an action is played by its name. help tells more of a command, or of a topic:"]
    rows += [
        f"{topic}: {', '.join(command.name for command in commands)}"
        for topic, commands in TOPICS.items()
    ]
    return answer(rows)


def help_page(game: Game, own: Sequence[tuple[str, str, str]]) -> list[str]:
    """The problem, the keys that play, a screen's own and those of commands; commands without one.

    Of a key: how it is shown, its name, what it does.
    """
    legal = game.keyboard.legal(game.view())[:10]
    actions = [f"{SHOWN.get(key, key)} {label}".strip() for key, label, _ in legal]
    keys = [(c.shown, f"{c.name} {c.argument}".strip(), c.help) for c in COMMANDS if c.key]
    others = [command.name for command in COMMANDS if not command.key]
    return [
        *lesson(game),
        "",
        f"actions: {',  '.join(actions) or 'a number, and Enter'}",
        "keys",
        *(f"  {shown:<7} {name:<14} {help_}" for shown, name, help_ in [*own, *keys]),
        f"commands, typed after ':'  {' '.join(others)}",
    ]


def _line(command: Command) -> str:
    return f"{f'{command.name} {command.argument}'.strip()}: {command.help}"


TOPICS: Mapping[str, tuple[Command, ...]] = {
    "turns": (
        Command("act", "ACTION", "play an action; its name alone does too", _act),
        Command("hint", "", "what a good player would do here", _game(of_game.hint), "tab", "Tab"),
        Command(
            "undo", "[N]", "take back the last turn, or N", _game(of_game.undo), "backspace", "Bksp"
        ),
        Command(
            "redo", "[N]", "play again what was taken back", _game(of_game.redo), "c-r", "Ctrl-R"
        ),
        Command("reroll", "", "the last turn under other dice; recorded so", _game(of_game.reroll)),
        Command("look", "", "the situation in sentences", _game(of_game.look), "L", "L"),
        Command("legal", "", "the actions that can be played", _game(of_game.legal)),
        Command("belief", "", "the probability of each hidden state", _game(of_game.belief)),
        Command("state", "", "the state in one line", _game(of_game.state)),
        Command("values", "", "what each action is worth", _game(of_game.values)),
        Command("whatif", "ACTION", "what an action may bring", _whatif, shown="W"),
        Command("policy", "", "the action of a good player", _game(of_game.policy)),
        Command("step", "[N]", "a turn of agents, or N", _game(of_game.step)),
        Command("auto", "[N]", "all turns of agents, or N", _game(of_game.auto)),
    ),
    "games": (
        Command(
            "play", "PROBLEM ...", "begin a game, with the options of dmplay play", of_table.play
        ),
        Command("new", "", "again, with fresh dice", lambda table, _: table.begin(), "N", "N"),
        Command(
            "restart", "", "again, under the same dice", lambda table, _: table.restart(), "R", "R"
        ),
        Command("seed", "[N]", "again, under these dice", of_table.seed),
        Command(
            "agent",
            "[SEAT] [NAME]",
            "again, under the same dice, with NAME in a seat",
            of_table.agent,
        ),
        Command(
            "set",
            "[NAME] [VALUE]",
            "again, under the same dice, with another parameter",
            of_table.set_,
        ),
        Command("screen", "", "the game on the full screen", of_table.screen),
    ),
    "files": (
        Command("save", "[FILE]", "copy the transcript so far", of_table.save, "S", "S"),
        Command(
            "transcript", "", "where it is, and its last turn", _game(of_game.transcript), "T", "T"
        ),
        Command("load", "[FILE]", "go on with a recorded game", of_table.load),
        Command("replay", "FILE", "look at a recorded game", of_table.replay),
        Command("review", "", "what each of your moves was worth", _game(of_game.review)),
        Command("branch", "[TURN]", "play on from a turn, in a file of its own", of_table.branch),
        Command("export", "[FILE] --svg ...", "write a game in another form", of_table.export),
    ),
    "book": (
        Command("list", "[KIND]", "the problems", _outer("list")),
        Command("records", "", "your best games, and your last", _outer("records")),
        Command("info", "[PROBLEM]", "all about a problem", _about("info")),
        Command("agents", "[PROBLEM]", "who can play it", _about("agents")),
        Command("solve", "[PROBLEM]", "its values or equilibria", _about("solve", set_=True)),
        Command("figure", "[NAME]", "a figure of the book", _outer("figure")),
        Command("guide", "[TOPIC]", "how to play, and bring your own", _outer("guide")),
    ),
    "shell": (
        Command("keys", "", "which key does what", _keys),
        Command("help", "[TOPIC]", "the commands; those of a topic, or one", _help, "?", "?"),
        Command("quit", "", "leave; the transcript is kept", _quit, "q", "q"),
    ),
}
COMMANDS = tuple(command for topic in TOPICS.values() for command in topic)
NAMED = {command.name: command for command in COMMANDS}
NAMED |= {other: NAMED[name] for other, name in (SYNONYMS | SHORT).items()}


def named(name: str, topics: Sequence[str] = ()) -> Command:
    """The command of this name; an unknown one may have meant a topic too."""
    if not is_command(name):
        raise UnknownName("command", name, [*topics, *(command.name for command in COMMANDS)])
    return NAMED[name.lower()]


def is_command(word: str) -> bool:
    """Whether a word is the name of a command."""
    return word.lower() in NAMED


def parts(line: str) -> list[str]:
    """The commands of a line, or of several that were pasted: `;` stands between, `#` comments."""
    told = (part for row in line.splitlines() for part in row.partition("#")[0].split(";"))
    return [part for part in map(str.strip, told) if part]


def own_parts(table: Table, line: str) -> Iterator[str]:
    """The commands of a typed line, up to where another person chooses who sees other things."""
    for part in parts(line):
        if table.curtained:
            return
        yield part


def typed(table: Table, line: str) -> str:
    """Does what one typed line says, an action, a command or an alias; tells what came of it.

    An action's name wins over all others, a problem's name begins it where no game is played;
    `act NAME` always plays.
    """
    if NO_TEXT.search(line):
        raise BadParameter(f"got {line!r}, expected text")
    word, _, rest = line.strip().partition(" ")
    if word not in table.aliases or _names_action(table, word):
        return _typed(table, line)
    told = [_typed(table, part) for part in parts(f"{table.aliases[word]} {rest}")]
    return answer([*filter(None, told)])


def _typed(table: Table, line: str) -> str:
    """Does a line in which no alias stands."""
    word, _, argument = line.strip().partition(" ")
    if is_command(word) and not _names_action(table, word):
        return _done(named(word), table, argument.strip())
    if not table.playing:
        if not is_name(word):
            raise UnknownName("command", word, [*(c.name for c in COMMANDS), *problem_names()])
        return of_table.play(table, line)
    return _act(table, line.strip())


def _done(command: Command, table: Table, argument: str) -> str:
    """Does a command; what it does not take is not left unsaid."""
    if argument and not command.argument:
        raise BadParameter(f"{command.name}: got {argument!r}, expected nothing after it")
    return command.run(table, argument)


def _names_action(table: Table, word: str) -> bool:
    if not table.playing:
        return False
    return word.lower() in map(str.lower, table.game.session.labels(table.game.watcher))

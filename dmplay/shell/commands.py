"""The commands of a game: one table that typed words, keys, help and the key row all read."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from dmplay.core import Interval
from dmplay.errors import BadParameter, UnknownName
from dmplay.shell.game import Game

LIKELIEST = 8  # states that the belief is told of


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
    key: str  # as prompt-toolkit names it; '' for none
    shown: str  # as the key row names it
    run: Callable[[Game, str], str]


def _count(argument: str, command: str) -> int:
    if not argument:
        return 1
    if not argument.isascii() or not argument.isdecimal() or int(argument) < 1:
        raise BadParameter(f"{command}: got {argument!r}, expected a number of turns, as 2")
    return int(argument)


def _undo(game: Game, argument: str) -> str:
    before = len(game.session.turns)
    game.undo(_count(argument, "undo"))
    now = len(game.session.turns)
    return f"undone. turn {now}." if now < before else "your choice is taken back."


def _redo(game: Game, argument: str) -> str:
    for _ in range(_count(argument, "redo")):
        game.redo()
    return game.said()


def _reroll(game: Game, argument: str) -> str:
    game.reroll()
    return game.said()


def _legal(game: Game, argument: str) -> str:
    seat = game.watcher
    known = game.problem.actions[seat]
    if isinstance(known, Interval):
        return f"legal: a number from {known.low:g} to {known.high:g}."
    if game.types_numbers:
        return f"legal: a number from {known[0]} to {known[-1]}."
    able = [f"{label} ({key})" for key, label, able in game.legal(seat) if able]
    return f"legal: {', '.join(able) or 'none'}."


def _belief(game: Game, argument: str) -> str:
    view = game.view()
    if view.beliefs is None:
        if game.problem.observations is not None:
            return "belief: too many states to tell."
        return "belief: every agent sees the state here."
    belief, states = view.beliefs[-1], game.problem.enumerated()
    order = np.argsort(-belief, kind="stable")[:LIKELIEST]
    told = [f"{game.problem.notation(states[i])} {belief[i]:.3f}" for i in order]
    rest = len(states) - len(order)
    if rest:
        others = f"{rest} other state{'s' * (rest > 1)}"
        told.append(f"{others} {max(1.0 - belief[order].sum(), 0.0):.3f}")
    return f"belief: {', '.join(told)}."


def _state(game: Game, argument: str) -> str:
    hidden = game.problem.observations is not None
    if hidden and not (game.reveal or game.session.over):
        return "state: hidden until the game is over, or with --reveal."
    return f"state: {game.problem.notation(game.session.state)}"


def _keys(game: Game, argument: str) -> str:
    actions = ", ".join(f"{label} {key}" for key, label, _ in game.legal(game.watcher))
    commands = ", ".join(f"{c.name} {c.shown}" for c in COMMANDS if c.key)
    return f"keys: {actions}. {commands}."


def _quit(game: Game, argument: str) -> str:
    raise Leave


def _help(game: Game, argument: str) -> str:
    if argument:
        command = named(argument)
        return f"{command.name} {command.argument}".strip() + f": {command.help}"
    return (
        "commands: "
        + ", ".join(command.name for command in COMMANDS)
        + (". help COMMAND tells more. an action is played by its name.")
    )


COMMANDS = (
    Command("hint", "", "what a good player would do here", "tab", "Tab", lambda g, a: g.hint()),
    Command("undo", "[N]", "take back the last turn, or N", "backspace", "Bksp", _undo),
    Command("redo", "[N]", "play again what was taken back", "c-r", "Ctrl-R", _redo),
    Command(
        "reroll", "", "the last turn again under other dice; recorded as such", "", "", _reroll
    ),
    Command("look", "", "the situation in sentences", "L", "L", lambda g, a: g.situation()),
    Command("legal", "", "the actions that can be played", "", "", _legal),
    Command("belief", "", "the probability of each hidden state", "", "", _belief),
    Command("state", "", "the state in one line", "", "", _state),
    Command("keys", "", "which key does what", "", "", _keys),
    Command("help", "[COMMAND]", "the commands", "?", "?", _help),
    Command("quit", "", "leave; the transcript is kept", "q", "q", _quit),
)


def named(name: str) -> Command:
    """The command of this name."""
    for command in COMMANDS:
        if command.name == name.lower():
            return command
    raise UnknownName("command", name, [command.name for command in COMMANDS])


def is_command(word: str) -> bool:
    """Whether a word is the name of a command."""
    return any(command.name == word.lower() for command in COMMANDS)


def typed(game: Game, line: str) -> str:
    """Does what one typed line says, an action or a command, and tells what came of it.

    An action's name wins over a command and over a key; `act NAME` always plays.
    """
    word, _, argument = line.strip().partition(" ")
    if word.lower() == "act":
        word, argument = argument.strip(), ""
    elif is_command(word) and not _names_action(game, word):
        return named(word).run(game, argument.strip())
    seat = game.watcher
    try:
        action = game.read(f"{word} {argument}".strip())
    except UnknownName:
        labels = game.problem.actions[seat]
        known = () if isinstance(labels, Interval) else labels
        names = [*known, *(command.name for command in COMMANDS)]
        raise UnknownName("action", word, names) from None
    if game.choose(action):
        return game.said()
    if game.session.over:
        return ""
    assert game.waiting is not None
    return f"chosen. {game.problem.agents[game.waiting]} is next."


def _names_action(game: Game, word: str) -> bool:
    labels = game.problem.actions[game.watcher]
    return not isinstance(labels, Interval) and word.lower() in labels

"""What can be asked of a game, and done to it, in words: each takes what was typed after it."""

from collections.abc import Callable
from itertools import islice

import numpy as np

from dmplay.advice.adviser import Adviser
from dmplay.describe import counted, ended
from dmplay.errors import BadParameter
from dmplay.finding.typed import whole
from dmplay.game.answer import Told, answer
from dmplay.game.game import Game
from dmplay.keys.keyboard import numbers
from dmplay.thought import About, think
from dmplay.transcript.format import lines

LIKELIEST = 8  # states that the belief is told of
HINT = About("thinking of a hint")
AHEAD = About("looking ahead")


def count(argument: str, command: str, default: int = 1) -> int:
    """A number of turns that was typed."""
    if not argument:
        return default
    number = whole(argument)
    if not number:
        raise BadParameter(f"{command}: got {argument!r}, expected a number of turns, as 2")
    return number


def undo(game: Game, argument: str) -> str:
    """Takes back turns, or a choice."""
    before = len(game.session.turns)
    game.undo(count(argument, "undo"))
    now = len(game.session.turns)
    if now == before:
        return "your choice is taken back."
    return game.account.change(game.moment(), before)


def redo(game: Game, argument: str) -> str:
    """Plays again what was taken back, and tells each turn."""
    told = []
    for _ in range(count(argument, "redo")):
        game.redo()
        told.append(game.account.said(game.moment()))
    return Told("\n".join(told)) if len(told) > 1 else told[0]


def reroll(game: Game, argument: str) -> str:
    """Throws the last turn's dice anew."""
    game.reroll()
    return game.account.said(game.moment())


def step(game: Game, argument: str) -> str:
    """So many turns of a game that plays by itself, one if no number is given."""
    return _played(game, "step", count(argument, "step"))


def auto(game: Game, argument: str) -> str:
    """All turns, or so many, of a game that plays by itself."""
    return _played(game, "auto", count(argument, "auto", default=0))


def _played(game: Game, command: str, turns: int) -> str:
    """Plays turns of agents, all if the number is 0, and tells each."""
    if game.people:
        raise BadParameter(f"{command}: people play here; agent SEAT NAME seats an agent")
    run = islice(game.run(), turns or None)
    told = [game.account.change(game.moment(), before) for before in run]
    if len(told) > 1:
        return Told("\n".join(told))
    return told[0] if told else f"the game is over ({ended(game.session.ending)})"


def look(game: Game, argument: str) -> str:
    """The situation in sentences, below the picture where the problem brings one."""
    return answer([*game.pictured(), game.account.situation(game.moment())])


def legal(game: Game, argument: str) -> str:
    """The actions that can be played."""
    seat = game.watcher
    actions = game.problem.actions[seat]
    if not actions.labels:
        return f"legal: {actions.words()}."
    if game.keyboard.types_numbers(seat):
        return f"legal: {numbers(actions.labels)}."
    able = [
        f"{label} ({key})" if key and _typed(game, key) == label else label
        for key, label, able in game.keyboard.legal(game.view())
        if able
    ]
    return f"legal: {', '.join(able) or 'none'}."


def _typed(game: Game, word: str) -> str:
    """The action that a typed word plays: a name before a key."""
    return game.session.action_name(game.watcher, game.keyboard.read(game.view(), word))


def belief(game: Game, argument: str) -> str:
    """The likeliest hidden states with their probabilities."""
    view = game.view()
    if view.beliefs is None:
        if game.problem.hidden:
            return "belief: too many states to tell."
        return "belief: every agent sees the state here."
    belief, states = view.beliefs[-1], game.problem.enumerated()
    order = np.argsort(-belief, kind="stable")[:LIKELIEST]
    told = [f"{game.problem.notation(states[i])} {belief[i]:.3f}" for i in order]
    rest = len(states) - len(order)
    if rest:
        told.append(f"{counted(rest, 'other state')} {max(1.0 - belief[order].sum(), 0.0):.3f}")
    return f"belief: {', '.join(told)}."


def state(game: Game, argument: str) -> str:
    """The state in one line, where it may be known."""
    if game.problem.hidden and not (game.reveal or game.session.over):
        return "state: hidden until the game is over, or with --reveal."
    return f"state: {game.problem.notation(game.session.state)}"


def _advised(game: Game, command: str, ask: Callable[[Adviser], str]) -> str:
    """What the adviser answers, which is counted; or why there is nothing to say."""
    game.may_help(command)
    adviser = game.adviser
    why = think(HINT, adviser.silent)
    told = "" if why else think(HINT, lambda: ask(adviser))
    if told:
        game.helped()
    return told or f"no {command}: {why or 'the adviser knows none'}"


def hint(game: Game, argument: str) -> str:
    """What a good player would do, and what each action is worth."""
    return _advised(game, "hint", Adviser.hint)


def values(game: Game, argument: str) -> str:
    """What each action is worth."""
    return _advised(game, "values", Adviser.values)


def policy(game: Game, argument: str) -> str:
    """What a good player would do."""
    return _advised(game, "policy", lambda adviser: f"policy {adviser.choice()}")


def whatif(game: Game, argument: str) -> str:
    """What an action may bring about, before it is played."""
    if not argument:
        raise BadParameter("whatif: expected an action")
    return foresee(game, game.keyboard.read(game.view(), argument))


def foresee(game: Game, action: float) -> str:
    """What an action of the watcher may bring about; counted as help."""
    game.may_help("whatif")
    told = think(AHEAD, lambda: game.adviser.foresee(action))
    game.helped()
    return told


def review(game: Game, argument: str) -> str:
    """What each move of the people was worth; kept as notes once the transcript ends."""
    from dmplay.advice import review as reviewing  # not needed before

    if not game.session.over or not game.people:
        raise BadParameter("review: it values the moves of people, once the game is over")
    found = reviewing.of(game.session, game.people, game.seats)
    game.notes = "".join(reviewing.notes(found))
    return answer(reviewing.table(found))


def transcript(game: Game, argument: str) -> str:
    """Where the transcript is, and its last turn without what is hidden."""
    if game.source is None:
        return "transcript: none is written; --record FILE writes one"
    held = "in" if game.recorder else "shown of"
    path = f"transcript: {counted(len(game.session.turns), 'turn')} {held} {game.source}"
    return answer([path, "", *lines(game.account.public(game.moment()))])

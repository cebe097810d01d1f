"""Who sits where: people, agents, scripts and recordings, and how a word or a key is an action."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from dmplay.core import Interval, Policy, Problem
from dmplay.dice import Dice
from dmplay.errors import BadParameter, DmplayError, UnknownName
from dmplay.finding import catalog
from dmplay.game.request import Request
from dmplay.policies.script import Script
from dmplay.terminal import clean
from dmplay.transcript.format import PERSON
from dmplay.transcript.header import LINES, Header
from dmplay.transcript.reading import Transcript, read
from dmplay.transcript.replay import replay
from dmplay.views._style_of import style_of

HUMAN = PERSON
UNASKED = (HUMAN, "script", "replay")  # seats whose actions only the file can tell
DIGITS = 10  # keys that are the number of an action
DIGIT_KEYS = "0123456789"
NUMERIC = re.compile(r"\s*[-+]?\.?\d")


def action_of(
    problem: Problem, seat: int, word: str, keys: Mapping[str, str] | None = None
) -> float:
    """The action that a person wrote: its name, an alias, its number or a key."""
    try:
        return problem.action(seat, word)
    except UnknownName:
        by_key = action_by_key(problem, seat, word, keys)
        if by_key is None:
            _check_bounds(problem, seat, word)
            raise
        return by_key


def _check_bounds(problem: Problem, seat: int, word: str) -> None:
    """Refuses a number where actions are other whole numbers, and tells which."""
    labels = problem.actions[seat]
    if isinstance(labels, Interval) or not all(label.isdigit() for label in labels):
        return
    if NUMERIC.match(word):
        step = int(labels[1]) - int(labels[0])
        tens = f" in steps of {step}" if step > 1 else ""
        wanted = f"a whole number from {labels[0]} to {labels[-1]}{tens}"
        raise BadParameter(f"action: got {word!r}, expected {wanted}") from None


def action_by_key(
    problem: Problem, seat: int, key: str, keys: Mapping[str, str] | None = None
) -> float | None:
    """The action that a key plays, of a view's keys if no others are in force.

    A digit is the action's number, 0 the tenth.
    """
    labels = problem.actions[seat]
    if isinstance(labels, Interval):
        return None
    known = style_of(problem).KEYS if keys is None else keys
    if known.get(key) in labels:
        return labels.index(known[key])
    if len(key) == 1 and key in DIGIT_KEYS and len(labels) <= DIGITS:
        number_ = (int(key) - 1) % DIGITS
        return number_ if number_ < len(labels) else None
    return None


def seat_policy(problem: Problem, seat: int, who: str) -> Policy | None:
    """The policy that plays a seat; None for a person."""
    kind, _, rest = who.partition(":")
    if who == HUMAN:
        return None
    if kind == "script":
        return Script(problem, seat, _script(problem, seat, rest))
    if kind == "replay":
        played = replay(_readable(rest), problem).turns
        return Script(problem, seat, tuple(turn.actions[seat].item() for turn in played))
    return catalog.agent(problem, seat, who)


def _readable(path: str) -> Transcript:
    try:
        return read(path)
    except OSError as error:
        raise BadParameter(f"{path}: {error.strerror}") from None


def _script(problem: Problem, seat: int, rest: str) -> tuple[float, ...]:
    """Actions from `a,b,c`, or from a file with one action or several to a line."""
    if _is_file(rest):
        try:
            rows = Path(rest).read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise BadParameter(f"{rest}: {error}") from None
        words = [
            (f"{rest}:{number_}", word)
            for number_, row in enumerate(rows, 1)
            for word in row.partition("#")[0].replace(",", " ").split()
        ]
    else:
        words = [(f"script action {n}", word) for n, word in enumerate(rest.split(","), 1) if word]
    actions = []
    for where, word in words:
        try:
            actions.append(action_of(problem, seat, word))
        except DmplayError as error:
            raise BadParameter(f"{where}: {error}") from None
    return tuple(actions)


def _is_file(path: str) -> bool:
    try:
        return Path(path).is_file()
    except OSError:  # too long to be a name
        return False


def asked_again(
    problem: Problem, seats: Mapping[str, str], *, trusted: bool
) -> list[Policy | None]:
    """The agents of a transcript that can be asked what they would do; None for the others."""
    return [_asked(problem, seat, who, trusted) for seat, who in enumerate(seats.values())]


def sitting(
    problem: Problem, seats: Mapping[str, str], *, trusted: bool
) -> tuple[list[str], list[Policy | None]]:
    """Who plays on where a transcript leaves off: its agents, people for all other seats.

    What a file names is imported only where it is trusted; raises BadParameter otherwise.
    """
    names = [HUMAN if who.partition(":")[0] in UNASKED else who for who in seats.values()]
    for name in names:
        base = name.partition(":")[0]
        if name != HUMAN and base not in catalog.agents(problem) and not trusted:
            raise BadParameter(f"seats: {name!r} is not built in; if it is yours, add --trust")
    policies = [
        None if name == HUMAN else catalog.agent(problem, seat, name)
        for seat, name in enumerate(names)
    ]
    return names, policies


def _asked(problem: Problem, seat: int, who: str, trusted: bool) -> Policy | None:
    name = who.partition(":")[0]
    if name in UNASKED or not (trusted or name in catalog.agents(problem)):
        return None
    policy = catalog.agent(problem, seat, who)
    return None if getattr(policy, "timed", False) else policy  # it may do otherwise next time


def header(loaded: catalog.Loaded, seats: Sequence[str], dice: Dice, request: Request) -> Header:
    """The transcript header of a game; scripts are named without their place."""
    names = [
        who.partition(":")[0] if who.startswith(("script:", "replay:")) else who for who in seats
    ]
    told = {line.field: getattr(request, line.field) for line in LINES}
    told |= {"problem": loaded.name, "parameters": loaded.parameters, "seed": dice.seed}
    told["seats"] = dict(zip(loaded.problem.agents, map(clean, names), strict=True))
    return Header(**told)

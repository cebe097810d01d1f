"""Who sits where: people, agents, scripts and recordings, and how a word or a key is an action."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from dmplay import catalog
from dmplay.core import Interval, Policy, Problem
from dmplay.dice import Dice
from dmplay.errors import BadParameter, DmplayError, UnknownName
from dmplay.policies.general import Script
from dmplay.shell.terminal import clean
from dmplay.transcript.format import Header
from dmplay.transcript.reading import read
from dmplay.views._style_of import style_of

HUMAN = "human"
UNASKED = (HUMAN, "script", "replay")  # seats whose actions only the file can tell
DIGITS = 10  # keys that are the number of an action


def action_of(problem: Problem, seat: int, word: str) -> float:
    """The action that a person wrote: its name, an alias, its number or a key."""
    try:
        return problem.action(seat, word)
    except UnknownName:
        by_key = action_by_key(problem, seat, word)
        if by_key is None:
            raise
        return by_key


def action_by_key(problem: Problem, seat: int, key: str) -> float | None:
    """The action that a key plays: a digit is its number, 0 the tenth."""
    labels = problem.actions[seat]
    if isinstance(labels, Interval):
        return None
    known = style_of(problem).KEYS
    if key in known:
        return labels.index(known[key])
    if len(key) == 1 and key.isdigit() and len(labels) <= DIGITS:
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
        transcript = read(Path(rest))
        name = problem.agents[seat]
        told = [block["actions"] for block in transcript.blocks if "actions" in block.entries]
        texts = [str(actions.get(name, "")) for actions in told if isinstance(actions, dict)]
        return Script(problem, seat, tuple(problem.action(seat, text) for text in texts))
    return catalog.agent(problem, seat, who)


def _script(problem: Problem, seat: int, rest: str) -> tuple[float, ...]:
    """Actions from `a,b,c`, or from a file with one action or several to a line."""
    file = Path(rest)
    if file.is_file():
        rows = file.read_text().splitlines()
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


def asked_again(
    problem: Problem, seats: Mapping[str, str], *, trusted: bool
) -> list[Policy | None]:
    """The agents of a transcript that can be asked what they would do; None for the others."""
    return [_asked(problem, seat, who, trusted) for seat, who in enumerate(seats.values())]


def _asked(problem: Problem, seat: int, who: str, trusted: bool) -> Policy | None:
    name = who.partition(":")[0]
    if name in UNASKED or not (trusted or name in catalog.agents(problem)):
        return None
    policy = catalog.agent(problem, seat, who)
    return None if getattr(policy, "timed", False) else policy  # it may do otherwise next time


def header(loaded: catalog.Loaded, seats: Sequence[str], dice: Dice, turns: int | None) -> Header:
    """The transcript header of a game; scripts are named without their place."""
    names = [
        who.partition(":")[0] if who.startswith(("script:", "replay:")) else who for who in seats
    ]
    told = dict(zip(loaded.problem.agents, map(clean, names), strict=True))
    return Header(loaded.name, told, dice.seed, loaded.parameters, dice.episode, turns)

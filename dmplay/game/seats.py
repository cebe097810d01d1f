"""Who sits where: people, agents, scripts and recordings."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from dmplay.core import Policy, Problem
from dmplay.disk import content
from dmplay.errors import BadParameter, DmplayError
from dmplay.finding import agents, problems
from dmplay.finding.ways import HERE, beside, is_program, moved
from dmplay.game.request import Request
from dmplay.game.saves import readable
from dmplay.keys.keyboard import action_of
from dmplay.policies.kinds import Seated
from dmplay.policies.script import Script
from dmplay.terminal import clean
from dmplay.transcript.format import PERSON, PLAYERS
from dmplay.transcript.header import LINES, Header
from dmplay.transcript.replay import replay
from dmplay.transcript.seal import opened

HUMAN = PERSON
UNASKED = (*PLAYERS, "script", "replay")  # seats whose actions only the file can tell


def people(seats: Sequence[str]) -> list[int]:
    """The seats that people play, or a language model."""
    return [seat for seat, who in enumerate(seats) if who in PLAYERS]


def seat_policy(problem: Problem, seat: int, who: str, turns: int | None = None) -> Policy | None:
    """The policy that plays a seat of a game of so many turns; None for a person."""
    kind, _, rest = who.partition(":")
    if who == HUMAN:
        return None
    if kind == "script":
        return Script(problem, seat, _script(problem, seat, rest))
    if kind == "replay":
        played = replay(opened(readable(Path(rest)), problem), problem).turns
        return Script(problem, seat, tuple(turn.actions[seat].item() for turn in played))
    if is_program(who):
        return agents.program(problem, seat, who, turns)
    return agents.agent(problem, seat, who)


def _script(problem: Problem, seat: int, rest: str) -> tuple[float, ...]:
    """Actions from `a,b,c`, or from a file with one action or several to a line."""
    if _is_file(rest):
        try:
            rows = content(Path(rest)).decode().splitlines()
        except OSError as error:
            raise BadParameter(f"{rest}: {error.strerror}") from None
        except UnicodeDecodeError:
            raise BadParameter(f"{rest}: got what is no UTF-8, expected lines of actions") from None
        words = [
            (f"{rest}:{number}", word)
            for number, row in enumerate(rows, 1)
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
    except (OSError, ValueError):  # too long to be a name, or no name
        return False


def asked_again(
    problem: Problem, seats: Mapping[str, str], *, trusted: bool, folder: Path = HERE
) -> list[Policy | None]:
    """The agents of a transcript that can be asked what they would do; None for the others.

    A path is told from `folder`.
    """
    names = [moved(who, folder, HERE) for who in seats.values()]
    return [_asked(problem, seat, who, trusted) for seat, who in enumerate(names)]


def sitting(
    problem: Problem, header: Header, *, trusted: bool, folder: Path = HERE
) -> tuple[list[str], list[Policy | None]]:
    """Who plays on where a transcript leaves off: its agents, people for all other seats.

    What a file names, a path told from `folder`, is imported only where it is trusted; raises
    BadParameter otherwise.
    """
    known = [HUMAN if who.partition(":")[0] in UNASKED else who for who in header.seats.values()]
    names = [moved(who, folder, HERE) for who in known]
    for name in names:
        base = name.partition(":")[0]
        if name != HUMAN and base not in agents.roster(problem).agents and not trusted:
            raise BadParameter(f"seats: {name!r} is not built in; if it is yours, add --trust")
    turns = header.turns
    return names, [seat_policy(problem, seat, name, turns) for seat, name in enumerate(names)]


def _asked(problem: Problem, seat: int, who: str, trusted: bool) -> Policy | None:
    brought = agents.is_brought(problem, seat, who)
    if who in UNASKED or is_program(who) or (brought and not trusted):
        return None
    policy = agents.agent(problem, seat, who)
    timed = isinstance(policy, Seated) and policy.timed  # it may do otherwise next time
    return None if timed else policy


def told_in(name: str, path: Path | None) -> str:
    """The name of a problem or an agent as a transcript there has it."""
    return moved(name, HERE, beside(path)) if path else name


def header(
    loaded: problems.Loaded, seats: Sequence[str], request: Request, path: Path | None
) -> Header:
    """The header of a game's transcript there; scripts are named without their place."""
    names = [
        who.partition(":")[0] if who.startswith(("script:", "replay:")) else told_in(who, path)
        for who in (request.person if who == HUMAN else who for who in seats)
    ]
    told = {line.field: getattr(request, line.field) for line in LINES}
    told |= {"problem": told_in(loaded.name, path), "origin": loaded.origin}
    told["parameters"] = loaded.parameters
    told["seats"] = dict(zip(loaded.problem.agents, map(clean, names), strict=True))
    return Header(**told)

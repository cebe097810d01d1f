"""Agents by name: who can play a seat, who advises there, and how an agent in a game is named.

An agent is `NAME`, `NAME:PARAMETER=VALUE,...`, `MODULE:ATTRIBUTE`, `./FILE.py:ATTRIBUTE` or a
program, `bot:COMMAND` or `bot:PARAMETER=VALUE,...,COMMAND`.
"""

from collections.abc import Sequence
from dataclasses import Field, fields, replace
from functools import cache, partial
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from dmplay.core import WHOLE, Policy, Problem, check_problem
from dmplay.errors import BadParameter, BadPolicy, UnknownName
from dmplay.finding import modules
from dmplay.finding.names import name_of, problem_names
from dmplay.finding.outside import attribute, is_outside
from dmplay.finding.problems import load, stem
from dmplay.finding.typed import typed
from dmplay.finding.ways import is_program
from dmplay.places import blamed
from dmplay.policies.kinds import Seated
from dmplay.policies.roster import ADVISER, PARTNER, Roster

GIVEN = ("problem", "seat", "company")  # fields that are no parameters
SHOWN = 4  # problems of an agent that does not fit


def roster(problem: Problem, seat: int = 0) -> Roster:
    """Who can play a seat of a problem: its own agents, then those for any problem."""
    own = stem(problem)
    if not own or find_spec(f"dmplay.policies.{own}") is None:
        own = "brought"
    first, rest = _listed(own, problem, seat), _listed("general", problem, seat)
    usual = replace(first, agents={**first.agents, **rest.agents})
    return usual if stem(problem) else modules.roster(problem, seat, usual)


def agent(problem: Problem, seat: int, name: str) -> Policy:
    """The agent of this name for a seat.

    Raises UnknownName with the nearest names, BadPolicy where it does not play this problem, and
    BadParameter for what its parameters, or the seat, cannot be.
    """
    check_problem(problem, None)
    if seat not in range(len(problem.agents)):
        raise BadParameter(f"seat: got {seat!r}, expected 0 to {len(problem.agents) - 1}")
    if is_program(name):
        return program(problem, seat, name)
    if not is_brought(problem, seat, name):
        return _of_roster(problem, seat, name)
    place, _, rest = name.partition(":")
    wanted, _, given = rest.partition(":")
    try:
        make = attribute(f"{place}:{wanted}")
    except BadParameter:  # no such module
        _check_fits(problem, seat, place)
        raise
    chosen = _settings(make, given, name) if given else {}
    try:
        made: Policy = make(problem, seat, **chosen)
    except TypeError as error:
        if blamed(error):  # on a line of what was brought
            raise
        _check_fits(problem, seat, place)
        raise BadPolicy(f"{name}: nothing that a problem and a seat make a policy of") from None
    missing = [part for part in ("draws", "begin", "update", "choose") if not hasattr(made, part)]
    if missing:
        raise BadPolicy(f"{name}: not a policy, it lacks {', '.join(missing)}")
    if not isinstance(made.draws, WHOLE) or made.draws < 0:
        raise BadPolicy(f"{name}: draws: got {made.draws!r}, expected how many, 0 or more")
    return made


def is_brought(problem: Problem, seat: int, name: str) -> bool:
    """Whether an agent's name points outside of those that can play a seat, into a file or module.

    What it names then runs only where it is trusted.
    """
    known = (*modules.TAKEN, *roster(problem, seat).agents)
    return is_outside(name) and name.partition(":")[0] not in known


def adviser(
    problem: Problem, seat: int, turns: int | None = None, seats: Sequence[str] = ()
) -> tuple[str, Seated] | None:
    """The agent whose values and choices serve as hints, as suits this game, with its name.

    The game is of so many turns, against those who sit in the other `seats`. None where there is
    none, or where it refuses the problem.
    """
    name = roster(problem, seat).advises(turns)
    if name is None:
        return None
    rivals = [who for other, who in enumerate(seats) if other != seat]
    try:
        suited = _of_roster(problem, seat, name).in_game(turns, rivals)
    except BadPolicy:
        return None
    return _named(name, suited), suited


def usual(problem: Problem, seat: int, turns: int | None = None) -> str:
    """Who plays a seat of many games where nobody was named: whoever advises there, if anybody
    does, or is sooner done.
    """
    known = roster(problem, seat)
    advises = known.advises(turns) if adviser(problem, seat, turns) else None
    return known.quick or advises or known.partner


def refused(problem: Problem, make: type[Seated]) -> bool:
    """Whether an agent of a roster does not play the first seat of a problem, as far as is known.

    A package is not loaded to know it.
    """
    if make.package:
        return False
    try:
        make(problem, 0)
    except BadPolicy:
        return True
    return False


def for_turns(problem: Problem, seat: int, name: str, turns: int) -> str:
    """The agent of this name in a game of so many turns: one that plans a whole game plans this.

    Unless the name says how many turns it plans.
    """
    base, _, given = name.partition(":")
    make = roster(problem, seat).agents.get(base)
    if make is None or not make.whole_game or "horizon" in _settings(make, given, base):
        return name
    return _named(base, _of_roster(problem, seat, name).in_game(turns, ()))


def settings(make: type[Seated]) -> dict[str, object]:
    """The parameters of an agent with their defaults."""
    return {one.name: one.default for one in _parameters(make)}


def meanings(make: type[Seated]) -> dict[str, str]:
    """The parameters of an agent with what they mean, '' where it does not say."""
    return {one.name: one.metadata.get("meaning", "") for one in _parameters(make)}


def _listed(module: str, problem: Problem, seat: int) -> Roster:
    found: Roster = import_module(f"dmplay.policies.{module}").roster(problem, seat)
    return found


def _of_roster(problem: Problem, seat: int, name: str) -> Seated:
    base, _, given = name.partition(":")
    known = roster(problem, seat).agents
    if base in modules.TAKEN:  # who does not choose by itself
        raise UnknownName("agent", name, [*known, "bot:COMMAND"])
    if base not in known:
        _check_fits(problem, seat, base)
        raise UnknownName("agent", base, _names(problem, seat))
    make = known[base]
    return make(problem, seat, **_settings(make, given, base)).among(partial(_other, problem))


def _names(problem: Problem, seat: int) -> list[str]:
    """Who can be named for a seat."""
    return ["human", *roster(problem, seat).agents, "script", "replay", "bot"]


def _check_fits(problem: Problem, seat: int, name: str) -> None:
    """Raises BadPolicy for an agent of other problems, with theirs."""
    where = {one: kind for one, kind, agents in _built_in() if name in agents}
    if not where:
        return
    kinds = {*where.values()}
    told = ", ".join([*where][:SHOWN]) + " and others" * (len(where) > SHOWN)
    others = ", ".join(_names(problem, seat))
    why = "" if problem.kind in kinds else f" ({' or '.join(sorted(kinds))}, not {problem.kind})"
    raise BadPolicy(f"agent {name} is for {told}{why}; expected one of {others}")


@cache
def _built_in() -> list[tuple[str, str, set[str]]]:
    """Each built-in problem with its kind and who can play the first and the last seat."""
    each = [(name, load(name)) for name in problem_names()]
    return [
        (name, its.kind, {*roster(its).agents, *roster(its, len(its.agents) - 1).agents})
        for name, its in each
    ]


def _other(problem: Problem, seat: int, name: str) -> Seated | None:
    """The agent of a name or a part, as a search has it play; None for random play."""
    seated = roster(problem, seat)
    if name in {ADVISER, PARTNER} and seated.simulated:
        name = seated.simulated
    elif name == ADVISER:
        found = None if seated.quick else adviser(problem, seat)
        name = found[0] if found else "random"
    elif name == PARTNER:
        name = seated.partner
    if name.partition(":")[0] in {"random", "search"}:
        return None
    made = _of_roster(problem, seat, name)
    if made.timed:
        raise BadPolicy(f"{name}: its choices depend on the clock; have a search take random")
    return made


def program(problem: Problem, seat: int, name: str, turns: int | None = None) -> Policy:
    """The program of `bot:COMMAND`, in a game of so many turns.

    Pairs that stand before the command are its parameters.
    """
    from dmplay.bots.bot import Bot  # not needed where none plays

    command, given = name.partition(":")[2], {}
    while command.startswith(("clock=", "belief=")):
        pair, _, command = command.partition(",")
        key, _, value = pair.partition("=")
        given[key] = typed(key, value, getattr(Bot, key))
    told = name_of(stem(problem)) or type(problem).__name__
    return Bot(problem, seat, command, told, turns, **given)  # type: ignore[arg-type] # typed by `typed`


def _settings(make: type[Seated], given: str, name: str) -> dict[str, object]:
    """The parameters `a=1,b=2` of an agent, typed after their defaults."""
    known = settings(make)
    found = {}
    for pair in filter(None, given.split(",")):
        key, equals, value = pair.partition("=")
        if not equals and make.unnamed:
            key, equals, value = make.unnamed, "=", pair
        plain = key.strip().replace("-", "_")
        if plain not in known:
            raise UnknownName("parameter", key, known, where=f"agent {name}")
        if not equals:
            raise BadParameter(f"agent {name}: got {pair!r}, expected {plain}=VALUE")
        found[plain] = typed(plain, value.strip(), known[plain])
    return found


def _named(name: str, found: Seated) -> str:
    """The name of an agent with those of its parameters that are not as by default."""
    plain = settings(type(found))
    changed = {key: getattr(found, key) for key in plain if getattr(found, key) != plain[key]}
    told = ",".join(f"{key}={_told(value)}" for key, value in changed.items())
    return f"{name}:{told}" if told else name


def _told(value: object) -> str:
    """A parameter's value as it is written in a name."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def _parameters(make: type[Seated]) -> list[Field[Any]]:
    return [one for one in fields(make) if one.name not in GIVEN]

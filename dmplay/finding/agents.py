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

from dmplay.core import INTEGER_TYPES, Policy, Problem, check_problem
from dmplay.errors import BadParameter, BadPolicy, UnknownName
from dmplay.finding import modules
from dmplay.finding.names import problem_names, stem_to_name
from dmplay.finding.outside import load_named_attribute, may_name_code
from dmplay.finding.problems import builtin_stem, load_problem
from dmplay.finding.typed import parse_parameter
from dmplay.finding.ways import names_bot
from dmplay.places import describe_error_location
from dmplay.policies.kinds import SeatPolicy
from dmplay.policies.roster import HINT_PROVIDER_ROLE, PARTNER_ROLE, Roster

NON_PARAMETER_FIELDS = ("problem", "seat", "policy_lookup")  # fields that are no parameters
MAX_LISTED_PROBLEMS = 4  # problems of an agent that does not fit


def load_roster(problem: Problem, seat: int = 0) -> Roster:
    """Who can play a seat of a problem: its own agents, then those for any problem."""
    own = builtin_stem(problem)
    if not own or find_spec(f"dmplay.policies.{own}") is None:
        own = "brought"
    first, rest = (
        _load_module_roster(own, problem, seat),
        _load_module_roster("general", problem, seat),
    )
    usual = replace(first, agents={**first.agents, **rest.agents})
    return usual if builtin_stem(problem) else modules.merge_module_agents(problem, seat, usual)


def load_agent(problem: Problem, seat: int, name: str) -> Policy:
    """The agent of this name for a seat.

    Raises UnknownName with the nearest names, BadPolicy where it does not play this problem, and
    BadParameter for what its parameters, or the seat, cannot be.
    """
    check_problem(problem, None)
    if seat not in range(len(problem.agents)):
        raise BadParameter(f"seat: got {seat!r}, expected 0 to {len(problem.agents) - 1}")
    if names_bot(name):
        return make_bot(problem, seat, name)
    if not names_user_code(problem, seat, name):
        return _make_roster_agent(problem, seat, name)
    place, _, rest = name.partition(":")
    wanted, _, given = rest.partition(":")
    try:
        make = load_named_attribute(f"{place}:{wanted}")
    except BadParameter:  # no such module
        _check_fits(problem, seat, place)
        raise
    chosen = _parse_parameters(make, given, name) if given else {}
    try:
        made: Policy = make(problem, seat, **chosen)
    except TypeError as error:
        if describe_error_location(error):  # on a line of what was brought
            raise
        _check_fits(problem, seat, place)
        raise BadPolicy(f"{name}: nothing that a problem and a seat make a policy of") from None
    missing = [
        part
        for part in ("uniform_count", "initial_memory", "update_memory", "choose")
        if not hasattr(made, part)
    ]
    if missing:
        raise BadPolicy(f"{name}: not a policy, it lacks {', '.join(missing)}")
    if not isinstance(made.uniform_count, INTEGER_TYPES) or made.uniform_count < 0:
        raise BadPolicy(
            f"{name}: uniform_count: got {made.uniform_count!r}, expected how many, 0 or more"
        )
    return made


def names_user_code(problem: Problem, seat: int, name: str) -> bool:
    """Whether an agent's name points outside of those that can play a seat, into a file or module.

    What it names then runs only where it is trusted.
    """
    known = (*modules.RESERVED_AGENT_NAMES, *load_roster(problem, seat).agents)
    return may_name_code(name) and name.partition(":")[0] not in known


def find_hint_provider(
    problem: Problem, seat: int, turn_limit: int | None = None, seats: Sequence[str] = ()
) -> tuple[str, SeatPolicy] | None:
    """The agent whose values and choices serve as hints, as suits this game, with its name.

    The game is of so many turns, against those who sit in the other `seats`. None where there is
    none, or where it refuses the problem.
    """
    name = load_roster(problem, seat).hint_provider_for(turn_limit)
    if name is None:
        return None
    rivals = [who for other, who in enumerate(seats) if other != seat]
    try:
        suited = _make_roster_agent(problem, seat, name).adapt_to_game(turn_limit, rivals)
    except BadPolicy:
        return None
    return _format_agent_name(name, suited), suited


def default_agent(problem: Problem, seat: int, turn_limit: int | None = None) -> str:
    """Who plays a seat of many games where nobody was named: whoever advises there, if anybody
    does, or is sooner done.
    """
    known = load_roster(problem, seat)
    advises = (
        known.hint_provider_for(turn_limit)
        if find_hint_provider(problem, seat, turn_limit)
        else None
    )
    return known.batch_agent or advises or known.default_partner


def refuses_problem(problem: Problem, agent_class: type[SeatPolicy]) -> bool:
    """Whether an agent of a roster does not play the first seat of a problem, as far as is known.

    A package is not loaded to know it.
    """
    if agent_class.required_package:
        return False
    try:
        agent_class(problem, 0)
    except BadPolicy:
        return True
    return False


def plan_for_turn_limit(problem: Problem, seat: int, name: str, turn_limit: int) -> str:
    """The agent of this name in a game of so many turns: one that plans a whole game plans this.

    Unless the name says how many turns it plans.
    """
    base, _, given = name.partition(":")
    make = load_roster(problem, seat).agents.get(base)
    if (
        make is None
        or not make.plans_whole_game
        or "horizon" in _parse_parameters(make, given, base)
    ):
        return name
    return _format_agent_name(
        base, _make_roster_agent(problem, seat, name).adapt_to_game(turn_limit, ())
    )


def default_parameters(agent_class: type[SeatPolicy]) -> dict[str, object]:
    """The parameters of an agent with their defaults."""
    return {one.name: one.default for one in _parameter_fields(agent_class)}


def parameter_meanings(agent_class: type[SeatPolicy]) -> dict[str, str]:
    """The parameters of an agent with what they mean, '' where it does not say."""
    return {one.name: one.metadata.get("meaning", "") for one in _parameter_fields(agent_class)}


def _load_module_roster(module: str, problem: Problem, seat: int) -> Roster:
    found: Roster = import_module(f"dmplay.policies.{module}").build_roster(problem, seat)
    return found


def _make_roster_agent(problem: Problem, seat: int, name: str) -> SeatPolicy:
    base, _, given = name.partition(":")
    known = load_roster(problem, seat).agents
    if base in modules.RESERVED_AGENT_NAMES:  # who does not choose by itself
        raise UnknownName("agent", name, [*known, "bot:COMMAND"])
    if base not in known:
        _check_fits(problem, seat, base)
        raise UnknownName("agent", base, _valid_agent_names(problem, seat))
    make = known[base]
    return make(problem, seat, **_parse_parameters(make, given, base)).with_policy_lookup(
        partial(_make_opponent, problem)
    )


def _valid_agent_names(problem: Problem, seat: int) -> list[str]:
    """Who can be named for a seat."""
    return ["human", *load_roster(problem, seat).agents, "script", "replay", "bot"]


def _check_fits(problem: Problem, seat: int, name: str) -> None:
    """Raises BadPolicy for an agent of other problems, with theirs."""
    where = {one: kind for one, kind, agents in _builtin_agents() if name in agents}
    if not where:
        return
    kinds = {*where.values()}
    told = ", ".join([*where][:MAX_LISTED_PROBLEMS]) + " and others" * (
        len(where) > MAX_LISTED_PROBLEMS
    )
    others = ", ".join(_valid_agent_names(problem, seat))
    why = "" if problem.kind in kinds else f" ({' or '.join(sorted(kinds))}, not {problem.kind})"
    raise BadPolicy(f"agent {name} is for {told}{why}; expected one of {others}")


@cache
def _builtin_agents() -> list[tuple[str, str, set[str]]]:
    """Each built-in problem with its kind and who can play the first and the last seat."""
    each = [(name, load_problem(name)) for name in problem_names()]
    return [
        (name, its.kind, {*load_roster(its).agents, *load_roster(its, len(its.agents) - 1).agents})
        for name, its in each
    ]


def _make_opponent(problem: Problem, seat: int, name: str) -> SeatPolicy | None:
    """The agent of a name or a part, as a search has it play; None for random play."""
    seated = load_roster(problem, seat)
    if name in {HINT_PROVIDER_ROLE, PARTNER_ROLE} and seated.simulation_agent:
        name = seated.simulation_agent
    elif name == HINT_PROVIDER_ROLE:
        found = None if seated.batch_agent else find_hint_provider(problem, seat)
        name = found[0] if found else "random"
    elif name == PARTNER_ROLE:
        name = seated.default_partner
    if name.partition(":")[0] in {"random", "search"}:
        return None
    made = _make_roster_agent(problem, seat, name)
    if made.depends_on_clock:
        raise BadPolicy(f"{name}: its choices depend on the clock; have a search take random")
    return made


def make_bot(problem: Problem, seat: int, name: str, turn_limit: int | None = None) -> Policy:
    """The program of `bot:COMMAND`, in a game of so many turns.

    Pairs that stand before the command are its parameters.
    """
    from dmplay.bots.bot import Bot  # not needed where none plays

    command, given = name.partition(":")[2], {}
    while command.startswith(("clock=", "belief=")):
        pair, _, command = command.partition(",")
        key, _, value = pair.partition("=")
        given[key] = parse_parameter(key, value, getattr(Bot, key))
    told = stem_to_name(builtin_stem(problem)) or type(problem).__name__
    return Bot(problem, seat, command, told, turn_limit, **given)  # type: ignore[arg-type] # typed by `typed`


def _parse_parameters(agent_class: type[SeatPolicy], text: str, name: str) -> dict[str, object]:
    """The parameters `a=1,b=2` of an agent, typed after their defaults."""
    known = default_parameters(agent_class)
    found = {}
    for pair in filter(None, text.split(",")):
        key, equals, value = pair.partition("=")
        if not equals and agent_class.positional_parameter:
            key, equals, value = agent_class.positional_parameter, "=", pair
        plain = key.strip().replace("-", "_")
        if plain not in known:
            raise UnknownName("parameter", key, known, error_prefix=f"agent {name}")
        if not equals:
            raise BadParameter(f"agent {name}: got {pair!r}, expected {plain}=VALUE")
        found[plain] = parse_parameter(plain, value.strip(), known[plain])
    return found


def _format_agent_name(name: str, policy: SeatPolicy) -> str:
    """The name of an agent with those of its parameters that are not as by default."""
    plain = default_parameters(type(policy))
    changed = {key: getattr(policy, key) for key in plain if getattr(policy, key) != plain[key]}
    told = ",".join(f"{key}={_format_parameter(value)}" for key, value in changed.items())
    return f"{name}:{told}" if told else name


def _format_parameter(value: object) -> str:
    """A parameter's value as it is written in a name."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def _parameter_fields(agent_class: type[SeatPolicy]) -> list[Field[Any]]:
    return [one for one in fields(agent_class) if one.name not in NON_PARAMETER_FIELDS]

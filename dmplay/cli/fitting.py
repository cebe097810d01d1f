"""What a file of settings says for every problem: what does not fit the one played is passed over.

What fits none is refused, with the file that says it.
"""

import os

import typer

from dmplay.cli import config
from dmplay.core import Problem
from dmplay.errors import BadParameter, BadPolicy, DmplayError


def problem(ctx: typer.Context) -> str:
    """The problem that stands before the cursor, with its variant."""
    # An option that still lacks its value leaves the arguments before it unread.
    base = ctx.params.get("problem") or next((word for word in ctx.args if word[:1] != "-"), "")
    variant = ctx.params.get("variant")
    return f"{base}:{variant}" if variant else str(base)


def parameters(
    ctx: typer.Context, option: typer.CallbackParam, settings: list[str]
) -> tuple[str, ...]:
    """The parameters that are set; of those in a file, what the problem has."""
    played = _played(ctx, option) if settings else None
    if played is None:
        return tuple(settings)
    from dmplay.finding.problems import parameters

    known = parameters(played)
    return tuple(one for one in settings if one.partition("=")[0].strip() in known)


def agent(ctx: typer.Context, option: typer.CallbackParam, who: str) -> str:
    """Who is to play; whom a file names, if that is one who plays this problem."""
    played = _played(ctx, option) if who else None
    if played is None:
        return who
    seats = range(1, len(played.agents)) if option.name == "vs" else range(1)
    asked = option.name != "ghost" or ctx.params.get("agent") == "human"
    fits = asked and seats and all(_plays(ctx, option, played, seat, who) for seat in seats)
    return who if fits else str(option.default or "")


def seats(ctx: typer.Context, option: typer.CallbackParam, named: list[str]) -> tuple[str, ...]:
    """Who plays which seat; of those in a file, whoever plays this problem, if it has the seat."""
    played = _played(ctx, option) if named else None
    if played is None:
        return tuple(named)
    pairs = [(one, *one.partition("=")[::2]) for one in named]
    return tuple(
        one
        for one, name, who in pairs
        if name in played.agents and _plays(ctx, option, played, played.seat(name), who)
    )


def wish(ctx: typer.Context, option: typer.CallbackParam, value: object) -> object:
    """What is for people, or for a transcript; of a file, where there is one or the other."""
    if not _of_a_file(ctx, option):
        return value
    who = [ctx.params.get("agent"), ctx.params.get("vs"), *(ctx.params.get("seat") or ())]
    person = any(str(one).endswith("human") for one in who)
    heard = person or (option.name == "frames" and ctx.params.get("record"))
    return value if heard else option.default


def _of_a_file(ctx: typer.Context, option: typer.CallbackParam) -> bool:
    """Whether a file of settings sets this option."""
    source = ctx.get_parameter_source(str(option.name))
    return source is not None and source.name == "DEFAULT_MAP" and not ctx.resilient_parsing


def _played(ctx: typer.Context, option: typer.CallbackParam) -> Problem | None:
    """The problem, where a file sets this option; None of a name that is none, told elsewhere."""
    if not _of_a_file(ctx, option):
        return None
    from dmplay.finding import problems
    from dmplay.game.request import pairs

    try:
        told = pairs(ctx.params.get("set_") or (), "--set")
        return problems.found(problem(ctx), told).problem
    except DmplayError:
        return None


def _plays(
    ctx: typer.Context, option: typer.CallbackParam, played: Problem, seat: int, who: str
) -> bool:
    """Whether an agent plays this seat; raises BadParameter for one that plays nothing."""
    from dmplay.finding.agents import is_brought
    from dmplay.game.seats import seat_policy

    try:
        seat_policy(played, seat, who)
    except DmplayError as error:
        if isinstance(error, BadPolicy) and not is_brought(played, seat, who):
            return False
        where = f"{config.paths(os.environ)[0]}: {ctx.info_name}.{option.name}"
        raise BadParameter(f"{where}: {error}") from None
    return True

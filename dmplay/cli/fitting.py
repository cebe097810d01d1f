"""What a file of settings says for every problem: what does not fit the one played is passed over.

What fits none is refused, with the file that says it.
"""

import os
from collections.abc import Callable
from typing import Any

import typer

from dmplay.cli import config
from dmplay.core import Problem
from dmplay.errors import BadParameter, BadPolicy, DmplayError


def _parameters(
    ctx: typer.Context, option: typer.CallbackParam, settings: list[str], name: str
) -> tuple[str, ...]:
    """Of the parameters what the problem has."""
    played = _played(ctx, name) if settings else None
    if played is None:
        return tuple(settings)
    from dmplay.finding.problems import parameters

    known = parameters(played)
    return tuple(one for one in settings if one.partition("=")[0].strip() in known)


def _agent(ctx: typer.Context, option: typer.CallbackParam, who: str, name: str) -> str:
    """Whom the file names, if that is one who plays this problem."""
    played = _played(ctx, name) if who else None
    if played is None:
        return who
    seats = range(1, len(played.agents)) if option.name == "vs" else range(1)
    asked = option.name != "ghost" or ctx.params.get("agent") == "human"
    fits = asked and seats and all(_plays(ctx, option, played, seat, who) for seat in seats)
    return who if fits else str(option.default or "")


def _seats(
    ctx: typer.Context, option: typer.CallbackParam, named: list[str], name: str
) -> tuple[str, ...]:
    """Whoever plays this problem, if it has the seat."""
    played = _played(ctx, name) if named else None
    if played is None:
        return tuple(named)
    pairs = [(one, *one.partition("=")[::2]) for one in named]
    return tuple(
        one
        for one, seat, who in pairs
        if seat in played.agents and _plays(ctx, option, played, played.seat(seat), who)
    )


def _wish(ctx: typer.Context, option: typer.CallbackParam, value: object, name: str) -> object:
    """What is for people, or for a transcript, where there is one or the other."""
    who = [ctx.params.get("agent"), ctx.params.get("vs"), *(ctx.params.get("seat") or ())]
    person = any(str(one).endswith("human") for one in who)
    heard = person or (option.name == "frames" and ctx.params.get("record"))
    return value if heard else option.default


KINDS: dict[str, Callable[[typer.Context, typer.CallbackParam, Any, str], object]] = {
    "parameters": _parameters,
    "agent": _agent,
    "seats": _seats,
    "wish": _wish,
}


def _played(ctx: typer.Context, name: str) -> Problem | None:
    """The problem of this name; None where it is none, which is told elsewhere."""
    from dmplay.finding import problems
    from dmplay.game.request import pairs

    try:
        told = pairs(ctx.params.get("set_") or (), "--set")
        return problems.found(name, told).problem
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

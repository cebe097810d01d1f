"""What a file of settings says for every problem: what does not fit the one played is passed over.

What fits none is refused, with the file that says it.
"""

import os
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import typer

from dmplay.cli import config
from dmplay.core import Problem
from dmplay.errors import BadParameter, BadPolicy, DmplayError
from dmplay.finding import problems
from dmplay.finding.agents import is_brought
from dmplay.game.request import Request, pairs
from dmplay.game.seats import HUMAN, seat_policy
from dmplay.game.start import seated


def _parameters(
    ctx: typer.Context, option: typer.CallbackParam, settings: list[str], name: str
) -> tuple[str, ...]:
    """Of the parameters what the problem has."""
    played = _played(ctx, name) if settings else None
    if played is None:
        return tuple(settings)
    known = problems.parameters(played)
    return tuple(one for one in settings if one.partition("=")[0].strip() in known)


def _agent(ctx: typer.Context, option: typer.CallbackParam, who: str, name: str) -> str:
    """Whom the file names, if that is one who plays this problem."""
    played = _played(ctx, name) if who else None
    if played is None:
        return who
    seats = range(1, len(played.agents)) if option.name == "vs" else range(1)
    asked = option.name != "ghost" or _attended(ctx, name)
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
    written = option.name == "frames" and ctx.params.get("record")
    return value if written or _attended(ctx, name) else option.default


KINDS: dict[str, Callable[[typer.Context, typer.CallbackParam, Any, str], object]] = {
    "parameters": _parameters,
    "agent": _agent,
    "seats": _seats,
    "wish": _wish,
}


def _found(ctx: typer.Context, name: str) -> problems.Loaded | None:
    """The problem of this name; None where it is none, which is told elsewhere."""
    try:
        told = pairs(ctx.params.get("set_") or (), "--set")
        return problems.found(name, told)
    except DmplayError:
        return None


def _played(ctx: typer.Context, name: str) -> Problem | None:
    found = _found(ctx, name)
    return found and found.problem


def _attended(ctx: typer.Context, name: str) -> bool:
    """Whether a person plays; who cannot sit there is refused elsewhere."""
    found, given = _found(ctx, name), ctx.params
    told = Request(name, agent=given["agent"], others=given["vs"], seats=given["seat"])
    with suppress(DmplayError):
        return found is None or HUMAN in seated(told, found)
    return False


def _plays(
    ctx: typer.Context, option: typer.CallbackParam, played: Problem, seat: int, who: str
) -> bool:
    """Whether an agent plays this seat; raises BadParameter for one that plays nothing."""
    try:
        seat_policy(played, seat, who)
    except DmplayError as error:
        if isinstance(error, BadPolicy) and not is_brought(played, seat, who):
            return False
        where = f"{config.paths(os.environ)[0]}: {ctx.info_name}.{option.name}"
        raise BadParameter(f"{where}: {error}") from None
    return True

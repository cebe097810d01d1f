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
from dmplay.finding.agents import names_user_code
from dmplay.game.request import GameRequest, parse_settings
from dmplay.game.seats import HUMAN, make_seat_policy
from dmplay.game.start import assign_players


def _filter_parameters(
    ctx: typer.Context, option: typer.CallbackParam, settings: list[str], problem_name: str
) -> tuple[str, ...]:
    """Of the parameters what the problem has."""
    played = _load_problem(ctx, problem_name) if settings else None
    if played is None:
        return tuple(settings)
    known = problems.parameter_values(played)
    return tuple(one for one in settings if one.partition("=")[0].strip() in known)


def _filter_agent(
    ctx: typer.Context, option: typer.CallbackParam, agent: str, problem_name: str
) -> str:
    """Whom the file names, if that is one who plays this problem."""
    played = _load_problem(ctx, problem_name) if agent else None
    if played is None:
        return agent
    seats = range(1, len(played.agents)) if option.name == "vs" else range(1)
    asked = option.name != "ghost" or _has_person(ctx, problem_name)
    fits = asked and seats and all(_can_play(ctx, option, played, seat, agent) for seat in seats)
    return agent if fits else str(option.default or "")


def _filter_seats(
    ctx: typer.Context, option: typer.CallbackParam, assignments: list[str], problem_name: str
) -> tuple[str, ...]:
    """Whoever plays this problem, if it has the seat."""
    played = _load_problem(ctx, problem_name) if assignments else None
    if played is None:
        return tuple(assignments)
    pairs = [(one, *one.partition("=")[::2]) for one in assignments]
    return tuple(
        one
        for one, seat, who in pairs
        if seat in played.agents and _can_play(ctx, option, played, played.seat_index(seat), who)
    )


def _filter_attended_option(
    ctx: typer.Context, option: typer.CallbackParam, value: object, problem_name: str
) -> object:
    """What is for people, or for a transcript, where there is one or the other."""
    written = option.name == "frames" and ctx.params.get("record")
    return value if written or _has_person(ctx, problem_name) else option.default


OPTION_FILTERS: dict[str, Callable[[typer.Context, typer.CallbackParam, Any, str], object]] = {
    "parameters": _filter_parameters,
    "agent": _filter_agent,
    "seats": _filter_seats,
    "wish": _filter_attended_option,
}


def _find_problem(ctx: typer.Context, problem_name: str) -> problems.LoadedProblem | None:
    """The problem of this name; None where it is none, which is told elsewhere."""
    try:
        told = parse_settings(ctx.params.get("set_") or (), "--set")
        return problems.find_problem(problem_name, told)
    except DmplayError:
        return None


def _load_problem(ctx: typer.Context, problem_name: str) -> Problem | None:
    found = _find_problem(ctx, problem_name)
    return found and found.problem


def _has_person(ctx: typer.Context, problem_name: str) -> bool:
    """Whether a person plays; who cannot sit there is refused elsewhere."""
    found, given = _find_problem(ctx, problem_name), ctx.params
    told = GameRequest(
        problem_name, agent=given["agent"], other_agent=given["vs"], seats=given["seat"]
    )
    with suppress(DmplayError):
        return found is None or HUMAN in assign_players(told, found)
    return False


def _can_play(
    ctx: typer.Context, option: typer.CallbackParam, problem: Problem, seat: int, agent: str
) -> bool:
    """Whether an agent plays this seat; raises BadParameter for one that plays nothing."""
    try:
        make_seat_policy(problem, seat, agent)
    except DmplayError as error:
        if isinstance(error, BadPolicy) and not names_user_code(problem, seat, agent):
            return False
        where = f"{config.config_paths(os.environ)[0]}: {ctx.info_name}.{option.name}"
        raise BadParameter(f"{where}: {error}") from None
    return True

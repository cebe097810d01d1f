"""Filters that drop options of settings files if they do not apply to the problem played.

An option that applies to no problem is an error whose message names the file.
"""

import os
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import typer

from dmplay.cli import config_files
from dmplay.core import Problem
from dmplay.errors import BadParameter, BadPolicy, DmplayError
from dmplay.game.game_setup import assign_players
from dmplay.game.launch_requests import GameRequest, parse_settings
from dmplay.game.seats import HUMAN, make_seat_policy
from dmplay.registry import problems
from dmplay.registry.agents import names_user_code


def _filter_parameters(
    ctx: typer.Context, option: typer.CallbackParam, settings: list[str], problem_name: str
) -> tuple[str, ...]:
    """Return the parameter settings that the problem has; all of them if it cannot be loaded."""
    problem = _load_problem(ctx, problem_name) if settings else None
    if problem is None:
        return tuple(settings)
    values = problems.parameter_values(problem)
    return tuple(setting for setting in settings if setting.partition("=")[0].strip() in values)


def _filter_agent(
    ctx: typer.Context, option: typer.CallbackParam, agent: str, problem_name: str
) -> str:
    """Return the agent if it can play the problem's seats; else the option's default.

    A ghost also needs a game with a person.
    """
    problem = _load_problem(ctx, problem_name) if agent else None
    if problem is None:
        return agent
    seats = range(1, len(problem.agents)) if option.name == "vs" else range(1)
    is_applicable = option.name != "ghost" or _has_person(ctx, problem_name)
    can_play = (
        is_applicable
        and seats
        and all(_can_play(ctx, option, problem, seat, agent) for seat in seats)
    )
    return agent if can_play else str(option.default or "")


def _filter_seats(
    ctx: typer.Context, option: typer.CallbackParam, assignments: list[str], problem_name: str
) -> tuple[str, ...]:
    """Return the assignments whose seats exist in the problem and whose agents can play them."""
    problem = _load_problem(ctx, problem_name) if assignments else None
    if problem is None:
        return tuple(assignments)
    triples = [(assignment, *assignment.partition("=")[::2]) for assignment in assignments]
    return tuple(
        assignment
        for assignment, seat, agent in triples
        if seat in problem.agents
        and _can_play(ctx, option, problem, problem.seat_index(seat), agent)
    )


def _filter_attended_option(
    ctx: typer.Context, option: typer.CallbackParam, value: object, problem_name: str
) -> object:
    """Return the value if a person plays; else the option's default.

    `--frames` also keeps its value if a transcript is written.
    """
    writes_frames = option.name == "frames" and ctx.params.get("record")
    return value if writes_frames or _has_person(ctx, problem_name) else option.default


OPTION_FILTERS: dict[str, Callable[[typer.Context, typer.CallbackParam, Any, str], object]] = {
    "parameters": _filter_parameters,
    "agent": _filter_agent,
    "seats": _filter_seats,
    "wish": _filter_attended_option,
}


def _find_problem(ctx: typer.Context, problem_name: str) -> problems.LoadedProblem | None:
    """Return the problem with the `--set` parameters; None if it cannot be loaded.

    The error is reported when the command loads the problem.
    """
    try:
        parameters = parse_settings(ctx.params.get("set_") or (), "--set")
        return problems.find_problem(problem_name, parameters)
    except DmplayError:
        return None


def _load_problem(ctx: typer.Context, problem_name: str) -> Problem | None:
    """Return the instance of a problem with the `--set` parameters; None if it cannot be loaded."""
    loaded_problem = _find_problem(ctx, problem_name)
    return loaded_problem and loaded_problem.problem


def _has_person(ctx: typer.Context, problem_name: str) -> bool:
    """Return whether a person plays a seat.

    True if the problem cannot be loaded, False if a player is invalid; both are reported elsewhere.
    """
    loaded_problem, params = _find_problem(ctx, problem_name), ctx.params
    request = GameRequest(
        problem_name, agent=params["agent"], other_agent=params["vs"], seats=params["seat"]
    )
    with suppress(DmplayError):
        return loaded_problem is None or HUMAN in assign_players(request, loaded_problem)
    return False


def _can_play(
    ctx: typer.Context, option: typer.CallbackParam, problem: Problem, seat: int, agent: str
) -> bool:
    """Return whether an agent can play this seat.

    Raise BadParameter, with the location of the setting, if the agent does not exist or is invalid.
    """
    try:
        make_seat_policy(problem, seat, agent)
    except DmplayError as error:
        if isinstance(error, BadPolicy) and not names_user_code(problem, seat, agent):
            return False
        location = f"{config_files.config_paths(os.environ)[0]}: {ctx.info_name}.{option.name}"
        raise BadParameter(f"{location}: {error}") from None
    return True

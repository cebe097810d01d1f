"""Everybody against everybody, for people and programs: `tournament`."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dmplay.core import Policy, Problem
from dmplay.describe import format_count, format_upper_bound
from dmplay.errors import BadParameter
from dmplay.finding import agents
from dmplay.game.errand import Printout
from dmplay.measure.engines import open_execution_backend
from dmplay.measure.tournament import (
    SEATING_ORDERS,
    TournamentResult,
    list_seatings,
    run_tournament,
)
from dmplay.reports.kept import TournamentCheckpoint
from dmplay.reports.match import EvaluationRequest, estimate_row, make_policy, make_report
from dmplay.reports.progress import ProgressBar
from dmplay.reports.tables import format_csv, format_json, format_mean, format_table
from dmplay.solutions.solution import Row

EQUILIBRIUM_AGENTS = ("equilibrium", "nash")  # agents that are one, where a problem has them


def report_tournament(
    request: EvaluationRequest,
    entrants: Sequence[str],
    *,
    episodes: int,
    orders: str = SEATING_ORDERS[0],
    results_file: Path | None = None,
) -> Printout:
    """Everybody against everybody: the cross table, the standings, and the game this makes."""
    if len({*entrants}) < len(entrants):
        raise BadParameter("tournament: an entrant is named twice; each plays itself anyhow")
    problem = request.load_problem().problem
    seats = len(problem.agents)
    policies = {name: _entrant_policies(problem, name, request) for name in entrants}
    facts = {"problem": request.problem, "parameters": request.parameters, "entrants": [*entrants],
             "episodes": episodes, "turns": request.turn_limit, "seed": request.seed}  # fmt: skip
    facts |= {"seats": orders} if orders != SEATING_ORDERS[0] else {}
    played = TournamentCheckpoint(results_file, facts) if results_file else {}
    exact = _equilibrium_agent(problem) if orders == SEATING_ORDERS[0] else ""
    with (
        ProgressBar(
            f"a tournament of {len(entrants)}",
            quiet=bool(request.output_format),
            motion=request.motion,
        ) as bar,
        open_execution_backend(request.engine, request.workers) as (workers, executor),
    ):
        found = run_tournament(
            problem, policies, equilibrium_policies=_entrant_policies(problem, exact, request) if exact else None,
            episodes=episodes, turns=request.turn_limit, seed=request.seed, workers=workers,
            executor=executor, progress=bar, returns_by_seating=played, seating_order=orders,
        )  # fmt: skip
    many, games = (
        len(list_seatings(len(entrants), seats, orders)),
        format_count(episodes, "game", ","),
    )
    head = f"{request.title}: {many} seatings of {games} of seed {request.seed}"
    return make_report(
        _format_tournament(found, request.output_format, head, facts, exact), found.shortfall_reason
    )


def _format_tournament(
    tournament: TournamentResult,
    output_format: str,
    headline: str,
    facts: dict[str, object],
    exact_agent: str,
) -> str:
    """The tournament in a form; for people under this headline."""
    standings = _standing_rows(tournament)
    if output_format == "json":
        rest = {"table": tournament.mean_returns.tolist(), "equilibrium": exact_agent, "exploitability": tournament.exploitability,
                "standings": standings}  # fmt: skip
        return format_json(facts | rest)
    if output_format == "csv":
        return format_csv(standings)
    cross = (
        [format_table(_cross_table(tournament))] if len(tournament.mean_returns.shape) == 3 else []
    )
    parts = [headline, *cross, format_table([_standing_table_row(row) for row in standings])]
    if tournament.exploitability is not None and len(tournament.mean_returns.shape) > 3:
        more = (
            f"more than {format_upper_bound(tournament.exploitability, 2)}"
            if tournament.exploitability
            else "anything"
        )
        parts.append(f"equilibrium: of this table; by another entrant no seat gains {more} in it")
    if tournament.exact_regrets:
        parts.append(f"exact regret: against {exact_agent}, an equilibrium of the problem itself")
    return "\n\n".join(parts)


def _entrant_policies(problem: Problem, name: str, request: EvaluationRequest) -> list[Policy]:
    """An entrant for every seat."""
    return [make_policy(problem, seat, name, request) for seat in range(len(problem.agents))]


def _equilibrium_agent(problem: Problem) -> str:
    """The agent that plays an equilibrium of the problem itself; '' where none is known."""
    if len(problem.agents) != 2 or problem.partially_observable:
        return ""
    known = [agents.load_roster(problem, seat).agents for seat in (0, 1)]
    return next((name for name in EQUILIBRIUM_AGENTS if all(name in one for one in known)), "")


def _cross_table(tournament: TournamentResult) -> list[Row]:
    """What the first seat and the second earn, the first seat's entrants as rows."""
    rows: list[Row] = []
    for name, paid in zip(tournament.entrants, tournament.mean_returns, strict=True):
        row: Row = {"first seat": name}
        for other, pair in zip(tournament.entrants, paid, strict=True):
            row[other] = "-" if np.isnan(pair).any() else "{:.4g}, {:.4g}".format(*pair)
        rows.append(row)
    return rows


def _standing_rows(tournament: TournamentResult) -> list[Row]:
    """The entrants, the best first, and last those who did not play."""
    rows: list[Row] = []
    for who in np.argsort(
        [-one.mean for one in tournament.return_estimates], kind="stable"
    ).tolist():
        one = tournament.return_estimates[who]
        row: Row = {"entrant": tournament.entrants[who]} | estimate_row(one)
        if tournament.best_replies is not None:
            row["best reply to it"] = tournament.entrants[tournament.best_replies[who]]
        if tournament.equilibrium is not None and tournament.regrets is not None:
            share = float(np.mean([mix[who] for mix in tournament.equilibrium]))
            row |= {"share in equilibrium": share, "regret": float(tournament.regrets[who])}
        if tournament.exact_regrets is not None:
            lost = tournament.exact_regrets[who]
            row |= {"exact regret": lost.mean, "exact error": lost.standard_error}
        rows.append(row)
    return rows


def _standing_table_row(row: Row) -> Row:
    shown = {key: value for key, value in row.items() if key not in ("low", "high")}
    shown["mean return"] = format_mean(shown["mean return"], shown.pop("standard error"))
    if "exact regret" in shown:
        shown["exact regret"] = format_mean(shown["exact regret"], shown.pop("exact error"), ".4g")
    return shown

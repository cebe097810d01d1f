"""The report of `tournament`, a round robin of agents, as text, JSON or CSV."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from dmplay.agents.base import AdviceQuestion
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.return_bounds import compute_return_bounds
from dmplay.core.text import format_count, format_json_report, format_score, format_upper_bound
from dmplay.errors import BadParameter
from dmplay.evaluation.executors import open_execution_backend
from dmplay.evaluation.solutions.solution import Row
from dmplay.evaluation.sweep import expand_entrants
from dmplay.evaluation.tournament import (
    SEATING_ORDERS,
    TournamentResult,
    list_equilibrium_pairings,
    list_seatings,
    run_tournament,
)
from dmplay.game.command_line_results import Printout
from dmplay.output.evaluation_request import (
    EvaluationRequest,
    load_entrants,
    make_evaluation_report,
    make_policy,
)
from dmplay.output.tables import format_csv, format_mean, format_table
from dmplay.output.tournament_checkpoint import MAX_RETURN, TournamentCheckpoint
from dmplay.registry import agents
from dmplay.terminal.progress import ProgressBar

# agents that play an equilibrium, if a problem has them
EQUILIBRIUM_AGENTS = ("equilibrium", "nash")


def report_tournament(
    request: EvaluationRequest,
    entrants: Sequence[str],
    *,
    episodes: int,
    orders: str = SEATING_ORDERS[0],
    results_file: Path | None = None,
) -> Printout:
    """Run a round-robin tournament; report the cross table, the standings and the equilibrium.

    Results are saved in `results_file`, if it is given, so that a tournament can resume. Raise
    BadParameter if an entrant is named twice.
    """
    entrants = expand_entrants(entrants)
    if len({*entrants}) < len(entrants):
        raise BadParameter(
            "tournament: an entrant is named twice; name it once, and it plays itself too"
        )
    problem = request.load_problem().problem
    seat_count = len(problem.agents)
    load = partial(_entrant_policies, problem, request=request)
    loaded, unloaded = load_entrants(problem, entrants, load, "tournament")
    policies = dict(loaded)
    entrants = [*policies]
    facts = {"problem": request.problem, "parameters": request.parameters, "entrants": [*entrants],
             "episodes": episodes, "turns": request.turn_limit, "seed": request.seed}  # fmt: skip
    facts |= {"seats": orders} if orders != SEATING_ORDERS[0] else {}
    exact_agent = ""
    if orders == SEATING_ORDERS[0]:
        exact_agent = _find_equilibrium_agent_name(problem, request.turn_limit)
    seatings = list_seatings(len(entrants), seat_count, orders)
    played_seatings = seatings + (list_equilibrium_pairings(len(entrants)) if exact_agent else [])
    returns_by_seating = (
        TournamentCheckpoint(
            results_file,
            facts,
            played_seatings,
            episodes,
            compute_return_bounds(problem, request.turn_limit) or (-MAX_RETURN, MAX_RETURN),
        )
        if results_file
        else {}
    )
    with (
        ProgressBar(
            f"tournament of {len(entrants)} entrants",
            quiet=bool(request.output_format),
            motion=request.motion,
        ) as bar,
        open_execution_backend(request.engine, request.workers) as (workers, executor),
    ):
        result = run_tournament(
            problem,
            policies,
            equilibrium_policies=_entrant_policies(problem, exact_agent, request)
            if exact_agent
            else None,
            episodes=episodes,
            turns=request.turn_limit,
            seed=request.seed,
            workers=workers,
            executor=executor,
            progress=bar,
            returns_by_seating=returns_by_seating,
            seating_order=orders,
        )
    withdrawals = [*unloaded, *result.withdrawals]
    if withdrawals:
        facts |= {"entrants": [*result.entrants], "withdrawals": withdrawals}
    seating_count = len(list_seatings(len(result.entrants), seat_count, orders))
    game_count = format_count(episodes, "game", ",")
    headline = f"{request.title}: {seating_count} seatings of {game_count} with seed {request.seed}"
    return make_evaluation_report(
        _format_tournament(result, request.output_format, headline, facts, exact_agent),
        result.shortfall_reason,
        withdrawals,
    )


def _format_tournament(
    tournament: TournamentResult,
    output_format: str,
    headline: str,
    facts: dict[str, object],
    exact_agent: str,
) -> str:
    """Return the tournament as JSON, CSV or text; as text, under a headline."""
    standings = tournament.list_rows()
    if output_format == "json":
        extra = {
            "table": tournament.mean_returns.tolist(),
            "equilibrium": exact_agent,
            "exploitability": tournament.exploitability,
            "equilibrium_count": tournament.equilibrium_count,
            "has_infinite_equilibria": tournament.has_infinite_equilibria,
            "has_all_equilibria": tournament.has_all_equilibria,
            "standings": standings,
        }
        return format_json_report(facts | extra)
    if output_format == "csv":
        return format_csv(standings)
    cross = (
        [format_table(_cross_table(tournament))] if len(tournament.mean_returns.shape) == 3 else []
    )
    parts = [headline, *cross, format_table([_build_standing_table_row(row) for row in standings])]
    if tournament.exploitability is not None and len(tournament.mean_returns.shape) > 3:
        gain_text = "anything"
        if tournament.exploitability:
            gain_text = f"more than {format_upper_bound(tournament.exploitability, 2)}"
        parts.append(
            f"equilibrium: of this table; no seat gains {gain_text} by changing its entrant"
        )
    is_infinite = tournament.has_infinite_equilibria
    if tournament.equilibrium_count > 1 or is_infinite:
        count = "infinitely many" if is_infinite else tournament.equilibrium_count
        parts.append(
            f"this table has {count} equilibria; shares and regrets are those of the first"
        )
    elif tournament.equilibrium_count and not tournament.has_all_equilibria:
        parts.append("shares and regrets are those of one equilibrium; there may be others")
    if tournament.exact_regrets:
        parts.append(
            f"exact regret: mean loss against {exact_agent}, which plays an exact equilibrium"
        )
    return "\n\n".join(parts)


def _entrant_policies(problem: Problem, name: str, request: EvaluationRequest) -> list[Policy]:
    """Return an entrant's policies for all seats."""
    return [make_policy(problem, seat, name, request) for seat in range(len(problem.agents))]


def _find_equilibrium_agent_name(problem: Problem, turn_limit: int | None) -> str:
    """Return the agent that plays an equilibrium of the game itself, or '' if there is none.

    Only two-agent problems without hidden states are considered. An equilibrium of an infinite
    horizon is none of a game with a turn limit.
    """
    if len(problem.agents) != 2 or problem.partially_observable:
        return ""
    question = AdviceQuestion(0, turn_limit)
    agents_by_seat = [agents.load_roster(problem, seat).agents for seat in (0, 1)]
    return next(
        (
            name
            for name in EQUILIBRIUM_AGENTS
            if all(name in seat_agents for seat_agents in agents_by_seat)
            and not agents_by_seat[0][name](problem, 0).values_basis(question).turns_scope
        ),
        "",
    )


def _cross_table(tournament: TournamentResult) -> list[Row]:
    """Return a table of the mean returns of both seats, with the first seat's entrants as rows."""
    rows: list[Row] = []
    for name, row_returns in zip(tournament.entrants, tournament.mean_returns, strict=True):
        row: Row = {"first seat": name}
        for opponent, returns in zip(tournament.entrants, row_returns, strict=True):
            row[opponent] = (
                "-" if np.isnan(returns).any() else ", ".join(map(format_score, returns))
            )
        rows.append(row)
    return rows


def _build_standing_table_row(row: Row) -> Row:
    """Return a table row of the standings, with means and standard errors combined."""
    cells = {key: value for key, value in row.items() if key not in ("low", "high")}
    cells["mean return"] = format_mean(cells["mean return"], cells.pop("standard error"))
    for name, error in (("share in equilibrium", "share error"), ("regret", "regret error")):
        if name in cells:
            cells[name] = format_mean(cells[name], cells.pop(error), 4)
    if "exact regret" in cells:
        cells["exact regret"] = format_mean(cells["exact regret"], cells.pop("exact error"), 4)
    return cells

"""Everybody against everybody, for people and programs: `tournament`."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dmplay.core import Policy, Problem
from dmplay.describe import at_most, counted
from dmplay.errors import BadParameter
from dmplay.finding import agents
from dmplay.game.errand import Printout
from dmplay.measure.engines import engine
from dmplay.measure.tournament import SEATS, Tournament, seatings, tournament
from dmplay.reports.kept import Kept
from dmplay.reports.match import Match, estimated, policy, told
from dmplay.reports.progress import Bar
from dmplay.reports.tables import csv_of, json_of, measured, table
from dmplay.solutions.solution import Row

EXACT = ("equilibrium", "nash")  # agents that are one, where a problem has them


def met(
    match: Match,
    entrants: Sequence[str],
    *,
    episodes: int,
    orders: str = SEATS[0],
    kept: Path | None = None,
) -> Printout:
    """Everybody against everybody: the cross table, the standings, and the game this makes."""
    if len({*entrants}) < len(entrants):
        raise BadParameter("tournament: an entrant is named twice; each plays itself anyhow")
    problem = match.found().problem
    seats = len(problem.agents)
    policies = {name: _side(problem, name, match) for name in entrants}
    facts = {"problem": match.problem, "parameters": match.parameters, "entrants": [*entrants],
             "episodes": episodes, "turns": match.turns, "seed": match.seed}  # fmt: skip
    facts |= {"seats": orders} if orders != SEATS[0] else {}
    played = Kept(kept, facts) if kept else {}
    exact = _exact(problem) if orders == SEATS[0] else ""
    with (
        Bar(f"a tournament of {len(entrants)}", quiet=bool(match.form), motion=match.motion) as bar,
        engine(match.engine, match.workers) as (workers, executor),
    ):
        found = tournament(
            problem, policies, exact=_side(problem, exact, match) if exact else None,
            episodes=episodes, turns=match.turns, seed=match.seed, workers=workers,
            executor=executor, progress=bar, played=played, orders=orders,
        )  # fmt: skip
    many, games = len(seatings(len(entrants), seats, orders)), counted(episodes, "game", ",")
    head = f"{match.title}: {many} seatings of {games} of seed {match.seed}"
    return told(_written(found, match.form, head, facts, exact), found.short)


def _written(found: Tournament, form: str, head: str, facts: dict[str, object], exact: str) -> str:
    """The tournament in a form; for people under this headline."""
    standings = _standings(found)
    if form == "json":
        rest = {"table": found.table.tolist(), "equilibrium": exact, "exploitability": found.gain,
                "standings": standings}  # fmt: skip
        return json_of(facts | rest)
    if form == "csv":
        return csv_of(standings)
    cross = [table(_cross(found))] if len(found.table.shape) == 3 else []
    parts = [head, *cross, table([_standing(row) for row in standings])]
    if found.gain is not None and len(found.table.shape) > 3:
        more = f"more than {at_most(found.gain, 2)}" if found.gain else "anything"
        parts.append(f"equilibrium: of this table; by another entrant no seat gains {more} in it")
    if found.exact:
        parts.append(f"exact regret: against {exact}, an equilibrium of the problem itself")
    return "\n\n".join(parts)


def _side(problem: Problem, name: str, match: Match) -> list[Policy]:
    """An entrant for every seat."""
    return [policy(problem, seat, name, match) for seat in range(len(problem.agents))]


def _exact(problem: Problem) -> str:
    """The agent that plays an equilibrium of the problem itself; '' where none is known."""
    if len(problem.agents) != 2 or problem.hidden:
        return ""
    known = [agents.roster(problem, seat).agents for seat in (0, 1)]
    return next((name for name in EXACT if all(name in one for one in known)), "")


def _cross(found: Tournament) -> list[Row]:
    """What the first seat and the second earn, the first seat's entrants as rows."""
    rows: list[Row] = []
    for name, paid in zip(found.entrants, found.table, strict=True):
        row: Row = {"first seat": name}
        for other, pair in zip(found.entrants, paid, strict=True):
            row[other] = "-" if np.isnan(pair).any() else "{:.4g}, {:.4g}".format(*pair)
        rows.append(row)
    return rows


def _standings(found: Tournament) -> list[Row]:
    """The entrants, the best first, and last those who did not play."""
    rows: list[Row] = []
    for who in np.argsort([-one.mean for one in found.earned], kind="stable").tolist():
        one = found.earned[who]
        row: Row = {"entrant": found.entrants[who]} | estimated(one)
        if found.replies is not None:
            row["best reply to it"] = found.entrants[found.replies[who]]
        if found.equilibrium is not None and found.regrets is not None:
            share = float(np.mean([mix[who] for mix in found.equilibrium]))
            row |= {"share in equilibrium": share, "regret": float(found.regrets[who])}
        if found.exact is not None:
            lost = found.exact[who]
            row |= {"exact regret": lost.mean, "exact error": lost.error}
        rows.append(row)
    return rows


def _standing(row: Row) -> Row:
    shown = {key: value for key, value in row.items() if key not in ("low", "high")}
    shown["mean return"] = measured(shown["mean return"], shown.pop("standard error"))
    if "exact regret" in shown:
        shown["exact regret"] = measured(shown["exact regret"], shown.pop("exact error"), ".4g")
    return shown

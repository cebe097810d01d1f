"""Measured play for people and programs: `run` and `compare`."""

import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from itertools import product
from json import dumps
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dmplay.blocks import Workers
from dmplay.chance import Reals
from dmplay.core import Policy, Problem
from dmplay.errors import BadParameter
from dmplay.finding import agents, problems
from dmplay.game.request import pairs
from dmplay.game.seats import HUMAN, seat_policy
from dmplay.measure.comparing import Comparison, Difference, compare
from dmplay.measure.estimate import Estimate
from dmplay.measure.running import Run, run
from dmplay.measure.tournament import Tournament, tournament
from dmplay.reports.kept import Kept
from dmplay.reports.progress import Bar
from dmplay.reports.tables import csv_of, table
from dmplay.solutions.solution import Row

BARS, BINS = "▁▂▃▄▅▆▇█", 12


class Match(NamedTuple):
    """What is played many times: a problem, who sits where, how many turns, which dice."""

    problem: str
    settings: Sequence[str] = ()
    agent: str = ""
    others: str = ""
    seats: Sequence[str] = ()
    turns: int | None = None
    seed: int = 0
    workers: Workers = 1
    executor: Executor | None = None


class Seated(NamedTuple):
    """A problem, the names of those who play it, and themselves."""

    problem: Problem
    names: list[str]
    policies: list[Policy]


def seated(match: Match, parameters: Mapping[str, object], agent: str = "") -> Seated:
    """Who plays; where nobody was named, the agent that knows best, or one that is soon done."""
    problem = problems.resolve(match.problem, parameters).problem
    if match.others and len(problem.agents) == 1:
        raise BadParameter(f"--vs: {match.problem} has one seat only; use --agent")
    known = [agents.roster(problem, seat) for seat in range(len(problem.agents))]
    names = [one.quick or one.adviser or one.partner for one in known]
    names[1:] = [match.others or one.partner for one in known[1:]]
    names[0] = agent or match.agent or names[0]
    for name, who in pairs(match.seats, "--seat").items():
        names[problem.seat(name)] = str(who)
    if HUMAN in names:
        where = problem.agents[names.index(HUMAN)]
        raise BadParameter(f"{where}: a person cannot play so many games; name an agent")
    policies = [seat_policy(problem, seat, who) for seat, who in enumerate(names)]
    return Seated(problem, names, [policy for policy in policies if policy is not None])


def settings(match: Match) -> Iterator[dict[str, object]]:
    """The parameters of each run: a list `0.1,0.2` of one that takes a number is a sweep."""
    usual = problems.parameters(problems.resolve(match.problem, {}).problem)
    given = pairs(match.settings, "--set")
    each = [
        str(value).split(",") if isinstance(usual.get(key), int | float) else [value]
        for key, value in given.items()
    ]
    for values in product(*each):
        yield dict(zip(given, values, strict=True))


def ran(
    match: Match, *, episodes: int, until: float | None, form: str = "", motion: bool = True
) -> str:
    """What agents earn, a table for each setting of the parameters."""
    found = []
    sweep = list(settings(match))
    with Bar(f"running {match.problem}", quiet=bool(form), motion=motion) as bar:
        for parameters in sweep:
            problem, names, policies = seated(match, parameters)
            result = run(
                problem, policies, episodes=episodes, until=until, turns=match.turns,
                seed=match.seed, workers=match.workers, executor=match.executor, progress=bar,
            )  # fmt: skip
            found.append((parameters if len(sweep) > 1 else {}, names, result))
    rows = [row for one in found for row in _rows(*one)]
    if form == "json":
        return dumps({"problem": match.problem, "seed": match.seed, "runs": rows})
    if form == "csv":
        return csv_of(rows)
    told = [_summary(match, found[0][2])] if len(found) == 1 else [_sweep(match, found)]
    return "\n\n".join([*told, table([_for_people(row) for row in rows]), *_pictures(found)])


def _rows(parameters: Mapping[str, object], names: Sequence[str], result: Run) -> list[Row]:
    least, low, middle, high, most = zip(*(one.quantiles for one in result.earned), strict=True)
    return [
        {
            **parameters,
            "seat": one.seat,
            "agent": name,
            "games": result.episodes,
            "mean return": one.returns.mean,
            "standard error": one.returns.error,
            "low": one.returns.low,
            "high": one.returns.high,
            "least": least[seat],
            "quartile": low[seat],
            "median": middle[seat],
            "third quartile": high[seat],
            "most": most[seat],
            "mean total": one.totals.mean,
            "total error": one.totals.error,
            "turns": result.turns,
            "ended": result.ended,
        }
        for seat, (one, name) in enumerate(zip(result.earned, names, strict=True))
    ]


def _for_people(row: Row) -> Row:
    """A row with its numbers put together."""
    plain = [key for key in row if key in ("seat", "agent") or key not in _WORDED]
    return {key: row[key] for key in plain} | {
        "return": f"{row['mean return']:.5g} ± {row['standard error']:.2g}",
        "95 % interval": f"{row['low']:.5g} to {row['high']:.5g}",
        "least, quartiles, most": "  ".join(
            f"{row[key]:.4g}" for key in ("least", "quartile", "median", "third quartile", "most")
        ),
        "total": f"{row['mean total']:.5g} ± {row['total error']:.2g}",
    }


_WORDED = {
    "games", "mean return", "standard error", "low", "high", "least", "quartile", "median",
    "third quartile", "most", "mean total", "total error", "turns", "ended",
}  # fmt: skip


def _summary(match: Match, result: Run) -> str:
    speed = result.episodes / max(result.seconds, 1e-9)
    return (
        f"{match.problem}: {result.episodes:,} games of seed {match.seed}, "
        f"{result.turns:.4g} turns each, {100 * result.ended:.3g} % of them to an end; "
        f"{speed:,.0f} games a second"
    )


def _sweep(match: Match, found: Sequence[tuple[Mapping[str, object], Sequence[str], Run]]) -> str:
    many = sum(result.episodes for _, _, result in found)
    return f"{match.problem}: {len(found)} settings, {many:,} games of seed {match.seed}"


def _pictures(found: Sequence[tuple[Mapping[str, object], Sequence[str], Run]]) -> list[str]:
    """The returns of each seat as a row of bars."""
    rows = []
    for parameters, names, result in found:
        for seat, name in enumerate(names):
            told = " ".join(f"{key}={value}" for key, value in parameters.items())
            bars, low, high = histogram(result.played.returns[:, seat])
            rows.append(f"{low:>9.4g} {bars} {high:<9.4g} {told} {name}".rstrip())
    return ["returns:\n" + "\n".join(rows)]


def histogram(sample: Reals) -> tuple[str, float, float]:
    """How many of a sample lie where, as bars between its least and its most."""
    low, high = float(sample.min()), float(sample.max())
    counts, _ = np.histogram(sample, BINS, (low, high if high > low else low + 1.0))
    level = np.ceil(counts / counts.max() * len(BARS)).astype(int)
    return "".join(" " if not one else BARS[one - 1] for one in level), low, high


def compared(  # noqa: PLR0913 - each is the caller's to choose
    match: Match,
    entrants: Sequence[str],
    *,
    episodes: int,
    decide: float | None,
    form: str = "",
    motion: bool = True,
) -> str:
    """Agents in the first seat on the same dice: what each earns, and every pair's difference."""
    if len(entrants) < 2:
        raise BadParameter(f"got {len(entrants)} agent, expected two or more to compare")
    parameters = pairs(match.settings, "--set")
    each = [seated(match, parameters, name) for name in entrants]
    since = time.monotonic()
    with Bar(f"comparing {' and '.join(entrants)}", quiet=bool(form), motion=motion) as bar:
        result = compare(
            each[0].problem, [one.policies for one in each], episodes=episodes, decide=decide,
            turns=match.turns, seed=match.seed, workers=match.workers,
            executor=match.executor, progress=bar,
        )  # fmt: skip
    rows = [
        _pair(entrants[one], entrants[other], difference)
        for (one, other), difference in result.differences.items()
    ]
    if form == "json":
        return dumps(
            {
                "problem": match.problem,
                "seed": match.seed,
                "games": len(result.returns),
                "decided": result.decided,
                "agents": _earned(entrants, result.earned),
                "pairs": rows,
            }
        )
    if form == "csv":
        return csv_of(rows)
    seconds = time.monotonic() - since
    told = f"{match.problem}: {len(result.returns):,} games of seed {match.seed}, on the same dice"
    tables = [table(_earned(entrants, result.earned)), table([_pair_for_people(r) for r in rows])]
    return "\n\n".join([f"{told}; {seconds:.3g} s", *tables, *_verdict(entrants, result, decide)])


def _earned(entrants: Sequence[str], earned: Sequence[Estimate]) -> list[Row]:
    return [
        {"agent": name, "mean return": one.mean, "standard error": one.error,
         "low": one.low, "high": one.high}
        for name, one in zip(entrants, earned, strict=True)
    ]  # fmt: skip


def _pair(one: str, other: str, found: Difference) -> Row:
    more = found.more
    return {
        "agent": one, "against": other, "difference": more.mean, "standard error": more.error,
        "low": more.low, "high": more.high, "ahead": found.ahead, "behind": found.behind,
        "games saved": found.saved if np.isfinite(found.saved) else None,
    }  # fmt: skip


def _pair_for_people(row: Row) -> Row:
    saved = row["games saved"]
    return {
        "agent": row["agent"],
        "against": row["against"],
        "earns more": f"{row['difference']:+.4g} ± {row['standard error']:.2g}",
        "interval": f"{row['low']:+.4g} to {row['high']:+.4g}",
        "ahead": f"{100 * float(str(row['ahead'])):.3g} %",
        "behind": f"{100 * float(str(row['behind'])):.3g} %",
        "dice of its own would take": "the same play" if saved is None else f"{saved:.3g} x",
    }


def _verdict(entrants: Sequence[str], result: Comparison, decide: float | None) -> list[str]:
    """Who is ahead, where that was to be decided."""
    if decide is None:
        return []
    if not result.decided:
        return [f"undecided after {len(result.returns):,} games"]
    better = entrants[0] if result.differences[0, 1].more.mean > 0 else entrants[1]
    return [f"decided: {better} earns more (wrong in at most {100 * decide:g} % of comparisons)"]


def met(  # noqa: PLR0913 - each is the caller's to choose
    match: Match,
    entrants: Sequence[str],
    *,
    episodes: int,
    kept: Path | None = None,
    form: str = "",
    motion: bool = True,
) -> str:
    """Everybody against everybody: the cross table, the standings, and the game this makes."""
    if len({*entrants}) < len(entrants):
        raise BadParameter("tournament: an entrant is named twice; each plays itself anyhow")
    parameters = pairs(match.settings, "--set")
    problem = problems.resolve(match.problem, parameters).problem
    seats = range(len(problem.agents))
    policies = {name: [_policy(problem, seat, name) for seat in seats] for name in entrants}
    told = {"problem": match.problem, "parameters": parameters, "entrants": [*entrants],
            "episodes": episodes, "turns": match.turns, "seed": match.seed}  # fmt: skip
    played = Kept(kept, told) if kept else {}
    with Bar(f"a tournament of {len(entrants)}", quiet=bool(form), motion=motion) as bar:
        found = tournament(
            problem, policies, episodes=episodes, turns=match.turns, seed=match.seed,
            workers=match.workers, executor=match.executor, progress=bar, played=played,
        )  # fmt: skip
    if form == "json":
        return dumps(told | {"table": found.table.tolist(), "standings": _standings(found)})
    if form == "csv":
        return csv_of(_standings(found))
    head = f"{match.problem}: {len(played)} seatings of {episodes:,} games of seed {match.seed}"
    tables = [table(_cross(found))] if len(seats) == 2 else []
    return "\n\n".join([head, *tables, table([_standing(row) for row in _standings(found)])])


def _policy(problem: Problem, seat: int, name: str) -> Policy:
    policy = seat_policy(problem, seat, name)
    if policy is None:
        raise BadParameter(f"{name}: a person cannot play so many games; name an agent")
    return policy


def _cross(found: Tournament) -> list[Row]:
    """What the first seat and the second earn, the first seat's entrants as rows."""
    rows: list[Row] = []
    for name, paid in zip(found.entrants, found.table, strict=True):
        row: Row = {"first seat": name}
        for other, pair in zip(found.entrants, paid, strict=True):
            row[other] = "{:.4g}, {:.4g}".format(*pair)
        rows.append(row)
    return rows


def _standings(found: Tournament) -> list[Row]:
    """The entrants, the best first."""
    rows: list[Row] = []
    for who in sorted(range(len(found.entrants)), key=lambda one: -found.earned[one].mean):
        one = found.earned[who]
        row: Row = {
            "entrant": found.entrants[who], "mean return": one.mean, "standard error": one.error,
            "low": one.low, "high": one.high,
        }  # fmt: skip
        if found.replies is not None:
            row["best reply to it"] = found.entrants[found.replies[who]]
        if found.equilibrium is not None and found.regrets is not None:
            share = (found.equilibrium.first[who] + found.equilibrium.second[who]) / 2
            row |= {"share in equilibrium": float(share), "regret": float(found.regrets[who])}
        rows.append(row)
    return rows


def _standing(row: Row) -> Row:
    told = {key: value for key, value in row.items() if key not in ("low", "high")}
    told["mean return"] = f"{told['mean return']:.5g} ± {told.pop('standard error'):.2g}"
    return told

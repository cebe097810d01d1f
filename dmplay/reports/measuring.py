"""Measured play for people and programs: `run` and `compare`."""

import time
from collections.abc import Iterator, Sequence

import numpy as np

from dmplay.chance import Reals
from dmplay.describe import brief, counted, several
from dmplay.errors import BadParameter
from dmplay.game.errand import Printout
from dmplay.game.request import pairs
from dmplay.measure.comparing import Comparison, Difference, compare
from dmplay.measure.engines import engine
from dmplay.measure.running import Run, run
from dmplay.policies.point_based import PointBased
from dmplay.reports.match import Lineup, Match, Setting, bounded, estimated, lineup, sweep, told
from dmplay.reports.progress import Bar
from dmplay.reports.recorded import NONE, Keeping, recorded
from dmplay.reports.tables import DASH, cell, csv_of, json_of, measured, table
from dmplay.rollouts import Interrupted, Lost
from dmplay.solutions.solution import Row
from dmplay.views.canvas import ASCII

BARS, BINS = "▁▂▃▄▅▆▇█", 12
WIDE = 48  # columns of a plot
QUANTILES = ("least", "quartile", "median", "third quartile", "most")


def ran(
    match: Match,
    *,
    episodes: int | None,
    until: float | None,
    keeping: Keeping = NONE,
    ascii_: bool = False,
) -> Printout:
    """What agents earn, a table for each setting of the parameters."""
    keeping.check()
    found: list[Setting] = []
    kept: list[Row] = []
    settings, short = [*sweep(match)], ""
    with (
        Bar(f"running {match.problem}", quiet=bool(match.form), motion=match.motion) as bar,
        engine(match.engine, match.workers) as (workers, executor),
    ):
        for place, each in enumerate(settings):
            game = bounded(each)
            who = lineup(game)
            try:
                result = run(
                    who.problem, who.policies, episodes=episodes, until=until,
                    turns=game.turns, seed=game.seed, workers=workers, executor=executor,
                    progress=bar.part(place, len(settings)),
                )  # fmt: skip
            except (Interrupted, Lost) as error:
                if not found:
                    raise
                short = str(error)
                break
            found.append(Setting(game, who, result, game.parameters if len(settings) > 1 else {}))
            kept += recorded(found[-1], keeping)
            short = result.short
            if short:
                break
    return told(_written(match, found, kept, ascii_=ascii_), short)


def _written(match: Match, found: Sequence[Setting], kept: Sequence[Row], *, ascii_: bool) -> str:
    """The report in its form; for people with pictures."""
    if match.form:
        rows = [row for one in found for row in _rows(one)]
        games = {"kept": kept} if kept else {}
        common = {"parameters": {} if found[0].swept else match.values, "seed": match.seed}
        facts = {"problem": match.problem} | common | {"runs": rows} | games
        return json_of(facts) if match.form == "json" else csv_of(rows)
    head = _summary(found[0].match, found[0].run) if len(found) == 1 else _sweep(match, found)
    rows = [row for one in found for row in _for_people(one)]
    known = [line for one in found for line in _known(one.lineup)]
    parts = [head, "\n".join([table(rows), *known])]
    parts += [_plot(found)] if len(found) > 1 else []
    parts += [_pictures(found)]
    parts += [table(kept)] if kept else []
    text = "\n\n".join(parts)
    return text.translate(ASCII).replace("±", "+-") if ascii_ else text


def _known(who: Lineup) -> list[str]:
    """What those who plan between two bounds know of the value."""
    each = zip(who.names, who.policies, strict=True)
    return [one.known(name) for name, one in each if isinstance(one, PointBased)]


def _rows(one: Setting) -> Iterator[Row]:
    """What each seat earned, for programs."""
    for earned, name in zip(one.run.earned, one.lineup.names, strict=True):
        yield {
            **(one.match.values if one.swept else {}),
            "seat": earned.seat,
            "agent": name,
            "games": one.run.episodes,
            **estimated(earned.returns),
            **dict(zip(QUANTILES, earned.quantiles, strict=True)),
            "mean total": earned.totals.mean,
            "total error": earned.totals.error,
            "turns": one.run.turns,
            "ended": one.run.ended,
        }


def _for_people(one: Setting) -> Iterator[Row]:
    """The same with its numbers put together."""
    for earned, name in zip(one.run.earned, one.lineup.names, strict=True):
        returns, totals = earned.returns, earned.totals
        many = np.isfinite(returns.error)
        yield {
            **one.swept,
            "seat": earned.seat,
            "agent": name,
            "return": measured(returns.mean, returns.error),
            "95 % interval": f"{returns.low:.5g} to {returns.high:.5g}" if many else DASH,
            "least, quartiles, most": "  ".join(f"{value:.4g}" for value in earned.quantiles),
            "total": measured(totals.mean, totals.error),
        }


def _summary(match: Match, result: Run) -> str:
    speed = result.episodes / max(result.seconds, 1e-9)
    return (
        f"{match.title}: {counted(result.episodes, 'game', ',')} of seed {match.seed}, "
        f"{several(brief(result.turns), 'turn')} each, {100 * result.ended:.3g} % of them to an "
        f"end; {counted(speed, 'game', ',.0f')} a second"
    )


def _sweep(match: Match, found: Sequence[Setting]) -> str:
    many = sum(one.run.episodes for one in found)
    games = counted(many, "game", ",")
    return f"{match.problem}: {len(found)} settings, {games} of seed {match.seed}"


def _plot(found: Sequence[Setting]) -> str:
    """The mean return of the first seat by setting, each with its interval."""
    each = [one.run.earned[0].returns for one in found]
    finite = [x for one in each for x in (one.low, one.mean, one.high) if np.isfinite(x)]
    low, high = min(finite), max(finite)
    scale = (WIDE - 1) / (high - low) if high > low else 0.0
    wide = max(len(str(one)) for one in found)
    rows = [f"mean return of {found[0].run.earned[0].seat}, {low:.4g} to {high:.4g}:"]
    for setting, one in zip(found, each, strict=True):
        ends = np.clip([one.low, one.mean, one.high], low, high)
        start, middle, end = (round(float(x - low) * scale) for x in ends)
        line = " " * start + "─" * (end - start + 1)
        drawn = f"{line[:middle]}●{line[middle + 1 :]}"
        rows.append(f"{setting!s:<{wide}}  {drawn:<{WIDE}}  {one.mean:.5g}")
    return "\n".join(rows)


def _pictures(found: Sequence[Setting]) -> str:
    """The returns of each seat as a row of bars."""
    rows = ["returns:"]
    for one in found:
        for seat, name in enumerate(one.lineup.names):
            bars, low, high = histogram(one.run.played.returns[:, seat])
            rows.append(f"{low:>9.4g} {bars} {high:<9.4g} {one} {name}".rstrip())
    return "\n".join(rows)


def histogram(sample: Reals) -> tuple[str, float, float]:
    """How many of a sample lie where, as bars between its least and its most."""
    low, high = float(sample.min()), float(sample.max())
    counts, _ = np.histogram(sample, BINS, (low, high if high > low else low + 1.0))
    level = np.ceil(counts / counts.max() * len(BARS)).astype(int)
    return "".join(" " if not one else BARS[one - 1] for one in level), low, high


def compared(
    match: Match, entrants: Sequence[str], *, episodes: int, decide: float | None
) -> Printout:
    """Agents in the first seat on the same dice: what each earns, and every pair's difference."""
    if len(entrants) < 2:
        got = counted(len(entrants), "agent")
        raise BadParameter(f"got {got}, expected two or more to compare")
    problem = match.found().problem
    for name in pairs(match.seats, "--seat"):
        if not problem.seat(name):
            raise BadParameter(f"--seat: {name} is the seat of those who are compared")
    each = [lineup(match._replace(agent=name)) for name in entrants]
    since = time.monotonic()
    what = f"comparing {' and '.join(entrants)}"
    with (
        Bar(what, quiet=bool(match.form), motion=match.motion) as bar,
        engine(match.engine, match.workers) as (workers, executor),
    ):
        result = compare(
            problem, [one.policies for one in each], episodes=episodes,
            decide=decide, turns=match.turns, seed=match.seed, workers=workers, executor=executor,
            progress=bar, names=entrants,
        )  # fmt: skip
    text = _compared(match, entrants, result, decide, time.monotonic() - since)
    return told(text, result.short)


def _compared(
    match: Match, entrants: Sequence[str], result: Comparison, decide: float | None, seconds: float
) -> str:
    """The comparison in its form."""
    each = zip(entrants, result.earned, strict=True)
    earned = [{"agent": name} | estimated(one) for name, one in each]
    rows = [
        _pair(entrants[one], entrants[other], difference)
        for (one, other), difference in result.differences.items()
    ]
    if match.form == "json":
        common = {"problem": match.problem, "parameters": match.values, "seed": match.seed}
        facts = common | {"games": len(result.returns)}
        return json_of(facts | {"decided": result.decided, "agents": earned, "pairs": rows})
    if match.form == "csv":
        return csv_of(rows)
    played = counted(len(result.returns), "game", ",")
    head = f"{match.title}: {played} of seed {match.seed}, on the same dice; {seconds:.3g} s"
    tables = [table(earned), table([_pair_for_people(row) for row in rows])]
    return "\n\n".join([head, *tables, *_verdict(entrants, result, decide)])


def _pair(one: str, other: str, found: Difference) -> Row:
    more = found.more
    return {
        "agent": one, "against": other, "difference": more.mean, "standard error": more.error,
        "low": more.low, "high": more.high, "ahead": found.ahead, "behind": found.behind,
        "games saved": found.saved if np.isfinite(found.saved) else None, "luck": found.luck,
    }  # fmt: skip


def _pair_for_people(row: Row) -> Row:
    saved = row["games saved"]
    same = row["difference"] == row["standard error"] == 0.0
    dice = "the same play" if same else f"{saved:.3g} x" if saved else DASH
    many = cell(row["standard error"]) != DASH
    return {
        "agent": row["agent"],
        "against": row["against"],
        "earns more": measured(row["difference"], row["standard error"], "+.4g"),
        "by luck": f"{row['luck']:+.2g}" if row["luck"] else DASH,
        "interval": f"{row['low']:+.4g} to {row['high']:+.4g}" if many else DASH,
        "ahead": f"{100 * float(str(row['ahead'])):.3g} %",
        "behind": f"{100 * float(str(row['behind'])):.3g} %",
        "dice of its own would take": dice,
    }


def _verdict(entrants: Sequence[str], result: Comparison, decide: float | None) -> list[str]:
    """Who is ahead, where that was to be decided."""
    if decide is None:
        return []
    if not result.decided:
        return [f"undecided after {counted(len(result.returns), 'game', ',')}"]
    better = entrants[0] if result.differences[0, 1].more.mean > 0 else entrants[1]
    return [f"decided: {better} earns more (wrong in at most {100 * decide:g} % of comparisons)"]

"""Measured play for people and programs: `run` and `compare`."""

import time
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from dmplay.chance import Reals
from dmplay.core import Policy
from dmplay.describe import brief, counted, several
from dmplay.errors import BadParameter
from dmplay.game.errand import Printout
from dmplay.game.request import pairs
from dmplay.measure.comparing import Comparison, Difference, compare
from dmplay.measure.engines import engine
from dmplay.measure.estimate import Estimate
from dmplay.measure.running import Run, run
from dmplay.policies.point_based import PointBased
from dmplay.reports.match import Match, bounded, seated, settings, told
from dmplay.reports.progress import Bar
from dmplay.reports.recorded import NONE, Keeping, recorded
from dmplay.reports.tables import csv_of, json_of, table
from dmplay.rollouts import Interrupted, Lost
from dmplay.solutions.solution import Row
from dmplay.views.canvas import ASCII

BARS, BINS = "▁▂▃▄▅▆▇█", 12
WIDE = 48  # columns of a plot


class Setting(NamedTuple):
    """What came of one setting of the parameters."""

    parameters: Mapping[str, object]  # those of a sweep
    names: Sequence[str]  # of who played
    run: Run
    known: Sequence[str]  # of what the problem is worth

    def __str__(self) -> str:
        return " ".join(f"{key}={value}" for key, value in self.parameters.items())


def ran(  # noqa: PLR0913 - each is the caller's to choose
    match: Match,
    *,
    episodes: int | None,
    until: float | None,
    keeping: Keeping = NONE,
    form: str = "",
    motion: bool = True,
    ascii_: bool = False,
) -> Printout:
    """What agents earn, a table for each setting of the parameters."""
    keeping.check()
    found: list[Setting] = []
    kept: list[Row] = []
    sweep, short = list(settings(match)), ""
    with (
        Bar(f"running {match.problem}", quiet=bool(form), motion=motion) as bar,
        engine(match.engine, match.workers) as (workers, executor),
    ):
        for place, parameters in enumerate(sweep):
            game = bounded(match, parameters)
            who = seated(game, parameters)
            try:
                result = run(
                    who.problem, who.policies, episodes=episodes, until=until, turns=game.turns,
                    seed=match.seed, workers=workers, executor=executor,
                    progress=bar.part(place, len(sweep)),
                )  # fmt: skip
            except (Interrupted, Lost) as error:
                if not found:
                    raise
                short = str(error)
                break
            known = _known(who.names, who.policies)
            one = Setting(parameters if len(sweep) > 1 else {}, who.names, result, known)
            found.append(one)
            kept += recorded(game, parameters, who, result, keeping, str(one))
            short = result.short
            if short:
                break
    return told(_written(match, found, kept, form, ascii_=ascii_), short)


def _written(
    match: Match, found: Sequence[Setting], kept: Sequence[Row], form: str, *, ascii_: bool
) -> str:
    """The report in this form; for people with pictures."""
    rows = [row for one in found for row in _rows(*one[:3])]
    if form == "json":
        games = {"kept": kept} if kept else {}
        return json_of({"problem": match.problem, "seed": match.seed, "runs": rows} | games)
    if form == "csv":
        return csv_of(rows)
    head = _summary(match, found[0].run) if len(found) == 1 else _sweep(match, found)
    known = [line for one in found for line in one.known]
    parts = [head, "\n".join([table([_for_people(row) for row in rows]), *known])]
    parts += [_plot(found)] if len(found) > 1 else []
    parts += [_pictures(found)]
    parts += [table(kept)] if kept else []
    text = "\n\n".join(parts)
    return text.translate(ASCII).replace("±", "+-") if ascii_ else text


def _known(names: Sequence[str], policies: Sequence[Policy]) -> list[str]:
    """What those who plan between two bounds know of the value."""
    each = zip(names, policies, strict=True)
    return [one.known(name) for name, one in each if isinstance(one, PointBased)]


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
        f"{match.problem}: {counted(result.episodes, 'game', ',')} of seed {match.seed}, "
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
        for seat, name in enumerate(one.names):
            bars, low, high = histogram(one.run.played.returns[:, seat])
            rows.append(f"{low:>9.4g} {bars} {high:<9.4g} {one} {name}".rstrip())
    return "\n".join(rows)


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
) -> Printout:
    """Agents in the first seat on the same dice: what each earns, and every pair's difference."""
    if len(entrants) < 2:
        raise BadParameter(f"got {len(entrants)} agent, expected two or more to compare")
    parameters = pairs(match.settings, "--set")
    each = [seated(match, parameters, name) for name in entrants]
    since = time.monotonic()
    with (
        Bar(f"comparing {' and '.join(entrants)}", quiet=bool(form), motion=motion) as bar,
        engine(match.engine, match.workers) as (workers, executor),
    ):
        result = compare(
            each[0].problem, [one.policies for one in each], episodes=episodes, decide=decide,
            turns=match.turns, seed=match.seed, workers=workers, executor=executor, progress=bar,
            names=entrants,
        )  # fmt: skip
    text = _compared(match, entrants, result, decide, form, time.monotonic() - since)
    return told(text, result.short)


def _compared(  # noqa: PLR0913, PLR0917
    match: Match,
    entrants: Sequence[str],
    result: Comparison,
    decide: float | None,
    form: str,
    seconds: float,
) -> str:
    """The comparison in this form."""
    rows = [
        _pair(entrants[one], entrants[other], difference)
        for (one, other), difference in result.differences.items()
    ]
    if form == "json":
        facts = {"problem": match.problem, "seed": match.seed, "games": len(result.returns)}
        agents = _earned(entrants, result.earned)
        return json_of(facts | {"decided": result.decided, "agents": agents, "pairs": rows})
    if form == "csv":
        return csv_of(rows)
    played = counted(len(result.returns), "game", ",")
    head = f"{match.problem}: {played} of seed {match.seed}, on the same dice"
    tables = [table(_earned(entrants, result.earned)), table([_pair_for_people(r) for r in rows])]
    return "\n\n".join([f"{head}; {seconds:.3g} s", *tables, *_verdict(entrants, result, decide)])


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
        "games saved": found.saved if np.isfinite(found.saved) else None, "luck": found.luck,
    }  # fmt: skip


def _pair_for_people(row: Row) -> Row:
    saved = row["games saved"]
    return {
        "agent": row["agent"],
        "against": row["against"],
        "earns more": f"{row['difference']:+.4g} ± {row['standard error']:.2g}",
        "by luck": f"{row['luck']:+.2g}" if row["luck"] else "-",
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
        return [f"undecided after {counted(len(result.returns), 'game', ',')}"]
    better = entrants[0] if result.differences[0, 1].more.mean > 0 else entrants[1]
    return [f"decided: {better} earns more (wrong in at most {100 * decide:g} % of comparisons)"]

"""Measured play for people and programs: `run` and `compare`."""

import time
from collections.abc import Iterator, Sequence

import numpy as np

from dmplay.chance import Reals
from dmplay.describe import append_noun, format_count, format_score
from dmplay.errors import BadParameter
from dmplay.game.errand import Printout
from dmplay.game.request import parse_settings
from dmplay.measure.comparing import Comparison, Difference, compare
from dmplay.measure.engines import open_execution_backend
from dmplay.measure.running import RunResult, run
from dmplay.policies.point_based import PointBasedPolicy
from dmplay.reports.match import (
    EvaluationRequest,
    Lineup,
    SettingResult,
    estimate_row,
    expand_sweep,
    limit_turns,
    make_lineup,
    make_report,
)
from dmplay.reports.progress import ProgressBar
from dmplay.reports.recorded import NO_TRANSCRIPTS, TranscriptSelection, record_episodes
from dmplay.reports.tables import (
    MISSING_CELL,
    format_cell,
    format_csv,
    format_json,
    format_mean,
    format_table,
)
from dmplay.rollouts import RolloutBlocksLost, RolloutInterrupted
from dmplay.solutions.solution import Row
from dmplay.views.canvas import ASCII_TRANSLATION

BAR_CHARACTERS, HISTOGRAM_BINS = "▁▂▃▄▅▆▇█", 12
PLOT_COLUMNS = 48  # columns of a plot
QUANTILE_NAMES = ("least", "quartile", "median", "third quartile", "most")


def report_run(
    request: EvaluationRequest,
    *,
    episodes: int | None,
    max_standard_error: float | None,
    selection: TranscriptSelection = NO_TRANSCRIPTS,
    ascii_: bool = False,
) -> Printout:
    """What agents earn, a table for each setting of the parameters."""
    selection.check_options()
    found: list[SettingResult] = []
    kept: list[Row] = []
    settings, short = [*expand_sweep(request)], ""
    with (
        ProgressBar(
            f"running {request.problem}", quiet=bool(request.output_format), motion=request.motion
        ) as bar,
        open_execution_backend(request.engine, request.workers) as (workers, executor),
    ):
        for place, each in enumerate(settings):
            game = limit_turns(each)
            who = make_lineup(game)
            try:
                result = run(
                    who.problem, who.policies, episodes=episodes, max_standard_error=max_standard_error,
                    turns=game.turn_limit, seed=game.seed, workers=workers, executor=executor,
                    progress=bar.subtask(place, len(settings)),
                )  # fmt: skip
            except (RolloutInterrupted, RolloutBlocksLost) as error:
                if not found:
                    raise
                short = str(error)
                break
            found.append(
                SettingResult(game, who, result, game.parameters if len(settings) > 1 else {})
            )
            kept += record_episodes(found[-1], selection)
            short = result.shortfall_reason
            if short:
                break
    return make_report(_format_run(request, found, kept, ascii_=ascii_), short)


def _format_run(
    request: EvaluationRequest,
    results: Sequence[SettingResult],
    transcript_rows: Sequence[Row],
    *,
    ascii_: bool,
) -> str:
    """The report in its form; for people with pictures."""
    if request.output_format:
        rows = [row for one in results for row in _iter_data_rows(one)]
        games = {"kept": transcript_rows} if transcript_rows else {}
        common = {
            "parameters": {} if results[0].swept_parameters else request.parameter_values,
            "seed": request.seed,
        }
        facts = {"problem": request.problem} | common | {"runs": rows} | games
        return format_json(facts) if request.output_format == "json" else format_csv(rows)
    head = (
        _run_headline(results[0].request, results[0].run)
        if len(results) == 1
        else _sweep_headline(request, results)
    )
    rows = [row for one in results for row in _iter_table_rows(one)]
    known = [line for one in results for line in _value_bound_lines(one.lineup)]
    parts = [head, "\n".join([format_table(rows), *known])]
    parts += [_plot_sweep(results)] if len(results) > 1 else []
    parts += [_format_histograms(results)]
    parts += [format_table(transcript_rows)] if transcript_rows else []
    text = "\n\n".join(parts)
    return text.translate(ASCII_TRANSLATION).replace("±", "+-") if ascii_ else text


def _value_bound_lines(lineup: Lineup) -> list[str]:
    """What those who plan between two bounds know of the value."""
    each = zip(lineup.agent_names, lineup.policies, strict=True)
    return [one.describe_bounds(name) for name, one in each if isinstance(one, PointBasedPolicy)]


def _iter_data_rows(result: SettingResult) -> Iterator[Row]:
    """What each seat earned, for programs."""
    for earned, name in zip(result.run.seat_summaries, result.lineup.agent_names, strict=True):
        yield {
            **(result.request.parameter_values if result.swept_parameters else {}),
            "seat": earned.seat,
            "agent": name,
            "games": result.run.episodes,
            **estimate_row(earned.returns),
            **dict(zip(QUANTILE_NAMES, earned.quantiles, strict=True)),
            "mean total": earned.totals.mean,
            "total error": earned.totals.standard_error,
            "turns": result.run.mean_turns,
            "ended": result.run.terminated_share,
        }


def _iter_table_rows(result: SettingResult) -> Iterator[Row]:
    """The same with its numbers put together."""
    for earned, name in zip(result.run.seat_summaries, result.lineup.agent_names, strict=True):
        returns, totals = earned.returns, earned.totals
        many = np.isfinite(returns.standard_error)
        yield {
            **result.swept_parameters,
            "seat": earned.seat,
            "agent": name,
            "return": format_mean(returns.mean, returns.standard_error),
            "95 % interval": f"{returns.low:.5g} to {returns.high:.5g}" if many else MISSING_CELL,
            "least, quartiles, most": "  ".join(f"{value:.4g}" for value in earned.quantiles),
            "total": format_mean(totals.mean, totals.standard_error),
        }


def _run_headline(request: EvaluationRequest, result: RunResult) -> str:
    speed = result.episodes / max(result.seconds, 1e-9)
    return (
        f"{request.title}: {format_count(result.episodes, 'game', ',')} of seed {request.seed}, "
        f"{append_noun(format_score(result.mean_turns), 'turn')} each, {100 * result.terminated_share:.3g} % of them to an "
        f"end; {format_count(speed, 'game', ',.0f')} a second"
    )


def _sweep_headline(request: EvaluationRequest, results: Sequence[SettingResult]) -> str:
    many = sum(one.run.episodes for one in results)
    games = format_count(many, "game", ",")
    return f"{request.problem}: {len(results)} settings, {games} of seed {request.seed}"


def _plot_sweep(results: Sequence[SettingResult]) -> str:
    """The mean return of the first seat by setting, each with its interval."""
    each = [one.run.seat_summaries[0].returns for one in results]
    finite = [x for one in each for x in (one.low, one.mean, one.high) if np.isfinite(x)]
    low, high = min(finite), max(finite)
    scale = (PLOT_COLUMNS - 1) / (high - low) if high > low else 0.0
    wide = max(len(str(one)) for one in results)
    rows = [f"mean return of {results[0].run.seat_summaries[0].seat}, {low:.4g} to {high:.4g}:"]
    for setting, one in zip(results, each, strict=True):
        ends = np.clip([one.low, one.mean, one.high], low, high)
        start, middle, end = (round(float(x - low) * scale) for x in ends)
        line = " " * start + "─" * (end - start + 1)
        drawn = f"{line[:middle]}●{line[middle + 1 :]}"
        rows.append(f"{setting!s:<{wide}}  {drawn:<{PLOT_COLUMNS}}  {one.mean:.5g}")
    return "\n".join(rows)


def _format_histograms(results: Sequence[SettingResult]) -> str:
    """The returns of each seat as a row of bars."""
    rows = ["returns:"]
    for one in results:
        for seat, name in enumerate(one.lineup.agent_names):
            bars, low, high = draw_histogram(one.run.rollout.returns[:, seat])
            rows.append(f"{low:>9.4g} {bars} {high:<9.4g} {one} {name}".rstrip())
    return "\n".join(rows)


def draw_histogram(sample: Reals) -> tuple[str, float, float]:
    """How many of a sample lie where, as bars between its least and its most."""
    low, high = float(sample.min()), float(sample.max())
    counts, _ = np.histogram(sample, HISTOGRAM_BINS, (low, high if high > low else low + 1.0))
    level = np.ceil(counts / counts.max() * len(BAR_CHARACTERS)).astype(int)
    return "".join(" " if not one else BAR_CHARACTERS[one - 1] for one in level), low, high


def report_comparison(
    request: EvaluationRequest, entrants: Sequence[str], *, episodes: int, decide: float | None
) -> Printout:
    """Agents in the first seat on the same dice: what each earns, and every pair's difference."""
    if len(entrants) < 2:
        got = format_count(len(entrants), "agent")
        raise BadParameter(f"got {got}, expected two or more to compare")
    problem = request.load_problem().problem
    for name in parse_settings(request.seats, "--seat"):
        if not problem.seat_index(name):
            raise BadParameter(f"--seat: {name} is the seat of those who are compared")
    each = [make_lineup(request._replace(agent=name)) for name in entrants]
    since = time.monotonic()
    what = f"comparing {' and '.join(entrants)}"
    with (
        ProgressBar(what, quiet=bool(request.output_format), motion=request.motion) as bar,
        open_execution_backend(request.engine, request.workers) as (workers, executor),
    ):
        result = compare(
            problem, [one.policies for one in each], episodes=episodes,
            decide=decide, turns=request.turn_limit, seed=request.seed, workers=workers, executor=executor,
            progress=bar, names=entrants,
        )  # fmt: skip
    text = _format_comparison(request, entrants, result, decide, time.monotonic() - since)
    return make_report(text, result.shortfall_reason)


def _format_comparison(
    request: EvaluationRequest,
    entrants: Sequence[str],
    result: Comparison,
    decide: float | None,
    seconds: float,
) -> str:
    """The comparison in its form."""
    each = zip(entrants, result.return_estimates, strict=True)
    earned = [{"agent": name} | estimate_row(one) for name, one in each]
    rows = [
        _pair_row(entrants[one], entrants[other], difference)
        for (one, other), difference in result.differences.items()
    ]
    if request.output_format == "json":
        common = {
            "problem": request.problem,
            "parameters": request.parameter_values,
            "seed": request.seed,
        }
        facts = common | {"games": len(result.returns)}
        return format_json(facts | {"decided": result.decided, "agents": earned, "pairs": rows})
    if request.output_format == "csv":
        return format_csv(rows)
    played = format_count(len(result.returns), "game", ",")
    head = f"{request.title}: {played} of seed {request.seed}, on the same dice; {seconds:.3g} s"
    tables = [format_table(earned), format_table([_pair_table_row(row) for row in rows])]
    return "\n\n".join([head, *tables, *_verdict_lines(entrants, result, decide)])


def _pair_row(agent: str, opponent: str, difference: Difference) -> Row:
    more = difference.advantage
    return {
        "agent": agent, "against": opponent, "difference": more.mean, "standard error": more.standard_error,
        "low": more.low, "high": more.high, "ahead": difference.share_ahead, "behind": difference.share_behind,
        "games saved": difference.games_saved_factor if np.isfinite(difference.games_saved_factor) else None, "luck": difference.control_variate_difference,
    }  # fmt: skip


def _pair_table_row(row: Row) -> Row:
    saved = row["games saved"]
    same = row["difference"] == row["standard error"] == 0.0
    dice = "the same play" if same else f"{saved:.3g} x" if saved else MISSING_CELL
    many = format_cell(row["standard error"]) != MISSING_CELL
    return {
        "agent": row["agent"],
        "against": row["against"],
        "earns more": format_mean(row["difference"], row["standard error"], "+.4g"),
        "by luck": f"{row['luck']:+.2g}" if row["luck"] else MISSING_CELL,
        "interval": f"{row['low']:+.4g} to {row['high']:+.4g}" if many else MISSING_CELL,
        "ahead": f"{100 * float(str(row['ahead'])):.3g} %",
        "behind": f"{100 * float(str(row['behind'])):.3g} %",
        "dice of its own would take": dice,
    }


def _verdict_lines(entrants: Sequence[str], result: Comparison, decide: float | None) -> list[str]:
    """Who is ahead, where that was to be decided."""
    if decide is None:
        return []
    if not result.decided:
        return [f"undecided after {format_count(len(result.returns), 'game', ',')}"]
    better = entrants[0] if result.differences[0, 1].advantage.mean > 0 else entrants[1]
    return [f"decided: {better} earns more (wrong in at most {100 * decide:g} % of comparisons)"]

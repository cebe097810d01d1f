"""The reports of `run` and `compare`, as text, JSON or CSV."""

import time
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from dmplay.agents.point_based import PointBasedPolicy
from dmplay.core.arrays import Reals
from dmplay.core.problem import find_seat
from dmplay.core.text import (
    append_noun,
    format_count,
    format_json_report,
    format_number,
    format_score,
)
from dmplay.draw.canvas import ASCII_TRANSLATION
from dmplay.draw.theme import BAR_LEVELS
from dmplay.errors import BadParameter
from dmplay.evaluation.comparison import Comparison, compare
from dmplay.evaluation.executors import open_execution_backend
from dmplay.evaluation.many_games import RunResult, run
from dmplay.evaluation.solutions.solution import Row
from dmplay.evaluation.statistics import Estimate, make_estimate_row
from dmplay.evaluation.sweep import expand_entrants
from dmplay.game.command_line_results import Printout
from dmplay.game.launch_requests import parse_settings
from dmplay.output.evaluation_request import (
    EvaluationRequest,
    SettingResult,
    iter_settings,
    limit_turns,
    load_entrants,
    load_players,
    make_evaluation_report,
)
from dmplay.output.selected_episode_recording import (
    NO_TRANSCRIPTS,
    TranscriptSelection,
    record_episodes,
)
from dmplay.output.tables import MISSING_CELL, format_cell, format_csv, format_mean, format_table
from dmplay.simulation.rollouts import RolloutBlocksLost, RolloutInterrupted
from dmplay.terminal.progress import ProgressBar

HISTOGRAM_BINS = 12
PLOT_COLUMNS = 48  # columns of a plot


def report_run(  # noqa: PLR0913 - the options of the command
    request: EvaluationRequest,
    *,
    episodes: int | None,
    max_standard_error: float | None,
    regret: bool = False,
    selection: TranscriptSelection = NO_TRANSCRIPTS,
    ascii_: bool = False,
) -> Printout:
    """Play many games for each setting of the parameters, and report the returns of each seat.

    With `regret`, also report the mean regret of each seat.

    If a run is cut short after the first setting, the settings played so far are reported.
    """
    selection.check_options()
    results: list[SettingResult] = []
    transcript_rows: list[Row] = []
    settings, shortfall_reason = [*iter_settings(request)], ""
    has_agent_sweep = len({setting.agents for setting in settings}) > 1
    with (
        ProgressBar(
            f"running {request.problem}", quiet=bool(request.output_format), motion=request.motion
        ) as bar,
        open_execution_backend(request.engine, request.workers) as (workers, executor),
    ):
        for index, setting_request in enumerate(settings):
            limited_request = limit_turns(setting_request)
            players = load_players(limited_request)
            try:
                result = run(
                    players.problem,
                    players.policies,
                    episodes=episodes,
                    max_standard_error=max_standard_error,
                    regret=regret,
                    turns=limited_request.turn_limit,
                    seed=limited_request.seed,
                    workers=workers,
                    executor=executor,
                    progress=bar.subtask(index, len(settings)),
                )
            except (RolloutInterrupted, RolloutBlocksLost) as error:
                if not results:
                    raise
                shortfall_reason = str(error)
                break
            results.append(
                SettingResult(
                    limited_request,
                    players,
                    result,
                    limited_request.parameters if len(settings) > 1 else {},
                    limited_request.agents if has_agent_sweep else (),
                )
            )
            transcript_rows += record_episodes(results[-1], selection)
            shortfall_reason = result.shortfall_reason
            if shortfall_reason:
                break
    return make_evaluation_report(
        _format_run(request, results, transcript_rows, ascii_=ascii_),
        shortfall_reason,
        [line for result in results for line in _format_forfeit_lines(result)],
    )


def _format_forfeit_lines(result: SettingResult) -> list[str]:
    """Return a line for each game of a setting that is left out because of a forfeit."""
    setting = f"{result}: " if str(result) else ""
    return [
        f"{setting}game {error.episode} is not counted: {error}" for error in result.run.forfeits
    ]


def _format_run(
    request: EvaluationRequest,
    results: Sequence[SettingResult],
    transcript_rows: Sequence[Row],
    *,
    ascii_: bool,
) -> str:
    """Return the report of a run as JSON, CSV or text; as text, with plots and histograms."""
    if request.output_format:
        rows = [row for result in results for row in _iter_data_rows(result)]
        forfeits = [line for result in results for line in _format_forfeit_lines(result)]
        lists = {"kept": transcript_rows, "forfeits": forfeits}
        common = {
            "parameters": {} if results[0].swept_parameters else request.parameter_values,
            "seed": request.seed,
        }
        facts = {"problem": request.problem} | common | {"runs": rows}
        facts |= {key: items for key, items in lists.items() if items}
        return format_json_report(facts) if request.output_format == "json" else format_csv(rows)
    headline = _run_headline(results[0].request, results[0].run)
    if len(results) > 1:
        games = format_count(sum(result.run.episodes for result in results), "game", ",")
        headline = f"{request.problem}: {len(results)} settings, {games} with seed {request.seed}"
    rows = [row for result in results for row in _iter_table_rows(result)]
    bound_lines = [
        policy.describe_bounds(name)
        for result in results
        for name, policy in zip(result.lineup.agent_names, result.lineup.policies, strict=True)
        if isinstance(policy, PointBasedPolicy)
    ]
    doubt_lines = [line for result in results for line in _format_doubt_lines(result)]
    regret_lines = [line for result in results for line in _format_regret_lines(result)]
    parts = [headline, "\n".join([format_table(rows), *regret_lines, *doubt_lines, *bound_lines])]
    parts += [_plot_sweep(results)] if len(results) > 1 else []
    parts += [_format_histograms(results)]
    table = [
        {"transcript": row["kept"], "reason": row["why"], "return": row["return"]}
        for row in transcript_rows
    ]
    parts += [format_table(table)] if table else []
    text = "\n\n".join(parts)
    return text.translate(ASCII_TRANSLATION).replace("±", "+-") if ascii_ else text


def _format_doubt_lines(result: SettingResult) -> list[str]:
    """Return a line for each seat whose interval may not hold the mean."""
    setting = f"{result}, " if str(result) else ""
    return [
        f"the interval of {setting}{summary.seat} is in doubt: {summary.doubt}"
        for summary in result.run.seat_summaries
        if summary.doubt
    ]


def _format_regret_lines(result: SettingResult) -> list[str]:
    """Return a line with the regret of each seat, or with the reason why it is unknown."""
    lines, setting = [], f"{result}, " if str(result) else ""
    for summary in result.run.seat_summaries:
        if summary.regret is None:
            continue
        regret, seat = summary.regret, f"{setting}{summary.seat}"
        if regret.per_game is None or regret.per_choice is None:
            lines.append(f"no regret of {seat}: {regret.basis}")
            continue
        exact = "exact" if regret.is_exact else "bounds"
        per_game, per_choice = map(_format_bounds, (regret.per_game, regret.per_choice))
        discounted = " (discounted)" * (result.lineup.problem.discount < 1.0)
        lines.append(
            f"regret of {seat}, {exact}, by {regret.basis}: "
            f"{per_game} per game{discounted}, {per_choice} per choice"
        )
    return lines


def _format_bounds(bounds: tuple[Estimate, Estimate]) -> str:
    """Return a mean with its standard error, or the two means between which it lies."""
    return " to ".join(
        format_mean(bound.mean, bound.standard_error) for bound in dict.fromkeys(bounds)
    )


def _iter_data_rows(result: SettingResult) -> Iterator[Row]:
    """Yield a row of data for each seat of a setting."""
    for row, name in zip(result.run.list_rows(), result.lineup.agent_names, strict=True):
        setting = result.request.parameter_values if result.swept_parameters else {}
        yield {**setting, "seat": row["seat"], "agent": name} | row


def _iter_table_rows(result: SettingResult) -> Iterator[Row]:
    """Yield a table row for each seat of a setting, with combined numbers."""
    for earned, name in zip(result.run.seat_summaries, result.lineup.agent_names, strict=True):
        returns, totals = earned.returns, earned.totals
        has_error = np.isfinite(returns.standard_error)
        yield {
            **result.swept_parameters,
            "seat": earned.seat,
            "agent": name,
            "return": format_mean(returns.mean, returns.standard_error),
            "95 % interval": f"{format_number(returns.low, 5)} to {format_number(returns.high, 5)}"
            if has_error
            else MISSING_CELL,
            "min, quartiles, max": "  ".join(format_number(value, 4) for value in earned.quantiles),
            "total": format_mean(totals.mean, totals.standard_error),
        }


def _run_headline(request: EvaluationRequest, result: RunResult) -> str:
    """Return the headline of a run: problem, games, seed, mean turns, ended games and speed."""
    speed = result.episodes / max(result.seconds, 1e-9)
    return (
        f"{request.title}: {format_count(result.episodes, 'game', ',')} with seed {request.seed}, "
        f"{append_noun(format_score(result.mean_turns), 'turn')} on average, "
        f"{100 * result.terminated_share:.3g} % ended before the turn limit; "
        f"{format_count(speed, 'game', ',.0f')} per second"
    )


def _plot_sweep(results: Sequence[SettingResult]) -> str:
    """Return a plot of the first seat's mean return by setting, with confidence intervals."""
    name = f"mean return of {results[0].run.seat_summaries[0].seat}"
    estimates = [item.run.seat_summaries[0].returns for item in results]
    return plot_estimates(name, [str(item) for item in results], estimates)


def plot_estimates(name: str, labels: Sequence[str], estimates: Sequence[Estimate]) -> str:
    """Return a plot with a row for each estimate: its label, its interval and its mean."""
    finite = [x for item in estimates for x in (item.low, item.mean, item.high) if np.isfinite(x)]
    low, high = min(finite), max(finite)
    scale = (PLOT_COLUMNS - 1) / (high - low) if high > low else 0.0
    label_columns = max(map(len, labels))
    rows = [f"{name}, {format_number(low, 4)} to {format_number(high, 4)}:"]
    for label, item in zip(labels, estimates, strict=True):
        ends = np.clip([item.low, item.mean, item.high], low, high)
        start, middle, end = (round(float(x - low) * scale) for x in ends)
        line = " " * start + "─" * (end - start + 1)
        marked_line = f"{line[:middle]}●{line[middle + 1 :]}"
        rows.append(
            f"{label:<{label_columns}}  {marked_line:<{PLOT_COLUMNS}}  "
            f"{format_number(item.mean, 5)}"
        )
    return "\n".join(rows)


def _format_histograms(results: Sequence[SettingResult]) -> str:
    """Return a histogram of the returns for each setting and seat, one per row."""
    rows = ["returns:"]
    for result in results:
        setting = result._replace(swept_agents=())
        for seat, name in enumerate(result.lineup.agent_names):
            bars, low, high = draw_histogram(result.run.rollout.returns[:, seat])
            rows.append(
                f"{format_score(low):>9} {bars} {format_score(high):<9} {setting} {name}".rstrip()
            )
    return "\n".join(rows)


def draw_histogram(sample: Reals) -> tuple[str, float, float]:
    """Return a histogram of a sample as a string of bars, with the sample's minimum and maximum."""
    low, high = float(sample.min()), float(sample.max())
    scaled = sample / (max(abs(low), abs(high)) or 1.0)
    spread = float(np.ptp(scaled))
    if spread <= HISTOGRAM_BINS * np.finfo(float).eps:  # equal but for rounding: one bar
        spread = 1.0
    counts, _ = np.histogram(scaled, HISTOGRAM_BINS, (scaled.min(), scaled.min() + spread))
    levels = np.ceil(counts / counts.max() * len(BAR_LEVELS)).astype(int)
    return "".join(" " if not level else BAR_LEVELS[level - 1] for level in levels), low, high


class DecisionOptions(NamedTuple):
    """The options of `compare` that let it end early."""

    error_probability: float | None = None  # None: play all games
    bounds_text: str = ""  # LOW,HIGH: the smallest and the largest return of a game
    asymptotic: bool = False

    def parse_bounds(self) -> tuple[float, float] | None:
        """Return the bounds of a return, if they are given; raise BadParameter if invalid."""
        if self.error_probability is None and (self.bounds_text or self.asymptotic):
            raise BadParameter("--bounds and --asymptotic: expected --decide P too")
        if not self.bounds_text:
            return None
        try:
            low, high = map(float, self.bounds_text.split(","))
        except ValueError:
            low, high = np.nan, np.nan
        if not (low <= high and np.isfinite([low, high]).all()):
            raise BadParameter(
                f"--bounds: got {self.bounds_text!r}, expected two numbers, such as -100,20"
            )
        return low, high


class ComparedSetting(NamedTuple):
    """The comparison of agents in one setting of the parameters."""

    request: EvaluationRequest
    entrants: Sequence[str]
    result: Comparison
    seconds: float
    lines: Sequence[str]  # on stderr


def report_comparison(
    request: EvaluationRequest, entrants: Sequence[str], decision: DecisionOptions, *, episodes: int
) -> Printout:
    """Compare agents in the first seat on common random numbers, and report their differences.

    A range in the name of an agent makes several agents. If there are several settings of the
    parameters, the agents are compared in each. Raise BadParameter for fewer than two agents, or if
    `request` names an agent of the first seat.
    """
    entrants = expand_entrants(entrants)
    if len(entrants) < 2:
        got = format_count(len(entrants), "agent")
        raise BadParameter(f"got {got}, expected at least 2")
    settings, compared = [*iter_settings(request)], list[ComparedSetting]()
    for setting in settings:
        compared.append(_compare_setting(setting, entrants, decision, episodes))
        if compared[-1].result.shortfall_reason:
            break
    return make_evaluation_report(
        _format_comparisons(compared, decision, has_sweep=len(settings) > 1),
        compared[-1].result.shortfall_reason,
        [line for item in compared for line in item.lines],
    )


def _compare_setting(
    request: EvaluationRequest, entrants: Sequence[str], decision: DecisionOptions, episodes: int
) -> ComparedSetting:
    """Compare agents in one setting of the parameters."""
    problem = request.load_problem().problem
    for name in parse_settings(request.seats, "--seat"):
        if not find_seat(problem, name):
            raise BadParameter(
                f"--seat: {name} is the seat of the compared agents; set another seat"
            )
    lineups, unloaded = load_entrants(
        problem, entrants, lambda name: load_players(request._replace(agent=name)), "comparison"
    )
    names = [name for name, _ in lineups]
    start_time = time.monotonic()
    task = f"comparing {' and '.join(names)}"
    with (
        ProgressBar(task, quiet=bool(request.output_format), motion=request.motion) as bar,
        open_execution_backend(request.engine, request.workers) as (workers, executor),
    ):
        result = compare(
            problem,
            [entry.policies for _, entry in lineups],
            episodes=episodes,
            decide=decision.error_probability,
            return_bounds=decision.parse_bounds(),
            asymptotic=decision.asymptotic,
            turns=request.turn_limit,
            seed=request.seed,
            workers=workers,
            executor=executor,
            progress=bar,
            names=names,
        )
    active = [names[index] for index in result.active]
    seconds = time.monotonic() - start_time
    return ComparedSetting(request, active, result, seconds, [*unloaded, *result.withdrawals])


def _format_comparisons(
    compared: Sequence[ComparedSetting], decision: DecisionOptions, *, has_sweep: bool
) -> str:
    """Return comparisons as JSON, CSV or text; of a sweep, all of them with their parameters."""
    request = compared[0].request
    if request.output_format == "csv":
        return format_csv(
            [
                (item.request.parameter_values if has_sweep else {}) | row
                for item in compared
                for row in item.result.list_rows()
            ]
        )
    if request.output_format == "json":
        facts = [_collect_comparison_facts(item) for item in compared]
        return format_json_report({"settings": facts} if has_sweep else facts[0])
    return "\n\n".join(_format_comparison(item, decision) for item in compared)


def _build_agent_rows(compared: ComparedSetting) -> list[Row]:
    """Return a row of data for each agent."""
    named_estimates = zip(compared.entrants, compared.result.return_estimates, strict=True)
    return [{"agent": name} | make_estimate_row(estimate) for name, estimate in named_estimates]


def _collect_comparison_facts(compared: ComparedSetting) -> dict[str, object]:
    """Return a comparison as JSON facts."""
    request, result = compared.request, compared.result
    return {
        "problem": request.problem,
        "parameters": request.parameter_values,
        "seed": request.seed,
        "games": len(result.returns),
        **({"withdrawals": result.withdrawals} if result.withdrawals else {}),
        "decided": result.decided,
        "agents": _build_agent_rows(compared),
        "pairs": result.list_rows(),
    }


def _format_comparison(compared: ComparedSetting, decision: DecisionOptions) -> str:
    """Return a comparison as text."""
    request, result = compared.request, compared.result
    headline = (
        f"{request.title}: {format_count(len(result.returns), 'game', ',')} with seed "
        f"{request.seed}, on the same random numbers; {compared.seconds:.3g} s"
    )
    pair_table = [_build_pair_table_row(row) for row in result.list_rows()]
    tables = [format_table(_build_agent_rows(compared)), format_table(pair_table)]
    verdict = _format_verdict_lines(compared.entrants, result, decision)
    return "\n\n".join([headline, *tables, *verdict])


def _format_signed(number: object, digits: int = 4) -> str:
    """Return a number in significant digits with its sign."""
    return format_number(float(str(number)), digits, "+")


def _build_pair_table_row(row: Row) -> Row:
    """Return the difference between two agents as a table row, from its row of data."""
    games_saved = row["games saved"]
    is_same_play = row["difference"] == row["standard error"] == 0.0
    independent_games = (
        "equal returns" if is_same_play else f"{games_saved:.3g} x" if games_saved else MISSING_CELL
    )
    has_error = format_cell(row["standard error"]) != MISSING_CELL
    return {
        "agent": row["agent"],
        "against": row["against"],
        "difference": format_mean(row["difference"], row["standard error"], 4, "+"),
        "luck": _format_signed(row["luck"], 2) if row["luck"] else MISSING_CELL,
        "interval": f"{_format_signed(row['low'])} to {_format_signed(row['high'])}"
        if has_error
        else MISSING_CELL,
        "ahead": f"{100 * float(str(row['ahead'])):.3g} %",
        "behind": f"{100 * float(str(row['behind'])):.3g} %",
        "games with separate seeds": independent_games,
    }


def _format_verdict_lines(
    entrants: Sequence[str], result: Comparison, decision: DecisionOptions
) -> list[str]:
    """Return a line with the agent that earns more, or with `undecided`; none without `decide`."""
    if decision.error_probability is None:
        return []
    if not result.decided:
        return [f"undecided after {format_count(len(result.returns), 'game', ',')}"]
    better = entrants[0] if result.differences[0, 1].advantage.mean > 0 else entrants[1]
    share = f"{100 * decision.error_probability:g} % of comparisons"
    reliability = (
        f"asymptotic: wrong in about {share} or fewer if there are many games"
        if decision.asymptotic
        else f"wrong in at most {share}"
    )
    return [f"decided: {better} earns more ({reliability})"]

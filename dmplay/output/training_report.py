"""The report of a training, as text, JSON or CSV, and the file of the agent that it learned."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dmplay.agents.learned_file import format_learned_file, read_learned_file
from dmplay.algorithms.registry import load_learners
from dmplay.core.safe_files import write_bytes
from dmplay.core.text import format_count, format_json_report, format_number
from dmplay.draw.canvas import ASCII_TRANSLATION
from dmplay.errors import BadParameter, DmplayError
from dmplay.evaluation.solutions.solution import Row
from dmplay.evaluation.statistics import Estimate
from dmplay.game.command_line_results import Printout
from dmplay.game.launch_requests import parse_settings
from dmplay.output.evaluation_report import plot_estimates
from dmplay.output.svg_export import write_or_print
from dmplay.output.tables import format_csv, format_table
from dmplay.registry.agents import load_agent
from dmplay.registry.problems import parameter_values, resolve_problem
from dmplay.terminal.progress import ProgressBar
from dmplay.terminal.signals import INTERRUPTED_EXIT_CODE
from dmplay.training.policy_difference import compare_with_optimum
from dmplay.training.train import Training, TrainingRun, repeat_training, train
from dmplay.training.turn_data import collect_rows, column_names

MAX_DIFFERENT_STATES = 10  # rows of the table of different states


class TrainingRequest(NamedTuple):
    """The options of `dmplay train`."""

    algorithm: str
    problem: str
    settings: Sequence[str] = ()
    seeds: int = 10
    first_seed: int = 0
    steps: int | None = None
    episodes: int | None = None
    eval_every: int | None = None
    eval_games: int = 1000
    continued: Path | None = None
    data: Path | None = None
    output: Path | None = None
    force: bool = False
    output_format: str = ""
    motion: bool = True
    ascii: bool = False


def report_learners(*, json: bool) -> str:
    """Return each learning algorithm with its purpose, its source and its parameters."""
    rows: list[Row] = [
        {"algorithm": name, "purpose": learner.summary, "source": learner.source}
        for name, learner in load_learners().items()
    ]
    if json:
        return format_json_report({"algorithms": rows})
    lines = ["Train an agent: dmplay train ALGORITHM PROBLEM", ""]
    lines += [f"{row['algorithm']}: {row['purpose']} ({row['source']})" for row in rows]
    return "\n".join(lines)


def report_training(request: TrainingRequest) -> Printout:
    """Train, write the file of the best agent if one is given, and return the report."""
    algorithm, name, settings, start = request.algorithm, request.problem, {}, None
    if request.continued is not None:
        start = read_learned_file(request.continued)
        algorithm, name = start.header["learner"], start.header["problem"]
        settings = dict(start.header["settings"])
    settings |= parse_settings(request.settings, "--set")
    loaded = resolve_problem(name, settings)
    seeds = range(request.first_seed, request.first_seed + request.seeds)
    quiet = bool(request.output_format)
    with ProgressBar(f"training {algorithm} on {name}", quiet=quiet, motion=request.motion) as bar:
        training = train(
            algorithm,
            loaded.problem,
            seeds=seeds,
            steps=request.steps,
            episodes=request.episodes,
            eval_every=request.eval_every,
            eval_games=request.eval_games,
            data=request.data,
            start=start,
            progress=bar,
        )
    all_values = parameter_values(loaded.problem)
    facts = {
        "algorithm": training.learner.name,
        "learner": algorithm,
        "problem": loaded.name,
        "settings": {key: all_values[key.replace("-", "_")] for key in settings},
    }
    if request.output is not None:
        data = format_learned_agent(training, training.best_run, facts)
        write_bytes(request.output, [data], force=request.force)
    text = _format_report(training, facts, request)
    exit_code = INTERRUPTED_EXIT_CODE if training.is_interrupted else 0
    note = "interrupted: the report is about what was learned until then"
    return Printout(text, stderr_text=note * training.is_interrupted, exit_code=exit_code)


def format_learned_agent(training: Training, run: TrainingRun, facts: dict[str, Any]) -> bytes:
    """Return the bytes of the file of the agent that a run has learned."""
    header = {
        **facts,
        "seed": run.seed,
        "actions": [*training.problem.actions[0].labels],
        "features": training.features,
        "part_steps": run.part_steps,
        "data": training.data is not None,
        "curve": [list(point) for point in run.checkpoints],
        "optimum": training.evaluator.optimum[0],
    }
    return format_learned_file(header, run.arrays)


def verify_learned_files(paths: Sequence[Path], *, retrain: bool) -> tuple[list[str], bool]:
    """Return a line for each file of a learned agent, and whether all are as they were written.

    With `retrain`, the training is repeated, and its arrays are compared bit by bit.
    """
    lines, are_good = list[str](), True
    for path in paths:
        try:
            file = read_learned_file(path)
            header = file.header
            problem = resolve_problem(header["problem"], header["settings"]).problem
            file.make_policy(problem, str(path))
            text = f"{path}: {header['learner']} on {header['problem']}, seed {header['seed']}"
            is_good = True
            if retrain:
                arrays = repeat_training(file, problem).arrays
                is_good = arrays.keys() == file.arrays.keys() and all(
                    np.array_equal(array, file.arrays[name]) for name, array in arrays.items()
                )
            verdict = "trained again, equal" if retrain else "digest and header are valid"
            lines.append(f"{text}: {verdict if is_good else 'trained again, DIFFERENT'}")
        except DmplayError as error:
            is_good = False
            lines.append(str(error))
        are_good &= is_good
    return lines, are_good


def _format_report(training: Training, facts: dict[str, Any], request: TrainingRequest) -> str:
    """Return the report as text, JSON or CSV."""
    rows: list[Row] = [
        {"seed": run.seed, **point._asdict()} for run in training.runs for point in run.checkpoints
    ]
    if request.output_format == "csv":
        return format_csv(rows)
    (optimum, source), best = training.evaluator.optimum, training.best_run
    difference = compare_with_optimum(training.evaluator, training.make_policy(best))
    if request.output_format == "json":
        curve = [
            {"steps": steps, "seconds": seconds, "mean": item.mean, "low": item.low,
             "high": item.high}
            for steps, seconds, item in training.curve
        ]  # fmt: skip
        facts = facts | {"curve": curve, "runs": rows, "optimum": optimum, "optimum source": source}
        if difference is not None:
            states = [state._asdict() for state in difference.rows]
            facts["difference"] = {"seed": best.seed, "cost": difference.cost, "states": states}
        return format_json_report(facts)
    last_steps, seconds, last = training.curve[-1]
    lowest = format_number(min(run.last.value for run in training.runs), 5)
    marks = [*(item for _, _, item in training.curve)]
    marks.append(last._replace(mean=optimum, low=optimum, high=optimum))
    marks = [Estimate(*(round(number, 9) for number in mark)) for mark in marks]
    is_exact = training.evaluator.mdp is not None
    measure = "expected return" if is_exact else "mean return"
    labels = [f"{steps:,} steps" for steps, _, _ in training.curve]
    parts = [
        f"{facts['learner']} on {facts['problem']}: {format_count(len(training.runs), 'seed')} of "
        f"{last_steps:,} steps, {seconds:.2f} s of training each",
        plot_estimates(
            f"{measure}, interquartile mean and 95 % interval",
            [*labels, f"optimum, {source}"],
            marks,
        ),
        f"after training: {last}; lowest seed {lowest}",
    ]
    if difference is not None:
        count, total = len(difference.rows), difference.state_count
        line = f"the policy of seed {best.seed} is optimal in all {total} states"
        if count:
            line = (
                f"the policy of seed {best.seed} is wrong in {count} of {total} states, which "
                f"costs {format_number(difference.cost, 2)}"
            )
        table = [state._asdict() for state in difference.rows[:MAX_DIFFERENT_STATES]]
        parts.append("\n".join([line, *([format_table(table, 3)] if count else [])]))
    if request.output is not None:
        parts.append(
            f"wrote {request.output}, the agent of seed {best.seed}: "
            f"dmplay {facts['problem']} --agent learned:{request.output}"
        )
    text = "\n\n".join(parts)
    return text.translate(ASCII_TRANSLATION) if request.ascii else text


def report_turn_data(  # noqa: PLR0913, PLR0917 - the options of the command
    name: str,
    settings: Sequence[str],
    agent: str,
    count: int,
    seed: int,
    output: Path | None,
    *,
    force: bool,
) -> Printout:
    """Write turns of an agent as comma-separated values."""
    problem = resolve_problem(name, parse_settings(settings, "--set")).problem
    if len(problem.agents) > 1:
        raise BadParameter(f"{name}: several agents choose, expected a problem of one agent")
    rows = collect_rows(problem, load_agent(problem, 0, agent), count, seed)
    names = column_names(problem)
    return write_or_print(
        output,
        [f"{format_csv([dict(zip(names, row, strict=True)) for row in rows])}\n"],
        force=force,
    )

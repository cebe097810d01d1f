"""Print the table of the guide: each learning algorithm on problems that it learns.

Usage: `python -m tests.training.table [SEEDS]`. It takes some minutes.
"""

import sys
from typing import Any

from dmplay.core.text import format_number
from dmplay.output.tables import format_table
from dmplay.training.train import train

# algorithm, parameters, problem, parameters of the problem, options of the training
ROWS: tuple[tuple[str, str, str, dict[str, Any], dict[str, Any]], ...] = (
    ("q-learning", "", "hexworld", {}, {}),
    ("q-learning", "", "hexworld:straight-line", {}, {}),
    ("sarsa", "", "hexworld", {}, {}),
    ("sarsa", "", "hexworld:straight-line", {}, {}),
    ("sarsa-lambda", "", "hexworld", {}, {}),
    ("sarsa-lambda", "rows=8,alpha=1,alpha_decay=1,epsilon=0,traces=replacing",
     "mountain-car:gym", {}, {"steps": 160_000}),
    ("maximum-likelihood", "", "hexworld", {}, {}),
    ("maximum-likelihood", "", "hexworld:straight-line", {}, {}),
    ("maximum-likelihood", "update=dyna", "hexworld", {}, {}),
    ("maximum-likelihood", "update=dyna", "hexworld:straight-line", {}, {}),
    ("policy-gradient", "", "cart-pole:gym", {}, {}),
    ("policy-gradient", "", "crying-baby", {}, {}),
    ("cross-entropy", "", "cart-pole:gym", {}, {}),
    ("cross-entropy", "games=4", "crying-baby", {}, {}),
    ("afterstates", "", "2048", {"p_two": 0.9}, {"episodes": 14_000, "seeds": 1}),
)  # fmt: skip


def main() -> None:
    """Print the table, and below it the parameters that are not the defaults."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    rows, notes = list[dict[str, object]](), dict[str, str]()
    for name, parameters, problem, values, options in ROWS:
        arguments = {"seeds": seeds, "eval_every": 10**12, **options, **values}
        training = train(f"{name}:{parameters}", problem, **arguments)
        ((steps, seconds, mean),) = training.curve
        mark = notes.setdefault(parameters, "*" * (len(notes) + 1)) if parameters else ""
        lowest = min(run.last.value for run in training.runs)
        numbers = [format_number(x, 4) for x in (mean.mean, mean.low, mean.high, lowest)]
        row: dict[str, object] = {
            "algorithm": f"{name}{mark}",
            "problem": problem,
            "steps": f"{steps:,}",
        }
        row |= {"s": f"{seconds:.2f}", "mean": numbers[0], "low": numbers[1], "high": numbers[2]}
        row |= {"lowest": numbers[3], "optimum": format_number(training.evaluator.optimum[0], 4)}
        rows.append(row)
        print(row, file=sys.stderr, flush=True)
    print(format_table(rows))
    print("\n".join(f"{mark} {parameters}" for parameters, mark in notes.items()))


if __name__ == "__main__":
    main()

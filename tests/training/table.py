"""Print the table of the guide: each learning algorithm on problems that it learns.

Usage: `python -m tests.training.table [SEEDS]`. It takes some minutes.
"""

import sys
from typing import Any

from dmplay.core.text import format_number
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
    """Print a line of the guide for each training."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    for name, parameters, problem, values, options in ROWS:
        algorithm = f"{name}:{parameters}" if parameters else name
        arguments = {"seeds": seeds, "eval_every": 10**12, **options, **values}
        training = train(algorithm, problem, **arguments)
        ((steps, seconds, mean),) = training.curve
        lowest = format_number(min(run.last.value for run in training.runs), 4)
        optimum = format_number(training.evaluator.optimum[0], 4)
        numbers = [format_number(x, 4) for x in (mean.mean, mean.low, mean.high)]
        print(
            f"- `{algorithm}` on `{problem}`: {numbers[0]}, interval {numbers[1]} to {numbers[2]}, "
            f"after {steps:,} steps and {seconds:.2f} s; lowest {lowest}, optimum {optimum}.",
            flush=True,
        )


if __name__ == "__main__":
    main()

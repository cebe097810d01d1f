"""Random small problems of every kind, each solved at two scales of its rewards.

`python -m tests.fuzz.reward_scales --cases 20000` runs many cases; a case is a number.
"""

import argparse
import os
import tempfile
from collections.abc import Callable
from itertools import zip_longest
from math import inf, isclose
from pathlib import Path
from random import Random
from time import monotonic

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.evaluation.solutions.solution import Solution
from dmplay.evaluation.solutions.solve import solve
from dmplay.formats import cassandra, gambit_nfg
from dmplay.registry.problems import load_problem

SCALES = (1e-8, 1e-12, 1e8, 1e-3)
NUMBER_TOLERANCE = 1e-6  # share of a problem's largest value by which scaled values may differ
BOUND_TOLERANCE = 1e-3  # the same for bounds, whose last digits depend on rounding errors
MIN_SIZE = 1e-3  # of the largest value at a scale of 1; below it are rounding errors
PRINTED_DIGIT = 1.01e-4  # of a probability in four decimals
POMDP_METHODS = {"alpha vectors, infinite horizon", "point-based, infinite horizon"}
ProblemText = Callable[[float], str]


def _draw_probabilities(random: Random, count: int) -> list[float]:
    """Return probabilities in tenths, so that they sum to 1 as printed."""
    cuts = sorted(random.randint(0, 10) for _ in range(count - 1))
    return [(high - low) / 10 for low, high in zip([0, *cuts], [*cuts, 10], strict=True)]


def _draw_reward(random: Random) -> int:
    return random.randint(-9, 9)


def _draw_markov(random: Random, suffix: str) -> ProblemText:
    """Return the text of a small MDP, POMDP or Dec-POMDP at each scale."""
    states = range(random.randint(2, 3))
    agents = 2 if suffix == "dpomdp" else 1
    joint = [(a, b) for a in range(2) for b in range(agents)]
    # Other discounts of POMDPs take seconds, and end with bounds when the work limit is reached.
    discount = random.choice(["0.4", "0.6"] if suffix == "pomdp" else ["0.5", "0.8", "0.9"])
    rows = [f"discount: {discount}", "values: reward", f"states: {len(states)}"]
    names = [" ".join(map(str, pair[:agents])) for pair in joint]
    if agents == 2:
        names = [f"{a} {b}" for a in range(2) for b in range(2)]
        rows = [
            "agents: 2",
            *rows,
            "start: uniform",
            "actions:",
            "2",
            "2",
            "observations:",
            "2",
            "2",
        ]
    else:
        rows += ["actions: 2", *["observations: 2"] * (suffix == "pomdp")]
    for name in names:
        for s in states:
            probabilities = " ".join(map(str, _draw_probabilities(random, len(states))))
            rows += (
                [f"T: {name} : {s} : {probabilities}"]
                if agents == 2
                else [f"T: {name} : {s}", probabilities]
            )
            if suffix == "pomdp":
                rows += [f"O: {name} : {s}", " ".join(map(str, _draw_probabilities(random, 2)))]
            if agents == 2:
                observed = " ".join(map(str, _draw_probabilities(random, 4)))
                rows += [f"O: {name} : {s} : {observed}"]
    tail = " : *" * (2 if suffix != "mdp" else 1)
    rewards = [(name, s, _draw_reward(random)) for name in names for s in states]
    return lambda scale: "\n".join(
        [
            *rows,
            *(
                f"R: {name} : {s}{tail} : {r * scale!r}"
                if agents == 2
                else f"R: {name} : {s}{tail} {r * scale!r}"
                for name, s, r in rewards
            ),
            "",
        ]
    )


def _draw_normal_form(random: Random, players: int) -> ProblemText:
    """Return the text of a game of two or three players at each scale."""
    counts = [random.randint(2, 3) for _ in range(players)] if players == 2 else [2] * 3
    size = players
    for count in counts:
        size *= count
    payoffs = [_draw_reward(random) for _ in range(size)]
    head = (
        f'NFG 1 R "" {{ {" ".join(f"{chr(34)}p{n}{chr(34)}" for n in range(players))} }} '
        f"{{ {' '.join(map(str, counts))} }}"
    )
    return lambda scale: f"{head}\n\n{' '.join(repr(p * scale) for p in payoffs)}\n"


def _draw_tree(random: Random) -> ProblemText:
    """Return the text of a game tree of two players without chance at each scale."""
    payoffs = [(_draw_reward(random), _draw_reward(random)) for _ in range(4)]

    def format_tree(scale: float) -> str:
        leaves = [
            f't "" {n} "" {{ {first * scale!r} {second * scale!r} }}'
            for n, (first, second) in enumerate(payoffs, 1)
        ]
        return "\n".join([
            'EFG 2 R "" { "A" "B" }', 'p "" 1 1 "" { "l" "r" } 0', 'p "" 2 1 "" { "u" "v" } 0',
            *leaves[:2], 'p "" 2 2 "" { "u" "v" } 0', *leaves[2:], "",
        ])  # fmt: skip

    return format_tree


KINDS: dict[str, Callable[[Random], ProblemText]] = {
    "mdp": lambda random: _draw_markov(random, "mdp"),
    "pomdp": lambda random: _draw_markov(random, "pomdp"),
    "dpomdp": lambda random: _draw_markov(random, "dpomdp"),
    "nfg": lambda random: _draw_normal_form(random, 2),
    "3-player nfg": lambda random: _draw_normal_form(random, 3),
    "efg": _draw_tree,
}


def solve_text(folder: Path, kind: str, text: str) -> Solution:
    """Return the solution of a problem; only the library of `.efg` games reads it from a file."""
    name = f"case.{kind.rpartition(' ')[2]}"
    problem: Problem
    if kind == "efg":
        path = folder / name
        path.write_text(text)
        problem = load_problem(str(path))
    elif name.endswith(".nfg"):
        problem = gambit_nfg.read_nfg(name, text.encode())
    else:
        problem = cassandra.read_markov_file(name, text.encode(), team=kind == "dpomdp")
    return solve(problem, turns=2 if kind == "dpomdp" else None)


def find_difference(number: int, folder: Path, kind: str = "") -> str:
    """Return the difference of a case's solutions at two scales of its rewards; '' if none."""
    random = Random(number)
    kind = kind or random.choice([*KINDS])
    format_text, scale = KINDS[kind](random), random.choice(SCALES)
    try:
        first = solve_text(folder, kind, format_text(1.0))
    except (BadParameter, BudgetExceeded) as error:
        message = str(error)
        try:
            solve_text(folder, kind, format_text(scale))
        except (BadParameter, BudgetExceeded):
            return ""
        return f"{kind} {number}: only at scale {scale:g} is it solved: {message}"
    second = solve_text(folder, kind, format_text(scale))
    difference = _compare(first, second, scale)
    return difference and f"{kind} {number} at scale {scale:g}: {difference}"


def _compare(  # noqa: PLR0911 - a return for each kind of solution
    first: Solution, second: Solution, scale: float
) -> str:
    """Return the first difference of two solutions, the second one with scaled rewards.

    Of alpha vectors only the upper envelope counts: a vector that is hardly needed may be missing.
    Of joint plans only the value counts, because several plans may have it. Regret matching is
    an approximation whose path depends on rounding errors.
    """
    if {first.method, second.method} == POMDP_METHODS:  # The work limit is near.
        return ""
    if "vector" in first.result:
        values, scaled_values = (_list_envelope(solution) for solution in (first, second))
        error = abs(values - scaled_values / scale).max() / abs(values).max()
        return f"values differ by {error:.1g}" * bool(error > NUMBER_TOLERANCE)
    if "optimal" in first.result:
        value, scaled = (_read_value(solution) for solution in (first, second))
        is_equal = isclose(value, scaled / scale, rel_tol=2e-5)
        return f"{value}, {scaled / scale}" * (not is_equal)
    if first.method.startswith("regret matching"):
        return f"method {second.method}" * (not second.method.startswith("regret matching"))
    if len(first.rows) != len(second.rows):
        return f"{len(first.rows)} rows, {len(second.rows)} rows"
    numbers = [abs(v) for row in first.rows for v in row.values() if isinstance(v, float)]
    is_bounded = first.method.startswith("point-based")
    share = BOUND_TOLERANCE if is_bounded else NUMBER_TOLERANCE
    tolerance = share * max([MIN_SIZE, *numbers])
    for row, scaled_row in zip(first.rows, second.rows, strict=True):
        for name, cell in row.items():
            scaled_cell = scaled_row[name]
            if isinstance(cell, float) and isinstance(scaled_cell, float):
                if not isclose(cell, scaled_cell / scale, rel_tol=0.0, abs_tol=tolerance):
                    return f"{name} {cell!r}, {scaled_cell / scale!r}"
            elif name != "state" and not _is_same_text(str(cell), str(scaled_cell)):
                return f"{name} {cell!r}, {scaled_cell!r}"
    return ""


def _is_same_text(text: str, other: str) -> bool:
    """Return whether two texts are equal up to the last digit of their probabilities."""
    pairs = [*zip_longest(text.split(), other.split(), fillvalue="")]
    return all(
        word == other_word
        or ("." in word + other_word and abs(float(word) - float(other_word)) < PRINTED_DIGIT)
        for word, other_word in pairs
    )


def _list_envelope(solution: Solution) -> Reals:
    """Return the greatest value of the alpha vectors at random beliefs."""
    vectors = np.array(
        [[value for value in row.values() if isinstance(value, float)] for row in solution.rows]
    )
    beliefs = np.random.default_rng(0).dirichlet(np.ones(vectors.shape[1]), size=50)
    return np.asarray((beliefs @ vectors.T).max(axis=1))


def _read_value(solution: Solution) -> float:
    """Return the value in the text of a result."""
    return float(solution.result.partition("value ")[2].split()[0])


def main() -> None:
    """Run cases and print those whose solutions do not follow the scale."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kind", default="")
    parser.add_argument("--seconds", type=float, default=inf, help="begin no case after this time")
    options = parser.parse_args()
    end, faults, number = monotonic() + options.seconds, 0, options.first
    with tempfile.TemporaryDirectory() as folder:
        while number < options.first + options.cases and monotonic() < end:
            difference = find_difference(number, Path(folder), options.kind)
            number += 1
            if difference:
                faults += 1
                print(difference, flush=True)
    print(f"{number - options.first} cases, {faults} faults")


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    main()

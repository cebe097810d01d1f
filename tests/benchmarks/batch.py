"""Measure the steps per second of every problem, by number of rows."""

import time
from statistics import median

import numpy as np

import dmplay
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.problem import Problem
from dmplay.core.spaces import Interval
from dmplay.registry.builtin_names import problem_names

ROW_COUNTS = (1, 100, 10_000)
GYM_ROWS = 8192
SAMPLE_TURNS = 12  # number of turns played to sample states, actions and uniforms
MIN_RUN_SECONDS = 0.05  # minimum duration of one run

StepInputs = tuple[Array, Array, Reals]


def _sample_actions(
    problem: Problem, legal: Bools | None, rng: np.random.Generator, rows: int
) -> Array:
    columns = []
    for seat, action_set in enumerate(problem.actions):
        if isinstance(action_set, Interval):
            columns.append(rng.uniform(action_set.low, action_set.high, rows))
        else:
            weights = rng.random((rows, len(action_set)))
            columns.append(
                np.argmax(weights if legal is None else weights * legal[:, seat], axis=1)
            )
    return np.stack(columns, axis=1)


def _sample_step_inputs(problem: Problem, rows: int) -> list[StepInputs]:
    """Return the states, actions and uniforms of the turns of random games."""
    rng = np.random.default_rng(7)
    s = problem.sample_initial_states(rng.random((rows, problem.uniform_counts.start)))
    cases = []
    for _ in range(SAMPLE_TURNS):
        a = _sample_actions(problem, problem.legal_actions_mask(s), rng, rows)
        u = rng.random((rows, problem.uniform_counts.step))
        cases.append((s, a, u))
        s = problem.step(s, a, u).state
    return cases


def _measure_step_rate(problem: Problem, cases: list[StepInputs]) -> float:
    """Return the steps per second, including the legal actions mask of each state."""
    steps, start_time = 0, time.perf_counter()
    while (seconds := time.perf_counter() - start_time) < MIN_RUN_SECONDS:
        for s, a, u in cases:
            problem.legal_actions_mask(s)
            problem.step(s, a, u)
            steps += len(s)
    return steps / seconds


def report(runs: int) -> None:
    """Print a row for each problem."""
    problems = {name: dmplay.load_problem(name) for name in problem_names()}
    cases = {
        (n, rows): _sample_step_inputs(p, rows) for n, p in problems.items() for rows in ROW_COUNTS
    }
    rates: dict[tuple[str, int], list[float]] = {key: [] for key in cases}
    for _ in range(runs):
        for key, samples in rates.items():
            samples.append(_measure_step_rate(problems[key[0]], cases[key]))
    width = max(map(len, problems))
    print(f"steps a second at {ROW_COUNTS} rows, medians of {runs} interleaved runs")
    for name, problem in problems.items():
        columns = "".join(f"{median(rates[name, rows]):14,.0f}" for rows in ROW_COUNTS)
        mask = "  with the legal mask"
        if problem.legal_actions_mask(cases[name, 1][0][0]) is None:
            mask = ""
        print(f"  {name:<{width}} {columns}{mask}")
    _compare_with_gymnasium(problems["cart-pole"], runs)


def _compare_with_gymnasium(problem: Problem, runs: int) -> None:
    """Print the rate of cart-pole and of Gymnasium's vector environment, interleaved, at 8,192
    rows.
    """
    from gymnasium.envs.classic_control.cartpole import CartPoleVectorEnv

    peer = CartPoleVectorEnv(num_envs=GYM_ROWS)
    peer.reset(seed=7)
    pushes = np.random.default_rng(7).integers(0, 2, GYM_ROWS)
    cases = _sample_step_inputs(problem, GYM_ROWS)
    dmplay_rates, gymnasium_rates = [], []
    for _ in range(runs):
        dmplay_rates.append(_measure_step_rate(problem, cases))
        steps, start_time = 0, time.perf_counter()
        while (seconds := time.perf_counter() - start_time) < MIN_RUN_SECONDS:
            peer.step(pushes)
            steps += GYM_ROWS
        gymnasium_rates.append(steps / seconds)
    ratio = median(dmplay_rates) / median(gymnasium_rates)
    print(f"  cart-pole at {GYM_ROWS} rows: {median(dmplay_rates) / 1e6:.1f} M, Gymnasium's vector "
          f"environment {median(gymnasium_rates) / 1e6:.1f} M, ratio {ratio:.1f}")  # fmt: skip

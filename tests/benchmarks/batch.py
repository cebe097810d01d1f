"""Steps a second of every problem, by the number of rows."""

import time
from statistics import median

import numpy as np

import dmplay
from dmplay.chance import Array, Bools, Reals
from dmplay.core import Interval, Problem
from dmplay.finding.names import problem_names

ROWS = (1, 100, 10_000)
PEER_ROWS = 8192
TURNS = 12  # of play, whose states, actions and draws are the sample
LEAST = 0.05  # seconds that one run takes

Case = tuple[Array, Array, Reals]


def _actions(problem: Problem, legal: Bools | None, rng: np.random.Generator, rows: int) -> Array:
    columns = []
    for seat, known in enumerate(problem.actions):
        if isinstance(known, Interval):
            columns.append(rng.uniform(known.low, known.high, rows))
        else:
            wish = rng.random((rows, len(known)))
            columns.append(np.argmax(wish if legal is None else wish * legal[:, seat], axis=1))
    return np.stack(columns, axis=1)


def _cases(problem: Problem, rows: int) -> list[Case]:
    """The turns of random games: states, actions and draws."""
    rng = np.random.default_rng(7)
    s = problem.sample_initial_states(rng.random((rows, problem.uniform_counts.start)))
    cases = []
    for _ in range(TURNS):
        a = _actions(problem, problem.legal_actions_mask(s), rng, rows)
        u = rng.random((rows, problem.uniform_counts.step))
        cases.append((s, a, u))
        s = problem.step(s, a, u).state
    return cases


def _rate(problem: Problem, cases: list[Case]) -> float:
    """Steps a second, the legal mask of the state before each included where there is one."""
    steps, began = 0, time.perf_counter()
    while (spent := time.perf_counter() - began) < LEAST:
        for s, a, u in cases:
            problem.legal_actions_mask(s)
            problem.step(s, a, u)
            steps += len(s)
    return steps / spent


def report(runs: int) -> None:
    """Prints a row for each problem."""
    problems = {name: dmplay.load_problem(name) for name in problem_names()}
    cases = {(n, rows): _cases(p, rows) for n, p in problems.items() for rows in ROWS}
    rates: dict[tuple[str, int], list[float]] = {key: [] for key in cases}
    for _ in range(runs):
        for key, found in rates.items():
            found.append(_rate(problems[key[0]], cases[key]))
    wide = max(map(len, problems))
    print(f"steps a second at {ROWS} rows, medians of {runs} interleaved runs")
    for name, problem in problems.items():
        told = "".join(f"{median(rates[name, rows]):14,.0f}" for rows in ROWS)
        mask = (
            ""
            if problem.legal_actions_mask(cases[name, 1][0][0]) is None
            else "  with the legal mask"
        )
        print(f"  {name:<{wide}} {told}{mask}")
    _beside_gymnasium(problems["cart-pole"], runs)


def _beside_gymnasium(problem: Problem, runs: int) -> None:
    """Prints cart-pole beside Gymnasium's own vector environment, in turn, at 8,192 rows."""
    from gymnasium.envs.classic_control.cartpole import CartPoleVectorEnv

    peer = CartPoleVectorEnv(num_envs=PEER_ROWS)
    peer.reset(seed=7)
    pushes = np.random.default_rng(7).integers(0, 2, PEER_ROWS)
    cases = _cases(problem, PEER_ROWS)
    ours, theirs = [], []
    for _ in range(runs):
        ours.append(_rate(problem, cases))
        steps, began = 0, time.perf_counter()
        while (spent := time.perf_counter() - began) < LEAST:
            peer.step(pushes)
            steps += PEER_ROWS
        theirs.append(steps / spent)
    ratio = median(ours) / median(theirs)
    print(f"  cart-pole at {PEER_ROWS} rows: {median(ours) / 1e6:.1f} M, Gymnasium's vector "
          f"environment {median(theirs) / 1e6:.1f} M, ratio {ratio:.1f}")  # fmt: skip

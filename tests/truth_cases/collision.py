from functools import cache
from typing import Any

import numpy as np

import dmplay
from dmplay.core.arrays import Bools, Reals
from dmplay.core.best_actions import VALUE_TOLERANCE, mark_best_actions
from dmplay.core.policy import Percept, Policy
from dmplay.core.problem import Problem, enumerate_outcomes
from dmplay.core.uniforms import NATURE_STREAM, generate_uniforms
from dmplay.problems.collision_avoidance import grid as collision_avoidance_grid
from dmplay.problems.collision_avoidance.grid import CLIMB_RATES, HEIGHTS
from dmplay.problems.collision_avoidance.rules import (
    ADVISED_RATES,
    START_HEIGHT_BOUND,
    START_RATE_BOUND,
    START_TIME,
)
from tests.truth_cases.case import Case, map_by_kind

LITERAL_PROBLEM = dmplay.load_problem("collision-avoidance")
REPAIRED_PROBLEM = dmplay.load_problem("collision-avoidance", repaired=True)
NO_ADVISORY = 1
GAME_COUNT = 20_000
OPTIMAL_GAME_COUNT = 200_000  # a larger number, because the optimal policy hardly ever collides


def step(case: Case) -> None:
    s = np.array([case.inputs["state"]], float)
    a = np.array([[ADVISED_RATES.tolist().index(case.inputs["action"])]])
    p, after = enumerate_outcomes(LITERAL_PROBLEM, s, a)
    expected = {tuple(state): probability for state, probability in case.expect["next"]}
    for state, probability in expected.items():
        (row,) = np.flatnonzero(np.abs(after.state[0] - state).max(axis=1) <= case.tol)
        case.equal(probability, p[0, row])
    assert len(expected) == len(p[0])
    gust_free = after.state[0, 1] - s[0]
    case.close("hddot", gust_free[1])
    for reward in after.rewards[0, :, 0]:
        case.close("reward", reward)
    assert (LITERAL_PROBLEM.terminal(after.state[0]) == case.expect["next_terminal"]).all()


def compute_gust_offsets() -> tuple[np.ndarray, np.ndarray]:
    """Return the height offsets that gusts cause without an advisory, and their probabilities."""
    s, p = np.array([[0.0, 0.0, 0.0, START_TIME]]), np.ones(1)
    while s[0, 3] > 0:
        p_next, after = enumerate_outcomes(LITERAL_PROBLEM, s, np.full((len(s), 1), NO_ADVISORY))
        s, inverse = np.unique(after.state.reshape(-1, 4), axis=0, return_inverse=True)
        weights = (p[:, None] * p_next).reshape(-1)
        p = np.bincount(inverse.reshape(-1), weights).astype(float)
    return s[:, 0], p


def start_height_cdf(x: np.ndarray) -> np.ndarray:
    """P(h0 + 40 dh0 < x): the distribution function of the sum of two uniforms."""
    narrow, wide = START_HEIGHT_BOUND, START_TIME * START_RATE_BOUND
    corners = ((narrow + wide, 1), (narrow - wide, -1), (wide - narrow, -1), (-narrow - wide, 1))
    area = sum(sign * np.maximum(x + offset, 0.0) ** 2 / 2 for offset, sign in corners)
    return np.asarray(area / (4 * narrow * wide))


def nmac_no_advisory_exact(case: Case) -> None:
    shift, p = compute_gust_offsets()
    case.close(
        "probability", p @ (start_height_cdf(50.0 - shift) - start_height_cdf(-50.0 - shift))
    )


def simulate_encounters(game: Problem, policy: Policy, games: int) -> dict[str, np.ndarray]:
    """Simulate games of 41 turns: near at time 0, return, and whether there was an advisory."""
    s = game.sample_initial_states(
        generate_uniforms(1, NATURE_STREAM, 0, rows=games, count=game.uniform_counts.start)
    )
    memory = policy.initial_memory(s)
    returns, alerted, near = np.zeros(games), np.zeros(games, bool), np.zeros(games, bool)
    for turn in range(1, int(START_TIME) + 2):
        near |= (s[:, 3] == 0) & (np.abs(s[:, 0]) < 50)
        a = policy.choose(memory, None, np.zeros((games, 0)))[:, None]
        alerted |= a[:, 0] != NO_ADVISORY
        after = game.step(
            s,
            a,
            generate_uniforms(1, NATURE_STREAM, turn, rows=games, count=game.uniform_counts.step),
        )
        s = after.state
        returns += after.rewards[:, 0]
        memory = policy.update_memory(memory, Percept(a[:, 0], s, a, after.rewards[:, 0]))
    assert game.terminal(s).all()
    return {"near": near, "return": returns, "alerted": alerted}


def nmac(case: Case) -> None:
    game, name = select_problem(case.inputs["branch"]), case.inputs["policy"].replace(" ", "-")
    games = OPTIMAL_GAME_COUNT if name == "optimal" else GAME_COUNT
    results = simulate_encounters(game, dmplay.load_agent(game, 0, name), games)
    case.mean("nmac", results["near"])
    case.mean("mean_return", results["return"])
    share = float(results["alerted"].mean())
    case.share(case.expect["alerted_share"], share, case.inputs["episodes"], games)


def select_problem(name: str) -> Problem:
    assert name in ("literal", "repaired")
    return LITERAL_PROBLEM if name == "literal" else REPAIRED_PROBLEM


@cache
def solve(name: str = "literal") -> Reals:
    return collision_avoidance_grid.compute_optimal_q(select_problem(name))


def grid_index(inputs: dict[str, Any]) -> tuple[int, int, slice, int]:
    """Return the index of the grid slice over all heights that a case selects."""
    rate = int(np.flatnonzero(inputs["hdot"] == CLIMB_RATES)[0])
    return inputs["tau"], ADVISED_RATES.tolist().index(inputs["a_prev"]), slice(None), rate


def list_best_rates(q: Reals) -> list[float]:
    return [float(rate) for rate in ADVISED_RATES[mark_best_actions(q)]]


def alert_mask(q: Reals) -> Bools:
    """Return a mask of the states where an advisory is better than none."""
    return np.asarray(q[..., [0, 2]].max(axis=-1) > q[..., NO_ADVISORY] + VALUE_TOLERANCE)


def grid_slice(case: Case) -> None:
    q = solve()[grid_index(case.inputs)]
    case.close("u", q.max(axis=1))
    case.close("q", q)
    assert [list_best_rates(row) for row in q] == case.expect["best"]


def grid_sum(case: Case) -> None:
    q = solve()[case.inputs["tau"]]
    case.close("sum_u", q.max(axis=-1).sum())
    case.close("sum_q", q.sum())
    case.close("alerts", alert_mask(q).sum())


def interpolated_q(case: Case) -> None:
    policy = dmplay.load_agent(LITERAL_PROBLEM, 0, "optimal")
    memory = policy.initial_memory(np.array([case.inputs["state"]], float))
    q = policy.action_values(memory)
    assert q is not None
    case.close("q", q[0])
    assert list_best_rates(q[0]) == case.expect["best"]
    chosen = int(policy.choose(memory, None, np.zeros((1, 0)))[0])
    assert ADVISED_RATES[chosen] == case.expect["best"][0]


def figure_f9_extent(case: Case) -> None:
    _, a_prev, _, rate = grid_index({**case.inputs, "tau": 0})
    alert = alert_mask(solve()[:, a_prev, :, rate])  # shape [41, 21]
    times, heights = np.flatnonzero(alert.any(axis=1)), HEIGHTS[alert.any(axis=0)]
    extents = {
        "first_tau_with_advisory": times.min(),
        "last_tau_with_advisory": times.max(),
        "largest_h": heights.max(),
        "smallest_h": heights.min(),
    }
    for key in case.expect:
        case.close(key, extents[key])


@cache
def evaluate_policy(name: str) -> Reals:
    """Return a policy's value at every point of the grid `[41, 3, 21, 21]`."""
    policy = dmplay.load_agent(LITERAL_PROBLEM, 0, name)
    after, tables = np.zeros(collision_avoidance_grid.GRID_SHAPE), []
    for time in collision_avoidance_grid.TIMES_TO_COLLISION:
        s = collision_avoidance_grid.make_grid_states(time)
        q = collision_avoidance_grid.compute_action_values(LITERAL_PROBLEM, time, after).reshape(
            len(s), -1
        )
        chosen = policy.choose(policy.initial_memory(s), None, np.zeros((len(s), 0)))
        after = q[np.arange(len(s)), chosen].reshape(collision_avoidance_grid.GRID_SHAPE)
        tables.append(after)
    return np.stack(tables)


def grid_policy_value(case: Case) -> None:
    u = evaluate_policy(case.inputs["policy"].replace(" ", "-"))
    case.close("u", u[grid_index(case.inputs)])
    case.close("sum_u", u[case.inputs["tau"]].sum())


def grid_value_from_start(case: Case) -> None:
    u = solve(case.inputs["branch"])[-1, NO_ADVISORY].max(axis=-1)
    weights = np.ones(21)
    weights[[0, -1]] = 0.5
    case.close("value", weights @ u @ weights / weights.sum() ** 2)


KINDS = map_by_kind(
    step, nmac_no_advisory_exact, nmac, grid_slice, grid_sum, interpolated_q, figure_f9_extent,
    grid_policy_value, grid_value_from_start,
)  # fmt: skip
LATER: set[str] = set()

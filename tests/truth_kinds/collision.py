from functools import cache
from typing import Any

import numpy as np

import dmplay
from dmplay.chance import Bools, Reals
from dmplay.core import Percept, Policy, Problem, enumerate_outcomes
from dmplay.dice import NATURE_STREAM, generate_uniforms
from dmplay.problems.collision_avoidance import (
    ADVISED_RATES,
    START_HEIGHT_BOUND,
    START_RATE_BOUND,
    START_TIME,
)
from dmplay.solvers import collision_grid
from dmplay.solvers.collision_grid import CLIMB_RATES, HEIGHTS
from dmplay.solvers.value_iteration import VALUE_TOLERANCE, mark_best_actions
from tests.truth_kinds.case import Case, by_kind

LITERAL = dmplay.load_problem("collision-avoidance")
REPAIRED = dmplay.load_problem("collision-avoidance", repaired=True)
NO_ADVISORY = 1
GAMES = 20_000
MANY_GAMES = 200_000  # of the optimal policy: it hardly ever collides


def step(case: Case) -> None:
    s = np.array([case.given["state"]], float)
    a = np.array([[ADVISED_RATES.tolist().index(case.given["action"])]])
    p, after = enumerate_outcomes(LITERAL, s, a)
    told = {tuple(state): share for state, share in case.expect["next"]}
    for state, share in told.items():
        (row,) = np.flatnonzero(np.abs(after.state[0] - state).max(axis=1) <= case.tol)
        case.equal(share, p[0, row])
    assert len(told) == len(p[0])
    gust_free = after.state[0, 1] - s[0]
    case.close("hddot", gust_free[1])
    for reward in after.rewards[0, :, 0]:
        case.close("reward", reward)
    assert (LITERAL.terminal(after.state[0]) == case.expect["next_terminal"]).all()


def offsets() -> tuple[np.ndarray, np.ndarray]:
    """How far gusts carry an aircraft that is told nothing, by the time of the encounter."""
    s, p = np.array([[0.0, 0.0, 0.0, START_TIME]]), np.ones(1)
    while s[0, 3] > 0:
        weight, after = enumerate_outcomes(LITERAL, s, np.full((len(s), 1), NO_ADVISORY))
        s, place = np.unique(after.state.reshape(-1, 4), axis=0, return_inverse=True)
        reaching = (p[:, None] * weight).reshape(-1)
        p = np.bincount(place.reshape(-1), reaching).astype(float)
    return s[:, 0], p


def below(x: np.ndarray) -> np.ndarray:
    """P(h0 + 40 dh0 < x): the distribution function of the sum of two uniforms."""
    narrow, wide = START_HEIGHT_BOUND, START_TIME * START_RATE_BOUND
    corners = ((narrow + wide, 1), (narrow - wide, -1), (wide - narrow, -1), (-narrow - wide, 1))
    area = sum(sign * np.maximum(x + at, 0.0) ** 2 / 2 for at, sign in corners)
    return np.asarray(area / (4 * narrow * wide))


def nmac_no_advisory_exact(case: Case) -> None:
    shift, p = offsets()
    case.close("probability", p @ (below(50.0 - shift) - below(-50.0 - shift)))


def flown(game: Problem, policy: Policy, games: int) -> dict[str, np.ndarray]:
    """What became of games of 41 turns: near at time 0, return, any advisory."""
    s = game.sample_initial_states(
        generate_uniforms(1, NATURE_STREAM, 0, rows=games, count=game.uniform_counts.start)
    )
    memory = policy.initial_memory(s)
    paid, alerted, near = np.zeros(games), np.zeros(games, bool), np.zeros(games, bool)
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
        paid += after.rewards[:, 0]
        memory = policy.update_memory(memory, Percept(a[:, 0], s, a, after.rewards[:, 0]))
    assert game.terminal(s).all()
    return {"near": near, "return": paid, "alerted": alerted}


def nmac(case: Case) -> None:
    game, name = branch(case.given["branch"]), case.given["policy"].replace(" ", "-")
    games = MANY_GAMES if name == "optimal" else GAMES
    seen = flown(game, dmplay.load_agent(game, 0, name), games)
    case.mean("nmac", seen["near"])
    case.mean("mean_return", seen["return"])
    share = float(seen["alerted"].mean())
    case.share(case.expect["alerted_share"], share, case.given["episodes"], games)


def branch(name: str) -> Problem:
    assert name in ("literal", "repaired")
    return LITERAL if name == "literal" else REPAIRED


@cache
def solution(name: str = "literal") -> Reals:
    return collision_grid.compute_optimal_q(branch(name))


def where(given: dict[str, Any]) -> tuple[int, int, slice, int]:
    """The grid slice over all heights that a case asks about."""
    rate = int(np.flatnonzero(given["hdot"] == CLIMB_RATES)[0])
    return given["tau"], ADVISED_RATES.tolist().index(given["a_prev"]), slice(None), rate


def best_rates(q: Reals) -> list[float]:
    return [float(rate) for rate in ADVISED_RATES[mark_best_actions(q)]]


def alerts(q: Reals) -> Bools:
    """Where an advisory is better than none."""
    return np.asarray(q[..., [0, 2]].max(axis=-1) > q[..., NO_ADVISORY] + VALUE_TOLERANCE)


def grid_slice(case: Case) -> None:
    q = solution()[where(case.given)]
    case.close("u", q.max(axis=1))
    case.close("q", q)
    assert [best_rates(row) for row in q] == case.expect["best"]


def grid_sum(case: Case) -> None:
    q = solution()[case.given["tau"]]
    case.close("sum_u", q.max(axis=-1).sum())
    case.close("sum_q", q.sum())
    case.close("alerts", alerts(q).sum())


def interpolated_q(case: Case) -> None:
    policy = dmplay.load_agent(LITERAL, 0, "optimal")
    memory = policy.initial_memory(np.array([case.given["state"]], float))
    q = policy.action_values(memory)
    assert q is not None
    case.close("q", q[0])
    assert best_rates(q[0]) == case.expect["best"]
    chosen = int(policy.choose(memory, None, np.zeros((1, 0)))[0])
    assert ADVISED_RATES[chosen] == case.expect["best"][0]


def figure_f9_extent(case: Case) -> None:
    _, a_prev, _, rate = where({**case.given, "tau": 0})
    alert = alerts(solution()[:, a_prev, :, rate])  # [41, 21]
    times, heights = np.flatnonzero(alert.any(axis=1)), HEIGHTS[alert.any(axis=0)]
    found = {
        "first_tau_with_advisory": times.min(),
        "last_tau_with_advisory": times.max(),
        "largest_h": heights.max(),
        "smallest_h": heights.min(),
    }
    for key in case.expect:
        case.close(key, found[key])


@cache
def earned(name: str) -> Reals:
    """What a policy earns from every point of the grid `[41, 3, 21, 21]`."""
    policy = dmplay.load_agent(LITERAL, 0, name)
    after, tables = np.zeros(collision_grid.GRID_SHAPE), []
    for time in collision_grid.TIMES_TO_COLLISION:
        s = collision_grid.make_grid_states(time)
        q = collision_grid.compute_action_values(LITERAL, time, after).reshape(len(s), -1)
        taken = policy.choose(policy.initial_memory(s), None, np.zeros((len(s), 0)))
        after = q[np.arange(len(s)), taken].reshape(collision_grid.GRID_SHAPE)
        tables.append(after)
    return np.stack(tables)


def grid_policy_value(case: Case) -> None:
    u = earned(case.given["policy"].replace(" ", "-"))
    case.close("u", u[where(case.given)])
    case.close("sum_u", u[case.given["tau"]].sum())


def grid_value_from_start(case: Case) -> None:
    u = solution(case.given["branch"])[-1, NO_ADVISORY].max(axis=-1)
    weights = np.ones(21)
    weights[[0, -1]] = 0.5
    case.close("value", weights @ u @ weights / weights.sum() ** 2)


KINDS = by_kind(
    step, nmac_no_advisory_exact, nmac, grid_slice, grid_sum, interpolated_q, figure_f9_extent,
    grid_policy_value, grid_value_from_start,
)  # fmt: skip
LATER: set[str] = set()

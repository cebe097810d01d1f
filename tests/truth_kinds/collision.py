import numpy as np

import dmplay
from dmplay.core import Percept, Policy, Problem, exact
from dmplay.dice import NATURE, uniforms
from dmplay.problems.collision_avoidance import FIRST_HEIGHT, FIRST_RATE, FIRST_TIME, RATES
from tests.truth_kinds.case import Case

LITERAL = dmplay.load("collision-avoidance")
REPAIRED = dmplay.load("collision-avoidance", repaired=True)
NO_ADVISORY = 1
GAMES = 20_000


def step(case: Case) -> None:
    s = np.array([case.given["state"]], float)
    a = np.array([[RATES.tolist().index(case.given["action"])]])
    p, after = exact(LITERAL, s, a)
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
    s, p = np.array([[0.0, 0.0, 0.0, FIRST_TIME]]), np.ones(1)
    while s[0, 3] > 0:
        weight, after = exact(LITERAL, s, np.full((len(s), 1), NO_ADVISORY))
        s, place = np.unique(after.state.reshape(-1, 4), axis=0, return_inverse=True)
        reaching = (p[:, None] * weight).reshape(-1)
        p = np.bincount(place.reshape(-1), reaching).astype(float)
    return s[:, 0], p


def below(x: np.ndarray) -> np.ndarray:
    """P(h0 + 40 dh0 < x): the distribution function of the sum of two uniforms."""
    narrow, wide = FIRST_HEIGHT, FIRST_TIME * FIRST_RATE
    corners = ((narrow + wide, 1), (narrow - wide, -1), (wide - narrow, -1), (-narrow - wide, 1))
    area = sum(sign * np.maximum(x + at, 0.0) ** 2 / 2 for at, sign in corners)
    return np.asarray(area / (4 * narrow * wide))


def nmac_no_advisory_exact(case: Case) -> None:
    shift, p = offsets()
    case.close("probability", p @ (below(50.0 - shift) - below(-50.0 - shift)))


def flown(game: Problem, policy: Policy, games: int) -> dict[str, np.ndarray]:
    """What became of games of 41 turns: near at time 0, return, any advisory."""
    s = game.start(uniforms(1, NATURE, 0, rows=games, count=game.draws.start))
    memory = policy.begin(s)
    paid, alerted, near = np.zeros(games), np.zeros(games, bool), np.zeros(games, bool)
    for turn in range(1, int(FIRST_TIME) + 2):
        near |= (s[:, 3] == 0) & (np.abs(s[:, 0]) < 50)
        a = policy.choose(memory, None, np.zeros((games, 0)))[:, None]
        alerted |= a[:, 0] != NO_ADVISORY
        after = game.step(s, a, uniforms(1, NATURE, turn, rows=games, count=game.draws.step))
        s = after.state
        paid += after.rewards[:, 0]
        memory = policy.update(memory, Percept(a[:, 0], s, a, after.rewards[:, 0]))
    assert game.terminal(s).all()
    return {"near": near, "return": paid, "alerted": alerted}


def nmac(case: Case) -> None:
    game = LITERAL if case.given["branch"] == "literal" else REPAIRED
    name = case.given["policy"].replace(" ", "-")
    if name == "optimal":
        return  # it waits for its solver
    seen = flown(game, dmplay.agent(game, 0, name), GAMES)
    case.mean("nmac", seen["near"])
    case.mean("mean_return", seen["return"])
    share = float(seen["alerted"].mean())
    case.share(case.expect["alerted_share"], share, case.given["episodes"], GAMES)


KINDS = {
    "step": step,
    "nmac_no_advisory_exact": nmac_no_advisory_exact,
    "nmac": nmac,
}
LATER = {
    "grid_slice",
    "grid_sum",
    "grid_policy_value",
    "interpolated_q",
    "figure_f9_extent",
    "grid_value_from_start",
}

from functools import cache

import numpy as np

import dmplay
from dmplay.core import Policy, Problem
from tests.truth_kinds.case import Case, by_kind, family
from tests.truth_kinds.course import courses

DYNAMICS = ("text", "gym")
LIMITS = {"gym": (2.4, 12.0), "julia": (4.8, 24.0)}
POLICIES = {
    "always_left": "always-left",
    "always_right": "always-right",
    "alternate_left_first": "alternate",
    "alternate_right_first": "alternate:first=right",
    "push_towards_lean": "balance:x=0,v=0,theta=1,omega=0",
    "push_by_theta_plus_omega": "balance:x=0,v=0,theta=1,omega=1",
    "linear_feedback": "balance:x=0.1,v=0.2,theta=1,omega=0.5",
}
GAMES = 2000
NO_CAP = 10_000


def problem(dynamics: str, limits: str = "gym") -> Problem:
    name = "cart-pole" if dynamics == "text" else "cart-pole:gym"
    x, theta = LIMITS[limits]
    return dmplay.load_problem(name, x_limit=x, theta_limit=theta)


def policy(game: Problem, name: str) -> Policy:
    return dmplay.load_agent(game, 0, POLICIES[name])


def step(case: Case) -> None:
    s = np.array([case.given["state"]], float)
    for dynamics in DYNAMICS:
        told = case.expect[dynamics]
        for limits, over in told["next_terminal"].items():
            game = problem(dynamics, limits)
            labels = game.actions[0].labels
            after = game.step(s, np.array([[labels.index(case.given["action"])]]), np.zeros((1, 0)))
            case.equal(told["next"], after.state[0])
            assert game.terminal(after.state)[0] == over
            case.close("reward", after.rewards[0, 0])


def terminal(case: Case) -> None:
    s = np.array([case.given["state"]], float)
    for limits, told in case.expect.items():
        game = problem("text", limits)
        assert game.terminal(s)[0] == told["terminal"]
        for push in (0, 1):
            after = game.step(s, np.array([[push]]), np.zeros((1, 0)))
            assert after.rewards[0, 0] == told["reward"]
            assert (after.state == s).all() or not told["terminal"]


def episode_length(case: Case) -> None:
    for dynamics, by_limits in case.expect["steps"].items():
        found = lengths(case.given["policy"], case.given["cap"], dynamics)
        for limits, steps in by_limits.items():
            assert found[limits][tuple(case.given["start"])] == steps


@cache
def lengths(name: str, cap: int, dynamics: str) -> dict[str, dict[tuple[float, ...], float]]:
    """How long the games last that some case asks of this policy, all played at once.

    Limits move nothing: they are looked at along one course, which ends at the widest.
    """
    given = [case["given"] for case in family("cartpole")["cases"]]
    asked = [one for one in given if (one.get("policy"), one.get("cap")) == (name, cap)]
    starts = [one["start"] for one in asked]
    widest = problem(dynamics, "julia")
    played = [*courses(widest, policy(widest, name), starts, cap)]
    before = [np.array(starts), *(s for s, _ in played[:-1])]
    paid = {limits: alive(problem(dynamics, limits), before) for limits in LIMITS}
    assert (paid["julia"] == np.sum([pay for _, pay in played], axis=0)).all()
    return {
        limits: dict(zip(map(tuple, starts), turns.tolist(), strict=True))
        for limits, turns in paid.items()
    }


def alive(game: Problem, states: list[np.ndarray]) -> np.ndarray:
    """In how many of these states each game goes on."""
    going = [~game.terminal(s) for s in states]
    turns: np.ndarray = np.sum(np.logical_and.accumulate(going), axis=0)
    return turns


def mean_policy_length(case: Case) -> None:
    game = problem(case.given["dynamics"], case.given["limits"])
    player = policy(game, case.given["policy"])
    played = dmplay.rollout(game, [player], episodes=GAMES, turn_limit=NO_CAP, seed=1)
    case.mean("mean", played.turn_counts, episodes=4000)


def random_policy_length(case: Case) -> None:
    game = problem(case.given["dynamics"], case.given["limits"])
    player = dmplay.load_agent(game, 0, "random")
    played = dmplay.rollout(game, [player], episodes=GAMES, turn_limit=NO_CAP, seed=2)
    case.mean("mean", played.total_rewards[:, 0])


KINDS = by_kind(
    step, terminal, episode_length, mean_policy_length, random_policy_length,
)  # fmt: skip
LATER: set[str] = set()

from functools import cache

import numpy as np

import dmplay
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from tests.truth_cases.case import Case, load_family, map_by_kind
from tests.truth_cases.deterministic_trajectory import iterate_games

DYNAMICS = ("text", "gym")
TERMINAL_LIMITS = {"gym": (2.4, 12.0), "julia": (4.8, 24.0)}
POLICIES = {
    "always_left": "always-left",
    "always_right": "always-right",
    "alternate_left_first": "alternate",
    "alternate_right_first": "alternate:first=right",
    "push_towards_lean": "balance:x=0,v=0,theta=1,omega=0",
    "push_by_theta_plus_omega": "balance:x=0,v=0,theta=1,omega=1",
    "linear_feedback": "balance:x=0.1,v=0.2,theta=1,omega=0.5",
}
GAME_COUNT = 2000
MAX_TURNS = 10_000


def load_problem(dynamics: str, limits: str = "gym") -> Problem:
    name = "cart-pole" if dynamics == "text" else "cart-pole:gym"
    x, theta = TERMINAL_LIMITS[limits]
    return dmplay.load_problem(name, x_limit=x, theta_limit=theta)


def load_policy(game: Problem, name: str) -> Policy:
    return dmplay.load_agent(game, 0, POLICIES[name])


def step(case: Case) -> None:
    s = np.array([case.inputs["state"]], float)
    for dynamics in DYNAMICS:
        expected = case.expect[dynamics]
        for limits, is_terminal in expected["next_terminal"].items():
            game = load_problem(dynamics, limits)
            labels = game.actions[0].labels
            after = game.step(
                s, np.array([[labels.index(case.inputs["action"])]]), np.zeros((1, 0))
            )
            case.equal(expected["next"], after.state[0])
            assert game.terminal(after.state)[0] == is_terminal
            case.close("reward", after.rewards[0, 0])


def terminal(case: Case) -> None:
    s = np.array([case.inputs["state"]], float)
    for limits, expected in case.expect.items():
        game = load_problem("text", limits)
        assert game.terminal(s)[0] == expected["terminal"]
        for push in (0, 1):
            after = game.step(s, np.array([[push]]), np.zeros((1, 0)))
            assert after.rewards[0, 0] == expected["reward"]
            assert (after.state == s).all() or not expected["terminal"]


def episode_length(case: Case) -> None:
    for dynamics, by_limits in case.expect["steps"].items():
        lengths_by_limits = compute_game_lengths(
            case.inputs["policy"], case.inputs["cap"], dynamics
        )
        for limits, steps in by_limits.items():
            assert lengths_by_limits[limits][tuple(case.inputs["start"])] == steps


@cache
def compute_game_lengths(
    name: str, cap: int, dynamics: str
) -> dict[str, dict[tuple[float, ...], float]]:
    """Return the game lengths of a policy for each start in the cases, by limits.

    All games are played at once. The limits do not affect the dynamics, so one course up to the
    widest limits serves all of them.
    """
    inputs_of_cases = [case["given"] for case in load_family("cartpole")["cases"]]
    matching = [
        inputs
        for inputs in inputs_of_cases
        if (inputs.get("policy"), inputs.get("cap")) == (name, cap)
    ]
    starts = [inputs["start"] for inputs in matching]
    widest = load_problem(dynamics, "julia")
    turns_played = [*iterate_games(widest, load_policy(widest, name), starts, cap)]
    before = [np.array(starts), *(s for s, _ in turns_played[:-1])]
    lengths_by_limits = {
        limits: count_turns_alive(load_problem(dynamics, limits), before)
        for limits in TERMINAL_LIMITS
    }
    assert (lengths_by_limits["julia"] == np.sum([pay for _, pay in turns_played], axis=0)).all()
    return {
        limits: dict(zip(map(tuple, starts), lengths.tolist(), strict=True))
        for limits, lengths in lengths_by_limits.items()
    }


def count_turns_alive(game: Problem, states: list[np.ndarray]) -> np.ndarray:
    """Count the leading states of each game that are not terminal."""
    alive_by_turn = [~game.terminal(s) for s in states]
    turns: np.ndarray = np.sum(np.logical_and.accumulate(alive_by_turn), axis=0)
    return turns


def mean_policy_length(case: Case) -> None:
    game = load_problem(case.inputs["dynamics"], case.inputs["limits"])
    player = load_policy(game, case.inputs["policy"])
    batch = dmplay.rollout(game, [player], episodes=GAME_COUNT, turn_limit=MAX_TURNS, seed=1)
    case.mean("mean", batch.turn_counts, episodes=4000)


def random_policy_length(case: Case) -> None:
    game = load_problem(case.inputs["dynamics"], case.inputs["limits"])
    player = dmplay.load_agent(game, 0, "random")
    batch = dmplay.rollout(game, [player], episodes=GAME_COUNT, turn_limit=MAX_TURNS, seed=2)
    case.mean("mean", batch.total_rewards[:, 0])


KINDS = map_by_kind(
    step, terminal, episode_length, mean_policy_length, random_policy_length,
)  # fmt: skip
LATER: set[str] = set()

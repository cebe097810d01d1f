"""Tests of control variates: they average to zero, and without them only the actions matter."""

import numpy as np

import dmplay
from dmplay.core.policy import Policy
from dmplay.evaluation.comparison import compare
from dmplay.evaluation.control_variate import build_control_variate
from dmplay.simulation.rollouts import Rollout, RolloutSpec, rollout_entrants
from tests.benchmarks import interval_coverage

HEXWORLD = dmplay.load_problem("hexworld")
OPTIMAL_POLICIES, RANDOM_POLICIES = (
    [dmplay.load_agent(HEXWORLD, 0, name)] for name in ("optimal", "random")
)


def play_entrants(*entrants: list[Policy], episodes: int = 200) -> tuple[Rollout, ...]:
    games = RolloutSpec(
        range(episodes), keep=Rollout._fields, control_variate=build_control_variate(HEXWORLD)
    )
    return rollout_entrants(HEXWORLD, entrants, games)


def test_optimal_play_minus_the_control_variate_earns_the_start_value() -> None:
    best, other = play_entrants(OPTIMAL_POLICIES, RANDOM_POLICIES)
    control_variate = build_control_variate(HEXWORLD)
    assert control_variate
    optimal_merit, random_merit = (
        entrant.returns - entrant.control_variates for entrant in (best, other)
    )
    start_values = {round(value, 6) for value in control_variate.q_values.max(axis=1)}
    assert {round(value, 6) for value in optimal_merit[:, 0]} <= start_values
    assert (random_merit < optimal_merit + 1e-9).all()
    assert optimal_merit.var() < best.returns.var()


def test_the_control_variate_averages_to_zero() -> None:
    for result in play_entrants(OPTIMAL_POLICIES, RANDOM_POLICIES, episodes=1000):
        error = result.control_variates.std() / np.sqrt(len(result.control_variates))
        assert 0 < abs(result.control_variates.mean()) < 3 * error


def test_control_variates_exist_for_single_agents_with_few_states() -> None:
    assert all(
        map(build_control_variate, map(dmplay.load_problem, ("hexworld", "crying-baby", "catch")))
    )
    others = ("2048", "mountain-car", "simple-regulator", "prisoners-dilemma", "predator-prey")
    assert not any(map(build_control_variate, map(dmplay.load_problem, others)))


def test_the_control_variate_saves_games_and_keeps_the_exact_difference() -> None:
    case = next(interval_coverage.iter_cases())
    comparison = compare(HEXWORLD, [OPTIMAL_POLICIES, RANDOM_POLICIES], episodes=400)
    difference = comparison.differences[0, 1]
    assert difference.advantage.low <= case.exact - case.worth <= difference.advantage.high
    separate = comparison.returns.var(axis=0).sum()
    paired = np.subtract(*comparison.returns.T).var()
    assert difference.games_saved_factor > 1.1 * separate / paired


def test_agents_with_equal_actions_are_never_decided_apart() -> None:
    """Rounding leaves no difference that could be decided."""
    comparison = compare(
        HEXWORLD,
        [OPTIMAL_POLICIES, [dmplay.load_agent(HEXWORLD, 0, "search:simulations=5")]],
        episodes=50,
    )
    same = compare(HEXWORLD, [OPTIMAL_POLICIES, OPTIMAL_POLICIES], episodes=200, decide=0.05)
    assert comparison.differences[0, 1].control_variate_difference != 0.0
    assert (same.decided, same.differences[0, 1].advantage.mean) == (False, 0.0)

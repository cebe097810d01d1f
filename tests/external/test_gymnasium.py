"""Tests of Gymnasium environments as problems."""

from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.core.problem import ContinuousStates
from dmplay.core.spaces import Interval, RealVector
from dmplay.core.tabular import tabulate
from dmplay.core.work_budget import report_progress_to
from dmplay.errors import BadParameter, UnknownName
from dmplay.evaluation.solutions import simulated_returns
from dmplay.evaluation.solutions.options import SolveOptions, use_solve_options
from dmplay.evaluation.solutions.solution import Solution
from dmplay.evaluation.solutions.solve import solve_problem
from dmplay.external.gymnasium import GymnasiumTableProblem
from dmplay.registry import problems
from dmplay.validation.conformance import check
from tests.support.external_problems import check_external_problem

pytestmark = pytest.mark.extra("gymnasium")

ENVIRONMENTS = (
    "FrozenLake-v1", "FrozenLake8x8-v1", "CliffWalking-v1", "CliffWalkingSlippery-v1", "Taxi-v4",
    "Blackjack-v1", "CartPole-v0", "CartPole-v1", "MountainCar-v0", "MountainCarContinuous-v0",
    "Pendulum-v1", "Acrobot-v1",
)  # fmt: skip
FAST_ENVIRONMENTS = ("FrozenLake-v1", "CartPole-v1", "Pendulum-v1")
FROZEN_LAKE = "gymnasium:FrozenLake-v1"


@pytest.mark.parametrize(
    ("names", "turns"),
    [(FAST_ENVIRONMENTS, 8), pytest.param(ENVIRONMENTS, 60, marks=pytest.mark.slow)],
)
def test_environments_can_be_played_recorded_undone_and_verified(
    names: tuple[str, ...], turns: int, tmp_path: Path
) -> None:
    results = [
        check_external_problem(f"gymnasium:{name}", tmp_path / "game.dmt", turns) for name in names
    ]
    assert [result for result in results if result.refused] == []
    assert len(results) >= (11 if names is ENVIRONMENTS else 3)


@pytest.mark.slow
def test_environments_satisfy_every_invariant() -> None:
    assert {name: check(dmplay.load_problem(f"gymnasium:{name}")) for name in ENVIRONMENTS} == {
        name: [] for name in ENVIRONMENTS
    }


def iterate_values(discount: float) -> list[float]:
    """Compute the values of the frozen lake's states from the environment's transition table."""
    from gymnasium.envs.toy_text.frozen_lake import FrozenLakeEnv

    table, values = FrozenLakeEnv().P, [0.0] * 16
    for _ in range(300):
        values = [
            max(
                sum(
                    p * (reward + discount * values[s2] * (not over)) for p, s2, reward, over in row
                )
                for row in table[s].values()
            )
            for s in range(16)
        ]
    return values


def test_an_environment_with_a_transition_table_is_an_exact_tabular_problem() -> None:
    lake = dmplay.load_problem(FROZEN_LAKE, discount=0.95)
    assert (lake.kind, lake.state_count, lake.horizon) == ("MDP", 16 + 5, 100)
    tables = tabulate(lake)
    assert np.allclose(tables.transition.sum(axis=2), 1.0)
    down = tables.transition[0, 1]
    assert np.flatnonzero(down).tolist() == [0, 1, 4]
    assert np.allclose(down[[0, 1, 4]], 1 / 3)
    policy = dmplay.load_agent(lake, 0, "optimal")
    values = policy.action_values(policy.initial_memory(np.arange(16)))
    assert values is not None
    assert values.max(axis=1) == pytest.approx(iterate_values(0.95), abs=1e-6)
    assert lake.format_state(np.array(20)) == "15 over"
    assert lake.parse_state("15 over") == 20
    assert lake.parse_state("15") == 15


def test_a_rendered_state_has_the_environment_s_colors() -> None:
    lake = dmplay.load_problem(FROZEN_LAKE)
    assert isinstance(lake, GymnasiumTableProblem)
    assert lake.draw_state(np.array(4)) == "SFFF\n\x1b[41mF\x1b[0mHFH\nFFFH\nHFFG"
    assert lake.draw_state(np.array(20)) == "SFFF\nFHFH\nFFFH\nHFF\x1b[41mG\x1b[0m"


def test_observations_are_numbers_and_rewards_are_visible() -> None:
    cart = dmplay.load_problem("gymnasium:CartPole-v1")
    assert cart.observations == (RealVector(4),)
    assert not isinstance(cart.state_count, ContinuousStates)
    view = dmplay.Session(cart, dmplay.SeededUniforms(3)).view(0)
    assert np.abs(view.observation).max() <= 0.05
    game = dmplay.Session(cart, dmplay.SeededUniforms(3))
    game.advance([1])
    assert [*(game.view(0).rewards or ())] == [1.0]
    assert dmplay.load_problem("gymnasium:Pendulum-v1").actions == (Interval(-2.0, 2.0),)


def test_the_arguments_of_an_environment_are_part_of_its_name() -> None:
    lake = dmplay.load_problem(f"{FROZEN_LAKE}(is_slippery=False,map_name=8x8)")
    assert lake.state_count == 64 + 11
    assert (tabulate(lake).transition.max(axis=2) == 1.0).all()
    resolved = problems.resolve_problem(FROZEN_LAKE, {})
    assert resolved.origin.startswith("gymnasium 1.")
    assert resolved.parameters == {}


def test_an_invalid_environment_is_an_error_of_one_line() -> None:
    with pytest.raises(UnknownName, match="gymnasium: unknown environment 'FrozenLake-1'; did"):
        dmplay.load_problem("gymnasium:FrozenLake-1")
    with pytest.raises(BadParameter, match=r"gymnasium:FrozenLake-v1\(slip=1\): .*argument 'slip'"):
        dmplay.load_problem(f"{FROZEN_LAKE}(slip=1)")
    with pytest.raises(BadParameter, match=r"got 'slip', expected KEY=VALUE"):
        dmplay.load_problem(f"{FROZEN_LAKE}(slip)")
    with pytest.raises(BadParameter, match="expected a name, or NAME"):
        dmplay.load_problem("gymnasium:")


def test_real_actions_have_no_labels_in_a_view() -> None:
    session = dmplay.Session(dmplay.load_problem("gymnasium:Pendulum-v1"), dmplay.SeededUniforms(1))
    session.advance([0.5])
    assert list(session.view(0).past_action_labels) == []


def solve_pendulum(options: SolveOptions) -> tuple[Solution, list[float]]:
    """Return the solution of the pendulum and the shares of the work that were reported."""
    shares = list[float]()
    pendulum = dmplay.load_problem("gymnasium:Pendulum-v1")
    with use_solve_options(options), report_progress_to(shares.append):
        return solve_problem(pendulum), shares


def test_long_games_of_an_environment_are_simulated_in_a_bounded_number_of_turns(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(simulated_returns, "MAX_EXTERNAL_TURNS", 300)
    solution, shares = solve_pendulum(SolveOptions(turns=20))
    assert solution.method == (
        "not a solution, but a simulation of random play, "
        "because dmplay has no exact solution for it"
    )
    assert solution.result == "20 games with seed 1, 20 turns on average"
    assert shares == sorted(shares)
    assert len(shares) > 20
    assert 0.9 < shares[-1] <= 1.0


def test_the_requested_games_of_an_environment_are_all_simulated(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(simulated_returns, "MAX_EXTERNAL_TURNS", 30)
    solution, _ = solve_pendulum(SolveOptions(turns=5, episodes=23))
    assert solution.result == "23 games with seed 1, 5 turns on average"

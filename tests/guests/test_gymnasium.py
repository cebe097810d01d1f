"""Environments of Gymnasium are played as what they are."""

from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.conformance import check
from dmplay.core import ContinuousStates, Interval, RealVector
from dmplay.errors import BadParameter, UnknownName
from dmplay.finding import problems
from dmplay.guests.gymnasium import GymnasiumTableProblem
from dmplay.tabular import tabulate
from tests.support.guests import tried

PLAYED = (
    "FrozenLake-v1", "FrozenLake8x8-v1", "CliffWalking-v1", "CliffWalkingSlippery-v1", "Taxi-v4",
    "Blackjack-v1", "CartPole-v0", "CartPole-v1", "MountainCar-v0", "MountainCarContinuous-v0",
    "Pendulum-v1", "Acrobot-v1",
)  # fmt: skip
FEW = ("FrozenLake-v1", "CartPole-v1", "Pendulum-v1")
LAKE = "gymnasium:FrozenLake-v1"


@pytest.mark.parametrize(
    ("names", "turns"), [(FEW, 8), pytest.param(PLAYED, 60, marks=pytest.mark.slow)]
)
def test_they_play_record_undo_and_verify(
    names: tuple[str, ...], turns: int, tmp_path: Path
) -> None:
    found = [tried(f"gymnasium:{name}", tmp_path / "game.dmt", turns) for name in names]
    assert [one for one in found if one.refused] == []
    assert len(found) >= (11 if names is PLAYED else 3)


@pytest.mark.slow
def test_they_keep_every_law() -> None:
    assert {name: check(dmplay.load_problem(f"gymnasium:{name}")) for name in PLAYED} == {
        name: [] for name in PLAYED
    }


def iterated(discount: float) -> list[float]:
    """What the states of the lake are worth, from the environment's own table."""
    from gymnasium.envs.toy_text.frozen_lake import FrozenLakeEnv

    table, worth = FrozenLakeEnv().P, [0.0] * 16
    for _ in range(300):
        worth = [
            max(
                sum(p * (reward + discount * worth[s2] * (not over)) for p, s2, reward, over in row)
                for row in table[s].values()
            )
            for s in range(16)
        ]
    return worth


def test_one_that_tells_its_tables_is_known_as_exactly_as_a_problem_of_arrays() -> None:
    lake = dmplay.load_problem(LAKE, discount=0.95)
    assert (lake.kind, lake.state_count, lake.horizon) == ("MDP", 16 + 5, 100)
    tables = tabulate(lake)
    assert np.allclose(tables.transition.sum(axis=2), 1.0)
    down = tables.transition[0, 1]
    assert np.flatnonzero(down).tolist() == [0, 1, 4]
    assert np.allclose(down[[0, 1, 4]], 1 / 3)
    best = dmplay.load_agent(lake, 0, "optimal")
    values = best.action_values(best.initial_memory(np.arange(16)))
    assert values is not None
    assert values.max(axis=1) == pytest.approx(iterated(0.95), abs=1e-6)
    assert lake.format_state(np.array(20)) == "15 over"
    assert lake.parse_state("15 over") == 20
    assert lake.parse_state("15") == 15


def test_it_draws_itself_with_its_colours_and_never_moves() -> None:
    lake = dmplay.load_problem(LAKE)
    assert isinstance(lake, GymnasiumTableProblem)
    assert lake.draw_state(np.array(4)) == "SFFF\n\x1b[41mF\x1b[0mHFH\nFFFH\nHFFG"
    assert lake.draw_state(np.array(20)) == "SFFF\nFHFH\nFFFH\nHFF\x1b[41mG\x1b[0m"


def test_what_is_observed_are_numbers_and_rewards_are_told() -> None:
    cart = dmplay.load_problem("gymnasium:CartPole-v1")
    assert cart.observations == (RealVector(4),)
    assert not isinstance(cart.state_count, ContinuousStates)
    view = dmplay.Session(cart, dmplay.SeededUniforms(3)).view(0)
    assert np.abs(view.observation).max() <= 0.05
    game = dmplay.Session(cart, dmplay.SeededUniforms(3))
    game.advance([1])
    assert [*(game.view(0).rewards or ())] == [1.0]
    assert dmplay.load_problem("gymnasium:Pendulum-v1").actions == (Interval(-2.0, 2.0),)


def test_what_it_is_made_with_stands_in_its_name() -> None:
    firm = dmplay.load_problem(f"{LAKE}(is_slippery=False,map_name=8x8)")
    assert firm.state_count == 64 + 11
    assert (tabulate(firm).transition.max(axis=2) == 1.0).all()
    found = problems.resolve_problem(LAKE, {})
    assert found.origin.startswith("gymnasium 1.")
    assert found.parameters == {}


def test_what_cannot_be_played_is_said_in_a_line() -> None:
    with pytest.raises(UnknownName, match="gymnasium: unknown environment 'FrozenLake-1'; did"):
        dmplay.load_problem("gymnasium:FrozenLake-1")
    with pytest.raises(BadParameter, match=r"gymnasium:FrozenLake-v1\(slip=1\): .*argument 'slip'"):
        dmplay.load_problem(f"{LAKE}(slip=1)")
    with pytest.raises(BadParameter, match=r"got 'slip', expected KEY=VALUE"):
        dmplay.load_problem(f"{LAKE}(slip)")
    with pytest.raises(BadParameter, match="expected a name, or NAME"):
        dmplay.load_problem("gymnasium:")

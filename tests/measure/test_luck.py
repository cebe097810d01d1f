"""What is luck in a game: nothing on average, and without it only the merit of moves is left."""

import numpy as np

import dmplay
from dmplay.core import Policy
from dmplay.measure.comparing import compare
from dmplay.measure.luck import build_control_variate
from dmplay.rollouts import Rollout, RolloutSpec, rollout_entrants
from tests.benchmarks import honest

HEX = dmplay.load_problem("hexworld")
OPTIMAL, RANDOM = ([dmplay.load_agent(HEX, 0, name)] for name in ("optimal", "random"))


def played(*entrants: list[Policy], episodes: int = 200) -> tuple[Rollout, ...]:
    games = RolloutSpec(
        range(episodes), keep=Rollout._fields, control_variate=build_control_variate(HEX)
    )
    return rollout_entrants(HEX, entrants, games)


def test_without_luck_a_game_of_the_best_moves_is_worth_what_its_start_is() -> None:
    best, other = played(OPTIMAL, RANDOM)
    judge = build_control_variate(HEX)
    assert judge
    merit, random = (one.returns - one.control_variates for one in (best, other))
    worth = {round(value, 6) for value in judge.q_values.max(axis=1)}
    assert {round(value, 6) for value in merit[:, 0]} <= worth
    assert (random < merit + 1e-9).all()
    assert merit.var() < best.returns.var()


def test_luck_is_nothing_on_average() -> None:
    for one in played(OPTIMAL, RANDOM, episodes=1000):
        error = one.control_variates.std() / np.sqrt(len(one.control_variates))
        assert 0 < abs(one.control_variates.mean()) < 3 * error


def test_luck_is_told_where_one_agent_plays_among_few_states() -> None:
    assert all(
        map(build_control_variate, map(dmplay.load_problem, ("hexworld", "crying-baby", "catch")))
    )
    others = ("2048", "mountain-car", "simple-regulator", "prisoners-dilemma", "predator-prey")
    assert not any(map(build_control_variate, map(dmplay.load_problem, others)))


def test_what_was_luck_saves_games_and_holds_the_exact_difference() -> None:
    case = next(honest.cases())
    found = compare(HEX, [OPTIMAL, RANDOM], episodes=400)
    one = found.differences[0, 1]
    assert one.advantage.low <= case.exact - case.worth <= one.advantage.high
    alone, paired = found.returns.var(axis=0).sum(), np.subtract(*found.returns.T).var()
    assert one.games_saved_factor > 1.1 * alone / paired


def test_agents_of_equal_moves_are_never_told_apart() -> None:
    """Rounding leaves no difference that could be decided."""
    found = compare(
        HEX, [OPTIMAL, [dmplay.load_agent(HEX, 0, "search:simulations=5")]], episodes=50
    )
    same = compare(HEX, [OPTIMAL, OPTIMAL], episodes=200, decide=0.05)
    assert found.differences[0, 1].control_variate_difference != 0.0
    assert (same.decided, same.differences[0, 1].advantage.mean) == (False, 0.0)

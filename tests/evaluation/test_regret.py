"""The mean regret of many games, by the best play beside the other policies."""

import json
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem, make_initial_observation
from dmplay.core.uniforms import NATURE_STREAM, generate_uniforms
from dmplay.evaluation.regret import find_regret_meters
from dmplay.registry.agents import HintAgent, load_roster
from dmplay.registry.builtin_names import problem_names
from tests.support.programs import run_dmplay

GAMES = 600
# no exact values in the default game: an estimate or a rating
UNKNOWN_REGRETS = {"2048", "cart-pole", "collision-avoidance", "mountain-car"}
BOUNDED_REGRETS = {"collaborative-predator-prey"}  # bounds that are tested with few turns


def load_policies(problem: Problem) -> list[Policy]:
    """Return a random agent, and the default partners of a problem."""
    partners = (load_roster(problem, seat).default_partner for seat in range(len(problem.agents)))
    names = ["random", *[*partners][1:]]
    return [dmplay.load_agent(problem, seat, name) for seat, name in enumerate(names)]


def find_meter(problem: Problem, policies: list[Policy], turns: int | None) -> HintAgent:
    """Return the agent that values the choices of the first seat."""
    meter = find_regret_meters(problem, policies, turns)[0]
    assert meter is not None
    return meter


def list_start_values(problem: Problem, meter: HintAgent, seed: int) -> np.ndarray:
    """Return a lower and an upper bound `[2, E]` of the best return from the starts of games."""
    count = problem.uniform_counts.start
    u = generate_uniforms(seed, NATURE_STREAM, 0, first_episode=0, rows=GAMES, count=count)
    state = problem.sample_initial_states(u)
    memory = meter.policy.initial_memory(make_initial_observation(problem, state, 0))
    legal = problem.legal_actions_mask(state)
    if problem.actions[0].labels:
        values = meter.policy.state_values(memory, None if legal is None else legal[:, 0])
        return np.stack([values, values])
    bounds = meter.policy.value_bounds(memory, meter.policy.choose(memory, None, np.zeros((0, 0))))
    return np.array(bounds)


@pytest.mark.parametrize("name", sorted({*problem_names()} - UNKNOWN_REGRETS - BOUNDED_REGRETS))
def test_random_play_loses_its_regret_and_the_best_play_nothing(name: str) -> None:
    problem = dmplay.load_problem(name)
    policies = load_policies(problem)
    result = dmplay.run(problem, policies, episodes=GAMES, seed=3, regret=True)
    meter = find_meter(problem, policies, None)
    low, high = list_start_values(problem, meter, 3)
    regrets = result.rollout.regrets[:, 0, 0]
    returns = result.rollout.returns[:, 0]
    # the luck of a game, which is 0 on average
    highest, lowest = returns - (low - regrets[:, 1]), returns - (high - regrets[:, 0])
    error = 4 * highest.std() / GAMES**0.5 + 1e-6
    assert lowest.mean() - error <= 0.0 <= highest.mean() + error
    assert result.seat_summaries[0].returns.mean < low.mean() - error
    best = dmplay.run(problem, [meter.policy, *policies[1:]], episodes=50, regret=True)
    assert not best.rollout.regrets[:, 0].any()
    # each game has the same regret, whichever games are played together
    first = dmplay.run(problem, policies, episodes=7, seed=3, regret=True).rollout
    assert np.array_equal(first.regrets, result.rollout.regrets[:7])
    assert np.array_equal(first.choice_counts, result.rollout.choice_counts[:7])


@pytest.mark.parametrize("name", sorted(UNKNOWN_REGRETS))
def test_without_exact_values_there_is_a_reason_in_place_of_the_regret(name: str) -> None:
    problem = dmplay.load_problem(name)
    result = dmplay.run(problem, load_policies(problem), episodes=3, turns=5, regret=True)
    (regret, *_) = [summary.regret for summary in result.seat_summaries]
    assert regret is not None
    assert regret.per_game is None
    assert regret.basis.startswith("the values of ")


def test_the_regret_beside_a_partner_whose_rule_is_known_has_bounds() -> None:
    problem = dmplay.load_problem("collaborative-predator-prey:triangle")
    players = [dmplay.load_agent(problem, seat, "random") for seat in range(2)]
    bounds = []
    for turns in (1, 2, 4):
        result = dmplay.run(problem, players, episodes=40, turns=turns, regret=True)
        regret = result.seat_summaries[0].regret
        assert regret is not None
        assert regret.per_game is not None
        bounds.append([estimate.mean for estimate in regret.per_game])
    assert bounds[0] == [0.0, 0.0]  # no action changes the reward of its own turn
    assert all(0.0 <= low <= high for low, high in bounds)
    assert bounds[2][1] > 0.0


def test_the_regret_per_choice_is_that_of_all_choices_together() -> None:
    problem = dmplay.load_problem("hexworld")
    agent = dmplay.load_agent(problem, 0, "random")
    result = dmplay.run(problem, [agent], episodes=200, regret=True)
    regret, rollout = result.seat_summaries[0].regret, result.rollout
    assert regret is not None
    assert regret.is_exact
    assert regret.per_choice is not None
    assert np.array_equal(rollout.choice_counts[:, 0], rollout.turn_counts)
    total = rollout.regrets[:, 0, 1, 0].sum()
    assert regret.per_choice[0].mean == pytest.approx(total / rollout.turn_counts.sum())


def test_the_report_has_the_regret_of_each_seat_or_a_reason(tmp_path: Path) -> None:
    words = (
        "prisoners-dilemma",
        "--agent",
        "grim",
        "--vs",
        "search",
        "--turns",
        "2",
        "--episodes",
        "2",
    )
    text = run_dmplay(tmp_path, "run", *words, "--regret").stdout
    assert "no regret of agent1: the values of plan-rounds are not about this game (if" in text
    assert "regret of agent2, exact, by plan-rounds, 2 turns left, against grim: 0 " in text
    rows = json.loads(run_dmplay(tmp_path, "run", *words, "--regret", "--json").stdout)["runs"]
    assert [row["regret"] for row in rows] == [None, 0.0]
    assert (
        "regret" not in json.loads(run_dmplay(tmp_path, "run", *words, "--json").stdout)["runs"][0]
    )

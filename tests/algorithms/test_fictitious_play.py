"""Fictitious play: counts, best responses and frequencies, round by round."""

from itertools import pairwise

import numpy as np
import pytest

import dmplay
from dmplay.algorithms.fictitious_play import ALGORITHM
from dmplay.algorithms.step import Step, StrategyMixes, WatchRequest
from dmplay.core.problem import Problem
from dmplay.formats import gambit_nfg
from dmplay.solvers.games import bimatrix_game, regret_matching, zero_sum
from tests.support.formulas import assert_formula_adds_up
from tests.support.problem_cases import CASE_NAMES, load_problem
from tests.support.random_problems import Large

THREE_PLAYERS_TEXT = (
    'NFG 1 R "" {"a" "b" "c"} {2 2 2} 3 1 0 0 2 1 1 1 1 2 0 4 0 0 1 2 2 5 1 3 0 1 1 1'
)


def watch(problem: Problem, rounds: int, seed: int = 0) -> list[Step]:
    return list(ALGORITHM.iterate_steps(WatchRequest(problem, iterations=rounds, seed=seed)))


def read_mixes(step: Step) -> StrategyMixes:
    picture = step.pictures[0]
    assert isinstance(picture, StrategyMixes)
    return picture


def load_game(name: str) -> Problem:
    if name == "three.nfg":
        return gambit_nfg.read_nfg("three.nfg", THREE_PLAYERS_TEXT.encode())
    return Large() if name == "large" else dmplay.load_problem(name)


every_game = pytest.mark.parametrize(
    "name", ["prisoners-dilemma", "rock-paper-scissors", "travelers-dilemma", "three.nfg", "large"]
)


def test_only_the_matrix_games_of_the_book_fit() -> None:
    fitting = [name for name in CASE_NAMES if not ALGORITHM.explain_misfit(load_problem(name))]
    assert fitting == ["prisoners-dilemma", "rock-paper-scissors", "travelers-dilemma"]
    assert ALGORITHM.explain_misfit(load_problem("hexworld")) == (
        "fictitious play needs at least two agents, but this problem has one"
    )
    assert ALGORITHM.explain_misfit(load_problem("predator-prey")) == (
        "fictitious play needs a game of one state, played in rounds, "
        "but this problem has more states"
    )


@every_game
def test_each_mix_is_the_frequency_of_the_actions_played(name: str) -> None:
    problem = load_game(name)
    steps = [read_mixes(step) for step in watch(problem, 20)]
    counts = [np.ones(action_count) for action_count in problem.action_counts]
    for before, after in pairwise(steps[1:]):
        for seat, action in enumerate(before.best_responses):
            counts[seat][action] += 1
            first_action = int(np.argmax(steps[1].mixes[seat] > steps[0].mixes[seat]))
            played = counts[seat] + np.eye(len(counts[seat]))[first_action]
            assert after.mixes[seat] == pytest.approx(played / played.sum())


@every_game
def test_each_next_action_is_a_best_response_by_the_solver(name: str) -> None:
    problem = load_game(name)
    payoffs = bimatrix_game.build_payoffs(problem)
    for step in watch(problem, 12)[1:]:
        picture = read_mixes(step)
        for seat, action in enumerate(picture.best_responses):
            mixes = tuple(picture.mixes)
            values = regret_matching.compute_response_values(payoffs, mixes, seat)
            assert values[action] == pytest.approx(values.max())
        assert_formula_adds_up(step.formula)


def test_rock_paper_scissors_cycles_and_its_frequencies_converge() -> None:
    *_, last = (read_mixes(step) for step in watch(load_game("rock-paper-scissors"), 1000))
    assert np.allclose(last.mixes, 1 / 3, atol=0.05)
    steps = [read_mixes(step) for step in watch(load_game("rock-paper-scissors"), 100)]
    assert {tuple(step.best_responses) for step in steps[1:]} == {(0, 0), (1, 1), (2, 2)}


def test_frequencies_secure_no_more_than_the_value_of_a_zero_sum_game() -> None:
    problem = load_game("rock-paper-scissors")
    payoffs = bimatrix_game.build_payoffs(problem)[..., 0]
    (value,) = zero_sum.solve_matrix_games(payoffs[None]).values
    row, column = read_mixes(watch(problem, 500)[-1]).mixes
    assert (row @ payoffs).min() <= value + 1e-12
    assert (payoffs @ column).max() >= value - 1e-12
    assert (payoffs @ column).max() - (row @ payoffs).min() < 0.1


def test_prisoners_end_in_the_equilibrium_that_the_solver_finds() -> None:
    problem = load_game("prisoners-dilemma")
    (equilibrium,) = bimatrix_game.enumerate_equilibria(bimatrix_game.build_payoffs(problem))
    last = read_mixes(watch(problem, 50)[-1])
    assert [*last.best_responses] == [int(np.argmax(mix)) for mix in equilibrium]


def test_the_seed_draws_the_first_round() -> None:
    problem = load_game("rock-paper-scissors")
    first_rounds = {watch(problem, 2, seed)[1].sentences[0] for seed in range(20)}
    assert "A random draw chose: agent1 rock, agent2 scissors." in first_rounds
    assert len(first_rounds) > 4


def test_the_last_round_says_how_far_the_frequencies_are_from_an_equilibrium() -> None:
    problem = load_game("rock-paper-scissors")
    last = watch(problem, 100)[-1]
    row, column = read_mixes(last).mixes
    payoffs = bimatrix_game.build_payoffs(problem)[..., 0]
    gain = max((payoffs @ column).max() - row @ payoffs @ column, 0)
    assert gain == pytest.approx(0.068, abs=5e-4)
    assert last.sentences[0] == (
        "The rounds end: an agent gains at most 0.068 by leaving its frequencies; a gain of 0 "
        "would be a Nash equilibrium."
    )


def test_ties_of_best_responses_are_named() -> None:
    third = watch(load_game("rock-paper-scissors"), 5)[3]
    assert "For each agent, rock and scissors are equally good; the first is taken." in (
        third.sentences
    )


@pytest.mark.parametrize("scale", [1.0, 1e-8, 1e-12, 1e8])
def test_the_end_is_an_equilibrium_only_if_no_agent_gains_at_any_scale(scale: float) -> None:
    for payoffs, is_equilibrium in (
        ((1, -1, -1, 1, -1, 1, 1, -1), False),
        ((0.3, 0.7, 0.3, 0.7), True),
    ):
        rows = len(payoffs) // 4
        text = f'NFG 1 R "" {{"a" "b"}} {{{rows} 2}} ' + " ".join(
            repr(payoff * scale) for payoff in payoffs
        )
        last = watch(gambit_nfg.read_nfg("game.nfg", text.encode()), 30)[-1]
        assert ("no agent gains" in last.sentences[0]) == is_equilibrium

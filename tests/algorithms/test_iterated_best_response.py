"""Iterated best response: a descent, a circle, and a Nash equilibrium that is checked."""

import pytest

import dmplay
from dmplay.algorithms.iterated_best_response import ALGORITHM
from dmplay.algorithms.step import Curve, Step, StrategyMixes, WatchRequest
from dmplay.core.problem import Problem
from dmplay.formats import gambit_nfg
from dmplay.solvers.games import bimatrix_game
from tests.formats.sources import read_ballet
from tests.support.formulas import assert_formula_adds_up
from tests.support.random_problems import Large


def watch(problem: Problem, rounds: int | None = None, seat: int = 0) -> list[Step]:
    assert not ALGORITHM.explain_misfit(problem)
    return list(ALGORITHM.iterate_steps(WatchRequest(problem, seat, iterations=rounds)))


def list_actions(problem: Problem, rounds: int | None = None) -> list[str]:
    """Return the actions of the agents in each round, such as "rock rock"."""
    actions = []
    for step in watch(problem, rounds)[1:]:
        picture = step.pictures[0]
        assert isinstance(picture, StrategyMixes)
        labels = zip(picture.action_labels, picture.mixes, strict=True)
        actions.append(" ".join(names[int(mix.argmax())] for names, mix in labels))
    return actions


def test_the_travelers_descend_dollar_by_dollar() -> None:
    actions = list_actions(dmplay.load_problem("travelers-dilemma"))
    assert actions == [*(f"{claim} {claim}" for claim in range(96, 1, -1)), "2 2"]


def test_rock_paper_scissors_runs_in_a_circle() -> None:
    problem = dmplay.load_problem("rock-paper-scissors")
    assert list_actions(problem) == ["rock rock", "paper paper", "scissors scissors", "rock rock"]
    assert watch(problem)[-1].sentences[1] == (
        "The same actions came 3 rounds ago: the agents run in a circle, without an end."
    )


def test_the_prisoners_defect_as_in_the_only_equilibrium() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    assert list_actions(problem) == ["defect defect"] * 2
    (equilibrium,) = bimatrix_game.enumerate_equilibria(bimatrix_game.build_payoffs(problem))
    assert [mix.tolist() for mix in equilibrium] == [[0, 1], [0, 1]]
    assert watch(problem)[-1].sentences[1] == (
        "Nothing changed, so this is a Nash equilibrium: no agent gets more by changing only its "
        "own action."
    )


def test_sentences_marks_and_formula_are_about_the_same_round() -> None:
    problem = dmplay.load_problem("travelers-dilemma")
    *_, step, _ = watch(problem)
    assert step.title == "round 95"
    assert step.sentences == (
        "The agents switched to agent1 2, agent2 2.",
        "No agent gains by changing only its own action.",
        "Best responses to these: agent1 2, agent2 2.",
    )
    assert step.formula == "U(agent1 2) = 1 x 2 = 2"
    for step in watch(problem):
        picture = step.pictures[0]
        assert isinstance(picture, StrategyMixes)
        payoffs = bimatrix_game.build_payoffs(problem)
        values = payoffs[..., 0] @ picture.mixes[1]
        assert values[picture.best_responses[0]] == pytest.approx(values.max())
        assert float(step.formula.rpartition(" = ")[2]) == pytest.approx(values.max(), rel=1e-3)


def test_the_first_step_gives_the_rule_and_names_equally_good_actions() -> None:
    start, first, *_ = watch(dmplay.load_problem("travelers-dilemma"))
    assert start.sentences[0] == (
        "Both get the lower claim: plus 2 for the lower claimant, minus 2 for the higher."
    )
    assert start.sentences[-1] == (
        "For each agent, 96 and 97 are equally good; the first is taken."
    )
    assert "The game is played once; the rounds here are steps of thinking." in first.sentences
    start, *_ = watch(dmplay.load_problem("rock-paper-scissors"))
    assert start.sentences[-1] == (
        "For each agent, all actions are equally good; the first is taken."
    )


def test_the_gain_is_the_regret_that_the_solver_computes() -> None:
    for problem in (dmplay.load_problem("travelers-dilemma"), Large(), read_ballet()):
        payoffs = bimatrix_game.build_payoffs(problem)
        for step in watch(problem, 30):
            mixes, curve = step.pictures
            assert isinstance(mixes, StrategyMixes)
            assert isinstance(curve, Curve)
            profile = bimatrix_game.MixedProfile(*mixes.mixes)
            regrets = bimatrix_game.compute_regrets(payoffs, profile)
            assert curve.numbers[-1] == pytest.approx(regrets.max())


def test_printed_payoffs_add_up_for_three_agents() -> None:
    text = 'NFG 1 R "" {"a" "b" "c"} {2 1 2} {{"" 1 2 3} {"" 4 -5 6.25}} 0 1 2 1'
    problem = gambit_nfg.read_nfg("three.nfg", text.encode())
    for seat in range(3):
        formulas = [step.formula for step in watch(problem, seat=seat)[1:]]
        assert len(formulas) >= 2
        for formula in formulas:
            assert_formula_adds_up(formula)


def test_a_limit_of_rounds_ends_the_descent() -> None:
    assert list_actions(dmplay.load_problem("travelers-dilemma"), 2) == ["96 96", "95 95"]

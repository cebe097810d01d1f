"""Alpha vectors in steps, compared with the exact solver at every stage."""

from itertools import product
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.algorithms.alpha_vectors import ALGORITHM, mark_dominated
from dmplay.algorithms.maximal_belief import find_maximal_belief
from dmplay.algorithms.step import AlphaVectorSet, Step, WatchRequest
from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.core.tabular import tabulate
from dmplay.solvers.games import zero_sum
from dmplay.solvers.pomdp import exact_pomdp, upper_envelope
from tests.support.formulas import assert_formula_adds_up
from tests.support.games import make_session, play_actions
from tests.support.literature_pomdps import make_cheese_maze, make_random_problem, make_tiger
from tests.support.problem_cases import CASE_NAMES, load_problem

PROBLEMS: dict[str, Problem] = {
    "crying-baby": load_problem("crying-baby"),
    "undiscounted baby": dmplay.load_problem("crying-baby", discount=1.0),
    "machine-replacement": load_problem("machine-replacement"),
    "catch": load_problem("catch"),
    "tiger": make_tiger(),
    "random 1": make_random_problem(1, 0.9),
    "random 2": make_random_problem(2, 1.0),
}
every_problem = pytest.mark.parametrize("name", PROBLEMS)


def watch(problem: Problem, turns: int | None = None, session: Session | None = None) -> list[Step]:
    assert not ALGORITHM.explain_misfit(problem)
    return list(ALGORITHM.iterate_steps(WatchRequest(problem, 0, session, turns)))


def read_vectors(step: Step) -> AlphaVectorSet:
    (picture,) = step.pictures
    assert isinstance(picture, AlphaVectorSet)
    return picture


def sort_rows(vectors: Reals) -> Reals:
    return vectors[np.lexsort(vectors.round(9).T)]


@every_problem
def test_every_pruned_stage_is_that_of_the_exact_solver(name: str) -> None:
    problem = PROBLEMS[name]
    prunings = [step for step in watch(problem, 5) if step.title.endswith("pruning")]
    stages = exact_pomdp.solve_finite_horizon(tabulate(problem), problem.discount, len(prunings))
    assert len(stages) >= 2
    for step, stage in zip(prunings, stages, strict=True):
        picture = read_vectors(step)
        needed = picture.vectors[~picture.dominated]
        assert sort_rows(needed) == pytest.approx(sort_rows(stage.alpha_vectors), abs=1e-9)


@every_problem
def test_formulas_add_up(name: str) -> None:
    for step in watch(PROBLEMS[name], 4):
        text = step.formula
        if " = R(" not in text:  # a reward that is read from the table
            assert_formula_adds_up(text)


def test_an_expansion_has_every_plan_and_its_value_by_the_textbook() -> None:
    problem = make_tiger(0.5)
    tables = tabulate(problem)
    before, after = (read_vectors(step) for step in watch(problem, 2)[1:3])
    old = before.vectors[~before.dominated]
    expected = []
    for a, left, right in product(range(3), range(len(old)), range(len(old))):
        vector = tables.rewards[:, a, 0].copy()
        for s, t, (o, plan) in product(range(2), range(2), enumerate((left, right))):
            p = tables.transition[s, a, t] * tables.observation_model[a, t, o]
            vector[s] += 0.5 * p * old[plan, t]
        expected.append(vector)
    assert after.vectors == pytest.approx(np.array(expected))
    assert len(after.vectors) == 27


def test_the_first_stage_of_the_tiger_has_a_plan_for_each_action() -> None:
    first, pruned, *_ = watch(make_tiger(), 1)
    assert read_vectors(first).vectors.tolist() == [[-1, -1], [-100, 10], [10, -100]]
    assert not read_vectors(pruned).dominated.any()
    assert first.formula == "alpha(left) = R(left, listen) = -1"
    assert pruned.formula == "V(b) = 0.5 x (-1) + 0.5 x (-1) = -1"


def test_the_marked_belief_is_that_of_the_game() -> None:
    session = make_session("crying-baby", [0.9], [0.5], [0.5])
    play_actions(session.problem, session, "ignore")
    for step in watch(session.problem, 3, session):
        assert read_vectors(step).belief == pytest.approx([0.09278, 0.90722], abs=1e-5)
    last = watch(session.problem, 3, session)[-1]
    assert last.sentences[-2] == (
        "With 3 turns left, the best plan at the marked belief begins with feed."
    )


def test_each_step_says_why_plans_are_removed_and_the_last_one_why_it_stops() -> None:
    *_, expansion, pruning = watch(load_problem("crying-baby"), 3)
    assert expansion.sentences[-1] == (
        "At the marked belief the best plan is feed, then ignore after crying, ignore after quiet."
    )
    assert pruning.sentences == (
        "Removed: 9 of 12 plans; at each belief, one of the 3 kept plans is at least as good.",
        "This also holds after each observation, so longer plans never need a removed one.",
        "With 3 turns left, the best plan at the marked belief begins with feed.",
        "The steps end here; dmplay watch --iterations N shows N turns.",
    )


def test_a_file_of_the_tiger_can_be_watched(tmp_path: Path) -> None:
    path = tmp_path / "tiger.pomdp"
    path.write_text(
        "discount: 0.95\nvalues: reward\nstates: left right\nactions: listen open-left open-right\n"
        "observations: left right\nT: listen identity\nT: open-left uniform\n"
        "T: open-right uniform\nO: listen\n0.85 0.15\n0.15 0.85\nO: open-left uniform\n"
        "O: open-right uniform\n"
        "R: listen : * : * : * -1\nR: open-left : left : * : * -100\n"
        "R: open-left : right : * : * 10\nR: open-right : left : * : * 10\n"
        "R: open-right : right : * : * -100\n"
    )
    problem = dmplay.load_problem(str(path))
    picture = read_vectors(watch(problem, 4)[-1])
    assert int((~picture.dominated).sum()) == 7
    assert tuple(picture.state_labels) == ("left", "right")


def test_vectors_that_are_best_only_at_a_tie_are_dominated() -> None:
    vectors = np.array([[1.0, 0.0], [1.0, -5.0], [0.0, 1.0], [0.5, 0.5], [0.0, 1.0], [0.6, 0.6]])
    assert mark_dominated(vectors).tolist() == [False, True, False, True, True, False]


@pytest.mark.parametrize("state_count", [2, 3, 5])
def test_the_maximal_belief_is_the_solution_of_a_matrix_game(state_count: int) -> None:
    generator = np.random.default_rng(state_count)
    for _ in range(50):
        vectors = generator.normal(size=(8, state_count)).round(2) * 10
        belief, lead = find_maximal_belief(vectors[0], vectors[1:])
        payoffs = vectors[0][:, None] - vectors[1:].T
        assert lead == pytest.approx(zero_sum.solve_matrix_games(payoffs[None]).values[0])
        assert belief.sum() == pytest.approx(1)
        assert (vectors[0] - vectors[1:]) @ belief == pytest.approx(
            np.maximum((vectors[0] - vectors[1:]) @ belief, lead)
        )


@pytest.mark.parametrize("state_count", [2, 3, 4])
def test_pruning_keeps_the_vectors_of_the_upper_envelope(state_count: int) -> None:
    generator = np.random.default_rng(10 + state_count)
    for _ in range(20):
        vectors = generator.normal(size=(40, state_count))
        envelope = upper_envelope.compute_upper_envelope(vectors)
        needed = np.flatnonzero(~mark_dominated(vectors))
        assert needed.tolist() == envelope.needed_vectors.tolist()


def test_too_many_plans_end_the_steps_with_a_sentence() -> None:
    last = watch(load_problem("catch"))[-1]
    assert last.sentences[-1].startswith("The next expansion has ")
    assert last.sentences[-1].endswith(" plans, too many to watch, so this is all.")


def test_problems_that_do_not_fit_get_one_line() -> None:
    fitting = [name for name in CASE_NAMES if not ALGORITHM.explain_misfit(load_problem(name))]
    assert {name.partition(":")[0] for name in fitting} == {
        "bandit",
        "catch",
        "crying-baby",
        "machine-replacement",
    }
    assert ALGORITHM.explain_misfit(load_problem("hexworld")) == (
        "alpha vectors need hidden states, but here the agent sees the state"
    )
    assert ALGORITHM.explain_misfit(load_problem("multicaregiver-crying-baby")) == (
        "alpha vectors need one agent, but this problem has several"
    )
    assert ALGORITHM.explain_misfit(make_cheese_maze()) == (
        "alpha vectors need at most 8 states and named observations, but this problem has more"
    )

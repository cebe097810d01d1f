"""The belief update in steps, compared with the session's belief and with T and O."""

import re
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.algorithms import belief_update
from dmplay.algorithms.belief_update import ALGORITHM
from dmplay.algorithms.step import BeliefTable, Step, WatchRequest
from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem, enumerate_outcomes, next_state_indices
from dmplay.core.session import Session
from dmplay.core.tabular import joint_actions, tabulate
from dmplay.errors import BadParameter
from tests.support.document_examples import TIGER_SOURCE
from tests.support.formulas import assert_formula_adds_up
from tests.support.games import make_session, play_actions
from tests.support.literature_pomdps import make_cheese_maze, make_tag, make_tiger
from tests.support.problem_cases import CASE_NAMES, load_problem
from tests.support.user_problems import Vault

SEED = 3
USER_PROBLEMS: dict[str, Problem] = {
    "tiger": make_tiger(),
    "cheese maze": make_cheese_maze(),
    "tag": make_tag(),
    "vault": Vault(),
}
HIDDEN_CASES = [name for name in CASE_NAMES if load_problem(name).partially_observable]
every_hidden_problem = pytest.mark.parametrize("name", [*HIDDEN_CASES, *USER_PROBLEMS])


def load_case(name: str) -> Problem:
    return USER_PROBLEMS[name] if name in USER_PROBLEMS else load_problem(name)


def watch(problem: Problem, seat: int = 0, session: Session | None = None) -> list[Step]:
    assert not ALGORITHM.explain_misfit(problem)
    return list(ALGORITHM.iterate_steps(WatchRequest(problem, seat, session, seed=SEED)))


def read_column(step: Step, name: str, table: int = 0) -> Reals:
    picture = step.pictures[table]
    assert isinstance(picture, BeliefTable)
    return dict(picture.columns)[name]


def test_it_fits_every_problem_with_beliefs_on_the_screen() -> None:
    for name in CASE_NAMES:
        problem = load_problem(name)
        obstacle = ALGORITHM.explain_misfit(problem)
        assert bool(obstacle) != problem.partially_observable, name
    assert ALGORITHM.explain_misfit(load_problem("hexworld")) == (
        "a belief update needs hidden states, but here every agent sees the state"
    )


@every_hidden_problem
def test_the_posterior_is_exactly_the_belief_of_the_session(name: str) -> None:
    problem = load_case(name)
    session = belief_update.play_random_game(problem, SEED, 6)
    for seat in range(len(problem.agents)):
        view = session.view(seat)
        assert view.beliefs is not None
        belief = view.beliefs[0]
        for turn in range(1, view.turns_played + 1):
            action, observation = int(view.actions[turn - 1]), int(view.observations[turn])
            update = belief_update.update_belief(problem, belief, seat, action, observation)
            belief = update.posterior
            assert np.array_equal(belief, view.beliefs[turn])


@every_hidden_problem
def test_shown_columns_multiply_and_divide_as_the_rule_says(name: str) -> None:
    problem = load_case(name)
    seat = len(problem.agents) - 1
    steps = watch(problem, seat)
    view = belief_update.play_random_game(problem, SEED, belief_update.DEFAULT_TURNS).view(seat)
    assert len(steps) == 1 + 3 * view.turns_played
    for predict, observe, normalize in zip(steps[1::3], steps[2::3], steps[3::3], strict=True):
        for table in range(len(normalize.pictures)):
            columns = ("predicted", "likelihood", "product", "posterior")
            predicted, likelihood, product, posterior = (
                read_column(normalize, column, table) for column in columns
            )
            assert np.nan_to_num(likelihood) * predicted == pytest.approx(product)
            assert product / product.sum() == pytest.approx(posterior)
            assert [predicted.sum(), posterior.sum()] == pytest.approx([1, 1])
            assert np.array_equal(read_column(predict, "predicted", table), predicted)
            assert np.array_equal(np.isnan(likelihood), predicted == 0)
        for step in (predict, observe, normalize):
            assert_formula_adds_up(step.formula)


@pytest.mark.parametrize("name", ["crying-baby", "machine-replacement", "catch", "tiger"])
def test_columns_are_those_of_the_tables_t_and_o(name: str) -> None:
    problem = load_case(name)
    tables = tabulate(problem)
    belief = np.array(problem.initial_belief)  # type: ignore[attr-defined]
    view = belief_update.play_random_game(problem, SEED, belief_update.DEFAULT_TURNS).view(0)
    for turn, step in enumerate(watch(problem)[3::3], 1):
        a, o = int(view.actions[turn - 1]), int(view.observations[turn])
        predicted = belief @ tables.transition[:, a]
        assert read_column(step, "predicted") == pytest.approx(predicted)
        likelihood = tables.observation_model[a, :, o]
        possible = predicted > 0
        assert read_column(step, "likelihood")[possible] == pytest.approx(likelihood[possible])
        belief = likelihood * predicted / (likelihood @ predicted)
        assert read_column(step, "posterior") == pytest.approx(belief)


def test_the_hunt_shows_marginals_of_the_joint_belief() -> None:
    problem = dmplay.load_problem("collaborative-predator-prey:circle")
    seat = 1
    session = belief_update.play_random_game(problem, SEED, 3)
    states = problem.enumerate_states()
    actions = joint_actions(problem)
    belief = np.full(len(states), 1 / len(states))
    for turn, played in enumerate(session.turns):
        possible = actions[actions[:, seat] == played.actions[seat]]  # the partner acts at random
        p, outcome = enumerate_outcomes(
            problem, states.repeat(len(possible), axis=0), np.tile(possible, (len(states), 1))
        )
        weights = p * belief.repeat(len(possible))[:, None]
        weights = weights * (outcome.observations[:, :, seat] == played.observations[seat])
        indices = next_state_indices(problem, outcome)
        joint = np.bincount(indices.ravel(), weights.ravel(), minlength=len(states))
        belief = joint / joint.sum()
        step = watch(problem, seat, session)[3 * turn + 3]
        for table, walker in enumerate((2, 1, 0)):  # the prey, the seat, its partner
            marginal = np.bincount(states[:, walker], belief, minlength=6)
            assert read_column(step, "posterior", table) == pytest.approx(marginal)
    tables = [table for table in step.pictures if isinstance(table, BeliefTable)]
    labels = [table.state_labels[0] for table in tables]
    assert labels == ["prey (-1,2)", "predator2 (-1,2)", "predator1 (-1,2)"]


PARTS_SOURCE = (
    TIGER_SOURCE
    + """

    def state_parts(self, seat):
        import numpy as np
        from dmplay import StatePart, StateParts
        doors = StatePart(["left door", "right door"], np.array([0, 1]))
        return StateParts("things", [doors, StatePart(["here"], np.array([0, 0]))])
"""
)


@pytest.mark.parametrize(
    ("part", "wrong", "message"),
    [
        ('StateParts("things", [doors', "([doors", "expected StateParts with a name"),
        ("[doors, StatePart", "[7, StatePart", "state_parts: got 7, expected a StatePart"),
        ("np.array([0, 0])", "[0, 0]", "got [0, 0], expected whole numbers of shape (2,)"),
        ("np.array([0, 0])", "np.zeros(3, int)", "expected whole numbers of shape (2,)"),
        ("np.array([0, 0])", "np.array([0, 1])", "got array([0, 1]), expected 0 to 0, the indices"),
    ],
)
def test_invalid_parts_of_a_state_are_refused_with_their_line(
    part: str, wrong: str, message: str, tmp_path: Path
) -> None:
    file = tmp_path / "parts.py"
    file.write_text(PARTS_SOURCE.replace(part, wrong))
    line = PARTS_SOURCE[: PARTS_SOURCE.index("def state_parts")].count("\n") + 1
    with pytest.raises(BadParameter, match=re.escape(message)) as error:
        dmplay.load_problem(file)
    assert f"parts.py:{line} state_parts" in str(error.value)


def test_a_users_file_divides_its_state_into_parts(tmp_path: Path) -> None:
    (tmp_path / "parts.py").write_text(PARTS_SOURCE)
    start, *_ = watch(dmplay.load_problem(tmp_path / "parts.py"))
    tables = [table for table in start.pictures if isinstance(table, BeliefTable)]
    assert [[*table.state_labels] for table in tables] == [["left door", "right door"], ["here"]]
    assert read_column(start, "prior", 1).tolist() == [1.0]
    sentence = "The belief is about all things together; each table shows one of them."
    assert start.sentences[-1] == sentence


def test_the_baby_of_the_book_is_fed_and_cries() -> None:
    session = make_session("crying-baby", [0.9], [0.5], [0.05])
    play_actions(session.problem, session, "ignore", "feed")
    steps = watch(session.problem, session=session)
    assert [step.title for step in steps] == [
        "start",
        "turn 1: predict",
        "turn 1: observe",
        "turn 1: normalize",
        "turn 2: predict",
        "turn 2: observe",
        "turn 2: normalize",
    ]
    assert steps[0].sentences[1] == "These are turns 1 to 2 of your game."
    assert steps[1].formula == "predicted(hungry) = 0.1 x 0.5 + 1 x 0.5 = 0.55"
    assert steps[2].formula == "P(crying) = 0.1 x 0.45 + 0.8 x 0.55 = 0.485"
    assert steps[3].formula == "b(hungry) = 0.44 / 0.485 = 0.9072"
    assert steps[4].formula == "predicted(sated) = 1 x 0.09278 + 1 x 0.9072 = 1"
    assert "A dash marks a state that is impossible now." in steps[5].sentences
    assert read_column(steps[6], "posterior").tolist() == [1, 0]


def test_a_product_of_zero_stays_in_the_sum_of_the_evidence() -> None:
    session = make_session("crying-baby", [0.9], [0.5], [0.05], [0.05])
    play_actions(session.problem, session, "ignore", "sing")
    observe = watch(session.problem, session=session)[5]
    assert observe.formula == "P(crying) = 0 x 0.08351 + 0.9 x 0.9165 = 0.8248"


@pytest.mark.parametrize(
    ("iterations", "sentence"),
    [
        (None, "These are turns 1 to 3 of your game."),
        (1, "This is turn 3 of your game."),
        (2, "These are turns 2 to 3 of your game."),
        (9, "These are turns 1 to 3 of your game."),
    ],
)
def test_the_first_step_says_which_turns_of_a_game_it_shows(
    iterations: int | None, sentence: str
) -> None:
    problem = load_problem("crying-baby")
    session = belief_update.play_random_game(problem, SEED, 3)
    first, *_ = ALGORITHM.iterate_steps(
        WatchRequest(problem, session=session, iterations=iterations)
    )
    assert first.sentences[1] == sentence


def test_the_last_turns_of_a_long_game_begin_with_the_belief_before_them() -> None:
    problem = load_problem("crying-baby")
    session = belief_update.play_random_game(problem, SEED, 12)
    request = WatchRequest(problem, session=session, iterations=2)
    steps = list(ALGORITHM.iterate_steps(request))
    assert [step.title for step in steps[:2]] == ["start of turn 11", "turn 11: predict"]
    beliefs = session.view(0).beliefs
    assert beliefs is not None
    assert np.array_equal(read_column(steps[0], "prior"), beliefs[10])
    assert np.array_equal(read_column(steps[-1], "posterior"), beliefs[12])


def test_other_agents_are_said_to_act_at_random() -> None:
    steps = watch(load_problem("multicaregiver-crying-baby"))
    assert steps[1].sentences[1] == "caregiver2: taken to act uniformly at random."

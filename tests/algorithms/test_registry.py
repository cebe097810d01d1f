"""The registry of algorithms, and what holds for each of them on each problem."""

import re
from itertools import islice
from textwrap import wrap

import numpy as np
import pytest

from dmplay.algorithms import registry
from dmplay.algorithms.step import BeliefTable, StateValues, Step, StrategyMixes, WatchRequest
from dmplay.errors import BadParameter, UnknownName
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problems import load_problem

MAX_WORDS, MAX_ROWS = 25, 4
FITTING_PAIRS = [
    (name, problem)
    for name, algorithm in registry.load_algorithms().items()
    for problem in problem_names()
    if not algorithm.explain_misfit(load_problem(problem))
]


def test_the_modules_of_the_folder_are_found_by_their_names() -> None:
    names = [*registry.load_algorithms()]
    assert names == sorted(names)
    assert {"value-iteration", "policy-iteration", "belief-update"} <= {*names}
    for name, algorithm in registry.load_algorithms().items():
        module = algorithm.iterate_steps.__module__
        assert module == f"dmplay.algorithms.{name.replace('-', '_')}"


def test_a_misspelled_algorithm_gets_the_nearest_name() -> None:
    with pytest.raises(UnknownName, match="did you mean value-iteration"):
        registry.find_algorithm("valueiteration")


def test_a_misfit_gets_the_reason_and_the_algorithms_that_fit() -> None:
    algorithm = registry.find_algorithm("value-iteration")
    problem = load_problem("rock-paper-scissors")
    with pytest.raises(BadParameter) as caught:
        registry.check_algorithm_fits(algorithm, problem, "rock-paper-scissors")
    assert str(caught.value).startswith(
        "value-iteration does not fit rock-paper-scissors: several agents choose; it plans for one "
        "agent; algorithms that fit it: fictitious-play, iterated-best-response"
    )


@pytest.mark.parametrize("problem", problem_names())
def test_each_problem_has_an_algorithm_or_each_algorithm_a_reason(problem: str) -> None:
    loaded = load_problem(problem)
    for algorithm in registry.load_algorithms().values():
        obstacle = algorithm.explain_misfit(loaded)
        assert obstacle == obstacle.strip()
        assert not obstacle.endswith(".")


@pytest.mark.parametrize(("name", "problem_name"), FITTING_PAIRS)
def test_the_first_steps_are_the_same_each_time_and_well_formed(
    name: str, problem_name: str
) -> None:
    algorithm, problem = registry.find_algorithm(name), load_problem(problem_name)
    first, second = (
        [*islice(algorithm.iterate_steps(WatchRequest(problem, iterations=3)), 8)] for _ in range(2)
    )
    assert first
    for step, repeated in zip(first, second, strict=True):
        assert (step.title, step.sentences) == (repeated.title, repeated.sentences)
        assert step.formula == repeated.formula
        assert step.title
        assert all(sentence[-1] in ".:" for sentence in step.sentences), step.sentences
        for picture in step.pictures:
            match picture:
                case StateValues():
                    assert len(picture.states) == len(picture.values)
                    assert np.isfinite(picture.values).all()
                case BeliefTable():
                    for column, numbers in picture.columns:
                        assert len(numbers) == len(picture.state_labels)
                        if column in ("prior", "predicted", "posterior"):
                            assert numbers.sum() == pytest.approx(1.0)
                case StrategyMixes():
                    for mix in picture.mixes:
                        assert mix.sum() == pytest.approx(1.0)


def assert_is_short(step: Step) -> None:
    """Assert that the sentences of a step are short, and fit in few rows of 80 columns."""
    for sentence in " ".join(step.sentences).split(". "):
        assert len(re.findall(r"[^\W\d]{2,}", sentence)) <= MAX_WORDS, sentence
    assert len(wrap(" ".join(step.sentences), 80)) <= MAX_ROWS, step.sentences


@pytest.mark.parametrize(("name", "problem_name"), FITTING_PAIRS)
def test_a_step_has_at_most_four_rows_of_short_sentences(name: str, problem_name: str) -> None:
    request = WatchRequest(load_problem(problem_name), iterations=3)
    for step in islice(registry.find_algorithm(name).iterate_steps(request), 16):
        assert_is_short(step)


@pytest.mark.parametrize(
    ("name", "problem_name"),
    [
        ("alpha-vectors", "crying-baby"),
        ("belief-update", "crying-baby"),
        ("fictitious-play", "rock-paper-scissors"),
        ("iterated-best-response", "travelers-dilemma"),
        ("policy-iteration", "hexworld"),
        ("tree-search", "hexworld"),
        ("value-iteration", "hexworld"),
    ],
)
def test_the_last_steps_of_a_whole_run_are_short_too(name: str, problem_name: str) -> None:
    request = WatchRequest(load_problem(problem_name))
    for step in registry.find_algorithm(name).iterate_steps(request):
        assert_is_short(step)

"""The steps of an algorithm as lines of text and as JSON Lines."""

import json

import pytest

from dmplay.algorithms import registry
from dmplay.algorithms.registry import find_algorithm
from dmplay.algorithms.step import WatchRequest
from dmplay.game.watching import WatchedSteps
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problems import load_problem
from dmplay.ui.watch.step_lines import LAST_STEPS, format_last_steps, iter_json_lines, iter_lines

FITTING_PAIRS = [
    (name, problem)
    for name, algorithm in registry.load_algorithms().items()
    for problem in problem_names()
    if not algorithm.explain_misfit(load_problem(problem))
]


def watch(algorithm: str, problem: str, iterations: int | None = None) -> WatchedSteps:
    """Return the steps of an algorithm on a problem."""
    request = WatchRequest(load_problem(problem), iterations=iterations)
    return WatchedSteps(find_algorithm(algorithm), request, problem)


def test_a_run_on_the_straight_line_in_lines() -> None:
    assert "".join(iter_lines(watch("value-iteration", "hexworld:straight-line", 2))) == (
        "value-iteration on hexworld:straight-line: compute the value of each state with 1 turn "
        "left, then with 2, and so on (section 7.5, Value Iteration).\n"
        "step 1. start.\n"
        "V(s), the value of state s, is the best expected return (discounted sum of rewards) from "
        "it.\n"
        "At first no turn is left, and V is 0.\n"
        "After the end of the game (1 state, not drawn), V stays 0.\n"
        "step 2. sweep 1.\n"
        "V is now the value of a game with 1 turn left.\n"
        "7 of 7 values changed, by at most 10 (called the residual).\n"
        "The formula is for e in (6,0), where V changed most; all actions are equally good.\n"
        "V = reward now + discount 0.9 x sum of (probability x old V of the next "
        "state).\n"
        "V(6,0) = 10 + 0.9 (1 x 0) = 10\n"
        "step 3. sweep 2.\n"
        "V is now the value of a game with 2 turns left.\n"
        "The sweeps end here, but the values still change.\n"
        "6 of 7 values changed, by at most 6.219 (the residual).\n"
        "The best action in (5,0), where V changed most, is e; "
        "the second-best action is worth 0.2705.\n"
        "V(5,0) = -0.3 + 0.9 (0.7 x 10 + 0.3 x (-0.3)) = 5.919\n"
        "values: (0,0) -0.57 e; (1,0) -0.57 e; (2,0) -0.57 e; (3,0) -0.57 e; (4,0) -0.57 e; "
        "(5,0) 5.919 e; (6,0) 10 e; over 0.\n"
        "residual: 10, 6.219.\n"
    )


def test_one_step_can_be_printed_alone() -> None:
    watched = watch("value-iteration", "hexworld", 3)
    lines = "".join(iter_lines(watched, watched.compute_until(1))).split("\n")
    assert lines[0] == "step 2. sweep 1."
    assert lines[-2] == "residual: 10."
    assert len(watched.steps) == 2, "later steps are not computed"


def test_a_belief_update_in_lines() -> None:
    text = "".join(iter_lines(watch("belief-update", "crying-baby", 1)))
    assert "posterior: sated 0.0928, hungry 0.9072.\n" in text


@pytest.mark.parametrize(("algorithm", "problem"), FITTING_PAIRS)
def test_each_json_line_is_an_object_with_the_data_of_the_pictures(
    algorithm: str, problem: str
) -> None:
    watched = watch(algorithm, problem, 2)
    facts = [json.loads(line) for line in iter_json_lines(watched)]
    assert [row["step"] for row in facts] == [*range(1, len(watched.steps) + 1)]
    assert [*facts[0]] == ["step", "title", "sentences", "formula", "pictures"]
    for row, step in zip(facts, watched.steps, strict=True):
        assert len(row["pictures"]) == len(step.pictures)
        assert all("kind" in picture for picture in row["pictures"])
        assert "NaN" not in json.dumps(row)


@pytest.mark.parametrize(("algorithm", "problem"), FITTING_PAIRS)
def test_lines_contain_every_sentence_and_no_drawing(algorithm: str, problem: str) -> None:
    watched = watch(algorithm, problem, 2)
    text = "".join(iter_lines(watched))
    for step in watched.steps:
        assert all(sentence in text for sentence in step.sentences)
        assert step.formula in text
    assert not {*text} & set("│█▁●╱")


def test_a_shell_without_a_screen_shows_the_last_steps() -> None:
    lines = format_last_steps(watch("value-iteration", "hexworld"))
    assert lines[1] == f"These are the last {LAST_STEPS} of 22 steps."
    assert [line for line in lines if line.startswith("step ")] == [
        "step 20. sweep 19.",
        "step 21. sweep 20.",
        "step 22. sweep 21.",
    ]

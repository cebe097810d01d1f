"""User-defined problems are checked before they are played, and errors are reported at once."""

from pathlib import Path

import numpy as np
import pytest

from dmplay import Labels, Outcome, Tables
from dmplay.core.arrays import Array
from dmplay.core.chance import Categorical, Chance, DiscreteUniform, Normal, Uniform
from dmplay.core.playability_checks import check_playable
from dmplay.core.problem import Problem
from dmplay.core.spaces import TextLine
from dmplay.core.user_code_locations import describe_error_location
from dmplay.errors import BadParameter
from dmplay.registry.problems import resolve_problem
from tests.support.user_problems import Heap, Key

VALID_TABLES = Key.tables
HALF_PROBABILITIES = np.full((3, 3, 3), 0.5)
SUM_MESSAGE = "tables.transition[before, take] sums to"


def get_error(problem: Problem) -> str:
    """Return the error of a problem, or '' if there is none."""
    try:
        check_playable("own", problem)
    except BadParameter as error:
        return str(error)
    return ""


def replace_attribute(kind: type[Problem], name: str, value: object) -> Problem:
    """Return a problem with another value of one attribute."""
    problem: Problem = type("Changed", (kind,), {name: value})()
    return problem


def test_valid_problems_have_no_errors() -> None:
    assert get_error(Key()) == get_error(Heap()) == ""


def test_a_discount_is_a_number_from_0_to_1() -> None:
    message = "discount: got 1.5, expected a number from 0 to 1"
    assert get_error(Key(discount=1.5)).endswith(message)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("agents", ("a", "a\u200db"),
         "expected a tuple of names of printable characters, without U+200D"),
        ("actions", (Labels(("a", "a\u200db")),),
         "expected Labels with names of printable characters, without U+200D"),
        ("state_names", ("one", "x" * 10**6), "expected a tuple of names of at most"),
        ("agents", ("a", "a"), "agents: got ('a', 'a'), expected a tuple of distinct names"),
        ("agents", ("a", "b"), "got 1 action set for 2 agents, expected one for each agent"),
        ("actions", 7, "actions: got 7, expected (Labels(...),)"),
        ("actions", (Labels(("a", "a")),),
         "actions: got ('a', 'a'), expected Labels with distinct names"),
        ("actions", (Labels(("a", "\x1b[2J")),), r"actions: got ('a', '\x1b[2J')"),
        ("observations", (Labels(()),), "observations: got ((),), expected Labels"),
        ("state_names", ("one", "one"),
         "state_names: got ('one', 'one'), expected a tuple of distinct names"),
        ("horizon", 0, "horizon: got 0, expected a whole number of turns, 1 or more, or None"),
        ("is_finite_horizon", 1, "is_finite_horizon: got 1, expected False, or True and a horizon"),
        ("initial_belief", np.array([0.5, 0.6, 0.0]), "initial_belief sums to 1.1, expected 1"),
        ("tables", Tables(HALF_PROBABILITIES, VALID_TABLES.rewards),
         f"{SUM_MESSAGE} 1.5, expected 1"),
        ("tables", Tables(0.9 * VALID_TABLES.transition, VALID_TABLES.rewards),
         f"{SUM_MESSAGE} 0.9, expected 1"),
        ("tables", Tables(2 * HALF_PROBABILITIES - HALF_PROBABILITIES * 3, VALID_TABLES.rewards),
         "expected no negative probability"),
        ("tables", Tables(HALF_PROBABILITIES[:2], VALID_TABLES.rewards),
         "got shape (2, 3, 3), expected an array of"),
        ("tables", Tables(VALID_TABLES.transition, VALID_TABLES.rewards * np.nan),
         "rewards: expected finite numbers"),
        ("tables", Tables(VALID_TABLES.transition > 0, VALID_TABLES.rewards),
         "tables.transition: got the type bool, expected finite numbers"),
        ("tables", Tables(VALID_TABLES.transition, VALID_TABLES.rewards, HALF_PROBABILITIES),
         "tables.observation: expected None"),
    ],
)  # fmt: skip
def test_invalid_attributes_and_arrays_are_reported(name: str, value: object, message: str) -> None:
    assert message in get_error(replace_attribute(Key, name, value))


def _make_resolver(state: object, rewards: object, observations: object) -> object:
    return lambda self, s, a, events: Outcome(state, rewards, observations)  # type: ignore[arg-type]


ZERO_REWARDS, ZERO_STATES = np.zeros((2, 1)), np.zeros(2, int)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("state_count", 10**400, "state_count: got 1"),
        ("initial_chance", lambda self, rows: None, "initial_chance: got None"),
        ("initial_states", lambda self, rows, events: 7,
         "initial_states: got 7, expected an array"),
        ("initial_states", lambda self, rows, events: np.full(rows, 0.5), "expected whole numbers"),
        ("initial_states", lambda self, rows, events: np.full(rows, 9),
         "initial_states: got state 9, expected 0 to 4"),
        ("terminal", lambda self, s: s, "terminal: got array"),
        ("legal_actions_mask", lambda self, s: np.zeros((2, 1, 2), bool),
         "at least one legal action for each agent"),
        ("format_state", lambda self, s: "a\nb", r"format_state: got 'a\nb', expected a line"),
        ("resolve_events", lambda self, s, a, events: None,
         "resolve_events: got None, expected Outcome"),
        ("resolve_events", _make_resolver(np.zeros(3, int), ZERO_REWARDS, ZERO_STATES),
         "resolve_events: got the states array([0, 0, 0])"),
        ("resolve_events", _make_resolver(ZERO_STATES, ZERO_REWARDS + np.inf, ZERO_STATES),
         "resolve_events: rewards: expected finite numbers"),
        ("resolve_events", _make_resolver(ZERO_STATES, ZERO_REWARDS[0], ZERO_STATES),
         "resolve_events: rewards: got shape (1,)"),
        ("resolve_events", _make_resolver(ZERO_STATES, ZERO_REWARDS, ZERO_STATES > 0),
         "resolve_events: got the observations array([False, False])"),
        ("resolve_events", _make_resolver(ZERO_STATES, ZERO_REWARDS, 7),
         "resolve_events: got the observations 7, expected the next states"),
    ],
)  # fmt: skip
def test_an_invalid_first_turn_is_reported(name: str, value: object, message: str) -> None:
    assert message in get_error(replace_attribute(Heap, name, value))


@pytest.mark.parametrize(
    "observations", [np.zeros((2, 1)), np.full((2, 1), 2), np.full((2, 1), -1)]
)
def test_observations_must_be_label_indices(observations: Array) -> None:
    hidden = type("Hidden", (Heap,), {"observations": (Labels(("x", "y")),)})
    assert "resolve_events: got the observations" in get_error(
        replace_attribute(
            hidden, "resolve_events", _make_resolver(ZERO_STATES, ZERO_REWARDS, observations)
        )
    )


@pytest.mark.parametrize("text", ["", " ", "red \x1b[31m", "long" * 5001])
def test_text_observations_must_be_printable(text: str) -> None:
    text_class = type("Telling", (Heap,), {"observations": (TextLine(),)})
    resolver = _make_resolver(ZERO_STATES, ZERO_REWARDS, np.array([["fine"], [text]]))
    message = "expected printable text, not empty, of at most 20,000 characters"
    assert f"resolve_events: got the observation {text!r:.99}, {message}" in get_error(
        replace_attribute(text_class, "resolve_events", resolver)
    )


@pytest.mark.parametrize(
    "chance",
    [
        Categorical(np.array([[0.5, 0.2]])),
        Categorical(np.full((1, 1), np.nan)),
        DiscreteUniform(np.zeros(2, int), 2),
        Uniform(np.zeros(2), np.full(2, np.inf)),
        Uniform(np.full(2, 4.0), np.full(2, 2.0)),
        Normal(np.full(2, np.nan), np.ones(2)),
        7,
    ],
)
def test_events_that_cannot_be_sampled_are_reported(chance: Chance) -> None:
    problem = replace_attribute(Heap, "chance", lambda self, s, a: (chance,))
    assert "chance: got " in get_error(problem)


def test_a_problem_is_checked_with_the_parameters_that_are_set(tmp_path: Path) -> None:
    file = tmp_path / "own.py"
    file.write_text("from tests.support.user_problems import Heap as Own\n")
    assert resolve_problem(f"{file}:Own", {"discount": "0.5"}).problem.discount == 0.5
    file.write_text(
        "from tests.support.user_problems import Heap\nOwn = type('O', (Heap,), {'state_count': 0})"
    )
    with pytest.raises(
        BadParameter, match=r"own.py:Own: state_count: got 0, expected a number of states"
    ):
        resolve_problem(f"{file}:Own", {})


def test_an_impossible_state_is_reported_if_all_states_are_listed() -> None:
    problem = replace_attribute(
        Heap, "resolve_events", _make_resolver(np.full(2, 9), ZERO_REWARDS, np.full(2, 9))
    )
    with pytest.raises(BadParameter, match="got state indices 9 to 9, expected 0 to 4"):
        problem.joint_belief_update(np.eye(5)[4], [0], [])


def test_an_error_is_located_in_user_code() -> None:
    with pytest.raises(IndexError) as caught:
        np.zeros(1)[7]
    location = describe_error_location(caught.value)
    assert location.startswith("./tests/core/test_playability_checks.py:")
    assert location.endswith(": IndexError: index 7 is out of bounds for axis 0 with size 1")
    assert describe_error_location(ValueError()) == ""


def test_an_error_is_not_located_in_a_package_of_another_environment(tmp_path: Path) -> None:
    library = tmp_path / "site-packages" / "big.py"
    with pytest.raises(MemoryError) as caught:
        exec(compile("raise MemoryError('of 32 TiB')", library, "exec"))
    location = describe_error_location(caught.value)
    assert location.startswith("./tests/core/test_playability_checks.py:")
    assert location.endswith(": MemoryError: of 32 TiB")

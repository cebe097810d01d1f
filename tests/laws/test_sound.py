"""What somebody brings is looked at before it is played, and what is wrong is said at once."""

from pathlib import Path

import numpy as np
import pytest

from dmplay import Labels, Outcome, Tables
from dmplay.chance import Array, Categorical, Chance, DiscreteUniform, Normal, Uniform
from dmplay.core import Problem, TextLine
from dmplay.errors import BadParameter
from dmplay.finding.problems import resolve_problem
from dmplay.laws.sound import check_playable
from dmplay.places import describe_error_location
from tests.support.brought import Heap, Key

RIGHT = Key.tables
HALF = np.full((3, 3, 3), 0.5)
SUMS = "tables.transition[before, take] sums to"


def told(problem: Problem) -> str:
    """What is wrong with a problem; '' where nothing is."""
    try:
        check_playable("own", problem)
    except BadParameter as error:
        return str(error)
    return ""


def changed(kind: type[Problem], name: str, value: object) -> Problem:
    """A problem in which something else is said."""
    made: Problem = type("Changed", (kind,), {name: value})()
    return made


def test_nothing_is_wrong_with_what_is_right() -> None:
    assert told(Key()) == told(Heap()) == ""


def test_a_discount_is_a_share() -> None:
    what = "discount: got 1.5, expected a number from 0 to 1"
    assert told(Key(discount=1.5)).endswith(what)


@pytest.mark.parametrize(
    ("name", "value", "what"),
    [
        ("agents", ("a", "a"), "agents: got ('a', 'a'), expected names, each another"),
        ("agents", ("a", "b"), "got 1 action set for 2 agents, expected one each"),
        ("actions", 7, "actions: got 7, expected (Labels(...),)"),
        ("actions", (Labels(("a", "a")),), "actions: got ('a', 'a'), expected Labels of names"),
        ("actions", (Labels(("a", "\x1b[2J")),), r"actions: got ('a', '\x1b[2J')"),
        ("observations", (Labels(()),), "observations: got ((),), expected Labels"),
        (
            "state_names",
            ("one", "one"),
            "state_names: got ('one', 'one'), expected names, each another",
        ),
        ("horizon", 0, "horizon: got 0, expected a number of turns, or None"),
        ("initial_belief", np.array([0.5, 0.6, 0.0]), "initial_belief sums to 1.1, expected 1"),
        ("tables", Tables(HALF, RIGHT.rewards), f"{SUMS} 1.5, expected 1"),
        ("tables", Tables(0.9 * RIGHT.transition, RIGHT.rewards), f"{SUMS} 0.9, expected 1"),
        ("tables", Tables(2 * HALF - HALF * 3, RIGHT.rewards), "expected no negative probability"),
        ("tables", Tables(HALF[:2], RIGHT.rewards), "got shape (2, 3, 3), expected an array of"),
        ("tables", Tables(RIGHT.transition, RIGHT.rewards * np.nan), "rewards: expected numbers"),
        (
            "tables",
            Tables(RIGHT.transition, RIGHT.rewards, HALF),
            "tables.observation: expected None",
        ),
    ],
)
def test_facts_and_arrays_that_cannot_be_are_told(name: str, value: object, what: str) -> None:
    assert what in told(changed(Key, name, value))


def _moved(state: object, rewards: object, seen: object) -> object:
    return lambda self, s, a, events: Outcome(state, rewards, seen)  # type: ignore[arg-type]


PAID, SEEN = np.zeros((2, 1)), np.zeros(2, int)


@pytest.mark.parametrize(
    ("name", "value", "what"),
    [
        ("state_count", 10**400, "state_count: got 1"),
        ("initial_chance", lambda self, rows: None, "initial_chance: got None"),
        (
            "initial_states",
            lambda self, rows, events: 7,
            "initial_states: got 7, expected an array",
        ),
        ("initial_states", lambda self, rows, events: np.full(rows, 0.5), "expected whole numbers"),
        (
            "initial_states",
            lambda self, rows, events: np.full(rows, 9),
            "initial_states: got state 9, expected 0 to 4",
        ),
        ("terminal", lambda self, s: s, "terminal: got array"),
        ("legal_actions_mask", lambda self, s: np.zeros((2, 1, 2), bool), "one action at least"),
        ("format_state", lambda self, s: "a\nb", r"format_state: got 'a\nb', expected a line"),
        (
            "resolve_events",
            lambda self, s, a, events: None,
            "resolve_events: got None, expected Outcome",
        ),
        (
            "resolve_events",
            _moved(np.zeros(3, int), PAID, SEEN),
            "resolve_events: got the states array([0, 0, 0])",
        ),
        (
            "resolve_events",
            _moved(SEEN, PAID + np.inf, SEEN),
            "resolve_events: rewards: expected numbers, none inf",
        ),
        ("resolve_events", _moved(SEEN, PAID[0], SEEN), "resolve_events: rewards: got shape (1,)"),
        (
            "resolve_events",
            _moved(SEEN, PAID, SEEN > 0),
            "resolve_events: got array([False, False]) to be seen",
        ),
        (
            "resolve_events",
            _moved(SEEN, PAID, 7),
            "resolve_events: got 7 to be seen, expected the new states",
        ),
    ],
)
def test_a_first_turn_that_cannot_be_is_told(name: str, value: object, what: str) -> None:
    assert what in told(changed(Heap, name, value))


@pytest.mark.parametrize("seen", [np.zeros((2, 1)), np.full((2, 1), 2), np.full((2, 1), -1)])
def test_observations_are_numbers_of_labels(seen: Array) -> None:
    hidden = type("Hidden", (Heap,), {"observations": (Labels(("x", "y")),)})
    assert "resolve_events: got the observations" in told(
        changed(hidden, "resolve_events", _moved(SEEN, PAID, seen))
    )


@pytest.mark.parametrize("seen", ["", " ", "red \x1b[31m", "long" * 5001])
def test_observations_in_words_are_printable(seen: str) -> None:
    telling = type("Telling", (Heap,), {"observations": (TextLine(),)})
    said = _moved(SEEN, PAID, np.array([["fine"], [seen]]))
    what = "expected printable text, not empty, of at most 20,000 characters"
    assert f"resolve_events: got the observation {seen!r:.99}, {what}" in told(
        changed(telling, "resolve_events", said)
    )


@pytest.mark.parametrize(
    "chance",
    [
        Categorical(np.array([[0.5, 0.2]])),
        Categorical(np.full((1, 1), np.nan)),
        DiscreteUniform(np.zeros(2, int), 2),
        Uniform(np.zeros(2), np.full(2, np.inf)),
        Normal(np.full(2, np.nan), np.ones(2)),
        7,
    ],
)
def test_what_nature_cannot_draw_is_told(chance: Chance) -> None:
    odd = changed(Heap, "chance", lambda self, s, a: (chance,))
    assert "chance: got " in told(odd)


def test_a_problem_is_looked_at_with_the_parameters_that_are_set(tmp_path: Path) -> None:
    file = tmp_path / "own.py"
    file.write_text("from tests.support.brought import Heap as Own\n")
    assert resolve_problem(f"{file}:Own", {"discount": "0.5"}).problem.discount == 0.5
    file.write_text(
        "from tests.support.brought import Heap\nOwn = type('O', (Heap,), {'state_count': 0})"
    )
    with pytest.raises(BadParameter, match=r"own.py:Own: state_count: got 0, expected how many"):
        resolve_problem(f"{file}:Own", {})


def test_a_state_that_is_none_of_a_problems_is_told_where_all_are_listed() -> None:
    far = changed(Heap, "resolve_events", _moved(np.full(2, 9), PAID, np.full(2, 9)))
    with pytest.raises(BadParameter, match="got states 9 to 9, expected 0 to 4"):
        far.joint_belief_update(np.eye(5)[4], [0], [])


def test_an_error_is_blamed_on_code_that_is_not_ours() -> None:
    with pytest.raises(IndexError) as caught:
        np.zeros(1)[7]
    told = describe_error_location(caught.value)
    assert told.startswith("./tests/laws/test_sound.py:")
    assert told.endswith(": IndexError: index 7 is out of bounds for axis 0 with size 1")
    assert describe_error_location(ValueError()) == ""


def test_a_package_of_another_environment_is_not_blamed(tmp_path: Path) -> None:
    library = tmp_path / "site-packages" / "big.py"
    with pytest.raises(MemoryError) as caught:
        exec(compile("raise MemoryError('of 32 TiB')", library, "exec"))
    told = describe_error_location(caught.value)
    assert told.startswith("./tests/laws/test_sound.py:")
    assert told.endswith(": MemoryError: of 32 TiB")

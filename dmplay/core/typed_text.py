"""Typed texts: numbers, probabilities, labels, states, histories and beliefs."""

import math
import re
from collections.abc import Mapping, Sequence

import numpy as np

from dmplay.core.arrays import Array, Reals
from dmplay.core.belief import normalize_belief
from dmplay.core.problem import ContinuousStates, Problem
from dmplay.core.spaces import Labels, normalize_label
from dmplay.errors import BadParameter, UnknownName

MAX_QUOTED_CHARACTERS = 60  # maximum characters of a bad value in an error message
MAX_LISTED_NAMES = 8  # maximum number of states in an error message
MAX_ORDERED_LABELS = 4  # more probabilities are typed with their names
PAIR_PATTERN = re.compile(r"\(?\s*(-?\d+)\s*(?:,|\s)\s*(-?\d+)\s*\)?")  # such as (8,2)
FRACTION_PATTERN = re.compile(r"([-+]?\d+)\s*/\s*(\d+)")


def parse_number(text: str) -> float:
    """Return the number of a text such as 0.15, 15% or 3/20; raise BadParameter for others."""
    fraction = FRACTION_PATTERN.fullmatch(text.strip())
    try:
        if fraction:
            return int(fraction[1]) / int(fraction[2])
        number = float(text.strip().removesuffix("%")) / (100 if text.strip().endswith("%") else 1)
    except (ValueError, ZeroDivisionError):
        raise BadParameter(f"got {text!r}, expected a number, such as 0.15") from None
    if not math.isfinite(number):
        raise BadParameter(f"got {text!r}, expected a finite number")
    return number


def parse_whole_number(text: str) -> int:
    """Return the whole number of a text; raise BadParameter for others."""
    if not text.strip().isdecimal() or len(text) > len(str(2**63)):
        raise BadParameter(f"got {text!r}, expected a whole number")
    return int(text)


def parse_distribution(
    text: str, labels: tuple[str, ...], noun: str = "answer"
) -> dict[str, float]:
    """Return typed probabilities by label, such as `hungry 0.8 sated 0.2` or `hungry=0.8, ...`.

    Without names, there is one number for each label, in their order.
    """
    words = split_labels(text.replace("=", " ").replace(": ", " "))
    label_forms = {_strip_parentheses(label) for label in labels}
    has_names = not len(words) % 2 and all(
        _strip_parentheses(word) in label_forms for word in words[::2]
    )
    if len(words) == len(labels) and not has_names:
        words = [word for pair in zip(labels, words, strict=True) for word in pair]
    if len(words) % 2 or not words:
        raise BadParameter(f"got {text!r}, expected {describe_distribution_syntax(labels)}")
    typed: dict[str, float] = {}
    for name, number in zip(words[::2], words[1::2], strict=True):
        label = find_label(name, labels, noun)
        if label in typed:
            raise BadParameter(f"got {label} twice, expected it once")
        typed[label] = parse_number(number)
    return typed


def describe_distribution_syntax(labels: tuple[str, ...]) -> str:
    """Return the form in which probabilities of labels can be typed."""
    if len(labels) > MAX_ORDERED_LABELS:
        return "pairs of a name and a number"
    names = f"{', '.join(labels[:-1])} and {labels[-1]}"
    return f"{len(labels)} numbers: the probabilities of {names}"


def split_labels(text: str) -> list[str]:
    """Return the words of a list, which spaces, commas or `>` separate; `(8, 2)` is one word."""
    joined = re.sub(r"(?<=\d),\s+(?=-?\d+\s*\))", ",", text)  # within parentheses
    return re.sub(r",\s|>|(?<=\)),", " ", joined).split()


def find_label(text: str, labels: tuple[str, ...], noun: str = "answer") -> str:
    """Return the label that a text names; raise UnknownName with the nearest names.

    Parentheses, and spaces after commas, need not be typed: `8,2` names `(8,2)`.
    """
    by_normal_form = {_strip_parentheses(label): label for label in labels}
    label = by_normal_form.get(_strip_parentheses(text))
    if label is None:
        raise UnknownName(noun, text.strip(), labels)
    return label


def parse_state(problem: Problem, text: str) -> Array:
    """Return the state that a text names; raise BadParameter if it names none."""
    start = problem.sample_initial_states(np.zeros((1, problem.uniform_counts.start)))[0]
    for spelling in _list_state_spellings(text):
        try:
            state = problem.parse_state(spelling)
        except (ValueError, LookupError):
            continue
        is_finite = state.dtype.kind != "f" or bool(np.isfinite(state).all())
        if state.shape == start.shape and is_finite:
            return state
    raise BadParameter(
        f"got {text!r}, expected a state such as {format_typed_state(problem, start)}"
    )


def format_typed_state(problem: Problem, state: Array) -> str:
    """Return a state as it can be typed; real numbers have three significant digits."""
    is_rounded = isinstance(problem.state_count, ContinuousStates)
    return problem.describe_state(state) if is_rounded else problem.format_state(state)


def parse_history(problem: Problem, seat: int, history: Sequence[str]) -> list[tuple[int, int]]:
    """Return the action of a seat and its observation in each turn of a history."""
    observations = problem.observations[seat] if problem.partially_observable else None
    if not isinstance(observations, Labels):
        raise BadParameter("history: expected a problem that has observations with labels")
    example = f"{problem.format_action(seat, 0)} {observations[0]}"
    pairs = []
    for turn in history:
        action, _, observation = str(turn).strip().rpartition(" ")
        if not action or not isinstance(turn, str) or isinstance(history, str):
            got = repr(history if isinstance(history, str) else turn)
            expected = f"expected an action and an observation in each text, as in {[example]}"
            raise BadParameter(f"history: got {got}, {expected}")
        action_index = int(problem.parse_action(seat, action))
        pairs.append((action_index, observations.parse_action(observation)))
    return pairs


def parse_belief(problem: Problem, text: str) -> Reals:
    """Return the belief `[S]` that a text describes; raise BadParameter if its sum is not 1."""
    names = list_state_names(problem)
    typed = parse_distribution(text, names, "state")
    return normalize_belief(np.array([typed.get(name, 0.0) for name in names]))


def list_state_names(problem: Problem) -> tuple[str, ...]:
    """Return the name of each state, in the order of beliefs."""
    return tuple(map(problem.format_state, problem.enumerate_states()))


def read_belief(problem: Problem, value: object) -> Reals:
    """Return the belief `[S]` in a text, a list or array, or a mapping of state names.

    States that a mapping leaves out have probability 0. Raise BadParameter for other values.
    """
    if isinstance(value, str):
        return parse_belief(problem, value)
    names = list_state_names(problem)
    if isinstance(value, Mapping):
        by_label = {find_label(str(name), names, "state"): number for name, number in value.items()}
        value = [by_label.get(name, 0.0) for name in names]
    value = value.tolist() if isinstance(value, np.ndarray) else value
    numbers = value if isinstance(value, list | tuple) else []
    if len(numbers) != len(names) or not all(map(_is_number, numbers)):
        got = repr(value)[:MAX_QUOTED_CHARACTERS]
        expected = f"a probability for each state: {', '.join(names[:MAX_LISTED_NAMES])}"
        expected += ", ..." * (len(names) > MAX_LISTED_NAMES)
        raise BadParameter(f"got {got}, expected {expected}")
    return normalize_belief(np.array(numbers, float))


def _is_number(value: object) -> bool:
    """Return whether a value is a number of Python or a float of NumPy."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def _list_state_spellings(text: str) -> list[str]:
    """Return a typed state as it is, as a pair `(8,2)`, and with spaces for commas."""
    pair = PAIR_PATTERN.fullmatch(text.strip())
    return [text, f"({pair[1]},{pair[2]})" if pair else " ".join(text.replace(",", " ").split())]


def _strip_parentheses(text: str) -> str:
    """Return a label in lower case, without outer parentheses and spaces around commas."""
    pair = PAIR_PATTERN.fullmatch(text.strip())
    return f"{pair[1]},{pair[2]}" if pair else normalize_label(text)

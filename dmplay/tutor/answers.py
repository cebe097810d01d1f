"""Typed answers: reading them, and checking them against the truth of the problem."""

from collections.abc import Mapping
from typing import NamedTuple

from dmplay.core.typed_text import (
    describe_distribution_syntax,
    find_label,
    format_typed_state,
    parse_distribution,
    parse_number,
    parse_whole_number,
    split_labels,
)
from dmplay.errors import BadParameter
from dmplay.tutor.lesson import Prediction
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.quantity import Quantity, compute_truth, find_quantity
from dmplay.tutor.truth import Truth, format_number

DEFAULT_TOLERANCE = 1e-9
MAX_LISTED_LABELS = 10
PROBABILITY_SUM_TOLERANCE = 0.011  # so that three probabilities of two decimals are accepted


class AnswerCheck(NamedTuple):
    """The result of a check: whether the answer is right, and one sentence on it."""

    is_right: bool
    reason: str


def compute_predicted_value(position: PositionInGame, prediction: Prediction) -> Truth | None:
    """Return the truth that the player predicts; None if it depends on what the player types."""
    return None if prediction.asks else compute_truth(position, prediction.quantity)


def describe_expected_answer(
    position: PositionInGame, prediction: Prediction, truth: Truth | None
) -> str:
    """Return the kind of answer to type, for example `a number` or `e, ne, nw, w, sw or se`."""
    if truth is None:
        return _describe_expected_argument(position, prediction)
    if isinstance(truth.value, Mapping):
        example = truth.labels[: min(2, len(truth.labels))]
        pairs = " ".join(f"{label} 0.5" for label in example)
        return f"probabilities, for example {pairs}"
    if isinstance(truth.value, tuple):
        return f"the names {' '.join(sorted(truth.labels))} in the right order"
    return _format_labels(truth.labels) if isinstance(truth.value, frozenset) else "a number"


def _describe_expected_argument(position: PositionInGame, prediction: Prediction) -> str:
    """Return the kind of argument of the quantity to type."""
    annotation = _find_quantity(position, prediction).parameters[prediction.asks].annotation
    if prediction.asks == "action":
        return _format_labels(position.problem.actions[position.seat].labels)
    if prediction.asks == "state":
        return f"a state, such as {format_typed_state(position.problem, position.session.state)}"
    if prediction.asks == "belief":
        names = map(position.problem.format_state, position.problem.enumerate_states())
        return describe_distribution_syntax(tuple(names))
    return {int: "a whole number", float: "a number"}.get(annotation, f"a {prediction.asks}")


def check_answer(
    position: PositionInGame, prediction: Prediction, truth: Truth | None, text: str
) -> AnswerCheck:
    """Return whether a typed answer is right; raise BadParameter if it cannot be read."""
    if truth is None:
        return _check_typed_argument(position, prediction, text)
    match truth.value:
        case Mapping():
            return _check_distribution(truth, prediction, text)
        case frozenset():
            label = find_label(text, truth.labels)
            is_right = label in truth.value
            return AnswerCheck(is_right, truth.comparison if is_right else truth.explain(label))
        case tuple():
            return _check_order(truth, text)
    typed = parse_number(text)
    number = abs(typed) if truth.is_cost else typed
    if abs(number - truth.value) <= max(prediction.tolerance, _get_tolerance(position, truth)):
        exact = format_number(truth.value)
        return AnswerCheck(
            True, f"more precisely, it is {exact}" * (exact != format_number(number))
        )
    direction = "high" if number > truth.value else "low"
    explanation = truth.explain(str(number))
    cost = f", a cost of {format_number(number)}," * (number != typed)
    reason = f"{format_number(typed)}{cost} is too {direction}"
    return AnswerCheck(False, reason + _append_explanation(explanation))


def describe_right_answer(
    position: PositionInGame, prediction: Prediction, truth: Truth | None
) -> str:
    """Return the right answer as text; '' if the player chooses a state, belief or number."""
    if truth is None and prediction.asks == "action":
        labels = position.problem.actions[position.seat].labels
        checks = {label: _check_typed_argument(position, prediction, label) for label in labels}
        return " or ".join(label for label, check in checks.items() if check.is_right)
    if truth is None:
        return ""
    match truth.value:
        case Mapping():
            return ", ".join(f"{label} {format_number(p)}" for label, p in truth.value.items())
        case frozenset():
            return " or ".join(sorted(truth.value))
        case tuple():
            return " ".join(truth.value)
    return format_number(truth.value)


def _find_quantity(position: PositionInGame, prediction: Prediction) -> Quantity:
    """Return the quantity of a question about a position."""
    return find_quantity(prediction.quantity.name, position.problem, position.problem_name)


def _check_typed_argument(
    position: PositionInGame, prediction: Prediction, text: str
) -> AnswerCheck:
    """Return whether the quantity of a typed argument is within the bounds."""
    annotation = _find_quantity(position, prediction).parameters[prediction.asks].annotation
    argument: object = text
    if annotation is float:
        argument = parse_number(text)
    elif annotation is int:
        argument = parse_whole_number(text)
    truth = compute_truth(position, prediction.quantity, **{prediction.asks: argument})
    if not isinstance(truth.value, float | int):
        raise BadParameter(f"{prediction.quantity.name} is not a number, expected one with asks")
    low, high = prediction.at_least, prediction.at_most
    tolerance = _get_tolerance(position, truth)
    is_right = (low is None or truth.value >= low - tolerance) and (
        high is None or truth.value <= high + tolerance
    )
    result = prediction.result or f"the {prediction.quantity.name.replace('-', ' ')} is then"
    value = format_number(truth.value)
    sentence = result.replace("{}", value) if "{}" in result else f"{result} {value}"
    explanation = _append_explanation(truth.explain(value))
    if is_right:
        return AnswerCheck(True, truth.explain(value) if low == high else sentence + explanation)
    is_too_low = low is not None and truth.value < low
    bound = f"at least {low:g}" if is_too_low else f"at most {high:g}"
    if low == high:
        bound = f"{low:g}"
    return AnswerCheck(
        False, f"{sentence}; the answer is right if this number is {bound}{explanation}"
    )


def _get_tolerance(position: PositionInGame, truth: Truth) -> float:
    """Return the difference up to which a number is equal to the truth.

    It is relative to the truth, which may be a probability, and near 0 to the scale of rewards.
    """
    assert isinstance(truth.value, float | int)
    return DEFAULT_TOLERANCE * max(abs(truth.value), min(position.problem.reward_scale, 1.0))


def _check_distribution(truth: Truth, prediction: Prediction, text: str) -> AnswerCheck:
    """Return whether typed probabilities are within the tolerance of the true ones.

    The reason names no label that the player did not type.
    """
    assert isinstance(truth.value, Mapping)
    typed = parse_distribution(text, truth.labels)
    total = sum(typed.values())
    if abs(total - 1.0) > PROBABILITY_SUM_TOLERANCE:
        return AnswerCheck(False, f"your probabilities add up to {format_number(total)}, not to 1")
    errors = {
        label: typed.get(label, 0.0) - truth.value.get(label, 0.0)
        for label in {**truth.value, **typed}
    }
    tolerance = max(prediction.tolerance, DEFAULT_TOLERANCE)
    if all(abs(error) <= tolerance for error in errors.values()):
        return AnswerCheck(True, "")
    wrong_labels = [label for label in typed if abs(errors[label]) > tolerance]
    if not wrong_labels:
        return AnswerCheck(False, "a name with a probability above 0 is missing")
    worst = max(wrong_labels, key=lambda label: abs(errors[label]))
    direction = "high" if errors[worst] > 0 else "low"
    number = format_number(typed[worst])
    return AnswerCheck(
        False, f"{number} for {worst} is too {direction}" + _append_explanation(truth.explain(text))
    )


def _check_order(truth: Truth, text: str) -> AnswerCheck:
    """Return whether typed names are in order; raise BadParameter unless each is typed once."""
    names = [find_label(word, truth.labels) for word in split_labels(text)]
    if sorted(names) != sorted(truth.labels):
        raise BadParameter(f"got {text!r}, expected each of {' '.join(sorted(truth.labels))} once")
    explanation = truth.explain(" ".join(names))
    return AnswerCheck(not explanation, explanation or truth.comparison)


def _format_labels(labels: tuple[str, ...]) -> str:
    """Return labels as a list with `or`; only some of many."""
    if len(labels) > MAX_LISTED_LABELS:
        are_numbers = labels[0].isdecimal() and labels[-1].isdecimal()
        return f"{labels[0]} to {labels[-1]}" if are_numbers else f"a name such as {labels[0]}"
    return " or ".join(filter(None, [", ".join(labels[:-1]), labels[-1]]))


def _append_explanation(explanation: str) -> str:
    """Return an explanation after a full stop, '' if there is none."""
    return f". {explanation[:1].upper()}{explanation[1:]}" if explanation else ""

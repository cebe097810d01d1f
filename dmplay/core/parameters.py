"""Parameters of problems and agents: dataclass fields with a description and bounds."""

from collections.abc import Mapping, Sequence
from dataclasses import Field, field, fields
from typing import Any, TypeVar

import numpy as np

from dmplay.core.text import format_number
from dmplay.errors import BadParameter

T = TypeVar("T")
DEFAULT_PARAMETER_BOUND = 1e6  # largest absolute value of a parameter without bounds


def parameter(  # noqa: PLR0913 - a problem sets each of them
    default: T,
    description: str,
    low: float | None = None,
    high: float | None = None,
    *,
    exclusive_low: bool = False,
    choices: Sequence[str] = (),
) -> T:
    """Return a dataclass field with a description and, for numbers, its bounds.

    A missing bound is a million in absolute value, or ten times the default if that is more.
    `exclusive_low` raises the lower bound by a millionth. A text must be one of `choices`, or any
    text if there are none.
    """
    bound = DEFAULT_PARAMETER_BOUND
    if isinstance(default, int | float):
        bound = max(DEFAULT_PARAMETER_BOUND, 10 * abs(default))
    low, high = -bound if low is None else low, bound if high is None else high
    low += 1 / DEFAULT_PARAMETER_BOUND if exclusive_low else 0
    metadata = {"meaning": description, "low": low, "high": high, "among": choices}
    return field(default=default, metadata=metadata)


INTEGER_TYPES, NUMBER_TYPES = (int, np.integer), (int, float, np.number)
# type of the default -> name of the expected type, accepted types
PARAMETER_TYPES: Mapping[type, tuple[str, tuple[type, ...]]] = {
    int: ("a whole number", INTEGER_TYPES),
    float: ("a number", NUMBER_TYPES),
    bool: ("true or false", (bool, np.bool_)),
    str: ("text", (str,)),
}
MAX_PRINTED_NUMBER = 1e300  # largest number that an error message prints


def check_parameters(instance: Any) -> None:
    """Raise BadParameter if a dataclass parameter has a wrong type or is out of bounds."""
    for parameter_field in fields(instance):
        if "low" in parameter_field.metadata and type(parameter_field.default) in PARAMETER_TYPES:
            _check_parameter(getattr(instance, parameter_field.name), parameter_field)


def _check_parameter(value: object, parameter_field: Field[Any]) -> None:
    """Raise BadParameter if one parameter, a number, a flag or a text, has an invalid value."""
    type_name, types = PARAMETER_TYPES[type(parameter_field.default)]
    is_bool = isinstance(value, bool | np.bool_)
    if not isinstance(value, types) or is_bool != isinstance(parameter_field.default, bool):
        raise BadParameter(f"{parameter_field.name}: got {value!r}, expected {type_name}")
    if isinstance(value, str) and value not in (parameter_field.metadata["among"] or (value,)):
        expected = f"one of {', '.join(parameter_field.metadata['among'])}"
        raise BadParameter(f"{parameter_field.name}: got {value!r}, expected {expected}")
    if is_bool or isinstance(value, str):
        return
    number: Any = value
    low, high = (parameter_field.metadata[key] for key in ("low", "high"))
    if not low <= number <= high:
        is_short = abs(number) <= MAX_PRINTED_NUMBER
        got = format_number(number) if is_short else "a number that is too large or not finite"
        has_upper_bound = high < DEFAULT_PARAMETER_BOUND or number > high
        upper_text = f" and at most {format_number(high)}" * has_upper_bound
        expected = f"a number at least {format_number(low)}{upper_text}"
        raise BadParameter(f"{parameter_field.name}: got {got}, expected {expected}")

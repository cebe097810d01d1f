"""Formulas of watched steps, whose printed arithmetic is computed again."""

import math
import re

import pytest

TERM_COUNT = re.compile(r"\(\d+ more terms?\)")


def assert_formula_adds_up(formula: str) -> None:
    """Assert that the last two parts of a formula, "NAME = SUM = RESULT", are equal.

    The numbers are printed in four digits, so that a sum of rounded numbers may differ slightly.
    """
    *_, terms, result = TERM_COUNT.sub("", formula).split(" = ")
    expression = terms.replace(" x ", " * ").replace("ln ", "log ")
    expression = re.sub(r"(?<=\d) \(", " * (", expression)  # a discount before a sum
    expression = re.sub(r"(sqrt|log) (\(|[\d.]+)", _call_function, expression)
    expected = eval(expression, {"__builtins__": {}, "sqrt": math.sqrt, "log": math.log})
    sizes = [abs(float(number)) for number in re.findall(r"\d+\.?\d*(?:e[+-]?\d+)?", expression)]
    assert float(result) == pytest.approx(expected, rel=2e-3, abs=2e-3 * max(sizes)), formula


def _call_function(match: "re.Match[str]") -> str:
    """Return a function's name with its argument in parentheses: "ln 12" is "log(12)"."""
    name, argument = match.groups()
    return f"{name}(" if argument == "(" else f"{name}({argument})"

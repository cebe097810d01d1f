"""Which view a problem has."""

import importlib
import importlib.util
from typing import cast

from dmplay.core import Problem
from dmplay.finding import problems
from dmplay.views import generic
from dmplay.views._canvas import Style


def style_of(problem: Problem) -> Style:
    """The view module of a problem; the generic one where it has none."""
    name = f"dmplay.views.{problems.stem(problem)}"
    own = problems.stem(problem) and importlib.util.find_spec(name)
    return cast(Style, importlib.import_module(name) if own else generic)

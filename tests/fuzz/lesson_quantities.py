"""Quantities of lessons with extreme arguments, on every problem, fitting or not."""

import contextlib
import inspect
import json
import traceback
from collections import ChainMap
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from random import Random

from dmplay.core.problem import Problem
from dmplay.core.spaces import Labels
from dmplay.errors import DmplayError
from dmplay.registry.builtin_names import problem_names
from dmplay.tutor.answers import check_answer, describe_expected_answer, describe_right_answer
from dmplay.tutor.lesson import PositionText, Prediction, QuantityCall
from dmplay.tutor.positions import PositionInGame, open_position
from dmplay.tutor.quantity import (
    FEATURES,
    QUANTITIES,
    Quantity,
    compute_truth,
    load_problem_quantities,
)
from tests.fuzz.case import Case, CaseOutcome

WHOLE_NUMBERS = (0, 1, 1, 2, 3, 10, 40, 1000, 10**5, 10**9, 2**62, 10**400)
REAL_NUMBERS = (0.0, 1.0, -1.0, 0.5, 1e-300, 1e6, 1e300, -1e300, float("inf"), float("nan"))
AGENTS = (
    "random", "optimal", "search:simulations=2", "nash", "level-k", "tit-for-tat", "equilibrium",
    "plan", "", "nobody", "script:/etc/passwd", "bot:true", "./spy.py:Spy",
)  # fmt: skip
ANSWERS = ("0", "1", "-1e300", "0.5", "x", "", "(1,1)", "feed", "nan", "0.5 0.5", "e w nw")


@cache
def open_problem(name: str) -> PositionInGame:
    """Return the start of a game of a problem with few turns."""
    return open_position(PositionText(name, turns=5), Path())


@cache
def list_states(name: str) -> tuple[str, ...]:
    """Return some states of a problem as text."""
    position = open_problem(name)
    start = position.problem.format_state(position.session.state)
    try:
        states = position.problem.enumerate_states()[:4]
    except DmplayError:
        return (start,)
    return (start, *map(position.problem.format_state, states))


@cache
def list_fitting_problems(quantity: str) -> tuple[str, ...]:
    """Return the problems that a quantity is for."""
    if quantity not in QUANTITIES:
        return tuple(
            name
            for name in problem_names()
            if quantity in load_problem_quantities(open_problem(name).problem)
        )
    features = QUANTITIES[quantity].features
    return tuple(
        name
        for name in problem_names()
        if all(FEATURES[feature](open_problem(name).problem) for feature in features)
    )


@cache
def list_quantities() -> Mapping[str, Quantity]:
    """Return the general quantities and those of the built-in problems."""
    problems = (open_problem(name).problem for name in problem_names())
    return {**QUANTITIES, **ChainMap(*map(dict, map(load_problem_quantities, problems)))}


def draw_quantity_case(random: Random) -> Case:
    """Draw a problem, a quantity, its arguments, and answers to it."""
    quantity = random.choice([*list_quantities()])
    fitting_names = list_fitting_problems(quantity) if random.random() < 0.8 else ()
    name = random.choice(fitting_names or problem_names())
    parameters = [*list_quantities()[quantity].parameters.items()]
    arguments = {
        key: draw_argument(random, name, key, parameter.annotation)
        for key, parameter in parameters
        if parameter.default is inspect.Parameter.empty or random.random() < 0.3
    }
    return Case((name, quantity, json.dumps(arguments)), typed="\n".join(random.sample(ANSWERS, 2)))


def draw_argument(random: Random, name: str, key: str, annotation: object) -> object:
    """Draw an argument of a quantity: usually one that fits, else an extreme one."""
    if annotation is int:
        return random.choice(WHOLE_NUMBERS)
    if annotation is float:
        return random.choice(REAL_NUMBERS)
    problem = open_problem(name).problem
    if annotation == Sequence[str]:
        count = random.choice((1, 1, 2, 4, 99, 3000))
        return [draw_text(random, problem, name, key) for _ in range(min(count, 9))] * (
            count // 9 or 1
        )
    return draw_text(random, problem, name, key)


def draw_text(random: Random, problem: Problem, name: str, key: str) -> str:
    """Draw a text that may be right for an argument of this name."""
    if random.random() < 0.05:
        return random.choice(ANSWERS)
    labels = [random.choice(actions.labels or ("0.5", "9e99")) for actions in problem.actions]
    states = list_states(name)
    space = problem.observations[0] if problem.observations else None
    observation = random.choice(space.labels) if isinstance(space, Labels) else "0"
    state = random.choice(states)
    fitting_texts = {
        "action": labels[0], "below": labels[0], "above": labels[0], "actions": " ".join(labels),
        "rounds": " ".join(labels), "state": state, "exit_state": state, "outcome": state,
        "states": state, "agent": random.choice(AGENTS), "candidates": random.choice(AGENTS),
        "belief": f"{states[0]} {random.choice((1, 0.5, -1, 1e308))} {states[-1]} 0.5",
        "opponent": random.choice(("uniform", labels[-1], f"{labels[-1]} 1", f"{labels[-1]} -3")),
        "history": f"{labels[0]} {observation}", "observation": observation,
    }  # fmt: skip
    return fitting_texts[key]


def run_quantity_case(case: Case) -> CaseOutcome:
    """Compute a quantity, and reply to the answers, as a lesson does."""
    name, quantity, text = case.words
    position, lines = open_problem(name), list[str]()
    prediction = Prediction(QuantityCall(quantity, json.loads(text)))
    try:
        truth = compute_truth(position, prediction.quantity)
        lines.append(describe_expected_answer(position, prediction, truth))
        lines.append(describe_right_answer(position, prediction, truth))
        for answer in [*case.typed.split("\n"), *truth.labels[:2]]:
            with contextlib.suppress(DmplayError):
                lines.append(check_answer(position, prediction, truth, answer).reason)
    except DmplayError as error:
        return CaseOutcome("refused", "\n".join([*lines, str(error)]))
    except Exception as error:
        return CaseOutcome(type(error).__name__, trace=traceback.format_exc())
    return CaseOutcome("exit 0", "\n".join(lines))

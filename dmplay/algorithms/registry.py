"""Algorithms by name: every module of this folder that can be watched, or that learns."""

import importlib
from functools import cache
from pathlib import Path
from types import ModuleType

from dmplay.algorithms.learner import Learner
from dmplay.algorithms.step import Algorithm
from dmplay.core.problem import Problem
from dmplay.errors import BadParameter, UnknownName


@cache
def _load_modules() -> list[ModuleType]:
    """Return the modules of this folder, in alphabetical order."""
    stems = sorted(file.stem for file in Path(__file__).parent.glob("[a-z]*.py"))
    return [importlib.import_module(f"{__package__}.{stem}") for stem in stems]


@cache
def load_learners() -> dict[str, type[Learner]]:
    """Return the classes of all learners by name, in alphabetical order."""
    learners = [getattr(module, "LEARNER", None) for module in _load_modules()]
    return {learner.name: learner for learner in filter(None, learners)}


@cache
def load_algorithms() -> dict[str, Algorithm]:
    """Return all algorithms that can be watched by name, in alphabetical order."""
    algorithms = [getattr(module, "ALGORITHM", None) for module in _load_modules()]
    return {algorithm.name: algorithm for algorithm in filter(None, algorithms)}


def find_algorithm(name: str) -> Algorithm:
    """Return the algorithm with this name; raise UnknownName with the nearest names."""
    algorithms = load_algorithms()
    if name.lower() not in algorithms:
        raise UnknownName("algorithm", name, algorithms)
    return algorithms[name.lower()]


def list_fitting_algorithms(problem: Problem) -> list[str]:
    """Return the names of the algorithms that can be watched on a problem."""
    return [name for name, entry in load_algorithms().items() if not entry.explain_misfit(problem)]


def check_algorithm_fits(algorithm: Algorithm, problem: Problem, problem_name: str) -> None:
    """Raise BadParameter with the reason and the fitting algorithms unless the problem fits."""
    obstacle = algorithm.explain_misfit(problem)
    if obstacle:
        fitting = ", ".join(list_fitting_algorithms(problem)) or "none"
        fault = f"{algorithm.name} does not fit {problem_name}: {obstacle}"
        raise BadParameter(f"{fault}; algorithms that fit it: {fitting}")

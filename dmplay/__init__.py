"""Fifteen decision problems to play, evaluate agents on, and test with recorded transcripts."""

from importlib import import_module

__version__ = "0.1.0"

# The module that defines each public name. It is imported on first use, so that `dmplay --version`
# needs no NumPy.
_PUBLIC_MODULES = {
    "Categorical": "chance",
    "SeededUniforms": "dice",
    "Interval": "core",
    "Labels": "core",
    "Normal": "chance",
    "Outcome": "core",
    "DiscreteUniform": "chance",
    "Policy": "core",
    "Problem": "core",
    "Session": "session",
    "Uniform": "chance",
    "Tables": "tabular",
    "Tabular": "tabular",
    "load_agent": "finding.agents",
    "check": "conformance",
    "compare": "measure.comparing",
    "enumerate_outcomes": "core",
    "load_problem": "finding.problems",
    "play": "hand",
    "rollout": "rollouts",
    "run": "measure.running",
    "run_tournament": "measure.tournament",
}
__all__ = [*_PUBLIC_MODULES]  # noqa: PLE0604 - the names above


def __getattr__(name: str) -> object:
    if name not in _PUBLIC_MODULES:
        raise AttributeError(f"module 'dmplay' has no attribute {name!r}")
    return getattr(import_module(f"dmplay.{_PUBLIC_MODULES[name]}"), name)


def __dir__() -> list[str]:
    return [*globals(), *_PUBLIC_MODULES]

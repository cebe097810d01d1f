"""Fifteen decision problems to play, evaluate agents on, and test with recorded transcripts."""

from importlib import import_module

from dmplay.core import notebook_display

__version__ = "0.1.0"

# The module that defines each public name. It is imported on first use, so that `dmplay --version`
# needs no NumPy.
_PUBLIC_MODULES = {
    "Categorical": "core.chance",
    "DiscreteUniform": "core.chance",
    "Interval": "core.spaces",
    "Labels": "core.spaces",
    "Normal": "core.chance",
    "Outcome": "core.problem",
    "Policy": "core.policy",
    "Problem": "core.problem",
    "SeededUniforms": "core.uniforms",
    "Session": "core.session",
    "Tables": "core.tabular",
    "Tabular": "core.tabular",
    "Uniform": "core.chance",
    "check": "validation.conformance",
    "compare": "evaluation.comparison",
    "enumerate_outcomes": "core.problem",
    "load_agent": "registry.agents",
    "load_problem": "registry.problems",
    "play": "game.manual_game",
    "rollout": "simulation.rollouts",
    "run": "evaluation.many_games",
    "run_tournament": "evaluation.tournament",
}
# public names of version 0.1.0 that were renamed
_RENAMED = {
    "Dice": "SeededUniforms",
    "Pick": "DiscreteUniform",
    "Span": "Uniform",
    "agent": "load_agent",
    "exact": "enumerate_outcomes",
    "load": "load_problem",
    "tournament": "run_tournament",
}
__all__ = [*_PUBLIC_MODULES]  # noqa: PLE0604 - the names above


def __getattr__(name: str) -> object:
    if name in _RENAMED:
        raise AttributeError(f"dmplay.{name} was renamed to dmplay.{_RENAMED[name]}")
    if name not in _PUBLIC_MODULES:
        raise AttributeError(f"module 'dmplay' has no attribute {name!r}")
    return getattr(import_module(f"dmplay.{_PUBLIC_MODULES[name]}"), name)


def _render_in_notebook(game: object) -> dict[str, str]:
    """Return a game as a notebook shows it; the drawing code is imported on first use."""
    from dmplay.output.notebook_rendering import mime_bundle

    return mime_bundle(game)


notebook_display.register_renderer(_render_in_notebook)


def __dir__() -> list[str]:
    return [*globals(), *_PUBLIC_MODULES]

"""Decision problems to play, evaluate agents on, and test with recorded transcripts.

The names listed here are the public interface; `dmplay guide python` describes them. Everything
else in the package's folders is private and may change.
"""

from importlib import import_module

from dmplay.core import notebook_display

__version__ = "0.1.0"

# The module that defines each public name. It is imported on first use, so that `dmplay --version`
# needs no NumPy.
_PUBLIC_MODULES = {
    # problems: their base classes and parts
    "ContinuousStates": "core.problem",
    "GridAxis": "core.state_grid",
    "MatrixGame": "core.matrix_game",
    "Outcome": "core.problem",
    "Problem": "core.problem",
    "SparseMatrix": "core.sparse_matrix",
    "SparseTables": "core.tabular",
    "StateGrid": "core.state_grid",
    "StatePart": "core.problem",
    "StateParts": "core.problem",
    "Tables": "core.tabular",
    "Tabular": "core.tabular",
    "WAIT_LABEL": "core.problem",
    "enumerate_outcomes": "core.problem",
    "parameter": "core.parameters",
    "tabulate": "core.tabular",
    # spaces of actions and observations
    "Interval": "core.spaces",
    "Labels": "core.spaces",
    "RealVector": "core.spaces",
    "TextLine": "core.spaces",
    # random events
    "Categorical": "core.chance",
    "DiscreteUniform": "core.chance",
    "Normal": "core.chance",
    "SeededUniforms": "core.uniforms",
    "Uniform": "core.chance",
    # policies: their interface and simple bases
    "Accuracy": "core.action_values",
    "BeliefPolicy": "agents.belief_policy",
    "ConstantPolicy": "agents.base",
    "Horizon": "core.action_values",
    "Percept": "core.policy",
    "Policy": "core.policy",
    "ReactivePolicy": "agents.base",
    "Roster": "agents.available_agents",
    "requires_fields": "core.policy",
    "SeatPolicy": "agents.base",
    "StationaryPolicy": "agents.base",
    "ValuesBasis": "core.action_values",
    # figures and boards of problems
    "Axis": "draw.axes",
    "BarsPanel": "draw.panels",
    "BeliefMarks": "draw.panels",
    "Figure": "game.plot_kinds",
    "GridPanel": "draw.panels",
    "HexPanel": "draw.panels",
    "LinePanel": "draw.panels",
    "Plot": "draw.panels",
    "PlottedHex": "draw.panels",
    "Series": "draw.panels",
    "TablePanel": "draw.panels",
    "TrianglePanel": "draw.panels",
    "draw_panels": "draw.panel_text",
    # what puzzles about a problem use
    "RuleOfThumb": "game.rules_of_thumb",
    # by name, from files and installed packages
    "list_agents": "registry.agents",
    "list_problems": "registry.problems",
    "load_agent": "registry.agents",
    "load_problem": "registry.problems",
    # one game
    "Playback": "game.playback",
    "Position": "game.position",
    "Session": "core.session",
    "View": "core.session",
    "play": "game.manual_game",
    "read": "game.recorded_games",
    "review": "game.playback",
    "save": "game.session_files",
    "verify": "game.transcript_verification",
    # many games, and solutions
    "check": "validation.conformance",
    "compare": "evaluation.comparison",
    "evaluate": "evaluation.agent_evaluation",
    "evaluate_transcripts": "evaluation.agent_evaluation",
    "rollout": "evaluation.many_games",
    "run": "evaluation.many_games",
    "run_tournament": "evaluation.tournament",
    "Setting": "evaluation.sweep",
    "Solution": "evaluation.solutions.solution",
    "solve": "evaluation.solutions.solve",
    "sweep": "evaluation.sweep",
    "tournament": "evaluation.tournament",
    "train": "training.train",
}
__all__ = [*_PUBLIC_MODULES]  # noqa: PLE0604 - the names above


def __getattr__(name: str) -> object:
    if name not in _PUBLIC_MODULES:
        raise AttributeError(f"module 'dmplay' has no attribute {name!r}")
    return getattr(import_module(f"dmplay.{_PUBLIC_MODULES[name]}"), name)


def _render_in_notebook(game: object) -> dict[str, str]:
    """Return a game as a notebook shows it; the drawing code is imported on first use."""
    from dmplay.output.notebook_rendering import render_mime_bundle

    return render_mime_bundle(game)


notebook_display.register_renderer(_render_in_notebook)


def __dir__() -> list[str]:
    return [*globals(), *_PUBLIC_MODULES]

"""dmplay: fifteen decision problems to play, pit agents in, and pin with golden transcripts."""

from importlib import import_module

__version__ = "0.1.0"

# Where each public name lives; loaded on first use, so that `dmplay --version` needs no numpy.
_HOMES = {
    "Categorical": "chance",
    "Dice": "dice",
    "Interval": "core",
    "Labels": "core",
    "Normal": "chance",
    "Outcome": "core",
    "Pick": "chance",
    "Policy": "core",
    "Problem": "core",
    "Session": "session",
    "Span": "chance",
    "Tables": "tabular",
    "Tabular": "tabular",
    "agent": "finding.agents",
    "check": "conformance",
    "compare": "measure.comparing",
    "exact": "core",
    "load": "finding.problems",
    "play": "hand",
    "rollout": "rollouts",
    "run": "measure.running",
    "tournament": "measure.tournament",
}
__all__ = [*_HOMES]  # noqa: PLE0604 - the names above


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'dmplay' has no attribute {name!r}")
    return getattr(import_module(f"dmplay.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return [*globals(), *_HOMES]

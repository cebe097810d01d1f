"""The user's options for solutions: turns, games, workers and work."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

from dmplay.errors import BadParameter
from dmplay.simulation.worker_pool import WorkerCount

DEFAULT_TURNS = 20  # of a problem without a horizon, if it is simulated or planned
# why a solution does not use an option; all other options are for simulations
UNUSED_OPTION_REASONS = {"turns": "takes no turn limit", "work": "computes no bounds"}


@dataclass
class SolveOptions:
    """The user's options for solutions; None stands for the default of each solution."""

    episodes: int | None = None
    turns: int | None = None
    workers: WorkerCount | None = None
    work: float | None = None  # times the default, for bounds on values
    method: str = ""  # the name of a solver; '' for the first one that fits
    used_options: set[str] = field(default_factory=set)  # names of the options that had an effect

    def check_options_used(self, method_name: str) -> None:
        """Raise BadParameter for an option that was set and had no effect."""
        for name in ("episodes", "turns", "workers", "work"):
            if getattr(self, name) not in (None, "auto") and name not in self.used_options:
                reason = UNUSED_OPTION_REASONS.get(name, "simulates no games")
                cause = f"because this solution {reason}; the method is {method_name}"
                raise BadParameter(f"{name}: has no effect, {cause}")


_options: ContextVar[SolveOptions | None] = ContextVar("options", default=None)


@contextmanager
def use_solve_options(options: SolveOptions) -> Iterator[None]:
    """Run the block with these options for simulations."""
    token = _options.set(options)
    try:
        yield
    finally:
        _options.reset(token)


def get_solve_options() -> SolveOptions:
    """Return the options of the user, or else the defaults."""
    return _options.get() or SolveOptions()


def resolve_horizon(default_turns: int | None) -> int | None:
    """Return the number of turns to plan, as set by the user or else the default.

    None stands for an infinite horizon: `resolve_horizon(None)` is None unless the user set a
    number.
    """
    options = get_solve_options()
    options.used_options.add("turns")
    return options.turns or default_turns


def resolve_bounds_work() -> float:
    """Return the work for bounds on values, as a multiple of the default."""
    options = get_solve_options()
    options.used_options.add("work")
    return options.work or 1.0

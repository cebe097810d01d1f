"""The spaces of Gymnasium and PettingZoo as dmplay's action and observation sets."""

from collections.abc import Sequence
from math import isfinite, prod
from typing import Any

import numpy as np

from dmplay.core import Interval, Labels
from dmplay.errors import BadParameter
from dmplay.guests.history import make_numbered_labels

MAX_ACTIONS = 10_000


class ActionSpaceAdapter:
    """The actions of a space: dmplay's names or numbers for them, and each as the space has it."""

    def __init__(self, space: Any, problem_name: str, names: Sequence[str] = ()) -> None:
        self._space = space
        self.action_set = self._make_action_set(problem_name, names)

    def _make_action_set(self, problem_name: str, names: Sequence[str]) -> Labels | Interval:
        space, kind = self._space, type(self._space).__name__
        if kind == "Discrete":
            return Labels(names) if names else make_numbered_labels(int(space.start), int(space.n))
        if (
            kind in ("MultiDiscrete", "MultiBinary")
            and prod(_component_sizes(space)) <= MAX_ACTIONS
        ):
            return Labels("-".join(map(str, one)) for one in np.ndindex(*_component_sizes(space)))
        if kind == "Box" and prod(space.shape) == 1:
            low, high = float(space.low.item()), float(space.high.item())
            if isfinite(low) and isfinite(high):
                return Interval(low, high)
        what = f"acts with a {kind} of shape {getattr(space, 'shape', None)}"
        raise BadParameter(
            f"{problem_name}: {what}; dmplay plays names, or one number between bounds"
        )

    def to_space_value(self, action: float) -> Any:
        """An action as the space has it."""
        space, kind = self._space, type(self._space).__name__
        if kind == "Discrete":
            return int(space.start) + int(action)
        if kind == "Box":
            return np.full(space.shape, action, space.dtype)
        each = np.unravel_index(int(action), _component_sizes(space))
        return np.array(each, space.dtype).reshape(space.shape)


def _component_sizes(space: Any) -> tuple[int, ...]:
    """How many values each part of an action has."""
    if type(space).__name__ == "MultiBinary":
        return (2,) * int(prod(space.shape))
    return tuple(int(n) for n in np.ravel(space.nvec))


def flat_dimension(space: Any, problem_name: str) -> int:
    """How many numbers an observation of a space is."""
    kind = type(space).__name__
    if kind == "Discrete":
        return 1
    if kind in ("Box", "MultiDiscrete", "MultiBinary"):
        return prod(space.shape)
    if kind in ("Tuple", "Dict"):
        return sum(flat_dimension(part, problem_name) for part in _list_subspaces(space))
    raise BadParameter(f"{problem_name}: observes a {kind}; dmplay shows numbers")


def flatten_observation(space: Any, observation: Any) -> list[float]:
    """An observation of a space as numbers."""
    kind = type(space).__name__
    if kind in ("Tuple", "Dict"):
        each = observation if kind == "Tuple" else [observation[key] for key in space.spaces]
        pairs = zip(_list_subspaces(space), each, strict=True)
        return [number for part, one in pairs for number in flatten_observation(part, one)]
    return [float(number) for number in np.ravel(observation)]


def _list_subspaces(space: Any) -> list[Any]:
    return [*(space.spaces.values() if hasattr(space.spaces, "values") else space.spaces)]

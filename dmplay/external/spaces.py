"""Conversions between the spaces of Gymnasium or PettingZoo and those of dmplay."""

from collections.abc import Sequence
from math import isfinite, prod
from typing import Any

import numpy as np

from dmplay.core.spaces import Interval, Labels
from dmplay.errors import BadParameter
from dmplay.external.history_problem import make_numbered_labels

MAX_ACTIONS = 10_000


class ActionSpaceAdapter:
    """The labels or interval for a space's actions, and their conversion to values of the space."""

    def __init__(self, space: Any, problem_name: str, names: Sequence[str] = ()) -> None:
        self._space = space
        self.action_set = self._make_action_set(problem_name, names)

    def _make_action_set(self, problem_name: str, names: Sequence[str]) -> Labels | Interval:
        """Return labels for a discrete space, or the interval of a box of one bounded number.

        Raises BadParameter for all other spaces.
        """
        space, kind = self._space, type(self._space).__name__
        if kind == "Discrete":
            return Labels(names) if names else make_numbered_labels(int(space.start), int(space.n))
        if (
            kind in ("MultiDiscrete", "MultiBinary")
            and prod(_component_sizes(space)) <= MAX_ACTIONS
        ):
            return Labels(
                "-".join(map(str, index)) for index in np.ndindex(*_component_sizes(space))
            )
        if kind == "Box" and prod(space.shape) == 1:
            low, high = float(space.low.item()), float(space.high.item())
            if isfinite(low) and isfinite(high):
                return Interval(low, high)
        explanation = f"the action space is a {kind} of shape {getattr(space, 'shape', None)}"
        raise BadParameter(
            f"{problem_name}: {explanation}; dmplay supports discrete actions, or one real "
            "number with finite bounds"
        )

    def to_space_value(self, action: float) -> Any:
        """Return an action as a value of the space."""
        space, kind = self._space, type(self._space).__name__
        if kind == "Discrete":
            return int(space.start) + int(action)
        if kind == "Box":
            return np.full(space.shape, action, space.dtype)
        components = np.unravel_index(int(action), _component_sizes(space))
        return np.array(components, space.dtype).reshape(space.shape)


def _component_sizes(space: Any) -> tuple[int, ...]:
    """Return the number of values of each component of a discrete space."""
    if type(space).__name__ == "MultiBinary":
        return (2,) * int(prod(space.shape))
    return tuple(int(n) for n in np.ravel(space.nvec))


def flat_dimension(space: Any, problem_name: str) -> int:
    """Return the number of numbers in an observation; raise BadParameter if it is not numeric."""
    kind = type(space).__name__
    if kind == "Discrete":
        return 1
    if kind in ("Box", "MultiDiscrete", "MultiBinary"):
        return prod(space.shape)
    if kind in ("Tuple", "Dict"):
        return sum(flat_dimension(subspace, problem_name) for subspace in _list_subspaces(space))
    raise BadParameter(
        f"{problem_name}: the observation space is a {kind}; dmplay supports only numbers"
    )


def flatten_observation(space: Any, observation: Any) -> list[float]:
    """Return an observation as a flat list of numbers."""
    kind = type(space).__name__
    if kind in ("Tuple", "Dict"):
        components = observation if kind == "Tuple" else [observation[key] for key in space.spaces]
        pairs = zip(_list_subspaces(space), components, strict=True)
        return [
            number
            for subspace, component in pairs
            for number in flatten_observation(subspace, component)
        ]
    return [float(number) for number in np.ravel(observation)]


def _list_subspaces(space: Any) -> list[Any]:
    """Return the parts of a Tuple or Dict space, in order."""
    return [*(space.spaces.values() if hasattr(space.spaces, "values") else space.spaces)]

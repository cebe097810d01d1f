"""The spaces of Gymnasium and PettingZoo as dmplay's action and observation sets."""

from collections.abc import Sequence
from math import isfinite, prod
from typing import Any

import numpy as np

from dmplay.core import Interval, Labels
from dmplay.errors import BadParameter
from dmplay.guests.history import digits

MOST_ACTIONS = 10_000


class Actions:
    """The actions of a space: dmplay's names or numbers for them, and each as the space has it."""

    def __init__(self, space: Any, name: str, called: Sequence[str] = ()) -> None:
        self._space = space
        self.known = self._set(name, called)

    def _set(self, name: str, called: Sequence[str]) -> Labels | Interval:
        space, kind = self._space, type(self._space).__name__
        if kind == "Discrete":
            return Labels(called) if called else digits(int(space.start), int(space.n))
        if kind in ("MultiDiscrete", "MultiBinary") and prod(_each(space)) <= MOST_ACTIONS:
            return Labels("-".join(map(str, one)) for one in np.ndindex(*_each(space)))
        if kind == "Box" and prod(space.shape) == 1:
            low, high = float(space.low.item()), float(space.high.item())
            if isfinite(low) and isfinite(high):
                return Interval(low, high)
        what = f"acts with a {kind} of shape {getattr(space, 'shape', None)}"
        raise BadParameter(f"{name}: {what}; dmplay plays names, or one number between bounds")

    def of(self, action: float) -> Any:
        """An action as the space has it."""
        space, kind = self._space, type(self._space).__name__
        if kind == "Discrete":
            return int(space.start) + int(action)
        if kind == "Box":
            return np.full(space.shape, action, space.dtype)
        each = np.unravel_index(int(action), _each(space))
        return np.array(each, space.dtype).reshape(space.shape)


def _each(space: Any) -> tuple[int, ...]:
    """How many values each part of an action has."""
    if type(space).__name__ == "MultiBinary":
        return (2,) * int(prod(space.shape))
    return tuple(int(n) for n in np.ravel(space.nvec))


def size(space: Any, name: str) -> int:
    """How many numbers an observation of a space is."""
    kind = type(space).__name__
    if kind == "Discrete":
        return 1
    if kind in ("Box", "MultiDiscrete", "MultiBinary"):
        return prod(space.shape)
    if kind in ("Tuple", "Dict"):
        return sum(size(part, name) for part in _parts(space))
    raise BadParameter(f"{name}: observes a {kind}; dmplay shows numbers")


def numbers(space: Any, seen: Any) -> list[float]:
    """An observation of a space as numbers."""
    kind = type(space).__name__
    if kind in ("Tuple", "Dict"):
        each = seen if kind == "Tuple" else [seen[key] for key in space.spaces]
        pairs = zip(_parts(space), each, strict=True)
        return [number for part, one in pairs for number in numbers(part, one)]
    return [float(number) for number in np.ravel(seen)]


def _parts(space: Any) -> list[Any]:
    return [*(space.spaces.values() if hasattr(space.spaces, "values") else space.spaces)]

"""What was found for the last few problems, which all seats, hints and reviews of them share."""

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import TypeVar, TypeVarTuple

T = TypeVar("T")
Ts = TypeVarTuple("Ts")
CACHE_SIZE = 4


def memoize(function: Callable[[*Ts], T]) -> Callable[[*Ts], T]:
    """The same function, which keeps what it found last.

    What it finds for a problem that cannot be told from others is not kept.
    """
    keeping = lru_cache(maxsize=CACHE_SIZE)(function)

    @wraps(function)
    def call_cached(*args: *Ts) -> T:
        try:
            hash(args)
        except TypeError:
            return function(*args)
        return keeping(*args)

    return call_cached

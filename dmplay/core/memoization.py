"""A cache of the last few results, shared by all seats, hints and reviews of a problem."""

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import TypeVar, TypeVarTuple

T = TypeVar("T")
Ts = TypeVarTuple("Ts")
CACHE_SIZE = 4


def memoize(function: Callable[[*Ts], T]) -> Callable[[*Ts], T]:
    """Return the function with a cache of its last four results.

    The result for arguments that cannot be hashed is not cached.
    """
    cached = lru_cache(maxsize=CACHE_SIZE)(function)

    @wraps(function)
    def call_cached(*args: *Ts) -> T:
        try:
            hash(args)
        except TypeError:
            return function(*args)
        return cached(*args)

    return call_cached

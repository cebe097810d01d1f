"""What was found for the last few problems, which all seats, hints and reviews of them share."""

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import TypeVar, TypeVarTuple

T = TypeVar("T")
Ts = TypeVarTuple("Ts")
KEPT = 4


def kept(find: Callable[[*Ts], T]) -> Callable[[*Ts], T]:
    """The same function, which keeps what it found last.

    What it finds for a problem that cannot be told from others is not kept.
    """
    keeping = lru_cache(maxsize=KEPT)(find)

    @wraps(find)
    def found(*args: *Ts) -> T:
        try:
            hash(args)
        except TypeError:
            return find(*args)
        return keeping(*args)

    return found

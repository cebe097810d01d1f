"""What an action loses against the best, and what it may bring, in few columns."""

import math
from collections.abc import Sequence

from dmplay.views._advice import ALIKE
from dmplay.views.canvas import short
from dmplay.views.style import Look, Outlook


def known(look: Look) -> dict[int, float]:
    """What each legal action loses, the best first."""
    losses = enumerate([] if look.regret is None else look.regret)
    legal = {action: float(loss) for action, loss in losses if not math.isnan(loss)}
    return dict(sorted(legal.items(), key=lambda pair: pair[1]))


def lost(look: Look, action: int, width: int = 6) -> str:
    """`best`, or what is lost: `-0.31`; nothing where it is not known."""
    loss = known(look).get(action)
    if loss is None:
        return ""
    return "best"[:width] if loss < ALIKE else short(-loss, width)


def bar(look: Look, action: int, width: int) -> str:
    """What is lost as a bar, a full one for the worst action, none for the best."""
    losses = known(look)
    loss = losses.get(action, 0.0)
    eighths = round(8 * width * loss / max(losses.values())) if loss >= ALIKE else 0
    whole, rest = divmod(eighths, 8)
    return "█" * whole + " ▏▎▍▌▋▊▉"[rest].strip()


def ranked(look: Look, names: Sequence[str]) -> str:
    """Every legal action, the best first: `right best, left -0.31`."""
    return ", ".join(f"{names[action]} {lost(look, action)}" for action in known(look))


def odds(share: float, width: int) -> str:
    """A probability in so many columns: `0.70`, `.70`, `.7` or a star."""
    texts = (f"{share:.2f}", f"{share:.2f}"[share < 1 :], f"{share:.1f}"[share < 0.95 :])
    return next((text for text in texts if len(text) <= width), "*")


def foreseen(outlook: Outlook, name: str) -> str:
    """What is drawn: `if e`; that it is drawn from samples is said."""
    return f"if {name}{' (samples)' * outlook.sampled}"

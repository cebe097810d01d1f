"""Beliefs as bars and words."""

from collections.abc import Sequence

from dmplay.chance import Reals
from dmplay.views.canvas import Canvas
from dmplay.views.style import Look

EIGHTHS = " ▏▎▍▌▋▊▉"
SPARKS = "▁▂▃▄▅▆▇█"
ASCII_SPARKS = "_.:-=+*#"


def bar(share: float, width: int, plain: bool) -> str:
    """A bar with eighths, the rest in dots: never without its number beside it."""
    if plain:
        return ("#" * round(share * width)).ljust(width, ".")
    eighths = round(share * width * 8)
    whole, rest = divmod(eighths, 8)
    return ("█" * whole + (EIGHTHS[rest] if rest else "")).ljust(width, "·")


def bars(  # noqa: PLR0913 - a place on the canvas, and what goes there
    canvas: Canvas, y: int, names: Sequence[str], belief: Reals, look: Look, *, most: int = 20
) -> int:
    """Draws a bar a state from row y on, as wide as the room; returns the next row."""
    longest = max(map(len, names))
    room = max(min(most, look.width - longest - 8), 1)
    for name, share in zip(names, belief, strict=True):
        canvas.put(0, y, name.ljust(longest))
        canvas.put(longest + 2, y, bar(float(share), room, look.ascii), "cyan")
        canvas.put(longest + 3 + room, y, f"{share:.3f}", "bold")
        y += 1
    return y


def truth(canvas: Canvas, y: int, names: Sequence[str], look: Look) -> None:
    """Says the true state, once it may be told."""
    if look.state is not None:
        canvas.put(0, y, f"truly {names[int(look.state)]}", "bold magenta")


def spark(shares: Sequence[float], plain: bool) -> str:
    """A history of probabilities, a glyph each."""
    glyphs = ASCII_SPARKS if plain else SPARKS
    return "".join(glyphs[min(int(share * len(glyphs)), len(glyphs) - 1)] for share in shares)


def words(names: Sequence[str], belief: Reals) -> str:
    """The states from the likeliest down: `hungry 0.732, sated 0.268`."""
    ranked = sorted(zip(names, belief, strict=True), key=lambda pair: -pair[1])
    return ", ".join(f"{name} {share:.3f}" for name, share in ranked)

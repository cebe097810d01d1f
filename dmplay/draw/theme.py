"""The colours and glyphs of series and actions, the same in all panels."""

from collections.abc import Iterable

SERIES_STYLES = ("cyan", "yellow", "green", "magenta", "blue", "red")


def choose_style(index: int) -> str:
    """Return the style of a series or an action."""
    return SERIES_STYLES[index % len(SERIES_STYLES)]


def assign_letters(names: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Return the glyph and the style of each name.

    A glyph is the first letter of the name that no earlier name has, or else a digit.
    """
    glyphs: dict[str, tuple[str, str]] = {}
    letters: set[str] = set()
    for number, name in enumerate(dict.fromkeys(names)):
        glyph = next((c for c in name if c.isalnum() and c not in letters), str(number % 10))
        letters.add(glyph)
        glyphs[name] = glyph, choose_style(number)
    return glyphs

"""The colours and glyphs of all drawings: of roles, series, actions and levels.

A colour is a name, which `dmplay.terminal.styles` shows in the way of a theme. No colour carries a
meaning alone: glyphs, words or places do too.
"""

import string
from collections.abc import Iterable

from dmplay.core.text import format_score

DATA, STRONG_DATA = "cyan", "bold cyan"  # bars, curves and values; the current value
CHOICE, BEST = "green", "bold green"  # keys and actions; the best action, or a gain
REGRET = "yellow"  # what an action loses
PREVIEW, ALERT = "bold yellow", "bold yellow"  # what an action would lead to; a clue to act on
PIECE, PIECE_TRAIL = "bold yellow", "yellow"  # the player's piece; where it was, and its parts
OTHER, TRUTH = "bold magenta", "bold magenta"  # another player's piece; what is hidden in a game
GOAL, LAND, CHANCE = "bold blue", "green", "blue"  # where to go; where one is; what chance brings
DANGER, DANGER_AREA = "bold red", "red"
SEAT_COLORS = ("yellow", "magenta", "blue")
BAR_LEVELS = "▁▂▃▄▅▆▇█"  # eighths of a cell's height
BAR_EIGHTHS = " ▏▎▍▌▋▊▉"  # eighths of a cell's width
ASCII_SPARK_LEVELS = "_.:-=+*#"
ASCII_COLUMN_LEVELS = "__--==##"  # by height, without the glyphs of marks that stand on columns
ACTION_GLYPHS = {
    "left": "←", "right": "→", "up": "↑", "down": "↓", "climb": "↑", "descend": "↓",
    "coast": "·", "no-advisory": "·",
}  # fmt: skip
LEVEL_COLORS = (17, 18, 24, 30, 36, 72, 108, 144, 187)  # palette colours from low to high values
SERIES_GLYPHS = "●○◆✗=%"
THIN_GLYPH = "·"  # of a series that is one of many, or of less importance
SERIES_STYLES = ("cyan", "yellow", "green", "magenta", "blue", "red")


def choose_style(index: int) -> str:
    """Return the style of a series or an action."""
    return SERIES_STYLES[index % len(SERIES_STYLES)]


def choose_level(share: float) -> tuple[str, str]:
    """Return the glyph and style of a value between the lowest, 0, and the highest, 1, of a map.

    The glyph of a level has its colour on that of the level below.
    """
    level = min(int(share * len(BAR_LEVELS)), len(BAR_LEVELS) - 1)
    return BAR_LEVELS[level], f"color({LEVEL_COLORS[level + 1]}) on color({LEVEL_COLORS[level]})"


def format_level_legend(label: str, low: float, high: float) -> str:
    """Return the legend of the lowest and the highest level of a map."""
    return f"{label}: {BAR_LEVELS[0]} {format_score(low)}  {BAR_LEVELS[-1]} {format_score(high)}"


def assign_letters(names: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Return the glyph and the style of each name.

    A glyph is an arrow or the first letter of the name that no earlier name has, or else a digit or
    another letter.
    """
    glyphs: dict[str, tuple[str, str]] = {}
    letters: set[str] = set()
    for number, name in enumerate(dict.fromkeys(names)):
        candidates = [
            ACTION_GLYPHS.get(name, ""), *filter(str.isalnum, name), str(number % 10),
            *string.digits, *string.ascii_letters,
        ]  # fmt: skip
        glyph = next((c for c in candidates if c and c not in letters), candidates[-1])
        letters.add(glyph)
        glyphs[name] = glyph, choose_style(number)
    return glyphs

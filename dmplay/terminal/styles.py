"""Styled lines of a screen, and their conversion to SGR codes, ANSI text and prompt_toolkit."""

from collections import defaultdict
from collections.abc import Sequence
from functools import cache
from itertools import pairwise

from rich.text import Text

Fragments = list[tuple[str, str]]
StyledRow = tuple[tuple[str, str], ...]  # the pieces of a row, each with its SGR codes
# a line of the screen: plain text, pieces with style names, or rich Text
ScreenLine = str | StyledRow | Text

# levels of each primary colour in the colour cube of the palette
CUBE_LEVELS = (0, 95, 135, 175, 215, 255)


def palette_rgb(number: int) -> tuple[int, int, int]:
    """Return red, green and blue, 0 to 255, of a palette colour from 16 on: a cube, then greys."""
    if number >= 232:
        grey = 8 + 10 * (number - 232)
        return grey, grey, grey
    red, remainder = divmod(number - 16, 36)
    return CUBE_LEVELS[red], CUBE_LEVELS[remainder // 6], CUBE_LEVELS[remainder % 6]


COLOR_NAMES = ("black", "red", "green", "yellow", "blue", "magenta", "cyan", "white")
SGR_CODES = {name: str(30 + number) for number, name in enumerate(COLOR_NAMES)}
SGR_CODES |= {f"bright_{name}": str(90 + number) for number, name in enumerate(COLOR_NAMES)}
PROMPT_TOOLKIT_STYLES = {name: f"ansi{name.replace('_', '')}" for name in SGR_CODES}
PROMPT_TOOLKIT_STYLES |= {"white": "ansigray", "bright_white": "ansiwhite"}
# palette numbers of the named colours, as other programs write them
NUMBERED_COLORS = {f"color({number})": name for number, name in enumerate(SGR_CODES)}
SGR_CODES |= {number: SGR_CODES[name] for number, name in NUMBERED_COLORS.items()}
PROMPT_TOOLKIT_STYLES |= {
    number: PROMPT_TOOLKIT_STYLES[name] for number, name in NUMBERED_COLORS.items()
}
BACKGROUND_COLORS = {f"on_{color}": color for color in SGR_CODES}
SGR_CODES |= {
    ground: str(int(SGR_CODES[color]) + 10) for ground, color in BACKGROUND_COLORS.items()
}
PROMPT_TOOLKIT_STYLES |= {
    ground: f"bg:{PROMPT_TOOLKIT_STYLES[color]}" for ground, color in BACKGROUND_COLORS.items()
}
PALETTE_HEX = {
    number: "#{:02x}{:02x}{:02x}".format(*palette_rgb(number)) for number in range(16, 256)
}
SGR_CODES |= {f"color({number})": f"38;5;{number}" for number in PALETTE_HEX}
SGR_CODES |= {f"on_color({number})": f"48;5;{number}" for number in PALETTE_HEX}
PROMPT_TOOLKIT_STYLES |= {f"color({number})": color for number, color in PALETTE_HEX.items()}
PROMPT_TOOLKIT_STYLES |= {
    f"on_color({number})": f"bg:{color}" for number, color in PALETTE_HEX.items()
}
# For a dark and a light background: palette numbers of the named colours and of dim text. The
# colours of the palette from 16 on are the same on all terminals; those of the 16 named colours are
# not. Each has a contrast of at least 4.5 on the usual backgrounds.
THEME_PALETTES = {
    "dark": {
        "red": 210, "green": 114, "yellow": 221, "blue": 111, "magenta": 213, "cyan": 80,
        "white": 252, "black": 248, "dim": 248,
    },
    "light": {
        "red": 124, "green": 22, "yellow": 94, "blue": 19, "magenta": 90, "cyan": 24,
        "white": 238, "black": 232, "dim": 240,
    },
}  # fmt: skip
THEME_PALETTES |= {"high-contrast-light": THEME_PALETTES["light"]}
SGR_CODES |= {"bold": "1", "dim": "2", "italic": "3", "underline": "4", "reverse": "7"}


def to_plain_text(line: ScreenLine) -> str:
    """Return the text of a line without its styles."""
    if isinstance(line, str):
        return line
    return line.plain if isinstance(line, Text) else "".join([piece for piece, _ in line])


def to_rich_text(line: ScreenLine) -> Text:
    """Return a line as rich Text, the slowest kind of line to create."""
    if isinstance(line, Text):
        return line
    return Text(line) if isinstance(line, str) else Text.assemble(*line)


def split_style_runs(text: Text) -> list[tuple[frozenset[str], str]]:
    """Return the text in pieces of one style each, with the style as a set of words."""
    plain = text.plain
    starting_styles, ending_styles = defaultdict(list), defaultdict(list)
    for span in text.spans:
        style, end = str(span.style), min(span.end, len(plain))
        if span.start < end and style:
            starting_styles[span.start].append(style)
            ending_styles[end].append(style)
    pieces: list[tuple[frozenset[str], str]] = []
    active = [str(text.style)]
    for start, end in pairwise(sorted({0, len(plain), *starting_styles, *ending_styles})):
        for style in ending_styles[start]:
            active.remove(style)
        active += starting_styles[start]
        style_words = _style_words(tuple(active))
        if pieces and pieces[-1][0] == style_words:
            pieces[-1] = (style_words, pieces[-1][1] + plain[start:end])
        else:
            pieces.append((style_words, plain[start:end]))
    return pieces


@cache
def _style_words(styles: tuple[str, ...]) -> frozenset[str]:
    """Return the style words of several styles; "not bold" removes "bold"."""
    style_words = frozenset(
        word for style in styles for word in style.replace("on ", "on_").split()
    )
    # "not" is only used in "not bold".
    return style_words - {"not", "bold"} if "not" in style_words else style_words


def to_fragments(text: Text, theme: str) -> Fragments:
    """Return the text as fragments for prompt_toolkit."""
    return [
        (_prompt_toolkit_style(style_words, theme), piece)
        for style_words, piece in split_style_runs(text)
    ]


@cache
def _prompt_toolkit_style(words: frozenset[str], theme: str) -> str:
    """Return style words as a prompt_toolkit style in a theme."""
    return " ".join(
        sorted(PROMPT_TOOLKIT_STYLES.get(word, word) for word in _theme_words(words, theme))
    )


def to_ansi(line: ScreenLine, theme: str) -> str:
    """Return a line, or a text of several lines, with ANSI escape sequences."""
    if isinstance(line, str):
        return line
    if isinstance(line, tuple):
        return _ansi_row([(piece, _style_codes(style, theme)) for piece, style in line])
    return "\n".join(map(_ansi_row, to_styled_rows(line, theme)))


def _ansi_row(row: Sequence[tuple[str, str]]) -> str:
    """Return a row of pieces and SGR codes as text with ANSI escape sequences."""
    return "".join([f"\x1b[{codes}m{piece}\x1b[0m" if codes else piece for piece, codes in row])


def to_styled_rows(text: Text, theme: str) -> list[StyledRow]:
    """Return the text as rows of pieces with SGR codes."""
    styled_rows: list[list[tuple[str, str]]] = [[]]
    for style_words, piece in split_style_runs(text):
        codes = _sgr_codes(style_words, theme)
        first_line, *other_lines = piece.split("\n")
        if first_line:
            styled_rows[-1].append((first_line, codes))
        styled_rows += [[(other_line, codes)] if other_line else [] for other_line in other_lines]
    return [tuple(row) for row in styled_rows]


@cache
def _style_codes(style: str, theme: str) -> str:
    """Return the SGR codes of a style in a theme, separated by semicolons."""
    return _sgr_codes(_style_words((style,)), theme)


@cache
def _sgr_codes(words: frozenset[str], theme: str) -> str:
    """Return the SGR codes of style words in a theme, separated by semicolons."""
    return ";".join(sorted(SGR_CODES[word] for word in _theme_words(words, theme)))


def _theme_words(words: frozenset[str], theme: str) -> set[str]:
    """Return the style words that a theme uses, without words that have no SGR code.

    "mono" has no colours and shows backgrounds in reverse; "high-contrast" has bright bold colours
    and nothing dim. "dark" and "light" have fixed colours that are readable on such a background,
    unless the text has a background of its own.
    """
    styles = {word for word in words if word in SGR_CODES}
    if theme in THEME_PALETTES and not styles & BACKGROUND_COLORS.keys():
        return _fix_colours(styles, theme)
    if theme == "mono":
        return styles - PROMPT_TOOLKIT_STYLES.keys() | (
            {"reverse"} if styles & BACKGROUND_COLORS.keys() else set()
        )
    if theme == "high-contrast":
        colors = styles & {*COLOR_NAMES} - {"black"}
        bright = {f"bright_{color}" for color in colors} | ({"bold"} if colors else set())
        return styles - colors - {"dim"} | bright
    return styles


def _fix_colours(styles: set[str], theme: str) -> set[str]:
    """Return style words with fixed colours in place of the named colours and of dim."""
    palette, is_high_contrast = THEME_PALETTES[theme], theme.startswith("high-contrast")
    base_names = {
        style: NUMBERED_COLORS.get(style, style).removeprefix("bright_")
        for style in styles & PROMPT_TOOLKIT_STYLES.keys()
    }
    colors = {
        f"color({palette[name]})" if name in palette else style
        for style, name in base_names.items()
    }
    if is_high_contrast and colors:
        colors.add("bold")
    elif "dim" in styles and not colors and not is_high_contrast:
        colors.add(f"color({palette['dim']})")
    return styles - base_names.keys() - {"dim"} | colors

"""Lines of a screen, and what terminals take: rows of SGR codes, ANSI, prompt-toolkit fragments."""

from collections import defaultdict
from collections.abc import Sequence
from functools import cache
from itertools import pairwise

from rich.text import Text

Fragments = list[tuple[str, str]]
StyledRow = tuple[tuple[str, str], ...]  # pieces of a row, each with its SGR codes
ScreenLine = (
    str | StyledRow | Text
)  # of a screen: words, or pieces with styles for codes, or any rich text

CUBE_LEVELS = (0, 95, 135, 175, 215, 255)  # of each primary colour in the palette's cube


def palette_rgb(number: int) -> tuple[int, int, int]:
    """Red, green and blue, 0 to 255, of a colour of the palette from 16 on: a cube, then greys."""
    if number >= 232:
        grey = 8 + 10 * (number - 232)
        return grey, grey, grey
    red, rest = divmod(number - 16, 36)
    return CUBE_LEVELS[red], CUBE_LEVELS[rest // 6], CUBE_LEVELS[rest % 6]


COLOR_NAMES = ("black", "red", "green", "yellow", "blue", "magenta", "cyan", "white")
SGR_CODES = {name: str(30 + number) for number, name in enumerate(COLOR_NAMES)}
SGR_CODES |= {f"bright_{name}": str(90 + number) for number, name in enumerate(COLOR_NAMES)}
PROMPT_TOOLKIT_STYLES = {name: f"ansi{name.replace('_', '')}" for name in SGR_CODES}
PROMPT_TOOLKIT_STYLES |= {"white": "ansigray", "bright_white": "ansiwhite"}
NUMBERED_COLORS = {
    f"color({number})": name for number, name in enumerate(SGR_CODES)
}  # as others draw them
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
SGR_CODES |= {"bold": "1", "dim": "2", "italic": "3", "underline": "4", "reverse": "7"}


def to_plain_text(line: ScreenLine) -> str:
    """What stands in a line."""
    if isinstance(line, str):
        return line
    return line.plain if isinstance(line, Text) else "".join([piece for piece, _ in line])


def to_rich_text(line: ScreenLine) -> Text:
    """A line as rich text, which takes longest to make."""
    if isinstance(line, Text):
        return line
    return Text(line) if isinstance(line, str) else Text.assemble(*line)


def split_style_runs(text: Text) -> list[tuple[frozenset[str], str]]:
    """The text in pieces of one style each, a style as its words."""
    plain = text.plain
    begin, finish = defaultdict(list), defaultdict(list)
    for span in text.spans:
        style, end = str(span.style), min(span.end, len(plain))
        if span.start < end and style:
            begin[span.start].append(style)
            finish[end].append(style)
    pieces: list[tuple[frozenset[str], str]] = []
    active = [str(text.style)]
    for start, end in pairwise(sorted({0, len(plain), *begin, *finish})):
        for style in finish[start]:
            active.remove(style)
        active += begin[start]
        words = _style_words(tuple(active))
        if pieces and pieces[-1][0] == words:
            pieces[-1] = (words, pieces[-1][1] + plain[start:end])
        else:
            pieces.append((words, plain[start:end]))
    return pieces


@cache
def _style_words(styles: tuple[str, ...]) -> frozenset[str]:
    words = frozenset(word for style in styles for word in style.replace("on ", "on_").split())
    return words - {"not", "bold"} if "not" in words else words  # the only negation in use


def to_fragments(text: Text, theme: str) -> Fragments:
    """Pieces for prompt-toolkit."""
    return [(_prompt_toolkit_style(words, theme), piece) for words, piece in split_style_runs(text)]


@cache
def _prompt_toolkit_style(words: frozenset[str], theme: str) -> str:
    return " ".join(
        sorted(PROMPT_TOOLKIT_STYLES.get(word, word) for word in _theme_words(words, theme))
    )


def to_ansi(line: ScreenLine, theme: str) -> str:
    """A line, or a text of several, with escape sequences."""
    if isinstance(line, str):
        return line
    if isinstance(line, tuple):
        return _ansi_row([(piece, _style_codes(style, theme)) for piece, style in line])
    return "\n".join(map(_ansi_row, to_styled_rows(line, theme)))


def _ansi_row(row: Sequence[tuple[str, str]]) -> str:
    return "".join([f"\x1b[{codes}m{piece}\x1b[0m" if codes else piece for piece, codes in row])


def to_styled_rows(text: Text, theme: str) -> list[StyledRow]:
    """The text a row at a time."""
    found: list[list[tuple[str, str]]] = [[]]
    for words, piece in split_style_runs(text):
        codes = _sgr_codes(words, theme)
        first, *more = piece.split("\n")
        if first:
            found[-1].append((first, codes))
        found += [[(part, codes)] if part else [] for part in more]
    return [tuple(row) for row in found]


@cache
def _style_codes(style: str, theme: str) -> str:
    return _sgr_codes(_style_words((style,)), theme)


@cache
def _sgr_codes(words: frozenset[str], theme: str) -> str:
    return ";".join(sorted(SGR_CODES[word] for word in _theme_words(words, theme)))


def _theme_words(words: frozenset[str], theme: str) -> set[str]:
    """The words that a theme keeps: weights alone in mono, nothing faint in high contrast."""
    known = {word for word in words if word in SGR_CODES}
    if theme == "mono":
        return known - PROMPT_TOOLKIT_STYLES.keys() | (
            {"reverse"} if known & BACKGROUND_COLORS.keys() else set()
        )
    if theme == "high-contrast":
        colors = known & {*COLOR_NAMES} - {"black"}
        bright = {f"bright_{color}" for color in colors} | ({"bold"} if colors else set())
        return known - colors - {"dim"} | bright
    return known

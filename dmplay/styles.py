"""Lines of a screen, and what terminals take: rows of SGR codes, ANSI, prompt-toolkit fragments."""

from collections import defaultdict
from collections.abc import Sequence
from functools import cache
from itertools import pairwise

from rich.text import Text

Fragments = list[tuple[str, str]]
Row = tuple[tuple[str, str], ...]  # pieces of a row, each with its SGR codes
Line = str | Row | Text  # of a screen: words, or pieces with styles for codes, or any rich text

LEVELS = (0, 95, 135, 175, 215, 255)  # of each primary colour in the palette's cube


def rgb(number: int) -> tuple[int, int, int]:
    """Red, green and blue, 0 to 255, of a colour of the palette from 16 on: a cube, then greys."""
    if number >= 232:
        grey = 8 + 10 * (number - 232)
        return grey, grey, grey
    red, rest = divmod(number - 16, 36)
    return LEVELS[red], LEVELS[rest // 6], LEVELS[rest % 6]


COLORS = ("black", "red", "green", "yellow", "blue", "magenta", "cyan", "white")
SGR = {name: str(30 + number) for number, name in enumerate(COLORS)}
SGR |= {f"bright_{name}": str(90 + number) for number, name in enumerate(COLORS)}
TOOLKIT = {name: f"ansi{name.replace('_', '')}" for name in SGR}
TOOLKIT |= {"white": "ansigray", "bright_white": "ansiwhite"}
NUMBERED = {f"color({number})": name for number, name in enumerate(SGR)}  # as others draw them
SGR |= {number: SGR[name] for number, name in NUMBERED.items()}
TOOLKIT |= {number: TOOLKIT[name] for number, name in NUMBERED.items()}
GROUNDS = {f"on_{color}": color for color in SGR}
SGR |= {ground: str(int(SGR[color]) + 10) for ground, color in GROUNDS.items()}
TOOLKIT |= {ground: f"bg:{TOOLKIT[color]}" for ground, color in GROUNDS.items()}
PALETTE = {number: "#{:02x}{:02x}{:02x}".format(*rgb(number)) for number in range(16, 256)}
SGR |= {f"color({number})": f"38;5;{number}" for number in PALETTE}
SGR |= {f"on_color({number})": f"48;5;{number}" for number in PALETTE}
TOOLKIT |= {f"color({number})": color for number, color in PALETTE.items()}
TOOLKIT |= {f"on_color({number})": f"bg:{color}" for number, color in PALETTE.items()}
SGR |= {"bold": "1", "dim": "2", "italic": "3", "underline": "4", "reverse": "7"}


def words(line: Line) -> str:
    """What stands in a line."""
    if isinstance(line, str):
        return line
    return line.plain if isinstance(line, Text) else "".join([piece for piece, _ in line])


def lettered(line: Line) -> Text:
    """A line as rich text, which takes longest to make."""
    if isinstance(line, Text):
        return line
    return Text(line) if isinstance(line, str) else Text.assemble(*line)


def runs(text: Text) -> list[tuple[frozenset[str], str]]:
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
        words = _words(tuple(active))
        if pieces and pieces[-1][0] == words:
            pieces[-1] = (words, pieces[-1][1] + plain[start:end])
        else:
            pieces.append((words, plain[start:end]))
    return pieces


@cache
def _words(styles: tuple[str, ...]) -> frozenset[str]:
    words = frozenset(word for style in styles for word in style.replace("on ", "on_").split())
    return words - {"not", "bold"} if "not" in words else words  # the only negation in use


def fragments(text: Text, theme: str) -> Fragments:
    """Pieces for prompt-toolkit."""
    return [(_style(words, theme), piece) for words, piece in runs(text)]


@cache
def _style(words: frozenset[str], theme: str) -> str:
    return " ".join(sorted(TOOLKIT.get(word, word) for word in _shown(words, theme)))


def ansi(line: Line, theme: str) -> str:
    """A line, or a text of several, with escape sequences."""
    if isinstance(line, str):
        return line
    if isinstance(line, tuple):
        return _sent([(piece, _codes_of(style, theme)) for piece, style in line])
    return "\n".join(map(_sent, rows(line, theme)))


def _sent(row: Sequence[tuple[str, str]]) -> str:
    return "".join([f"\x1b[{codes}m{piece}\x1b[0m" if codes else piece for piece, codes in row])


def rows(text: Text, theme: str) -> list[Row]:
    """The text a row at a time."""
    found: list[list[tuple[str, str]]] = [[]]
    for words, piece in runs(text):
        codes = _codes(words, theme)
        first, *more = piece.split("\n")
        if first:
            found[-1].append((first, codes))
        found += [[(part, codes)] if part else [] for part in more]
    return [tuple(row) for row in found]


@cache
def _codes_of(style: str, theme: str) -> str:
    return _codes(_words((style,)), theme)


@cache
def _codes(words: frozenset[str], theme: str) -> str:
    return ";".join(sorted(SGR[word] for word in _shown(words, theme)))


def _shown(words: frozenset[str], theme: str) -> set[str]:
    """The words that a theme keeps: weights alone in mono, nothing faint in high contrast."""
    known = {word for word in words if word in SGR}
    if theme == "mono":
        return known - TOOLKIT.keys() | ({"reverse"} if known & GROUNDS.keys() else set())
    if theme == "high-contrast":
        colors = known & {*COLORS} - {"black"}
        bright = {f"bright_{color}" for color in colors} | ({"bold"} if colors else set())
        return known - colors - {"dim"} | bright
    return known

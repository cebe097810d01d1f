"""From rich text to what terminals take: prompt-toolkit fragments, and ANSI for the first frame."""

from itertools import pairwise

from rich.text import Text

Fragments = list[tuple[str, str]]

SGR = {"bold": "1", "dim": "2", "italic": "3", "underline": "4", "reverse": "7"}
COLORS = ("black", "red", "green", "yellow", "blue", "magenta", "cyan", "white")
SGR |= {name: str(30 + number) for number, name in enumerate(COLORS)}
SGR |= {f"bright_{name}": str(90 + number) for number, name in enumerate(COLORS)}
TOOLKIT = {
    "black": "ansiblack", "red": "ansired", "green": "ansigreen", "yellow": "ansiyellow",
    "blue": "ansiblue", "magenta": "ansimagenta", "cyan": "ansicyan", "white": "ansigray",
    "bright_black": "ansibrightblack", "bright_red": "ansibrightred",
    "bright_green": "ansibrightgreen", "bright_yellow": "ansibrightyellow",
    "bright_blue": "ansibrightblue", "bright_magenta": "ansibrightmagenta",
    "bright_cyan": "ansibrightcyan", "bright_white": "ansiwhite",
}  # fmt: skip


def runs(text: Text) -> list[tuple[frozenset[str], str]]:
    """The text in pieces of one style each, a style as its words."""
    plain = text.plain
    edges = {0, len(plain)} | {edge for span in text.spans for edge in (span.start, span.end)}
    cuts = sorted(edge for edge in edges if 0 <= edge <= len(plain))
    pieces = []
    for start, end in pairwise(cuts):
        words = set(str(text.style).split())
        for span in text.spans:
            if span.start <= start and span.end >= end:
                words |= set(str(span.style).split())
        if "not" in words:  # "not bold" is the only negation in use
            words -= {"not", "bold"}
        pieces.append((frozenset(words), plain[start:end]))
    return pieces


def fragments(text: Text, color: bool) -> Fragments:
    """Pieces for prompt-toolkit; without colour only bold, dim, underline and reverse remain."""
    shown = []
    for words, piece in runs(text):
        names = sorted(word for word in words if word in SGR and (color or word not in TOOLKIT))
        shown.append((" ".join(TOOLKIT.get(name, name) for name in names), piece))
    return shown


def ansi(text: Text, color: bool) -> str:
    """The text with escape sequences, lines ended for a terminal in raw mode."""
    out = []
    for words, piece in runs(text):
        codes = sorted(SGR[w] for w in words if w in SGR and (color or w not in TOOLKIT))
        out.append(f"\x1b[{';'.join(codes)}m{piece}\x1b[0m" if codes else piece)
    return "".join(out).replace("\n", "\r\n")

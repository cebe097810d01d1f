"""The weights and colours that a terminal writes in, and the shortest way from some to others."""

import re
from functools import cache

Pen = frozenset[str]  # SGR codes, one a word: `1`, `31`, `48;5;230`

PLAIN: Pen = frozenset()
CODE = re.compile(r"[34]8;5;\d+|\d+")
OFF = {"1": "22", "2": "22", "3": "23", "4": "24", "7": "27"}  # what ends a code
INK, GROUND = "39", "49"  # what ends a colour: of what is written, and behind it
LINED = {"4", "7"}  # underlined and reversed: then all of a pen is seen of a blank


@cache
def pen(codes: str) -> Pen:
    """The pen of SGR codes written with semicolons."""
    return frozenset(CODE.findall(codes))


@cache
def seen(pen: Pen) -> Pen:
    """What of a pen is seen of a blank that it writes."""
    return pen if pen & LINED else ground(pen)


@cache
def ground(pen: Pen) -> Pen:
    """The colour behind what a pen writes."""
    return frozenset(code for code in pen if _off(code) == GROUND)


@cache
def blanking(now: Pen, wanted: Pen) -> Pen:
    """The pen nearest to this one of which so much is seen of a blank."""
    if seen(now) == wanted:
        return now
    if not wanted or wanted & LINED:
        return wanted
    return now - ground(now) - LINED | wanted


@cache
def turned(old: Pen, new: Pen) -> str:
    """The shortest sequence that makes one pen another."""
    if old == new:
        return ""
    if not new:
        return "\x1b[m"
    steps: list[str] = []
    for off in sorted({_off(code) for code in old ^ new}):
        gone, come, now = (
            sorted(code for code in codes if _off(code) == off)
            for codes in (old - new, new - old, new)
        )
        covered = off in (INK, GROUND) and now  # a colour takes the place of another
        steps += come if covered or not gone else [off, *now]
    forms = (f"\x1b[{';'.join(codes)}m" for codes in (steps, ["0", *sorted(new)]))
    return min(forms, key=len)


def _off(code: str) -> str:
    return OFF.get(code) or (GROUND if code.startswith(("4", "10")) else INK)

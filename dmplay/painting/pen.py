"""The weights and colours that a terminal writes in, and the shortest way from some to others."""

import re
from functools import cache

SgrCodes = frozenset[str]  # SGR codes, one a word: `1`, `31`, `48;5;230`

NO_CODES: SgrCodes = frozenset()
CODE_PATTERN = re.compile(r"[34]8;5;\d+|\d+")
ATTRIBUTE_RESETS = {"1": "22", "2": "22", "3": "23", "4": "24", "7": "27"}  # what ends a code
RESET_FOREGROUND, RESET_BACKGROUND = (
    "39",
    "49",
)  # what ends a colour: of what is written, and behind it
CODES_SHOWN_ON_BLANKS = {"4", "7"}  # underlined and reversed: then all of a pen is seen of a blank


@cache
def parse_sgr_codes(codes: str) -> SgrCodes:
    """The pen of SGR codes written with semicolons."""
    return frozenset(CODE_PATTERN.findall(codes))


@cache
def select_visible_on_blank(codes: SgrCodes) -> SgrCodes:
    """What of a pen is seen of a blank that it writes."""
    return codes if codes & CODES_SHOWN_ON_BLANKS else select_background(codes)


@cache
def select_background(codes: SgrCodes) -> SgrCodes:
    """The colour behind what a pen writes."""
    return frozenset(code for code in codes if _get_reset_code(code) == RESET_BACKGROUND)


@cache
def choose_codes_for_blank(current: SgrCodes, visible_codes: SgrCodes) -> SgrCodes:
    """The pen nearest to this one of which so much is seen of a blank."""
    if select_visible_on_blank(current) == visible_codes:
        return current
    if not visible_codes or visible_codes & CODES_SHOWN_ON_BLANKS:
        return visible_codes
    return current - select_background(current) - CODES_SHOWN_ON_BLANKS | visible_codes


@cache
def encode_sgr_change(old: SgrCodes, new: SgrCodes) -> str:
    """The shortest sequence that makes one pen another."""
    if old == new:
        return ""
    if not new:
        return "\x1b[m"
    steps: list[str] = []
    for off in sorted({_get_reset_code(code) for code in old ^ new}):
        gone, come, now = (
            sorted(code for code in codes if _get_reset_code(code) == off)
            for codes in (old - new, new - old, new)
        )
        covered = (
            off in (RESET_FOREGROUND, RESET_BACKGROUND) and now
        )  # a colour takes the place of another
        steps += come if covered or not gone else [off, *now]
    forms = (f"\x1b[{';'.join(codes)}m" for codes in (steps, ["0", *sorted(new)]))
    return min(forms, key=len)


def _get_reset_code(code: str) -> str:
    return ATTRIBUTE_RESETS.get(code) or (
        RESET_BACKGROUND if code.startswith(("4", "10")) else RESET_FOREGROUND
    )

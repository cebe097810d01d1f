"""SGR codes of the terminal (weights and colours), and the shortest change between two sets."""

import re
from functools import cache

SgrCodes = frozenset[str]  # such as `1`, `31`, `48;5;230`

NO_CODES: SgrCodes = frozenset()
CODE_PATTERN = re.compile(r"[34]8;5;\d+|\d+")
# code -> code that switches it off
ATTRIBUTE_RESETS = {"1": "22", "2": "22", "3": "23", "4": "24", "7": "27"}
RESET_FOREGROUND, RESET_BACKGROUND = (
    "39",
    "49",
)  # codes that reset the text colour and the background colour
# underline and reverse: with them, all codes are visible on a blank
CODES_SHOWN_ON_BLANKS = {"4", "7"}


@cache
def parse_sgr_codes(codes: str) -> SgrCodes:
    """Parse SGR codes separated by semicolons."""
    return frozenset(CODE_PATTERN.findall(codes))


@cache
def select_visible_on_blank(codes: SgrCodes) -> SgrCodes:
    """Return the codes visible on a blank: the background, or all if underlined or reversed."""
    return codes if codes & CODES_SHOWN_ON_BLANKS else select_background(codes)


@cache
def select_background(codes: SgrCodes) -> SgrCodes:
    """Return the codes of the background colour."""
    return frozenset(code for code in codes if _get_reset_code(code) == RESET_BACKGROUND)


@cache
def choose_codes_for_blank(current: SgrCodes, visible_codes: SgrCodes) -> SgrCodes:
    """Return codes close to the current ones that show `visible_codes` on a blank."""
    if select_visible_on_blank(current) == visible_codes:
        return current
    if not visible_codes or visible_codes & CODES_SHOWN_ON_BLANKS:
        return visible_codes
    return current - select_background(current) - CODES_SHOWN_ON_BLANKS | visible_codes


@cache
def encode_sgr_change(old: SgrCodes, new: SgrCodes) -> str:
    """Return the shortest escape sequence that changes one set of codes to another."""
    if old == new:
        return ""
    if not new:
        return "\x1b[m"
    steps: list[str] = []
    for reset_code in sorted({_get_reset_code(code) for code in old ^ new}):
        removed, added, target = (
            sorted(code for code in codes if _get_reset_code(code) == reset_code)
            for codes in (old - new, new - old, new)
        )
        is_replaced = (
            reset_code in (RESET_FOREGROUND, RESET_BACKGROUND) and target
        )  # A new colour replaces the old one.
        steps += added if is_replaced or not removed else [reset_code, *target]
    forms = (f"\x1b[{';'.join(codes)}m" for codes in (steps, ["0", *sorted(new)]))
    return min(forms, key=len)


def _get_reset_code(code: str) -> str:
    """Return the code that switches off an SGR code, such as '39' for a text colour."""
    return ATTRIBUTE_RESETS.get(code) or (
        RESET_BACKGROUND if code.startswith(("4", "10")) else RESET_FOREGROUND
    )

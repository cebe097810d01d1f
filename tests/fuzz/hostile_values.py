"""Nonsense input: JSON values, words, and bytes that a parser may fail on."""

import json
from random import Random

HUGE = "1" + "0" * 400
ESCAPES = (
    "\x1b[2J",
    "\x1b]0;title\x07",
    "\x9b31m",
    "\x00",
    "\r",
    "\x7f",
    "\u202e",
    "\u2066",
    "\x85",
)
NONSENSE_WORDS = (
    *ESCAPES, "", " ", "-1", "0", "1", "2", "1e308", "nan", "inf", "-inf", HUGE, "9" * 5000,
    "1e-320", "true", "null", "[]", "{}", "[[", '"', "'", "\\", "=", ":", ";", "#", "|", "--", "-",
    "*", "é", "日本", "\u0301", "\ufeff", "a" * 3000, "%s", "{0}", "..", "$HOME", "\ud800",
)  # fmt: skip
NONSENSE_VALUES = (
    "-1", "0", "1", "2", "3", "7", "1.0", "-0.0", "0.5", "1e308", "-1e308", "1e-320", "1e400", HUGE,
    "9" * 18, str(2**31), str(2**53 + 1), str(2**63), str(2**64), "NaN", "Infinity", "-Infinity",
    "null", "true", "false", "[]", "{}", '""', '" "', "[[]]", "[null]", '[""]', '{"": 0}',
    "[" * 40 + "]" * 40, "[" * 3000 + "]" * 3000, "[" * 3000, '{"a":' * 40 + "0" + "}" * 40,
    '{"a": 1, "a": 2}', '"\\ud800"', '"\\u0000"', '"\\u001b[2J"', '"\\u202e"', "0x10", "1_000",
    "01", "[0.5, 0.5]", "[1e308, 1e308]", f"[{', '.join(['0.5'] * 500)}]", json.dumps("x" * 20_000),
    *(json.dumps(draw_word, ensure_ascii=False) for draw_word in ESCAPES),
)  # fmt: skip
NONSENSE_BYTES = (
    *(draw_word.encode() for draw_word in ESCAPES),
    b"", b"\xff", b"\xc3", b"\xed\xa0\x80", b"\xef\xbb\xbf", b"\r\n", b"\n\n", b"\n", b"| ", b"# ",
    b": ", b"turn: 1\n", b"end: {}\n", b"undo: 1\n\n", b"reroll: 1\n\n", b"a" * 5000, b"[" * 500,
)  # fmt: skip


def draw_value(random: Random) -> str:
    """Draw a value as it may stand in a file, valid JSON or not."""
    return random.choice(NONSENSE_VALUES)


def draw_word(random: Random) -> str:
    """Draw a word that a person may type, or at times two words in one."""
    text = random.choice(NONSENSE_WORDS)
    return text + random.choice(NONSENSE_WORDS) if random.random() < 0.1 else text


def draw_argument(random: Random) -> str:
    """Draw a word that a process accepts as an argument: without NUL or lone surrogates."""
    return draw_word(random).replace("\0", "").replace("\ud800", "\udcff")


def draw_bytes(random: Random) -> bytes:
    """Draw bytes that may stand anywhere in a file."""
    return random.choice(NONSENSE_BYTES)

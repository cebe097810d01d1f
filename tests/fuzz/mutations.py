"""Mutations of a transcript: of its bytes, lines, values, header and structure."""

import json
import re
from collections.abc import Callable, Sequence
from random import Random

from dmplay.registry import problems
from dmplay.transcript.format import TURN_KEYS, compute_checksum
from dmplay.transcript.header import HEADER_LINES
from tests.fuzz import hostile_values
from tests.fuzz.corpus import list_transcripts
from tests.support.problem_cases import CASE_NAMES

Mutation = Callable[[Random, bytes], bytes]
LARGE_INTEGER = 10**300  # near the largest integer that a float can represent
DIGEST_PATTERN = re.compile(r'"sha256": "[0-9a-f]{16}"')
LINE_KEYS = (
    "dmplay",
    *(line.key for line in HEADER_LINES),
    *TURN_KEYS,
    "undo",
    "reroll",
    "end",
    "other",
)
AGENT_TEXTS = (
    "human", "script", "replay", "random", "Random", "random ", "randοm", "", "nobody", "os:path",
    "./evil.py:X", "random:x=1", "search:simulations=1", "python3 -c pass", "../1.:", "a:b", ".a:b",
)  # fmt: skip


def mutate_transcript(random: Random, raw: bytes, counts: Sequence[int] = (1, 1, 1, 2, 4)) -> bytes:
    """Apply a random number of mutations, and usually make the checksum right again."""
    for _ in range(random.choice(counts)):
        raw = random.choice(MUTATIONS)(random, raw)
    return update_checksum(raw) if random.random() < 0.6 else raw


def update_checksum(raw: bytes) -> bytes:
    """Return the transcript with its correct checksum, if it has an end line and can have one."""
    try:
        text = raw.decode()
    except UnicodeDecodeError:
        return raw
    above, end, last = text.rpartition("\nend: ")
    digest = compute_checksum(above + "\n")
    last = DIGEST_PATTERN.sub(f'"sha256": "{digest}"', last, count=1)
    return f"{above}{end}{last}".encode() if end else raw


def change_bytes(random: Random, raw: bytes) -> bytes:
    """Replace, insert or remove a few bytes."""
    first = random.randrange(len(raw) + 1)
    last = first + random.choice((0, 1, 1, 2, 8, 100))
    replacement = random.choice(
        (hostile_values.draw_bytes(random), random.randbytes(random.choice((1, 4))))
    )
    return raw[:first] + replacement + raw[last:]


def cut_transcript(random: Random, raw: bytes) -> bytes:
    """Cut off the end of the transcript, or its beginning."""
    position = random.randrange(len(raw) + 1)
    return raw[:position] if random.random() < 0.8 else raw[position:]


def change_line(random: Random, raw: bytes) -> bytes:
    """Repeat, remove, move or replace a line, possibly by one of another transcript."""
    rows = raw.split(b"\n")
    index = random.randrange(len(rows))
    row = rows.pop(index)
    other = random.choice(random.choice(list_transcripts()).split(b"\n"))
    nonsense = f"{random.choice(LINE_KEYS)}: {hostile_values.draw_value(random)}".encode()
    target = random.randrange(len(rows) + 1)
    rows[target:target] = random.choice(
        ([], [row], [other], [nonsense], [b""], [b"| " + hostile_values.draw_bytes(random)])
    )
    if random.random() < 0.5:
        rows.insert(index, row)
    return b"\n".join(rows)


def change_value(random: Random, raw: bytes) -> bytes:
    """Replace the value of a line, or a value inside it."""
    rows = raw.split(b"\n")
    index = random.randrange(len(rows))
    key, colon, value_text = rows[index].partition(b": ")
    try:
        value = json.loads(value_text)
    except (ValueError, RecursionError):
        return raw
    rows[index] = key + colon + replace_value(random, value).encode(errors="surrogatepass")
    return b"\n".join(rows)


def replace_value(random: Random, value: object) -> str:
    """Return the JSON of a value after it, or a value inside it, was replaced."""
    holder: dict[str, object] = {"": value}
    replacement = _mark_value(random, holder, "")
    return json.dumps(holder[""], ensure_ascii=False).replace(f'"{VALUE_MARK}"', replacement)


VALUE_MARK = "\ue000 this value"


def _mark_value(random: Random, holder: dict[str, object] | list[object], key: str | int) -> str:
    """Put a mark in the place of a value, or of a value inside it, and return the replacement."""
    value = holder[key]  # type: ignore[index] # of a list or a dictionary
    if isinstance(value, dict | list) and value and random.random() < 0.8:
        inside = random.choice(list(value) if isinstance(value, dict) else range(len(value)))
        return _mark_value(random, value, inside)
    holder[key] = VALUE_MARK  # type: ignore[index]
    return random.choice((hostile_values.draw_value(random), draw_similar_value(random, value)))


def draw_similar_value(random: Random, value: object) -> str:
    """Draw the JSON of a value that is almost the same."""
    if isinstance(value, bool) or value is None:
        return json.dumps(not value)
    if isinstance(value, int | float):
        is_large = isinstance(value, int) and abs(value) > LARGE_INTEGER
        step = random.choice((1, -1) if is_large else (1, -1, 0.1, 1e-3, 1e-9, 1e6))
        return json.dumps(value + step)
    if isinstance(value, str):
        words = (f"{value}x", value[1:], value.upper(), f"{value} ", "(0,0)")
        return json.dumps(random.choice(words))
    if isinstance(value, list | tuple):
        value = [*value]
        return json.dumps(random.choice(([*value, 0], value[1:], value[::-1], value * 3)))
    return json.dumps({**json.loads(json.dumps(value)), "other": 1})


def change_header(random: Random, raw: bytes) -> bytes:
    """Replace a line of the header by that of a game that is possible or almost so."""
    line = random.choice(
        (_draw_problem_line, _draw_parameter_line, _draw_seats_line, _draw_number_line)
    )(random, raw)
    key = line.partition(b":")[0]
    above, separator, body = raw.partition(b"\n\n")
    rows = [row for row in above.split(b"\n") if not row.startswith(key + b":")]
    order = [name.encode() for name in LINE_KEYS]
    rows.append(line)
    rows.sort(key=lambda row: next((n for n, key in enumerate(order) if row.startswith(key)), 0))
    return b"\n".join(rows) + separator + body


def _draw_problem_line(random: Random, raw: bytes) -> bytes:
    names = (
        *CASE_NAMES,
        "./evil.py:X",
        "os:path",
        "hexworld:nowhere",
        "",
        "nobody",
        "os.path:join",
    )
    return f"problem: {json.dumps(random.choice(names))}".encode()


def parse_problem_name(raw: bytes) -> str:
    """Return the problem that a transcript names, or the first problem if there is no such name."""
    match = re.search(rb'^problem: "([a-z0-9:-]+)"$', raw, re.MULTILINE)
    name = match[1].decode() if match else ""
    return name if name in CASE_NAMES else CASE_NAMES[0]


def _draw_parameter_line(random: Random, raw: bytes) -> bytes:
    parameters = problems.parameter_values(problems.load_problem(parse_problem_name(raw)))
    key = random.choice((*parameters, *parameters, "other"))
    value = random.choice(
        (hostile_values.draw_value(random), draw_similar_value(random, parameters.get(key, 1)))
    )
    return f"set: {{{json.dumps(key)}: {value}}}".encode(errors="surrogatepass")


def _draw_seats_line(random: Random, raw: bytes) -> bytes:
    agents = problems.load_problem(parse_problem_name(raw)).agents
    agent_texts = (*AGENT_TEXTS, hostile_values.draw_word(random))
    seats = {name: random.choice(agent_texts) for name in agents}
    if random.random() < 0.2:
        seats[hostile_values.draw_word(random)] = random.choice(agent_texts)
    return f"seats: {json.dumps(seats)}".encode()


def _draw_number_line(random: Random, raw: bytes) -> bytes:
    key = random.choice(("seed", "episode", "turns", "strict", "reveal", "dmplay"))
    return f"{key}: {random.choice((hostile_values.draw_value(random), 'true'))}".encode(
        errors="surrogatepass"
    )


def change_blocks(random: Random, raw: bytes) -> bytes:
    """Move, repeat or remove a block of lines, or replace it by one of another game."""
    blocks = raw.split(b"\n\n")
    index = random.randrange(len(blocks))
    block = blocks.pop(index)
    other = random.choice(random.choice(list_transcripts()).split(b"\n\n"))
    event = (
        f"{random.choice(('undo', 'reroll'))}: "
        f"{random.choice(('1', '2', hostile_values.draw_value(random)))}"
    )
    replacement = random.choice(([], [block] * 2, [block] * 50, [other], [block, event.encode()]))
    target = random.choice((index, random.randrange(len(blocks) + 1)))
    blocks[target:target] = replacement
    return b"\n\n".join(blocks)


MUTATIONS: tuple[Mutation, ...] = (
    change_bytes,
    cut_transcript,
    change_line,
    change_value,
    change_value,
    change_header,
    change_blocks,
)

"""Ways in which a transcript may be spoilt: its bytes, lines, values, header and structure."""

import json
import re
from collections.abc import Callable, Sequence
from random import Random

from dmplay.finding import problems
from dmplay.transcript.format import TURN_KEYS, compute_checksum
from dmplay.transcript.header import HEADER_LINES
from tests.fuzz import absurd
from tests.fuzz.corpus import transcripts
from tests.support.cases import CASES

Mutation = Callable[[Random, bytes], bytes]
LARGE = 10**300  # a whole number about as large as a real one can be
DIGEST = re.compile(r'"sha256": "[0-9a-f]{16}"')
KEYS = (
    "dmplay",
    *(line.key for line in HEADER_LINES),
    *TURN_KEYS,
    "undo",
    "reroll",
    "end",
    "other",
)
AGENTS = (
    "human", "script", "replay", "random", "Random", "random ", "randοm", "", "nobody", "os:path",
    "./evil.py:X", "random:x=1", "search:simulations=1", "python3 -c pass", "../1.:", "a:b", ".a:b",
)  # fmt: skip


def spoilt(random: Random, raw: bytes, many: Sequence[int] = (1, 1, 1, 2, 4)) -> bytes:
    """A transcript after so many mutations; often with the right checksum."""
    for _ in range(random.choice(many)):
        raw = random.choice(MUTATIONS)(random, raw)
    return summed(raw) if random.random() < 0.6 else raw


def summed(raw: bytes) -> bytes:
    """The same with the checksum that belongs to it, where it has an end and can have one."""
    try:
        text = raw.decode()
    except UnicodeDecodeError:
        return raw
    above, end, last = text.rpartition("\nend: ")
    digest = compute_checksum(above + "\n")
    last = DIGEST.sub(f'"sha256": "{digest}"', last, count=1)
    return f"{above}{end}{last}".encode() if end else raw


def bytes_changed(random: Random, raw: bytes) -> bytes:
    """A few bytes are others, or are gone."""
    first = random.randrange(len(raw) + 1)
    last = first + random.choice((0, 1, 1, 2, 8, 100))
    put = random.choice((absurd.raw(random), random.randbytes(random.choice((1, 4)))))
    return raw[:first] + put + raw[last:]


def cut(random: Random, raw: bytes) -> bytes:
    """The end is not there, or the beginning."""
    at = random.randrange(len(raw) + 1)
    return raw[:at] if random.random() < 0.8 else raw[at:]


def line_changed(random: Random, raw: bytes) -> bytes:
    """A line is doubled, gone, moved, or one of another transcript or of none."""
    rows = raw.split(b"\n")
    at = random.randrange(len(rows))
    row = rows.pop(at)
    other = random.choice(random.choice(transcripts()).split(b"\n"))
    odd = f"{random.choice(KEYS)}: {absurd.value(random)}".encode()
    to = random.randrange(len(rows) + 1)
    rows[to:to] = random.choice(([], [row], [other], [odd], [b""], [b"| " + absurd.raw(random)]))
    if random.random() < 0.5:
        rows.insert(at, row)
    return b"\n".join(rows)


def value_changed(random: Random, raw: bytes) -> bytes:
    """A value of a line, or one inside of it, is another."""
    rows = raw.split(b"\n")
    at = random.randrange(len(rows))
    key, colon, told = rows[at].partition(b": ")
    try:
        value = json.loads(told)
    except (ValueError, RecursionError):
        return raw
    holder: dict[str, object] = {"": value}
    put = _replaced(random, holder, "")
    text = json.dumps(holder[""], ensure_ascii=False).replace(json.dumps(MARK), put)
    rows[at] = key + colon + text.encode(errors="surrogatepass")
    return b"\n".join(rows)


MARK = "\ue000 this value"


def _replaced(random: Random, holder: dict[str, object] | list[object], key: str | int) -> str:
    """Puts a mark in the place of a value, or of one inside of it; what is to stand there."""
    value = holder[key]  # type: ignore[index] # of a list or a dictionary
    if isinstance(value, dict | list) and value and random.random() < 0.8:
        inside = random.choice(list(value) if isinstance(value, dict) else range(len(value)))
        return _replaced(random, value, inside)
    holder[key] = MARK  # type: ignore[index]
    return random.choice((absurd.value(random), near(random, value)))


def near(random: Random, value: object) -> str:
    """JSON of a value that is almost the same."""
    if isinstance(value, bool) or value is None:
        return json.dumps(not value)
    if isinstance(value, int | float):
        whole = isinstance(value, int) and abs(value) > LARGE
        step = random.choice((1, -1) if whole else (1, -1, 0.1, 1e-3, 1e-9, 1e6))
        return json.dumps(value + step)
    if isinstance(value, str):
        words = (f"{value}x", value[1:], value.upper(), f"{value} ", "(0,0)")
        return json.dumps(random.choice(words))
    if isinstance(value, list | tuple):
        value = [*value]
        return json.dumps(random.choice(([*value, 0], value[1:], value[::-1], value * 3)))
    return json.dumps({**json.loads(json.dumps(value)), "other": 1})


def header_changed(random: Random, raw: bytes) -> bytes:
    """A line of the header is another: of a game that might be."""
    line = random.choice((_problem, _set, _seats, _numbers))(random, raw)
    key = line.partition(b":")[0]
    above, empty, rest = raw.partition(b"\n\n")
    rows = [row for row in above.split(b"\n") if not row.startswith(key + b":")]
    order = [name.encode() for name in KEYS]
    rows.append(line)
    rows.sort(key=lambda row: next((n for n, key in enumerate(order) if row.startswith(key)), 0))
    return b"\n".join(rows) + empty + rest


def _problem(random: Random, raw: bytes) -> bytes:
    names = (*CASES, "./evil.py:X", "os:path", "hexworld:nowhere", "", "nobody", "os.path:join")
    return f"problem: {json.dumps(random.choice(names))}".encode()


def named(raw: bytes) -> str:
    """The problem of a transcript, where it names one that there is."""
    found = re.search(rb'^problem: "([a-z0-9:-]+)"$', raw, re.MULTILINE)
    name = found[1].decode() if found else ""
    return name if name in CASES else CASES[0]


def _set(random: Random, raw: bytes) -> bytes:
    known = problems.parameter_values(problems.load_problem(named(raw)))
    key = random.choice((*known, *known, "other"))
    value = random.choice((absurd.value(random), near(random, known.get(key, 1))))
    return f"set: {{{json.dumps(key)}: {value}}}".encode(errors="surrogatepass")


def _seats(random: Random, raw: bytes) -> bytes:
    agents = problems.load_problem(named(raw)).agents
    who = (*AGENTS, absurd.word(random))
    seats = {name: random.choice(who) for name in agents}
    if random.random() < 0.2:
        seats[absurd.word(random)] = random.choice(who)
    return f"seats: {json.dumps(seats)}".encode()


def _numbers(random: Random, raw: bytes) -> bytes:
    key = random.choice(("seed", "episode", "turns", "strict", "reveal", "dmplay"))
    return f"{key}: {random.choice((absurd.value(random), 'true'))}".encode(errors="surrogatepass")


def blocks_changed(random: Random, raw: bytes) -> bytes:
    """Blocks are in another order, many times there, gone, or of another game."""
    blocks = raw.split(b"\n\n")
    at = random.randrange(len(blocks))
    block = blocks.pop(at)
    other = random.choice(random.choice(transcripts()).split(b"\n\n"))
    event = (
        f"{random.choice(('undo', 'reroll'))}: {random.choice(('1', '2', absurd.value(random)))}"
    )
    put = random.choice(([], [block] * 2, [block] * 50, [other], [block, event.encode()]))
    to = random.choice((at, random.randrange(len(blocks) + 1)))
    blocks[to:to] = put
    return b"\n\n".join(blocks)


MUTATIONS: tuple[Mutation, ...] = (
    bytes_changed, cut, line_changed, value_changed, value_changed, header_changed, blocks_changed,
)  # fmt: skip

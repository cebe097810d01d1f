"""Reading a transcript: strict about form, with the line and column of the first fault."""

import re
import sys
from collections.abc import Iterator
from dataclasses import MISSING, dataclass
from pathlib import Path
from typing import Any, NamedTuple

from dmplay import disk
from dmplay.errors import BadTranscript, UnknownName
from dmplay.transcript.format import BACK, CHOSEN, EVENTS, MOST_KNOWN, NOTE, TURN, text
from dmplay.transcript.header import FORMAT, LINES, VERSION, Header, Kind
from dmplay.transcript.keyed import keyed

LONGEST_LINE = 1_000_000

HEADER = ("dmplay", *(line.key for line in LINES))
BLOCKS = {keys[0]: keys for keys in (HEADER, TURN, *((e,) for e in EVENTS), ("end",))}
END = re.compile(r"(#.*\n)*end: .*\n(#.*\n)*\Z")
NOTES = re.compile(r"(#.*\n)+\Z")


class Entry(NamedTuple):
    """A value, and the line it stands on."""

    line: int
    value: object


@dataclass(slots=True)
class Block:
    """The lines between two empty ones: a hundred thousand of them are few bytes each."""

    line: int
    keys: tuple[str, ...]  # shared by all blocks that have the same
    values: tuple[object, ...]
    frame: tuple[str, ...]
    notes: tuple[tuple[int, str], ...]  # how many lines of the block stand before it, and its text

    @property
    def kind(self) -> str:
        """What it is: dmplay (the header), turn, undo, reroll or end."""
        return self.keys[0]

    def __getitem__(self, key: str) -> object:
        return self.values[self.keys.index(key)]

    def get(self, key: str, default: object = None) -> object:
        """A value, or what is meant where there is none."""
        return self[key] if key in self.keys else default

    def at(self, place: int) -> int:
        """The line of the file on which this line of the block stands."""
        between = sum(0 < before <= place for before, _ in self.notes)
        return self.line + place + between

    def line_of(self, key: str) -> int:
        """The line of a value; the block's first where there is none."""
        return self.at(self.keys.index(key)) if key in self.keys else self.line

    @property
    def entries(self) -> dict[str, Entry]:
        """All values with their lines."""
        return {key: Entry(self.line_of(key), self[key]) for key in self.keys}

    def anew(self, rows: list[str]) -> str:
        """The text of this block with these lines."""
        return text(self.noted(rows))

    def noted(self, rows: list[str]) -> list[str]:
        """New lines of this block with its notes in their places."""
        out = list(rows)
        for place, note in reversed(self.notes):
            out.insert(min(place, len(rows)), note)
        return out


@dataclass(frozen=True)
class Transcript:
    """A file read and checked for form; whether it is true is for `verify` to say."""

    path: str
    header: Header
    header_block: Block
    blocks: list[Block]  # the opening, turns and events
    end: Block | None
    content: str  # the whole blocks, up to the end line
    last: str  # the end line and the notes around it
    torn: str  # what follows the last whole block of an unfinished file

    def fault(self, line: int, what: str) -> BadTranscript:
        """The error that a line of it is."""
        return BadTranscript(self.path, line, None, what)

    @property
    def reason(self) -> str:
        """Why the game ended, as its end line says; '' without one."""
        told = self.end["end"] if self.end else None
        return str(told.get("reason")) if isinstance(told, dict) else ""

    @property
    def notes(self) -> list[str]:
        """The notes, wherever they stand."""
        return [row[:-1] for part in (self.content, self.last) for row in NOTE.findall(part)]

    @property
    def chosen(self) -> str:
        """The reason where somebody ended the game before it came to its end; else ''."""
        return self.reason if self.reason in CHOSEN else ""


def read(path: str | Path) -> Transcript:
    """Reads a transcript strictly; raises BadTranscript with line and column, or OSError."""
    transcript = left(path)
    if not transcript.blocks:
        line = transcript.content.count("\n") + 1
        raise transcript.fault(line, "torn before its first turn; dmplay resume begins it")
    return transcript


def left(path: str | Path) -> Transcript:
    """A transcript as it was left, perhaps before its first turn."""
    return parse(disk.content(Path(path)), str(path))


def parse(raw: bytes, path: str = "transcript") -> Transcript:
    """A transcript from its bytes, torn before its opening or not; `path` is for messages."""
    content, last, torn = _split(_decoded(raw, path), path)
    blocks = list(_blocks(content, path, 1))
    end = next(iter(_blocks(last, path, content.count("\n") + 1)), None) if last else None
    if not blocks:
        if torn:
            raise BadTranscript(path, 1, None, "not a transcript, or torn before its first turn")
        raise BadTranscript(path, 1, None, f"empty, expected 'dmplay: {VERSION}'")
    header, *rest = blocks
    for place, block in enumerate(rest):
        opening = block.kind == "turn" and block["turn"] == 0
        if block.kind in ("dmplay", "end") or opening != (place == 0):
            expected = "a turn, an undo or a reroll" if place else "the opening, 'turn: 0'"
            raise BadTranscript(path, block.line, None, f"got {block.kind}, expected {expected}")
    told = header_of(header, path)
    barred = EVENTS if told.strict == "hints" else BACK if told.strict else ()
    for block in rest:
        if block.kind in barred:
            raise BadTranscript(path, block.line, None, f"got {block.kind}, but the game is strict")
    return Transcript(path, told, header, rest, end, content, last, torn)


def _decoded(raw: bytes, path: str) -> str:
    try:
        return raw.decode()
    except UnicodeDecodeError as error:
        before = raw[: error.start]
        line, column = before.count(b"\n") + 1, error.start - before.rfind(b"\n")
        raise BadTranscript(path, line, column, "not UTF-8") from None


def _split(content: str, path: str) -> tuple[str, str, str]:
    """The whole blocks, the end block or '', and the torn tail or ''."""
    if "\r" in content:
        line = content[: content.index("\r")].count("\n") + 1
        fault = "a carriage return; lines end with a newline alone"
        raise BadTranscript(path, line, None, fault)
    at = content.rfind("\n\n") + 2 if "\n\n" in content else 0
    tail = content[at:]
    if END.match(tail):
        return content[:at], tail, ""
    return (content, "", "") if NOTES.match(tail) else (content[:at], "", tail)


def _blocks(content: str, path: str, first: int) -> Iterator[Block]:
    """The blocks of some whole lines, the first of which has this number.

    Most lines of a game come again and again: these are read once, and their values shared.
    """
    known: dict[str, tuple[str, object]] = {}
    shapes: dict[tuple[str, ...], tuple[str, ...]] = {}
    entries: dict[str, object] = {}
    frame: list[str] = []
    notes: list[tuple[int, str]] = []
    begun = first
    for line, row in enumerate(_rows(content), first):
        found = known.get(row)
        if found is None and row and not _beside(row, line, path, len(entries), frame, notes):
            found = keyed(row, path, line)
            if len(known) < MOST_KNOWN:
                known[row] = found
        if found:
            key, value = found
            if key in entries:
                raise BadTranscript(path, line, 1, f"{key} stands twice in this block")
            if frame:
                raise BadTranscript(path, line, 1, f"{key} after the frame")
            begun = begun if entries else line
            entries[key] = value
        elif not row and frame and not entries:
            raise BadTranscript(path, line, None, "a frame without a turn")
        elif not row and entries:
            keys = tuple(entries)
            block = Block(begun, keys, tuple(entries.values()), tuple(frame), tuple(notes))
            if keys not in shapes:
                shapes[keys] = _ordered(block, path)
            block.keys = shapes[keys]
            yield block
            entries.clear()
            frame.clear()
            notes.clear()


def _rows(content: str) -> Iterator[str]:
    """The lines, of which not all are held at once."""
    at = 0
    while (end := content.find("\n", at + LONGEST_LINE)) >= 0:
        yield from content[at:end].split("\n")
        at = end + 1
    yield from content[at:].split("\n")


def _beside(  # noqa: PLR0913, PLR0917 - a line, and where it goes
    row: str, line: int, path: str, before: int, frame: list[str], notes: list[tuple[int, str]]
) -> bool:
    """Whether a line is one of a frame, or a note; it is kept as such."""
    if len(row) > LONGEST_LINE:
        fault = "a line of over a million characters"
        raise BadTranscript(path, line, LONGEST_LINE + 1, fault)
    if row[0] not in "#|":
        return False
    if row == "#" or row.startswith("# "):
        notes.append((before + len(frame), row))
    elif row[0] == "|":
        frame.append(sys.intern(row[2:]))
    else:
        return False
    return True


def _ordered(block: Block, path: str) -> tuple[str, ...]:
    """The keys of a block, which must be its kind's, in order."""
    if block.kind not in BLOCKS:
        raise BadTranscript(path, block.line, 1, str(UnknownName("block", block.kind, BLOCKS)))
    order = BLOCKS[block.kind]
    for key, entry in block.entries.items():
        if key not in order:
            raise BadTranscript(path, entry.line, 1, str(UnknownName("key", key, order)))
    if list(block.keys) != [key for key in order if key in block.keys]:
        expected = f"keys out of order, expected {', '.join(order)}"
        raise BadTranscript(path, block.line, None, expected)
    return block.keys


def header_of(block: Block, path: str) -> Header:
    """The header that a block holds; raises BadTranscript where it is none."""
    _told(block, path, "dmplay", FORMAT)
    told = {line.field: _told(block, path, line.key, line.kind, line.default) for line in LINES}
    return Header(**told)


def _told(block: Block, path: str, key: str, kind: Kind, default: object = MISSING) -> Any:
    """What stands on a line of the header, or what is meant where there is none."""
    entry = block.entries.get(key)
    if entry is None and default is MISSING:
        what = f"the header has no {key}: {kind.expected}"
        raise BadTranscript(path, block.line, None, what)
    if entry is None:
        return default
    if not kind.holds(entry.value):
        raise BadTranscript(path, entry.line, None, f"{key}: expected {kind.expected}")
    return entry.value

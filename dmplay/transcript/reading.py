"""Reading a transcript: strict about form, with the line and column of the first fault."""

import re
import sys
from collections.abc import Iterator
from dataclasses import MISSING, dataclass
from pathlib import Path
from typing import Any, NamedTuple

from dmplay import disk
from dmplay.errors import BadTranscript, UnknownName
from dmplay.transcript.format import (
    EVENT_KEYS,
    MAX_CACHED_LINES,
    NOTE_PATTERN,
    PLAYER_END_REASONS,
    TAKE_BACK_EVENTS,
    TURN_KEYS,
    join_block,
)
from dmplay.transcript.header import FORMAT_VERSION, HEADER_LINES, VERSION_TYPE, Header, ValueType
from dmplay.transcript.keyed import parse_line

MAX_LINE_CHARS = 1_000_000

HEADER_KEYS = ("dmplay", *(line.key for line in HEADER_LINES))
BLOCK_KEYS = {
    keys[0]: keys for keys in (HEADER_KEYS, TURN_KEYS, *((e,) for e in EVENT_KEYS), ("end",))
}
END_BLOCK_PATTERN = re.compile(r"(#.*\n)*end: .*\n(#.*\n)*\Z")
NOTES_PATTERN = re.compile(r"(#.*\n)+\Z")


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

    def file_line(self, row: int) -> int:
        """The line of the file on which this line of the block stands."""
        between = sum(0 < before <= row for before, _ in self.notes)
        return self.line + row + between

    def line_of_key(self, key: str) -> int:
        """The line of a value; the block's first where there is none."""
        return self.file_line(self.keys.index(key)) if key in self.keys else self.line

    @property
    def entries(self) -> dict[str, Entry]:
        """All values with their lines."""
        return {key: Entry(self.line_of_key(key), self[key]) for key in self.keys}

    def rewrite(self, rows: list[str]) -> str:
        """The text of this block with these lines."""
        return join_block(self.insert_notes(rows))

    def insert_notes(self, rows: list[str]) -> list[str]:
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
    end_block: Block | None
    content: str  # the whole blocks, up to the end line
    end_text: str  # the end line and the notes around it
    torn_tail: str  # what follows the last whole block of an unfinished file

    def error_at(self, line: int, explanation: str) -> BadTranscript:
        """The error that a line of it is."""
        return BadTranscript(self.path, line, None, explanation)

    @property
    def end_reason(self) -> str:
        """Why the game ended, as its end line says; '' without one."""
        told = self.end_block["end"] if self.end_block else None
        return str(told.get("reason")) if isinstance(told, dict) else ""

    @property
    def notes(self) -> list[str]:
        """The notes, wherever they stand."""
        return [
            row[:-1] for part in (self.content, self.end_text) for row in NOTE_PATTERN.findall(part)
        ]

    @property
    def player_end_reason(self) -> str:
        """The reason where somebody ended the game before it came to its end; else ''."""
        return self.end_reason if self.end_reason in PLAYER_END_REASONS else ""


def read_transcript(path: str | Path) -> Transcript:
    """Reads a transcript strictly; raises BadTranscript with line and column, or OSError."""
    transcript = read_incomplete_transcript(path)
    if not transcript.blocks:
        line = transcript.content.count("\n") + 1
        raise transcript.error_at(line, "torn before its first turn; dmplay resume begins it")
    return transcript


def read_incomplete_transcript(path: str | Path) -> Transcript:
    """A transcript as it was left, perhaps before its first turn."""
    return parse_transcript(disk.read_bytes(Path(path)), str(path))


def parse_transcript(raw: bytes, path: str = "transcript") -> Transcript:
    """A transcript from its bytes, torn before its opening or not; `path` is for messages."""
    content, last, torn = _split_sections(_decode_utf8(raw, path), path)
    blocks = list(_parse_blocks(content, path, 1))
    end = next(iter(_parse_blocks(last, path, content.count("\n") + 1)), None) if last else None
    if not blocks:
        if torn:
            raise BadTranscript(path, 1, None, "not a transcript, or torn before its first turn")
        raise BadTranscript(path, 1, None, f"empty, expected 'dmplay: {FORMAT_VERSION}'")
    header, *rest = blocks
    for place, block in enumerate(rest):
        opening = block.kind == "turn" and block["turn"] == 0
        if block.kind in ("dmplay", "end") or opening != (place == 0):
            expected = "a turn, an undo or a reroll" if place else "the opening, 'turn: 0'"
            raise BadTranscript(path, block.line, None, f"got {block.kind}, expected {expected}")
    told = parse_header(header, path)
    barred = EVENT_KEYS if told.strict == "hints" else TAKE_BACK_EVENTS if told.strict else ()
    for block in rest:
        if block.kind in barred:
            raise BadTranscript(path, block.line, None, f"got {block.kind}, but the game is strict")
    return Transcript(path, told, header, rest, end, content, last, torn)


def _decode_utf8(raw: bytes, path: str) -> str:
    try:
        return raw.decode()
    except UnicodeDecodeError as error:
        before = raw[: error.start]
        line, column = before.count(b"\n") + 1, error.start - before.rfind(b"\n")
        raise BadTranscript(path, line, column, "not UTF-8") from None


def _split_sections(content: str, path: str) -> tuple[str, str, str]:
    """The whole blocks, the end block or '', and the torn tail or ''."""
    if "\r" in content:
        line = content[: content.index("\r")].count("\n") + 1
        fault = "a carriage return; lines end with a newline alone"
        raise BadTranscript(path, line, None, fault)
    at = content.rfind("\n\n") + 2 if "\n\n" in content else 0
    tail = content[at:]
    if END_BLOCK_PATTERN.match(tail):
        return content[:at], tail, ""
    return (content, "", "") if NOTES_PATTERN.match(tail) else (content[:at], "", tail)


def _parse_blocks(content: str, path: str, first: int) -> Iterator[Block]:
    """The blocks of some whole lines, the first of which has this number.

    Most lines of a game come again and again: these are read once, and their values shared.
    """
    known: dict[str, tuple[str, object]] = {}
    shapes: dict[tuple[str, ...], tuple[str, ...]] = {}
    entries: dict[str, object] = {}
    frame: list[str] = []
    notes: list[tuple[int, str]] = []
    begun = first
    for line, row in enumerate(_iter_lines(content), first):
        found = known.get(row)
        if (
            found is None
            and row
            and not _collect_frame_or_note(row, line, path, len(entries), frame, notes)
        ):
            found = parse_line(row, path, line)
            if len(known) < MAX_CACHED_LINES:
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
                shapes[keys] = _check_key_order(block, path)
            block.keys = shapes[keys]
            yield block
            entries.clear()
            frame.clear()
            notes.clear()


def _iter_lines(content: str) -> Iterator[str]:
    """The lines, of which not all are held at once."""
    at = 0
    while (end := content.find("\n", at + MAX_LINE_CHARS)) >= 0:
        yield from content[at:end].split("\n")
        at = end + 1
    yield from content[at:].split("\n")


def _collect_frame_or_note(  # noqa: PLR0913, PLR0917 - a line, and where it goes
    row: str, line: int, path: str, entry_count: int, frame: list[str], notes: list[tuple[int, str]]
) -> bool:
    """Whether a line is one of a frame, or a note; it is kept as such."""
    if len(row) > MAX_LINE_CHARS:
        fault = "a line of over a million characters"
        raise BadTranscript(path, line, MAX_LINE_CHARS + 1, fault)
    if row[0] not in "#|":
        return False
    if row == "#" or row.startswith("# "):
        notes.append((entry_count + len(frame), row))
    elif row[0] == "|":
        frame.append(sys.intern(row[2:]))
    else:
        return False
    return True


def _check_key_order(block: Block, path: str) -> tuple[str, ...]:
    """The keys of a block, which must be its kind's, in order."""
    if block.kind not in BLOCK_KEYS:
        raise BadTranscript(path, block.line, 1, str(UnknownName("block", block.kind, BLOCK_KEYS)))
    order = BLOCK_KEYS[block.kind]
    for key, entry in block.entries.items():
        if key not in order:
            raise BadTranscript(path, entry.line, 1, str(UnknownName("key", key, order)))
    if list(block.keys) != [key for key in order if key in block.keys]:
        expected = f"keys out of order, expected {', '.join(order)}"
        raise BadTranscript(path, block.line, None, expected)
    return block.keys


def parse_header(block: Block, path: str) -> Header:
    """The header that a block holds; raises BadTranscript where it is none."""
    _read_header_value(block, path, "dmplay", VERSION_TYPE)
    told = {
        line.field: _read_header_value(block, path, line.key, line.value_type, line.default)
        for line in HEADER_LINES
    }
    return Header(**told)


def _read_header_value(
    block: Block, path: str, key: str, value_type: ValueType, default: object = MISSING
) -> Any:
    """What stands on a line of the header, or what is meant where there is none."""
    entry = block.entries.get(key)
    if entry is None and default is MISSING:
        what = f"the header has no {key}: {value_type.expected}"
        raise BadTranscript(path, block.line, None, what)
    if entry is None:
        return default
    if not value_type.accepts(entry.value):
        raise BadTranscript(path, entry.line, None, f"{key}: expected {value_type.expected}")
    return entry.value

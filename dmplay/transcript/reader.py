"""The strict reader of transcripts; errors state the line and column of the first fault."""

import re
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass
from pathlib import Path
from typing import Any, NamedTuple

from dmplay.core import safe_files
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
from dmplay.transcript.line_parser import parse_line

MAX_LINE_CHARS = 1_000_000
NOT_A_TRANSCRIPT = "not a transcript, or cut off before its first turn"

HEADER_KEYS = ("dmplay", *(line.key for line in HEADER_LINES))
BLOCK_KEYS = {
    keys[0]: keys for keys in (HEADER_KEYS, TURN_KEYS, *((e,) for e in EVENT_KEYS), ("end",))
}
END_BLOCK_PATTERN = re.compile(r"(#.*\n)*end: .*\n(#.*\n)*\Z")
# the end line, whose checksum is its last value
COMPLETE_END_LINE_PATTERN = re.compile(r'^end: .*"sha256": "[0-9a-f]+"\}$', re.MULTILINE)
BLANKS = " \t\n"
BLOCK_SEPARATOR = "\n\n"
HINT_PATTERN = re.compile(r"^help: .*$", re.MULTILINE)
CONFLICT_PATTERN = re.compile(r"^(?:<{7} |={7}$|>{7} |\|{7} )", re.MULTILINE)  # of git and others
NOTES_PATTERN = re.compile(r"(#.*\n)+\Z")


class Entry(NamedTuple):
    """A value of a block, and the number of its line."""

    line: int
    value: object


@dataclass(slots=True)
class Block:
    """The lines between two empty ones, in few bytes because a file can have 100,000 blocks."""

    line: int
    keys: tuple[str, ...]  # shared by all blocks with the same keys
    values: tuple[object, ...]
    frame: tuple[str, ...]
    # (number of lines of the block before the note, text of the note)
    notes: tuple[tuple[int, str], ...]

    @property
    def kind(self) -> str:
        """The kind of block, its first key: dmplay (a header), turn, undo, reroll, help or end."""
        return self.keys[0]

    def __getitem__(self, key: str) -> object:
        return self.values[self.keys.index(key)]

    def get_value(self, key: str, default: object = None) -> object:
        """Return the value of a key, or the default if the block does not have it."""
        return self[key] if key in self.keys else default

    def file_line(self, row: int) -> int:
        """Return the number in the file of a line of the block, counted from 0 without notes."""
        note_count = sum(0 < position <= row for position, _ in self.notes)
        return self.line + row + note_count

    def line_of_key(self, key: str) -> int:
        """Return the line number of a key; the block's first if it does not have the key."""
        return self.file_line(self.keys.index(key)) if key in self.keys else self.line

    @property
    def entries(self) -> dict[str, Entry]:
        """All values by key, with their line numbers."""
        return {key: Entry(self.line_of_key(key), self[key]) for key in self.keys}

    def replace_lines(self, rows: list[str]) -> str:
        """Return the text of the block with new lines and its old notes."""
        return join_block(self.insert_notes(rows))

    def insert_notes(self, rows: list[str]) -> list[str]:
        """Return new lines of the block, with its notes inserted at their positions."""
        result = list(rows)
        for position, note in reversed(self.notes):
            result.insert(min(position, len(rows)), note)
        return result


@dataclass(frozen=True)
class Transcript:
    """A file that was read and checked for its form; `verify` checks whether it is true."""

    path: str
    header: Header
    header_block: Block
    blocks: list[Block]  # the start, turns and events
    end_block: Block | None
    content: str  # the complete blocks, up to the end line
    end_text: str  # the end line and the notes around it
    torn_tail: str  # text after the last complete block of an unfinished file
    # whether mail or an editor changed the line ends of the file; the other fields have them as
    # dmplay writes them
    has_changed_line_ends: bool = False

    def error_at(self, line: int, explanation: str) -> BadTranscript:
        """Return an error with the path and a line number."""
        return BadTranscript(self.path, line, None, explanation)

    @property
    def end_reason(self) -> str:
        """The reason in the end line; '' without an end line."""
        end_facts = self.end_block["end"] if self.end_block else None
        return str(end_facts.get("reason")) if isinstance(end_facts, dict) else ""

    @property
    def notes(self) -> list[str]:
        """All notes of the file, in order."""
        return [
            row[:-1]
            for section in (self.content, self.end_text)
            for row in NOTE_PATTERN.findall(section)
        ]

    @property
    def player_end_reason(self) -> str:
        """The end reason if a player ended the game early; else ''."""
        return self.end_reason if self.end_reason in PLAYER_END_REASONS else ""


def read_transcript(path: str | Path) -> Transcript:
    """Return the transcript in a file, read strictly.

    Raises BadTranscript with line and column, also if the file ends before its first turn; or
    OSError.
    """
    transcript = read_incomplete_transcript(path)
    if not transcript.blocks:
        line = transcript.content.count("\n") + 1
        raise transcript.error_at(
            line, "cut off before its first turn; dmplay resume starts the game"
        )
    return transcript


def read_incomplete_transcript(path: str | Path) -> Transcript:
    """Return the transcript in a file, even if the file ends before its first turn."""
    return parse_transcript(safe_files.read_bytes(Path(path)), str(path))


@dataclass(frozen=True)
class TranscriptOutline:
    """The facts that identify a recorded game, read without its turns."""

    path: str
    header: Header
    end_reason: str  # '' without an end line
    turns: int  # number of recorded turns, including turns that were undone later
    has_start: bool  # False if the file ends before the start of the game
    hint_counts: Mapping[str, int]  # by seat

    @property
    def has_natural_end(self) -> bool:
        """True if the game has ended, and no player ended it early."""
        return bool(self.end_reason) and self.end_reason not in PLAYER_END_REASONS


def read_outline(path: Path) -> TranscriptOutline:
    """Return the outline of a transcript, whose turns are neither parsed nor checked.

    Raises BadTranscript if the header or the end is malformed; or OSError.
    """
    name = str(path)
    text = _restore_line_ends(_decode_utf8(safe_files.read_bytes(path), name))
    content, last, _ = _split_sections(text, name)
    header_block = next(_parse_blocks(content, name, 1), None)
    if header_block is None:
        raise BadTranscript(name, 1, None, NOT_A_TRANSCRIPT)
    end_block = next(_parse_blocks(last, name, content.count("\n") + 1), None) if last else None
    end_facts = end_block["end"] if end_block else None
    hint_counts = Counter[str]()
    for row in HINT_PATTERN.findall(content):
        _, counts = parse_line(row, name, 1)
        if isinstance(counts, dict):
            hint_counts.update(
                {seat: count for seat, count in counts.items() if type(count) is int}
            )
    blocks_with_turn = content.count("\nturn: ")  # the start and the turns
    return TranscriptOutline(
        name,
        parse_header(header_block, name),
        str(end_facts.get("reason")) if isinstance(end_facts, dict) else "",
        max(blocks_with_turn - 1, 0),
        blocks_with_turn > 0,
        hint_counts,
    )


def parse_transcript(raw: bytes, path: str = "transcript") -> Transcript:
    """Return the transcript in the bytes of a file, complete or not.

    `path` is for messages. Raises BadTranscript with line and column.
    """
    text = _decode_utf8(raw, path)
    restored_text = _restore_line_ends(text)
    if conflict := CONFLICT_PATTERN.search(restored_text):
        line = restored_text.count("\n", 0, conflict.start()) + 1
        explanation = f"got the merge conflict marker {conflict[0].strip()}; resolve the conflict"
        raise BadTranscript(path, line, None, explanation)
    content, last, torn = _split_sections(restored_text, path)
    blocks = list(_parse_blocks(content, path, 1))
    end = next(iter(_parse_blocks(last, path, content.count("\n") + 1)), None) if last else None
    if not blocks:
        if torn:
            raise BadTranscript(path, 1, None, NOT_A_TRANSCRIPT)
        raise BadTranscript(path, 1, None, f"empty, expected 'dmplay: {FORMAT_VERSION}'")
    header_block, *game_blocks = blocks
    for index, block in enumerate(game_blocks):
        is_start = block.kind == "turn" and block["turn"] == 0
        if block.kind in ("dmplay", "end") or is_start != (index == 0):
            if block.kind == "end":
                explanation = "got lines after the end of the game, expected only notes"
                raise BadTranscript(path, block.line, None, explanation)
            expected = "a turn, an undo or a reroll" if index else "the start, 'turn: 0'"
            raise BadTranscript(path, block.line, None, f"got {block.kind}, expected {expected}")
    header = parse_header(header_block, path)
    forbidden_kinds = (
        EVENT_KEYS if header.strict == "hints" else TAKE_BACK_EVENTS if header.strict else ()
    )
    for block in game_blocks:
        if block.kind in forbidden_kinds:
            raise BadTranscript(path, block.line, None, f"got {block.kind}, but the game is strict")
    has_changed_line_ends = restored_text != text
    return Transcript(
        path, header, header_block, game_blocks, end, content, last, torn, has_changed_line_ends
    )


def _decode_utf8(raw: bytes, path: str) -> str:
    """Return the content of a file as text; raise BadTranscript if it is not UTF-8."""
    try:
        return raw.decode()
    except UnicodeDecodeError as error:
        before = raw[: error.start]
        line, column = before.count(b"\n") + 1, error.start - before.rfind(b"\n")
        raise BadTranscript(path, line, column, "not UTF-8") from None


def _restore_line_ends(text: str) -> str:
    """Return a text with the line ends that dmplay writes, and without a byte order mark.

    Mail programs and editors add a carriage return to each line, leave out the newline of a
    complete last line, or add blank lines at the end of the file.
    """
    text = text.removeprefix("\ufeff").replace("\r\n", "\n")
    lines = text.rstrip(BLANKS)
    blanks = text[len(lines) :]
    last_line_blanks, newline, _ = blanks.partition("\n")
    last_block = f"{lines[lines.rfind(BLOCK_SEPARATOR) + len(BLOCK_SEPARATOR) :]}\n"
    if END_BLOCK_PATTERN.match(last_block):
        if newline:
            return f"{lines}{last_line_blanks}\n"
        return f"{lines}\n" if COMPLETE_END_LINE_PATTERN.search(last_block) else text
    # A file without an end line ends with one empty line, after which a game is resumed.
    if lines and blanks.startswith(BLOCK_SEPARATOR, len(last_line_blanks)):
        return lines + last_line_blanks + BLOCK_SEPARATOR
    return text


def _split_sections(content: str, path: str) -> tuple[str, str, str]:
    """Return the complete blocks, the end block or '', and the incomplete tail or ''."""
    if "\r" in content:
        line = content[: content.index("\r")].count("\n") + 1
        explanation = "carriage return inside the file; lines must end with a newline only"
        raise BadTranscript(path, line, None, explanation)
    tail_start = content.rfind("\n\n") + 2 if "\n\n" in content else 0
    tail = content[tail_start:]
    if END_BLOCK_PATTERN.match(tail):
        return content[:tail_start], tail, ""
    return (content, "", "") if NOTES_PATTERN.match(tail) else (content[:tail_start], "", tail)


def _parse_blocks(content: str, path: str, first: int) -> Iterator[Block]:
    """Yield the blocks of complete lines, the first of which has this number.

    Most lines of a game recur. Each is parsed once, and blocks share its value.
    """
    cache: dict[str, tuple[str, object]] = {}
    shared_keys: dict[tuple[str, ...], tuple[str, ...]] = {}
    entries: dict[str, object] = {}
    frame: list[str] = []
    notes: list[tuple[int, str]] = []
    first_line = first
    for line, row in enumerate(_iter_lines(content), first):
        parsed_line = cache.get(row)
        if (
            parsed_line is None
            and row
            and not _store_frame_or_note(row, line, path, len(entries), frame, notes)
        ):
            parsed_line = parse_line(row, path, line)
            if len(cache) < MAX_CACHED_LINES:
                cache[row] = parsed_line
        if parsed_line:
            key, value = parsed_line
            if key in entries:
                raise BadTranscript(path, line, 1, f"{key} occurs twice in this block")
            if frame:
                raise BadTranscript(
                    path, line, 1, f"got {key} after the frame, expected it before the frame"
                )
            first_line = first_line if entries else line
            entries[key] = value
        elif not row and frame and not entries:
            raise BadTranscript(path, line, None, "a frame without a turn")
        elif not row and entries:
            keys = tuple(entries)
            block = Block(first_line, keys, tuple(entries.values()), tuple(frame), tuple(notes))
            if keys not in shared_keys:
                shared_keys[keys] = _check_key_order(block, path)
            block.keys = shared_keys[keys]
            yield block
            entries.clear()
            frame.clear()
            notes.clear()


def _iter_lines(content: str) -> Iterator[str]:
    """Yield the lines, without holding all of them in memory at once."""
    start = 0
    while (end := content.find("\n", start + MAX_LINE_CHARS)) >= 0:
        yield from content[start:end].split("\n")
        start = end + 1
    yield from content[start:].split("\n")


def _store_frame_or_note(  # noqa: PLR0913, PLR0917 - a line, and where it goes
    row: str, line: int, path: str, entry_count: int, frame: list[str], notes: list[tuple[int, str]]
) -> bool:
    """Append a line of a frame or a note to its list; return whether the line was either.

    Raises BadTranscript if the line is too long.
    """
    if len(row) > MAX_LINE_CHARS:
        explanation = f"line longer than {MAX_LINE_CHARS:,} characters"
        raise BadTranscript(path, line, MAX_LINE_CHARS + 1, explanation)
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
    """Return the keys of a block; raise BadTranscript if one is unknown or out of order."""
    if block.kind not in BLOCK_KEYS:
        raise BadTranscript(path, block.line, 1, str(UnknownName("block", block.kind, BLOCK_KEYS)))
    order = BLOCK_KEYS[block.kind]
    for key in block.keys:
        if key not in order:
            line = block.line_of_key(key)
            raise BadTranscript(path, line, 1, str(UnknownName("key", key, order)))
    if list(block.keys) != [key for key in order if key in block.keys]:
        expected = f"keys out of order, expected {', '.join(order)}"
        raise BadTranscript(path, block.line, None, expected)
    return block.keys


def parse_header(block: Block, path: str) -> Header:
    """Return the header in a block; raise BadTranscript if it is malformed."""
    _read_header_value(block, path, "dmplay", VERSION_TYPE)
    values = {
        line.field: _read_header_value(block, path, line.key, line.value_type, line.default)
        for line in HEADER_LINES
    }
    return Header(**values)


def _read_header_value(
    block: Block, path: str, key: str, value_type: ValueType, default: object = MISSING
) -> Any:
    """Return the value of a header line or its default; raise BadTranscript if it is malformed."""
    if key not in block.keys and default is MISSING:
        explanation = f"the header has no {key}, expected {value_type.expected}"
        raise BadTranscript(path, block.line, None, explanation)
    if key not in block.keys:
        return default
    value = block[key]
    if not value_type.accepts(value):
        line = block.line_of_key(key)
        raise BadTranscript(path, line, None, f"{key}: expected {value_type.expected}")
    return value

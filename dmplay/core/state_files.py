"""The JSON files in which dmplay remembers something between two runs.

All of them are read and changed here, so that nothing in them is lost. A file, or an entry, that
cannot be read is kept aside under another name. A file of a later version is not changed.
"""

import errno
import json
import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import count
from pathlib import Path
from typing import Any

from dmplay.core import safe_files
from dmplay.errors import BadParameter, DmplayError, clip_message

FORMAT_VERSION = 1
MAX_WHOLE_NUMBER = 2**63
# Errors that stay until somebody moves the file; after any other one, it may be read again later.
LASTING_ERRNOS = (errno.EACCES, errno.EPERM, errno.EISDIR, errno.EINVAL, errno.EFBIG, errno.ELOOP)


@dataclass(frozen=True)
class StateFile:
    """A file in the state folder: a JSON object of sections, each a table or a list of entries."""

    name: str
    purpose: str  # such as "progress in lessons", for messages
    # The type of each section, and the parser of its entries, which raises an error for others.
    sections: Mapping[str, tuple[type[Any], Callable[[Any], object]]]

    @property
    def path(self) -> Path:
        """The path of the file itself, also if a symbolic link in the state folder names it."""
        folder = safe_files.user_folder(os.environ, "XDG_STATE_HOME", ".local", "state")
        return Path(os.path.realpath(folder / self.name))

    def read(self) -> dict[str, Any]:
        """Return the valid contents of the file, {} if there are none."""
        try:
            content, fault = self._load_valid_entries()
        except (DmplayError, OSError) as error:
            warn_once(f"{self.purpose}: {error}")
            return {}
        return self.update(lambda _: None) or content if fault else content

    def update(self, change: Callable[[dict[str, Any]], None]) -> dict[str, Any]:
        """Change the contents under a lock, and return them; print a warning if that fails."""
        content: dict[str, Any] = {}
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            with safe_files.exclusive_lock(self.path.with_suffix(".lock")):
                content, fault = self._load_valid_entries()
                if fault:
                    self._rename_invalid_file(fault)
                change(content)
                text = json.dumps({"dmplay": FORMAT_VERSION, **content}, indent=1) + "\n"
                safe_files.write_file(self.path, text, continues=True, private=True)
        except (DmplayError, OSError, RecursionError) as error:
            warn_once(f"{self.purpose}: not saved: {error}")
        return content

    def _load_valid_entries(self) -> tuple[dict[str, Any], str]:
        """Return the valid contents, and the fault of the others, '' if there is none.

        Raise BadParameter for a file of a later version, and OSError if it may be read later.
        """
        try:
            content = json.loads(safe_files.read_bytes(self.path), parse_constant=float)
        except FileNotFoundError:
            return {}, ""
        except OSError as error:
            if error.errno not in LASTING_ERRNOS:
                raise
            return {}, str(error.strerror)
        except (ValueError, RecursionError) as error:
            return {}, f"not a file of JSON: {error}"
        version = content.pop("dmplay", None) if isinstance(content, dict) else None
        if isinstance(version, int | float) and version > FORMAT_VERSION:
            message = (
                "was written by a later version of dmplay; this version does not read or change it"
            )
            raise BadParameter(f"{self.path} {message}")
        if version != FORMAT_VERSION or isinstance(version, bool):
            return {}, f'expected an object with "dmplay": {FORMAT_VERSION}'
        faults = [self._remove_invalid_entries(content, section) for section in self.sections]
        return content, next(filter(None, faults), "")

    def _remove_invalid_entries(self, content: dict[str, Any], section: str) -> str:
        """Remove the entries of a section that cannot be read; return the first fault or ''."""
        kind, parse_entry = self.sections[section]
        entries: Any = content.get(section, kind())
        if type(entries) is not kind:
            content[section] = kind()
            return f"{section}: expected a {'table' if kind is dict else 'list'}"
        pairs = [*(entries.items() if kind is dict else enumerate(entries))]
        invalid_keys = [key for key, entry in pairs if not _can_parse_entry(parse_entry, entry)]
        for key in reversed(invalid_keys):
            del content[section][key]
        return f"{section}: cannot read the entry {invalid_keys[0]!r}" if invalid_keys else ""

    def _rename_invalid_file(self, fault: str) -> None:
        """Rename the file, and print a line that names its place."""
        path = self.path
        names = (path.with_stem(f"{path.stem}-unreadable{number or ''}") for number in count())
        aside = next(name for name in names if not os.path.lexists(name))
        path.rename(aside)
        warn_once(f"{self.purpose}: {path}: {fault}; dmplay keeps the old file as {aside}")


def require_whole_number(value: object, high: int = MAX_WHOLE_NUMBER) -> int:
    """Return a whole number from 0 to `high`; raise ValueError for any other value."""
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= high:
        raise ValueError(value)
    return value


def require_line(value: object) -> str:
    """Return a printable text of one line; raise ValueError for any other value."""
    if not isinstance(value, str) or not value.isprintable():
        raise ValueError(value)
    return value


def _can_parse_entry(parse_entry: Callable[[Any], object], entry: object) -> bool:
    """Return whether an entry can be parsed."""
    try:
        parse_entry(entry)
    except (ValueError, TypeError, LookupError, AttributeError):
        return False
    return True


@cache  # prints each warning only once
def warn_once(message: str) -> None:
    """Print a warning to standard error, once for each message."""
    print(clip_message(f"warning: {message}"), file=sys.stderr)

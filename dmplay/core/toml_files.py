"""The reader of TOML files, settings and lessons, with limits that keep reading them quick."""

import re
from pathlib import Path

from dmplay.core import safe_files
from dmplay.errors import BadFile, BadParameter

# The work of Python's parser grows with the square of the parts of a key, which dots separate.
MAX_FILE_BYTES, MAX_DOTS_PER_LINE = 64 * 2**10, 100
MAX_INTEGER_BITS = 64  # with the sign, as TOML demands; Python refuses to print very long ones
LONG_INTEGER = f"got an integer of more than {MAX_INTEGER_BITS} bits"
ERROR_POSITION = re.compile(r" \(at line (\d+), column (\d+)\)")


def read_toml(path: Path) -> dict[str, object]:
    """Return the contents of a TOML file.

    Raise BadFile with line and column, or BadParameter, if it is invalid or too complex.
    """
    import tomllib  # imported only if a file exists

    try:
        text = safe_files.read_bytes(path, MAX_FILE_BYTES).decode()
        for number, line in enumerate(text.split("\n"), 1):
            dot_count = line.count(".")
            if dot_count > MAX_DOTS_PER_LINE:
                expected = f"expected at most {MAX_DOTS_PER_LINE} in a line"
                raise BadParameter(f"{path}: line {number}: got {dot_count} dots, {expected}")
        content = tomllib.loads(text)
    except BadParameter:
        raise
    except OSError as error:
        raise BadParameter(f"{path}: {error.strerror}") from None
    except RecursionError:
        raise BadParameter(f"{path}: arrays or tables are nested too deeply") from None
    except UnicodeDecodeError:
        raise BadParameter(f"{path}: not UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        message = str(error).partition("\n")[0]
        explanation = ERROR_POSITION.sub("", f"{message[:1].lower()}{message[1:]}")
        match = ERROR_POSITION.search(message)
        if match is None:
            raise BadParameter(f"{path}: {explanation}") from None
        raise BadFile(str(path), int(match[1]), int(match[2]), explanation) from None
    except ValueError:  # Python's own limit on decimal digits
        raise BadParameter(f"{path}: {LONG_INTEGER}") from None
    _check_integers(content, str(path))
    return content


def _check_integers(value: object, location: str) -> None:
    """Raise BadParameter if a value is or contains an integer beyond MAX_INTEGER_BITS."""
    if isinstance(value, dict):
        for key, item in value.items():
            _check_integers(item, f"{location}: {key}")
    elif isinstance(value, list):
        for item in value:
            _check_integers(item, location)
    elif isinstance(value, int) and value.bit_length() >= MAX_INTEGER_BITS:
        raise BadParameter(f"{location}: {LONG_INTEGER}")

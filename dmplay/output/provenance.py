"""Provenance: how an output was made, for its metadata.

All writers of JSON, SVG and PNG call `describe_provenance`. The command line sets the command that
runs; what Python functions return has no provenance.
"""

import hashlib
import json
import platform
import struct
import sys
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from html import escape
from importlib.metadata import version
from pathlib import Path
from typing import Any

from dmplay import __version__
from dmplay.core.running_command import get_running_command
from dmplay.core.safe_files import read_bytes, write_file
from dmplay.core.text import JSON_REPORT_BEGINNING, format_json_report
from dmplay.errors import BadParameter, DmplayError

KEY = "provenance"
PNG_END_BYTES = 12  # of the last chunk of a PNG file
AGENT_OPTIONS = ("agent", "agents", "entrants", "vs", "seat", "policies")


def describe_provenance(digest: str) -> dict[str, object]:
    """Return the provenance of an output of the running command; {} if no command runs.

    It has the versions, the command with the values of all its options, the parameters of the
    problem and of the agents with their defaults, the seed, and the digest of the content.
    """
    if not get_running_command().words:
        return {}
    options = {name: _to_json_value(value) for name, value in get_running_command().options.items()}
    return {
        **list_versions(),
        "command": [*get_running_command().words],
        "options": options,
        **_describe_problems(options),
        "seed": options.get("seed"),
        "digest": digest,
    }


def list_versions() -> dict[str, str]:
    """Return the versions of dmplay, Python and NumPy."""
    numpy = sys.modules.get("numpy")  # The import would take longer than most reports.
    numpy_version = numpy.__version__ if numpy else version("numpy")
    return {"dmplay": __version__, "python": platform.python_version(), "numpy": numpy_version}


def _to_json_value(value: object) -> object:
    """Return the value of an option as JSON can write it."""
    if isinstance(value, list | tuple):
        return [_to_json_value(item) for item in value]
    return value if value is None or isinstance(value, bool | int | float | str) else str(value)


def _describe_problems(options: Mapping[str, Any]) -> dict[str, object]:
    """Return the parameters of the problem and of the agents that the options name.

    If they name a list of problems, they are by problem.
    """
    facts = {name: _describe_problem(name, options) for name in list_problem_names(options)}
    described = {name: pair for name, pair in facts.items() if pair}
    if "problems" not in options:
        return next(iter(described.values()), {})
    keys = ("parameters", "agents") if described else ()
    return {key: {name: pair[key] for name, pair in described.items()} for key in keys}


def list_problem_names(options: Mapping[str, Any]) -> list[str]:
    """Return the names of the problems in the options of a command."""
    names = options.get("problems") or [options.get("problem")]
    variant = options.get("variant")
    texts = [name for name in names if isinstance(name, str) and name]
    return [f"{name}:{variant}" if variant else name for name in texts]


def _describe_problem(name: str, options: Mapping[str, Any]) -> dict[str, object]:
    """Return the parameters of a problem and of the agents that the options name."""
    from dmplay.game.launch_requests import parse_settings
    from dmplay.registry import agents, problems

    with suppress(DmplayError):
        problem = problems.find_problem(name, {}).problem
        values = problems.parameter_values(problem)
        for key, text in parse_settings(options.get("set_") or (), "--set").items():
            values[problems.find_parameter_name(key, values)] = text
        with suppress(DmplayError):  # for several values of a parameter
            problem = problems.with_parameters(problem, values)
            values = problems.parameter_values(problem)
        parameters = {key: _to_json_value(value) for key, value in values.items()}
        return {
            "parameters": parameters,
            "agents": agents.describe_agents(problem, list_agent_names(options)),
        }
    return {}


def list_agent_names(options: Mapping[str, Any]) -> list[str]:
    """Return the names of the agents in the options of a command."""
    names = list[str]()
    for option in AGENT_OPTIONS:
        value = options.get(option) or ()
        texts = [*map(str, value)] if isinstance(value, list | tuple) else [str(value)]
        names += [text.partition("=")[2] if option == "seat" else text for text in texts]
    return names


def compute_digest(content: bytes) -> str:
    """Return the digest of the content of an output, without its provenance."""
    return f"sha256:{hashlib.sha256(content).hexdigest()}"


def add_to_report(text: str) -> str:
    """Return a report with its provenance as the last key, if it is JSON of a command.

    The digest is that of the report without this key, as `json.dumps` writes it.
    """
    if not text.startswith(JSON_REPORT_BEGINNING) or "\n" in text:  # JSON Lines stay plain
        return text
    provenance = describe_provenance(compute_digest(text.encode()))
    if not provenance:
        return text
    return f'{text.removesuffix("}")}, "{KEY}": {json.dumps(provenance)}}}'


def add_to_chunks(chunks: Iterable[str]) -> Iterator[str]:
    """Yield the parts of an SVG picture or of a JSON object, with its provenance at the end.

    Other texts are unchanged. The digest is that of all characters but the provenance.
    """
    digest, last, first = hashlib.sha256(), "", ""
    for chunk in chunks:
        if last:
            yield last
        first = first or chunk[:100]
        digest.update(chunk.encode())
        last = chunk
    digest_text, end = f"sha256:{digest.hexdigest()}", ""
    if first.startswith(("<svg", "<?xml")):
        end = "</svg>"
    elif first.startswith("{\n"):
        end = "\n}"
    before, separator, after = last.rpartition(end) if end else ("", "", "")
    provenance = describe_provenance(digest_text) if separator else {}
    if provenance:
        text = json.dumps(provenance)
        inserted = format_svg_metadata(text) if end == "</svg>" else f',\n "{KEY}": {text}'
        last = before + inserted + end + after
    if last:
        yield last
    write_meta_file(digest_text)


def format_svg_metadata(text: str) -> str:
    """Return the element of an SVG picture that holds its provenance."""
    return f'<metadata id="{KEY}">{escape(text, quote=False)}</metadata>\n'


def add_to_picture(data: bytes, file_format: str) -> bytes:
    """Return a picture file with its provenance; the digest is that of the file without it."""
    if file_format == "svg":
        return "".join(add_to_chunks([data.decode()])).encode()
    provenance = describe_provenance(compute_digest(data)) if file_format == "png" else {}
    if not provenance:
        return data
    chunk = b"iTXt" + KEY.encode() + b"\0\0\0\0\0" + json.dumps(provenance).encode()
    size, checksum = struct.pack(">I", len(chunk) - 4), struct.pack(">I", zlib.crc32(chunk))
    return data[:-PNG_END_BYTES] + size + chunk + checksum + data[-PNG_END_BYTES:]


def find_meta_file() -> Path | None:
    """Return the file for the provenance of an output without place for it; None if not wanted.

    Raise BadParameter if it is a file that has no provenance, which would be lost.
    """
    name = get_running_command().options.get("meta")
    if not name:
        return None
    path = Path(name)
    if path.exists() and not read_provenance(path)[1]:
        raise BadParameter(f"--meta {path}: the file exists, and it has no provenance")
    return path


def write_meta_file(digest: str) -> None:
    """Write the provenance of a text with this digest, such as CSV, to the file of `--meta`."""
    path = find_meta_file()
    if path is not None:
        report = format_json_report({KEY: describe_provenance(digest)})
        write_file(path, [f"{report}\n"], force=True)


def read_provenance(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a report in a file without its provenance, and its provenance; {} if it has none."""
    try:
        report = json.loads(read_bytes(path))
    except OSError as error:
        raise BadParameter(f"{path}: {error.strerror}") from None
    except (ValueError, RecursionError):
        report = None
    provenance = report.pop(KEY, {}) if isinstance(report, dict) else {}
    return (report, provenance) if isinstance(provenance, dict) else ({}, {})

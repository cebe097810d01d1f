"""The command that repeats the command which made a file, and compares the results."""

import json
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from dmplay.errors import BadParameter

REPEATABLE_COMMANDS = ("run", "compare", "tournament", "solve", "evaluate")
# they change no result, or write files
OMITTED_OPTIONS = (
    "output", "record", "every", "worst", "best", "meta", "workers", "executor",
)  # fmt: skip
OMITTED_KEYS = ("kept",)  # of reports: the transcripts of `--record`
META_SUFFIX = ".meta.json"
DIFFERENT_EXIT_CODE = 1
OPTION_PATTERN = re.compile(r"-(?![\d.])")  # not a negative number
VERSION_NAMES = {"dmplay": "dmplay", "python": "Python", "numpy": "NumPy"}


def rerun(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="JSON of a command, or its FILE.meta.json")
    ],
    trust: Annotated[
        bool, typer.Option("--trust", help="run user code and programs that the command names")
    ] = False,
) -> object:
    """Repeat the command that made a file, and compare the results.

    It repeats run, compare, tournament, solve and evaluate. Their JSON contains the
    command and all its options. CSV has them in the file of the option --meta. The exit
    code is 0 if the results are the same, and 1 if they differ.

    \b
      dmplay rerun walks.json
    """
    from dmplay.game.command_line_results import Printout
    from dmplay.output import provenance

    report, made_by = provenance.read_provenance(file)
    command, values = made_by.get("command"), made_by.get("options")
    if not (isinstance(command, list) and command and isinstance(values, dict)):
        raise BadParameter(f"{file}: expected JSON of a command, with the key provenance")
    name = str(command[0])
    if name not in REPEATABLE_COMMANDS:
        expected = ", ".join(REPEATABLE_COMMANDS)
        raise BadParameter(f"{file}: made by the command {name}, expected one of {expected}")
    _check_values(name, values)
    if not trust:
        _check_code(values)
    recorded = _read_recorded_text(file, report)
    text = _run_again(name, values | {"trust": trust and bool(values.get("trust"))})
    digest = str(made_by.get("digest"))
    edits, differences = [*_iter_edits(recorded, digest)], [*_compare(recorded, text)][:1]
    if recorded is None and provenance.compute_digest(f"{text}\n".encode()) != digest:
        differences = ["the output has another digest"]
    if not edits and not differences:
        return f"{file}: same results"
    versions = provenance.list_versions()
    others = [
        f"{label} {made_by.get(key)}, now {versions[key]}"
        for key, label in VERSION_NAMES.items()
        if made_by.get(key) != versions[key]
    ]
    lines = [f"{file}: different results", *edits, *differences]
    lines += [f"made by {'; '.join(others)}"] if others else []
    return Printout("\n".join(lines), exit_code=DIFFERENT_EXIT_CODE)


def _check_values(name: str, values: Mapping[str, Any]) -> None:
    """Raise BadParameter if the value of an option would not be read as one by the command.

    Such a value could be another option, or a name that `_check_code` does not see.
    """
    from dmplay.cli.commands import build_command

    for option in build_command(name).params:
        value, is_flag = values.get(option.name or ""), getattr(option, "is_flag", False)
        is_list, is_multiple = isinstance(value, list), option.multiple or option.nargs == -1
        items = value if isinstance(value, list) else [value]
        texts = [str(item) for item in items if item is not None]
        is_valid = is_list == is_multiple and (not is_flag or isinstance(value, bool))
        is_nested = any(isinstance(item, list | dict) for item in items)
        if value not in (None, "", []) and (
            not is_valid or is_nested or any(map(OPTION_PATTERN.match, texts))
        ):
            raise BadParameter(f"provenance: {option.name}: got {value!r}, which is no value of it")


def _check_code(values: Mapping[str, Any]) -> None:
    """Raise BadParameter if the options of a command name user code or a program."""
    from dmplay.game.transcript_verification import names_transcripts
    from dmplay.output.provenance import list_agent_names, list_problem_names
    from dmplay.registry import agents, problems
    from dmplay.registry.problem_name_kinds import names_bot

    names = list_agent_names(values)
    if "problems" in values and any(map(names_transcripts, names[:1])):
        return  # Transcripts name the code, which is not run without --trust.
    for problem_name in list_problem_names(values):
        problem = problems.find_problem(problem_name, {}, trusted=False).problem
        for name in filter(None, names):
            if names_bot(name) or agents.names_user_code(problem, 0, name):
                remedy = "if you trust it, add --trust"
                raise BadParameter(f"agent {name!r} is code outside dmplay; {remedy}")


def _read_recorded_text(file: Path, report: Mapping[str, Any]) -> str | None:
    """Return the text of a report; beside a meta file, that of the file it is about, if there."""
    if not file.name.endswith(META_SUFFIX):
        return json.dumps(report)
    described_file = file.with_name(file.name.removesuffix(META_SUFFIX))
    return described_file.read_text() if described_file.is_file() else None


def _run_again(name: str, values: Mapping[str, Any]) -> str:
    """Return the report of a command with these options, as it is printed.

    Aliases, environment variables and settings files do not change it.
    """
    from dmplay.cli.commands import build_command
    from dmplay.core.running_command import list_words
    from dmplay.game.command_line_results import Printout

    command = build_command(name)
    used = {key: value for key, value in values.items() if key not in OMITTED_OPTIONS}
    for variable in [key for key in os.environ if key.startswith("DMPLAY_")]:
        del os.environ[variable]
    words = [*list_words(command.params, used)]
    result = command(words, standalone_mode=False, prog_name=f"dmplay {name}")
    text = result.text if isinstance(result, Printout) else result
    return str(text)


def _iter_edits(recorded: str | None, digest: str) -> Iterator[str]:
    """Yield a line if a recorded text is not the one that was written."""
    from dmplay.output.provenance import compute_digest

    if recorded is not None and compute_digest(recorded.encode()) != digest:
        yield "the file was changed after it was written: it does not have its digest"


def _compare(recorded: str | None, text: str) -> Iterator[str]:
    """Yield the first difference between two texts, as data if they are JSON."""
    if recorded is None:
        return
    ours, theirs = recorded.rstrip("\n"), text.rstrip("\n")
    if ours == theirs:
        return
    try:
        before, after = json.loads(ours), json.loads(theirs)
    except ValueError:
        pairs = zip([*ours.split("\n"), ""], [*theirs.split("\n"), ""], strict=False)
        for number, (old, new) in enumerate(pairs, 1):
            if old != new:
                yield f"line {number}: got {new!r}, expected {old!r}"
        return
    for key in OMITTED_KEYS:
        before.pop(key, None)
    yield from _iter_differences("", before, after)


def _iter_differences(path: str, before: object, after: object) -> Iterator[str]:
    """Yield a line for each value that differs, with its place."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key in dict.fromkeys([*before, *after]):
            item_path = f"{path}.{key}" if path else str(key)
            yield from _iter_differences(item_path, before.get(key), after.get(key))
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for index, (old, new) in enumerate(zip(before, after, strict=True)):
            yield from _iter_differences(f"{path}[{index}]", old, new)
    elif before != after:
        yield f"{path}: got {json.dumps(after)}, expected {json.dumps(before)}"

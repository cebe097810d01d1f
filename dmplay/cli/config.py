"""Settings from files: the user's `config.toml`, the project's `dmplay.toml` over it.

A project's file may come with a download: it sets looks and numbers, and keys, but nothing that
runs code, chooses what is played or weakens a check.

color = "never"                     for every command that has the option
[play]                              for one command
turns = 20
[keys]                              which keys play
preset = "left"
[keys.hex]
k = "nw"
[aliases]                           more commands
hw = "play hexworld --seed 7"
"""

import os
import shlex
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

from dmplay import disk
from dmplay.errors import BadParameter, UnknownName
from dmplay.finding.names import problem_names

PROJECT_FILE = "dmplay.toml"
# Set once for every command that has them.
GENERAL_OPTIONS = ("plain", "color", "ascii", "theme", "speed", "width", "motion", "input")
PROJECT_FILE_OPTIONS = (*GENERAL_OPTIONS, "keys", "rate", "turns", "seed", "episode")
SettingsTable = dict[str, object]


class ConfigFile(NamedTuple):
    """A file of settings."""

    path: str
    is_user_file: bool  # the user's; a project's may come from anywhere
    options: SettingsTable  # for every command that has them
    commands: dict[str, SettingsTable]  # for one
    key_preset: str | None
    keys: dict[str, dict[str, str]]  # family -> key -> action
    aliases: dict[str, str]


def check_project_option(option: str, location: str) -> None:
    """Refuses what a project's file may not set."""
    if option not in PROJECT_FILE_OPTIONS:
        raise BadParameter(
            f"{location}: a folder's file sets looks and numbers; "
            "only your own config.toml and the command line set this"
        )


def config_paths(env: Mapping[str, str]) -> tuple[Path, Path]:
    """Where the user's file is, by the base directory specification, and the project's, here."""
    return disk.user_folder(env, "XDG_CONFIG_HOME", ".config") / "config.toml", Path(PROJECT_FILE)


@cache
def load_config_files() -> tuple[ConfigFile, ...]:
    """The files there are, the user's first."""
    user, project = config_paths(os.environ)
    found = [(user, True), (project, False)]
    return tuple(
        read_config_file(path, is_user_file=own) for path, own in found if os.path.isfile(path)
    )


def merged_aliases() -> dict[str, str]:
    """Every alias with what it stands for."""
    return {name: line for file in load_config_files() for name, line in file.aliases.items()}


def merged_keys() -> dict[str, tuple[str, dict[str, str]]]:
    """The keys set for each family with the last file to do it; a project's replace a user's."""
    merged: dict[str, tuple[str, dict[str, str]]] = {}
    for file in load_config_files():
        for family, own in file.keys.items():
            merged[family] = file.path, {**merged.get(family, ("", {}))[1], **own}
    return merged


def read_config_file(path: Path, *, is_user_file: bool) -> ConfigFile:
    """A file's settings; raises BadParameter or UnknownName, which name the file."""
    import tomllib  # only where there is a file

    name = str(path)
    try:
        content = tomllib.loads(disk.read_bytes(path).decode())
    except OSError as error:
        raise BadParameter(f"{name}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:  # not TOML, or not UTF-8
        raise BadParameter(f"{name}: {_describe_parse_error(error)}") from None
    for key in ("keys", "aliases"):
        if not isinstance(content.setdefault(key, {}), dict):
            raise BadParameter(f"{name}: {key}: got {content[key]!r}, expected a table, [{key}]")
    set_keys, given = content.pop("keys"), content.pop("aliases")
    preset = (
        _require_text(set_keys.pop("preset"), f"{name}: keys.preset")
        if "preset" in set_keys
        else None
    )
    sections = {key: value for key, value in content.items() if isinstance(value, dict)}
    options = {key: value for key, value in content.items() if key not in sections}
    if given and not is_user_file:
        check_project_option("aliases", f"{name}: aliases.{next(iter(given))}")
    return ConfigFile(
        name,
        is_user_file,
        options,
        sections,
        preset,
        _parse_keys(set_keys, name),
        _parse_aliases(given, name),
    )


def _describe_parse_error(error: Exception) -> str:
    told = "not UTF-8" if isinstance(error, UnicodeDecodeError) else str(error).partition("\n")[0]
    return f"{told[:1].lower()}{told[1:]}" if told else type(error).__name__


def _parse_keys(table: SettingsTable, file_name: str) -> dict[str, dict[str, str]]:
    """The keys of each family, checked for form."""
    known = ["hex", *problem_names()]
    found = {}
    for family, own in table.items():
        if family not in known:
            raise UnknownName("keys", family, ["preset", *known], error_prefix=file_name)
        if not isinstance(own, dict):
            raise BadParameter(f"{file_name}: keys.{family}: got {own!r}, expected a table")
        where = f"{file_name}: keys.{family}"
        found[family] = {key: _require_text(label, f"{where}.{key}") for key, label in own.items()}
    return found


def _parse_aliases(table: SettingsTable, file_name: str) -> dict[str, str]:
    """The aliases, checked for form."""
    found = {}
    for alias, line in table.items():
        where = f"{file_name}: aliases.{alias}"
        if not alias or not alias.isprintable() or set(alias) & set(" -;#'\"\\:./"):
            raise BadParameter(f"{where}: got {alias!r}, expected one plain word")
        if alias in problem_names():
            raise BadParameter(f"{where}: {alias} is a problem; give another name")
        found[alias] = _require_text(line, where)
        try:
            words = shlex.split(found[alias])
        except ValueError:  # a quotation without end
            words = []
        if not words:
            raise BadParameter(f"{where}: got {line!r}, expected a command")
    return found


def _require_text(value: object, location: str) -> str:
    if not isinstance(value, str):
        raise BadParameter(f"{location}: got {value!r}, expected text")
    return value

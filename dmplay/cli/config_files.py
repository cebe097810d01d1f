"""Settings files: the user's `config.toml`, overridden by the project's `dmplay.toml`.

A project's file may come with a download. It may set display options, numbers and keys, but
nothing that runs code, selects a problem or weakens a check.

color = "never"                     for every command that has the option
[play]                              for one command
turns = 20
[keys]                              keys of the game
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
from typing import Any, NamedTuple

from dmplay.core import safe_files
from dmplay.core.toml_files import read_toml
from dmplay.errors import BadParameter, UnknownName
from dmplay.registry.builtin_names import problem_names

PROJECT_FILE = "dmplay.toml"
DISPLAY_OPTIONS = ("plain", "color", "ascii", "theme", "speed", "width", "motion", "input")
# Options that may be set once for all commands.
GENERAL_OPTIONS = (*DISPLAY_OPTIONS, "keep")
# A project's file must not set `keep`, which could delete the games of its reader.
PROJECT_FILE_OPTIONS = (*DISPLAY_OPTIONS, "keys", "rate", "turns", "seed", "episode")
SettingsTable = dict[str, object]


class ConfigFile(NamedTuple):
    """The contents of a settings file."""

    path: str
    is_user_file: bool  # whether it is the user's; a project's file is not trusted
    options: SettingsTable  # options of every command that has them
    commands: dict[str, SettingsTable]  # options of single commands
    key_preset: str | None
    keys: dict[str, dict[str, str]]  # family -> key -> action
    aliases: dict[str, str]


def check_project_option(option: str, location: str) -> None:
    """Raise BadParameter unless a project's file may set this option."""
    if option not in PROJECT_FILE_OPTIONS:
        raise BadParameter(
            f"{location}: this file may set only display options, numbers and keys; "
            "use your own config.toml or the command line"
        )


def config_paths(env: Mapping[str, str]) -> tuple[Path, Path]:
    """Return the user's settings file, by the XDG base directory specification, and the project's.

    The project's file is in the current folder.
    """
    user_folder = safe_files.user_folder(env, "XDG_CONFIG_HOME", ".config")
    return user_folder / "config.toml", Path(PROJECT_FILE)


@cache
def load_config_files() -> tuple[ConfigFile, ...]:
    """Return the contents of the existing settings files, the user's first."""
    return tuple(
        read_config_file(path, is_user_file=is_user_file)
        for path, is_user_file in zip(config_paths(os.environ), (True, False), strict=True)
        if os.path.isfile(path)
    )


def merged_aliases() -> dict[str, str]:
    """Return the command line of every alias; those of the project's file replace the user's."""
    return {name: line for file in load_config_files() for name, line in file.aliases.items()}


def merged_keys() -> dict[str, tuple[str, dict[str, str]]]:
    """Return, for each problem family, its keys and the last file that sets them.

    Keys of the project's file replace those of the user's file.
    """
    keys_by_family: dict[str, tuple[str, dict[str, str]]] = {}
    for file in load_config_files():
        for family, overrides in file.keys.items():
            previous = keys_by_family.get(family, ("", {}))[1]
            keys_by_family[family] = file.path, {**previous, **overrides}
    return keys_by_family


def read_config_file(path: Path, *, is_user_file: bool) -> ConfigFile:
    """Return the contents of a settings file.

    Raise BadFile, BadParameter or UnknownName, with the path in the message, if they are invalid.
    """
    name = str(path)
    content: dict[str, Any] = read_toml(path)
    for key in ("keys", "aliases"):
        if not isinstance(content.setdefault(key, {}), dict):
            raise BadParameter(f"{name}: {key}: got {content[key]!r}, expected a table, [{key}]")
    key_table, alias_table = content.pop("keys"), content.pop("aliases")
    preset = key_table.pop("preset", None)
    if preset is not None:  # TOML has no None
        _require_text(preset, f"{name}: keys.preset")
    sections = {key: value for key, value in content.items() if isinstance(value, dict)}
    options = {key: value for key, value in content.items() if key not in sections}
    if alias_table and not is_user_file:
        check_project_option("aliases", f"{name}: aliases.{next(iter(alias_table))}")
    keys, aliases = _parse_keys(key_table, name), _parse_aliases(alias_table, name)
    return ConfigFile(name, is_user_file, options, sections, preset, keys, aliases)


def _parse_keys(table: SettingsTable, file_name: str) -> dict[str, dict[str, str]]:
    """Return the keys of each problem family; raise an error if they are invalid.

    It is UnknownName for an unknown family, else BadParameter.
    """
    families = ["hex", *problem_names()]
    keys_by_family = {}
    for family, family_table in table.items():
        if family not in families:
            raise UnknownName("keys", family, ["preset", *families], error_prefix=file_name)
        location = f"{file_name}: keys.{family}"
        if not isinstance(family_table, dict):
            raise BadParameter(f"{location}: got {family_table!r}, expected a table")
        keys_by_family[family] = {
            key: _require_text(label, f"{location}.{key}") for key, label in family_table.items()
        }
    return keys_by_family


def _parse_aliases(table: SettingsTable, file_name: str) -> dict[str, str]:
    """Return the aliases; raise BadParameter for an invalid name or an empty command."""
    command_lines = {}
    for alias, line in table.items():
        location = f"{file_name}: aliases.{alias}"
        if not alias or not alias.isprintable() or set(alias) & set(" -;#'\"\\:./"):
            raise BadParameter(f"{location}: got {alias!r}, expected one plain word")
        if alias in problem_names():
            raise BadParameter(f"{location}: {alias} is a problem; choose another name")
        command_lines[alias] = _require_text(line, location)
        try:
            words = shlex.split(command_lines[alias])
        except ValueError:  # an unclosed quotation
            words = []
        if not words:
            raise BadParameter(f"{location}: got {line!r}, expected a command")
    return command_lines


def _require_text(value: object, location: str) -> str:
    """Return the value if it is a string; else raise BadParameter with its location."""
    if not isinstance(value, str):
        raise BadParameter(f"{location}: got {value!r}, expected text")
    return value
